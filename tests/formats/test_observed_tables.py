"""Tables of surfaces, relative poses, instruments, bases, covariances: networks of every kind come back."""

import numpy as np
import pytest
from damaged import check_damaged
from test_plain_project import EXAMPLE, change, written

from fuzz.networks import KINDS, random_network
from message_codes import check_words, rejected
from photogram import InputError, adjust, formats
from photogram.network import Level, OnLevel, OnPlane, Plane, Relative

NETWORKS = (0, 1, 2, 4, 5, 8, 9, 11, 14, 17, 29, 32, 33, 40, 7, 18, 22)
"""With every kind of observation; the last three lie in geographic space."""


def project_of(block, place):
    count = len(block.cameras)
    own = (block.spheroid.a, block.spheroid.b) if block.spheroid else None
    return formats.Project(
        block=block,
        path=place,
        title="made",
        sizes=((2000, 1500),) * count,
        pixel_mm=(None,) * count,
        starts=np.full((len(block.point_ids), 3), np.nan),
        frame=formats.Frame("geographic", ellipsoid=own) if own else formats.Frame(),
    )


def test_these_networks_have_every_kind_of_observation():
    assert {kind for number in NETWORKS for kind in random_network(5, number).kinds} == set(KINDS)


@pytest.mark.parametrize("number", NETWORKS)
def test_a_network_of_any_kind_comes_back(tmp_path, number):
    network = random_network(5, number)
    project = project_of(network.block, tmp_path)
    assert formats.cannot_hold(project, "plain") == []
    block = formats.read(written(project, tmp_path / "there")).block
    # Standard deviations of control without covariances are those of its point.
    observed = [
        each
        for each in network.block.observations
        if getattr(each, "sd", None) is None or each.KIND != "control"
    ]
    assert sorted(each.KIND for each in block.observations) == sorted(each.KIND for each in observed)
    one, two = (adjust(each, datum=network.datum, tolerance=1e-10) for each in (network.block, block))
    assert two.degrees_of_freedom == one.degrees_of_freedom
    assert len(two.unknowns) == len(one.unknowns)
    # Longitudes and latitudes end at 1e-9 m, a millionth of the standard deviations of these points.
    limit = 1e-9 if network.block.spheroid is None else 1e-5
    photos = [block.photo_ids.index(name) for name in network.block.photo_ids]
    points = [block.point_ids.index(name) for name in network.block.point_ids]
    assert (
        np.abs(two.photo_positions[photos] - one.photo_positions) <= limit * one.photo_sd[:, :3] + 1e-12
    ).all()
    assert (np.abs(two.point_positions[points] - one.point_positions) <= limit * one.point_sd + 1e-12)[
        one.used_points
    ].all()


@pytest.fixture
def facade(tmp_path):
    """Return a folder with a project that has a table of every kind, written by hand."""
    place = written(formats.read(EXAMPLE), tmp_path / "facade")
    points = formats.read(place).block.point_ids
    photos = formats.read(place).block.photo_ids
    a, b, c, d, e, *_ = [name for name in points if name.startswith("t")]
    tables = {
        "instruments": "instrument,scale,constant,sd_scale,sd_constant\ntape,1,0,0.001,\n",
        "distances": f"from,to,distance,sd,instrument\n{a},{b},30,0.01,tape\n{a},{c},31,0.01,laser\n",
        "height_differences": f"from,to,dz,sd\n{a},{b},0.5,0.002\n",
        "levels": "level,z,sd\nlake,12.5,0.1\n",
        "level_points": f"level,point,dz,sd\nlake,{a},0,0.01\nlake,{b},0.5,0.01\npond,{c},,0.01\n",
        "planes": "plane,x,y,z,nx,ny,nz,sd_distance\nwall,1,2,3,0,0,1,\n",
        "plane_points": f"plane,point,distance,sd\nwall,{a},,0.01\nroof,{b},0.2,0.01\n",
        "lines": "line,x,y,z,dx,dy,dz\nrail,1,2,3,1,0,0\n",
        "line_points": f"line,point,sd_x,sd_y,cov_xy\nrail,{a},0.01,0.02,0.0001\n",
        "plumb_lines": "plumb_line,x,y,z\nedge,1,2,3\n",
        "plumb_line_points": f"plumb_line,point,sd\nedge,{d},0.01\nedge,{e},0.01\n",
        "relative_poses": (
            "from,to,x,y,z,omega,phi,kappa,sd_x,sd_y,sd_z,sd_rotation_x,sd_rotation_y,sd_rotation_z,"
            "cov_xy,cov_x_rotation_z\n"
            f"{photos[0]},{photos[1]},25,0,0,0,0,90,0.1,0.1,0.1,0.5,0.5,0.5,0.001,0.002\n"
        ),
        "covariances": (
            "kind,name,first,second,covariance\n"
            "plane,roof,distance,distance,1e-4\nplane,roof,rotation x,rotation_x,1e-2\n"
            "plane,roof,rotation y,rotation y,1e-2\nplane,roof,distance,rotation_y,1e-4\n"
            "camera,drone,k1,K1,1e-8\ncamera,drone,k2,k2,1e-8\ncamera,drone,k1,k2,-5e-9\n"
        ),
    }
    for name, text in tables.items():
        (place / f"{name}.csv").write_text(text)
    return place


