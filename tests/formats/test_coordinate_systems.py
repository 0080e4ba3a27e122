"""Coordinate reference systems: in from any, adjusted in a cartesian frame, back with covariances."""

import shutil
import warnings

import numpy as np
import pytest
from test_plain_project import EXAMPLE, change, written

from message_codes import refused
from photogram import InputError, adjust, formats
from photogram.formats import Frame
from photogram.formats.supplements import with_control
from photogram.io.delimited import read_columns
from photogram.words import Phrase

pyproj = pytest.importorskip("pyproj", reason="pyproj is not installed")
crs = pytest.importorskip("photogram.formats.crs")
places = pytest.importorskip("photogram.formats.results")

CONTROL = ["north-1", "north-2", "south-1", "south-2"]
FRAME = Frame("topocentric", "EPSG:4979", (47.38, 8.54, 450.0))
PIPELINE = (
    "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart +ellps=WGS84"
    " +step +proj=topocentric +ellps=WGS84 +lon_0=8.54 +lat_0=47.38 +h_0=450"
)


def test_the_frame_is_that_of_projs_own_pipeline():
    random = np.random.default_rng(2)
    places = np.column_stack(
        [8.54 + random.normal(0, 0.05, 50), 47.38 + random.normal(0, 0.05, 50), random.uniform(300, 900, 50)]
    )
    found, _, remarks = crs.to_frame("EPSG:4979", places, np.zeros((50, 3, 3)), FRAME)
    theirs = np.column_stack(pyproj.Transformer.from_pipeline(PIPELINE).transform(*places.T))
    np.testing.assert_allclose(found, theirs, atol=2e-9)
    assert remarks == []


@pytest.mark.parametrize(
    "name", ["EPSG:4979", "EPSG:32632", "EPSG:4978", "ENU:47.4,8.5,400", "EPSG:2056", "EPSG:31467"]
)
def test_there_and_back(name):
    random = np.random.default_rng(3)
    local = random.normal(0, 400, (20, 3))
    root = random.normal(0, 0.01, (20, 3, 3))
    covariances = root @ root.transpose(0, 2, 1)
    out, turned = crs.from_frame(name, local, covariances, FRAME)
    back, again, _ = crs.to_frame(name, out, turned, FRAME)
    # Systems on another datum go through a transformation whose inverse is iterated.
    np.testing.assert_allclose(back, local, atol=1e-3 if name in ("EPSG:2056", "EPSG:31467") else 5e-9)
    np.testing.assert_allclose(again, covariances, atol=2e-9)
    np.testing.assert_allclose(
        np.trace(turned, axis1=1, axis2=2), np.trace(covariances, axis1=1, axis2=2), rtol=1e-12
    )


@pytest.mark.parametrize("name", ["EPSG:32632", "EPSG:4979", "EPSG:4978"])
def test_one_standard_deviation_of_all_axes_stays_as_it_was_typed(name):
    place, _ = crs.from_frame(name, np.array([[812.0, -433.0, 60.0]]), np.zeros((1, 3, 3)), FRAME)
    _, turned, _ = crs.to_frame(name, place, np.eye(3)[np.newaxis] * 0.010**2, FRAME)
    assert np.sqrt(np.diagonal(turned[0])).tolist() == [0.010] * 3


def test_covariances_of_a_projected_system_are_along_its_grid():
    place = np.array([[465254.6, 5247458.8, 448.4]])
    along_north = np.diag([0.0, 1.0, 0.0])[np.newaxis]
    _, turned, remarks = crs.to_frame("EPSG:32632", place, along_north, FRAME)
    east, north = np.sqrt(turned[0, 0, 0]), np.sqrt(turned[0, 1, 1])
    # gamma = atan(tan(lon - lon0) sin lat): -0.338 degrees at 0.46 degrees west of the central meridian.
    assert np.degrees(np.arctan2(east, north)) == pytest.approx(0.3388, abs=2e-3)
    assert [(each.code, each.fields["crs"]) for each in remarks] == [("crs.heights", "EPSG:32632")]