def test_tables_that_are_written_by_hand_are_what_they_say(facade):
    block = formats.read(facade).block
    levels = [each for each in block.observations if isinstance(each, OnLevel)]
    assert [each.level.name for each in levels] == ["lake", "lake", "pond"]
    assert levels[0].level is levels[1].level
    assert isinstance(levels[0].level, Level)
    assert levels[0].level.height == 12.5
    assert levels[2].level.is_open
    planes = [each for each in block.observations if isinstance(each, OnPlane)]
    assert [each.distance for each in planes] == [0.0, 0.2]
    assert isinstance(planes[0].plane, Plane)
    np.testing.assert_allclose(planes[0].plane.attitude[:, 2], [0, 0, 1])
    (pose,) = [each for each in block.observations if isinstance(each, Relative)]
    np.testing.assert_allclose(np.asarray(pose.rotation), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    own = pose.precision
    np.testing.assert_allclose(own[0, 1], 0.001)
    np.testing.assert_allclose(own[0, 5], 0.002 * np.pi / 180)
    np.testing.assert_allclose(np.sqrt(own[3, 3]), np.radians(0.5))
    (prior,) = [each for each in block.observations if each.KIND == "prior"]
    np.testing.assert_allclose(prior.precision[0, 2], 1e-4 * np.pi / 180)
    names, matrix = block.cameras[0].covariance
    assert tuple(names) == ("k1", "k2")
    np.testing.assert_array_equal(matrix, [[1e-8, -5e-9], [-5e-9, 1e-8]])
    instruments = {each.instrument.name for each in block.observations if each.KIND == "distance"}
    assert instruments == {"tape", "laser"}


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        (
            "level_points",
            "lake,t",
            "lake,x",
            ["level_points.csv", "record 2", "error.column point: error.unknown.close point x01"],
        ),
        ("level_points", "0.01", "", ["record 2", "error.column sd: cells.no-sd level_points"]),
        (
            "level_points",
            "pond",
            "Lake",
            ["record 4", "column level", "error.column level: cells.similar Lake lake"],
        ),
        ("planes", "1,2,3", "1,,3", ["planes.csv", "record 2", "x, y, z must all have values"]),
        ("planes", "0,0,1", "0,0,0", ["planes.csv", "record 2", "a vector with a positive length"]),
        ("planes", "1,2,3,0,0,1", ",,,0,0,1", ["record 2", "plane wall is weighted, fixed or partly given"]),
        ("lines", "1,2,3,1,0,0", "1,2,3,,,", ["lines.csv", "record 2", "requires a direction"]),
        (
            "line_points",
            "0.0001",
            "0.1",
            ["line_points.csv", "record 2", "positive definite"],
        ),
        (
            "plumb_lines",
            "edge,1,2,3",
            "edge,1,2,3\nedge,1,2,3",
            ["record 3", "error.repeated plumb line edge"],
        ),
        ("relative_poses", "0,0,90", ",,", ["relative_poses.csv", "record 2", "plain.no-angles"]),
        (
            "relative_poses",
            ",0.1,0.1,0.1,",
            ",0.1,,0.1,",
            ["record 2", "column sd_y", "error.column sd_y: error.empty"],
        ),
        ("instruments", "tape,1", "tape,x", ["instruments.csv", "record 2", "column scale", "'x'"]),
        (
            "covariances",
            "plane,roof",
            "plane,rof",
            ["covariances.csv", "record 2", "error.unknown.close plane rof roof"],
        ),
        (
            "covariances",
            "rotation x,rotation_x",
            "rotation x,rot",
            ["record 3", "error.unknown component of plane rot distance,rotation x,rotation y"],
        ),
        (
            "covariances",
            "k1,K1",
            "k1,K9",
            ["record 6", "error.unknown.close parameter of the camera drone k9 k2"],
        ),
        (
            "covariances",
            "camera,drone,k1,k2",
            "camera,phone,k1,k2",
            ["record 8", "error.unknown.close camera phone"],
        ),
        ("covariances", "k1,k2,-5e-9", "k1,k2,-5e-7", ["record 6", "symmetric and positive definite"]),
        ("height_differences", "0.002", "0", ["height_differences.csv", "record 2"]),
    ],
)
def test_a_fault_is_named_with_file_row_and_column(facade, file, old, new, words):
    change(facade / f"{file}.csv", old, new)
    with pytest.raises(InputError) as refused:
        formats.read(facade)
    for word in (f"{file}.csv", *words):
        check_words(word, refused.value)