def test_axes_are_easting_first_whatever_an_authority_says():
    found, _, _ = crs.to_frame("EPSG:4326", np.array([[8.54, 47.38, 450.0]]), np.zeros((1, 3, 3)), FRAME)
    np.testing.assert_allclose(found, 0, atol=1e-8)
    gauss = np.array([[3465254.6, 5249000.0, 448.4]])
    near, _, remarks = crs.to_frame("EPSG:31467", gauss, np.zeros((1, 3, 3)), FRAME)
    assert np.linalg.norm(near) < 2000
    assert any(each.code == "crs.northing" for each in remarks)


def test_heights_for_which_a_grid_is_missing_are_refused():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        available = pyproj.transformer.TransformerGroup(
            "EPSG:4326+5773", "EPSG:4979", always_xy=True
        ).best_available
    if available:
        pytest.skip("the grid of EGM96 is installed")
    with pytest.raises(InputError, match="geoid"):
        crs.to_frame("EPSG:4326+5773", np.array([[8.54, 47.38, 400.0]]), np.zeros((1, 3, 3)), FRAME)


def test_control_in_a_projected_system_adjusts_to_the_same_block(tmp_path):
    plain = formats.read(EXAMPLE)
    place = shutil.copytree(EXAMPLE, tmp_path / "utm")
    change(place / "project.toml", "[frame]", '[frame]\nkind = "topocentric"\norigin = [47.38, 8.54, 450.0]')
    change(
        place / "project.toml",
        "[adjust]",
        '[control]\ncrs = "EPSG:32632"\n[gnss]\ncrs = "EPSG:4979"\n[adjust]',
    )
    for table, name in (("control", "EPSG:32632"), ("gnss", "EPSG:4979")):
        lines = (place / f"{table}.csv").read_text().splitlines()
        rows = [line.split(",") for line in lines if not line.startswith("#")]
        values = np.array([row[1:4] for row in rows[1:]], dtype=float)
        out, _ = crs.from_frame(name, values, np.zeros((len(values), 3, 3)), FRAME)
        body = [
            ",".join([row[0], *map(repr, own), *row[4:]])
            for row, own in zip(rows[1:], out.tolist(), strict=True)
        ]
        (place / f"{table}.csv").write_text("\n".join([",".join(rows[0]), *body, ""]))
    project = formats.read(place)
    assert project.frame.origin == FRAME.origin
    one, two = adjust(plain.block), adjust(project.block)
    order = [project.block.point_ids.index(name) for name in plain.block.point_ids]
    np.testing.assert_allclose(two.point_positions[order], one.point_positions, atol=1e-6)
    np.testing.assert_allclose(two.point_sd[order], one.point_sd, rtol=1e-5)
    # Without an origin one is chosen, and written with the adjusted project.
    text = (
        (place / "project.toml")
        .read_text()
        .replace('kind = "topocentric"\norigin = [47.38, 8.54, 450.0]', "")
    )
    (place / "project.toml").write_text(text)
    chosen = formats.read(place)
    assert chosen.frame.kind == "topocentric"
    assert chosen.frame.origin is not None
    again = formats.read(written(chosen, tmp_path / "again"))
    assert again.frame == chosen.frame


def test_a_system_that_there_is_not_is_refused_with_the_table(tmp_path):
    place = shutil.copytree(EXAMPLE, tmp_path / "own")
    change(place / "project.toml", "[adjust]", '[control]\ncrs = "EPSG:1"\n[adjust]')
    with refused("control.csv", "EPSG:1"):
        formats.read(place)


def test_one_height_of_the_geoid_may_stand_behind_a_system():
    frame = Frame("topocentric", "EPSG:4979", (47.38, 8.54, 450.0))
    covariances = np.tile(np.diag([1e-4, 4e-4, 9e-4]), (2, 1, 1))
    above_sea = np.array([[466000.0, 5247000.0, 400.0], [466500.0, 5247300.0, 420.0]])
    ellipsoidal = above_sea + np.array([0.0, 0.0, 46.5])
    expected, turned, _ = crs.to_frame("EPSG:32632", ellipsoidal, covariances, frame)
    found, other, remarks = crs.to_frame("EPSG:32632+geoid=46.5", above_sea, covariances, frame)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8)
    np.testing.assert_allclose(other, turned, rtol=1e-9, atol=1e-15)
    assert [(each.code, each.fields["height"]) for each in remarks] == [("crs.geoid", 46.5)]
    back, _ = crs.from_frame("EPSG:32632+geoid=46.5", found, covariances, frame)
    np.testing.assert_allclose(back, above_sea, rtol=0, atol=1e-7)
    with refused("crs.unknown crs=EPSG:32632+geoid=x"):
        crs.geocentric("EPSG:32632+geoid=x", above_sea)