@pytest.mark.parametrize("seed", range(2))
def test_damaged_tables_end_in_a_message(facade, tmp_path, seed):
    assert check_damaged(facade, tmp_path / "damaged", "plain", 125, 20 + seed) > 40


RIGS = """rig,sensor,camera,x,y,z,omega,phi,kappa,sd_x
stereo,left,drone,0,0,0,0,0,0,
stereo,right,,0.5,0,0,0,0,0,0.01
stereo,rear,,,,,,,,
"""


def test_sensors_have_names_where_cameras_do_not_tell_them(tmp_path):
    place = written(formats.read(EXAMPLE), tmp_path / "rig")
    photos = formats.read(place).block.photo_ids
    (place / "rigs.csv").write_text(RIGS)
    frames = [(photos[0], "left"), (photos[1], "right"), (photos[2], "rear")]
    (place / "frames.csv").write_text(
        "frame,rig,photo,sensor\n" + "".join(f"one,stereo,{photo},{sensor}\n" for photo, sensor in frames)
    )
    (place / "bases.csv").write_text(
        "rig,from,to,distance,sd\nstereo,right,left,0.5,0.001\nstereo,right,rear,9,1\n"
    )
    (place / "gnss.csv").unlink()
    block = formats.read(place).block
    assert [each.sensor.name for each in block.mounts] == ["right", "rear"]
    assert block.mounts[1].sensor.is_open
    bases = [each for each in block.observations if each.KIND == "base"]
    assert bases[0].first is None
    assert bases[0].second is block.mounts[0].sensor
    assert (bases[1].first, bases[1].second) == (block.mounts[0].sensor, block.mounts[1].sensor)
    change(place / "bases.csv", "right,left", "right,top")
    with rejected("error.column to: plain.no-sensor-of-rig stereo top"):
        formats.read(place)


def test_groups_share_what_has_one_name(tmp_path):
    place = written(formats.read(EXAMPLE), tmp_path / "gnss")
    lines = (place / "gnss.csv").read_text().splitlines()
    rows = [f"{line},{'east' if row < 3 else 'west'}" for row, line in enumerate(lines[1:])]
    (place / "gnss.csv").write_text("\n".join([lines[0].replace(",group", "") + ",group", *rows]) + "\n")
    groups = (
        "group,lever,lever_x,sd_lever_x,shift,sd_shift_x\n"
        "east,antenna,0.1,0.02,true,1\nwest,antenna,0.1,0.02,day,1\n"
    )
    (place / "gnss_groups.csv").write_text(groups)
    own = [each for each in formats.read(place).block.observations if each.KIND == "position"]
    assert len({id(each.lever_arm) for each in own}) == 1
    assert own[0].lever_arm.name == "antenna"
    assert {each.shift.name for each in own} == {"east", "day"}
    (place / "gnss_groups.csv").write_text(groups.replace("west,antenna,0.1", "west,antenna,0.2"))
    with rejected("error.column lever: plain.other-values antenna"):
        formats.read(place)