@pytest.fixture
def utm(tmp_path):
    """Return the example without its control, and its control in a projected system with weights."""
    place = shutil.copytree(EXAMPLE, tmp_path / "project")
    change(place / "project.toml", "[frame]", '[frame]\nkind = "topocentric"\norigin = [47.38, 8.54, 450.0]')
    rows = [line.split(",") for line in (place / "control.csv").read_text().splitlines() if line[0] != "#"]
    values = np.array([row[1:4] for row in rows[1:]], dtype=float)
    places, _ = crs.from_frame("EPSG:32632", values, np.zeros((len(values), 3, 3)), FRAME)
    lines = [
        ",".join([row[0], *map(str, xyz), "0.01,0.01,0.02", row[4]])
        for row, xyz in zip(rows[1:], places.tolist(), strict=True)
    ]
    header = "point,x,y,z,sd_x,sd_y,sd_z,use"
    lines.append("unseen,465185.8,5247414.9,443.2,0.01,0.01,0.02,control")
    (tmp_path / "utm.csv").write_text("\n".join([header, *lines, ""]))
    (place / "control.csv").unlink()
    return place, tmp_path / "utm.csv"


def test_weighted_control_of_another_system_is_control(utm):
    place, table = utm
    (place / "control.csv").write_bytes(table.read_bytes())
    change(place / "project.toml", "[adjust]", '[control]\ncrs = "EPSG:32632"\n[adjust]')
    project = formats.read(place)
    assert project.control_crs == "EPSG:32632"
    result = adjust(project.block)
    kinds = dict(zip(result.block.point_ids, result.point_kinds.tolist(), strict=True))
    assert sorted(name for name, kind in kinds.items() if kind == "control") == [*CONTROL, "unseen"]
    assert kinds["middle"] == "check"
    rows, differences = places.placed(result, project.control_crs).control_differences()
    assert sorted(result.block.point_ids[row] for row in rows.tolist()) == CONTROL
    own = result.kinds["control"].residuals[:4]
    np.testing.assert_allclose(np.linalg.norm(differences, axis=1), np.linalg.norm(own, axis=1), rtol=1e-9)
    np.testing.assert_allclose(differences[:, 2], -own[:, 2], atol=1e-4)
    free = formats.read(EXAMPLE).replace(
        frame=FRAME, lacks=(Phrase("read.free", {"option": Phrase("option.control")}),)
    )
    assert with_control(free, table, {}, "EPSG:32632").lacks == ()


def test_a_command_counts_weighted_control_of_another_system(utm, tmp_path, run):
    place, table = utm
    outcome = run(
        "adjust", place, "--control", table, "--control-crs", "EPSG:32632", "--out", tmp_path / "out"
    )
    assert outcome.exit_code == 0
    assert "control points 4 check points 1 " in " ".join(outcome.stdout.split())
    assert "Lacking" not in outcome.stdout
    differences = read_columns(tmp_path / "out" / "in_crs" / "control.csv", known=(), numbers=())
    assert sorted(differences.texts("point")) == CONTROL
    for name in ("report.txt", "report.html"):
        assert "Control and check points in EPSG:32632" in (tmp_path / "out" / name).read_text()


def test_control_without_images_does_not_count(utm, run):
    place, table = utm
    (place / "control.csv").write_bytes(table.read_bytes())
    change(place / "project.toml", "[adjust]", '[control]\ncrs = "EPSG:32632"\n[adjust]')
    outcome = run("info", place)
    text = " ".join(outcome.stdout.split())
    assert "control points 4 check points 1 control without observations unseen" in text
