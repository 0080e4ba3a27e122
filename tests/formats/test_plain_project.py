"""The plain project: what is read, what is refused and where, round trips."""

import csv
import json
import re
import shutil
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from block import check_adjustment, check_poses, same_blocks, sample, truth, with_control, with_noise
from damaged import check_damaged

from message_codes import rejected, traced
from photogram import (
    Attitudes,
    Camera,
    Distance,
    InputError,
    LeverArm,
    Position,
    Spheroid,
    adjust,
    first_values,
    formats,
    simulate,
)
from photogram.formats.plain.schema import TABLES
from photogram.formats.plain.settings import KEYS
from photogram.formats.supplements import self_calibrated
from photogram.io import delimited
from photogram.io.delimited import read_columns
from photogram.io.numbers import scaled
from photogram.network import (
    Attitude,
    Boresight,
    Control,
    Difference,
    Drift,
    Mount,
    Sensor,
    Shift,
    cameras,
    moving_photos,
    trajectories,
)
from photogram.targets import board, options
from photogram.words import option_sd

ANGLES = ("omega", "phi", "kappa")
EXAMPLE = Path(formats.__file__).parents[1] / "examples" / "project"


@pytest.fixture
def example(tmp_path):
    return Path(shutil.copytree(EXAMPLE, tmp_path / "project"))


def change(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def written(project, place, file_format="plain"):
    place.mkdir(parents=True, exist_ok=True)
    for name, content in formats.to_files(project, file_format).items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(content)
    return place


# Cameras


@pytest.mark.parametrize(
    ("model", "single", "values"),
    [
        ("", "simple_pinhole", ""),
        ("opencv", "radial", "-0.068,0.041"),
        ("opencv_fisheye", "radial_fisheye", "-0.068,0.041"),
        ("division", "simple_division", "-0.068"),
        ("opencv", "agisoft_frame", "-0.068,0.041,1e-3,-2e-3"),
        ("full_opencv", "agisoft_frame", "-0.068,0.041,1e-3,-2e-3"),
        ("thin_prism_fisheye", "agisoft_fisheye", "-0.068,0.041,1e-3,-2e-3"),
    ],
)
def test_one_unknown_column_f_is_one_unknown(example, model, single, values):
    names = ("", "k", "k1,k2", "k1,k2,p1,p2")[len(values.split(",")) // 2 + bool(values)]
    head = ",".join(filter(None, ["camera,model,width,height,f,sd_f,cx,cy", names]))
    row = ",".join(filter(None, [f"drone,{model},4000,3000,3620.0,inf,2009.3,1491.6", values]))
    (example / "cameras.csv").write_text(f"{head}\n{row}\n")
    (camera,) = formats.read(example).block.cameras
    assert camera.model == single
    assert [name for name, sd in zip(camera.names, camera.deviations, strict=True) if sd] == ["f"]
    parameters = {name: value for name, value in camera.parameters.items() if name != "f"}
    if "w" in parameters:
        parameters = {name: parameters[name] for name in ("k1", "k2")}
        parameters |= {"cx": 2009.3, "cy": 1491.6, "p1": 1e-3, "p2": -2e-3}
    double = Camera(model or "pinhole", parameters | {"fx": 3620.0, "fy": 3620.0})
    directions = np.array([[0.1, -0.2, -1.0], [-0.3, 0.2, -1.0]])
    np.testing.assert_allclose(camera.project(directions), double.project(directions), atol=1e-9)


def test_one_unknown_f_with_p1_is_adjusted_and_written_as_one(example, tmp_path, run):
    (example / "cameras.csv").write_text(
        "camera,model,width,height,f,cx,cy,k1,k2,p1,p2,sd_f\n"
        "drone,opencv,4000,3000,3620,2009.3,1491.6,-0.068,0.041,1e-4,-2e-4,inf\n"
    )
    project = formats.read(example)
    (camera,) = project.block.cameras
    fixed = adjust(project.block.replace(cameras=[camera.replace(sd=0.0)]))
    done = run("adjust", str(example), "--json", "result.json", "--out", "out")
    assert done.exit_code in (0, 4), done.output
    document = json.loads(Path("result.json").read_bytes())
    unknowns = [each for each in document["cameras"][0]["parameters"] if each["sd"]]
    assert [each["name"] for each in unknowns] == ["f"]
    assert document["degrees_of_freedom"] == fixed.degrees_of_freedom - 1
    (camera,) = formats.read(Path("out/adjusted")).block.cameras
    assert [name for name, sd in zip(camera.names, camera.deviations, strict=True) if sd] == ["f"]
    assert camera.parameters["f"] == pytest.approx(unknowns[0]["value"], abs=1e-9)


@pytest.mark.parametrize(
    ("fy", "names", "unknown"),
    [
        ("3620", "f", ["f"]),
        ("3621", "f", ["fx", "fy"]),
        ("3620", "fx,fy", ["fx", "fy"]),
        ("3620", "f,k3", ["f", "k3"]),
    ],
)
def test_f_of_equal_fx_and_fy_is_one_unknown(example, fy, names, unknown):
    (example / "cameras.csv").write_text(
        "camera,model,width,height,fx,fy,cx,cy,k1,k2,p1,p2\n"
        f"drone,opencv,4000,3000,3620,{fy},2009.3,1491.6,-0.068,0.041,1e-4,-2e-4\n"
    )
    project = formats.read(example)
    (before,), (camera,) = (
        each.block.cameras for each in (project, self_calibrated(project, names.split(",")))
    )
    assert [name for name, sd in zip(camera.names, camera.deviations, strict=True) if sd] == unknown
    directions = np.array([[0.1, -0.2, -1.0], [-0.3, 0.2, -1.0]])
    np.testing.assert_allclose(camera.project(directions), before.project(directions), rtol=1e-12)


# Numbers


def test_angles_are_written_as_they_were_typed(example, tmp_path):
    again = written(formats.read(example), tmp_path / "again")
    typed, back = (
        read_columns(place / "photos.csv", known=(), numbers=ANGLES).vectors(ANGLES)
        for place in (example, again)
    )
    np.testing.assert_array_equal(back, typed)


def test_micrometres_are_millimetres_as_they_were_typed():
    typed = np.arange(1, 20_001) / 1000
    exact = np.array([float(f"{count}e-6") for count in range(1, 20_001)])
    np.testing.assert_array_equal(scaled(typed, 1e-3), exact)


# What is read


def test_the_sample_is_the_truth():
    project = formats.read(sample("project"))
    check_poses(project.block, truth()["photos"])
    found = {
        (project.block.photo_ids[photo], project.block.point_ids[point]): xy
        for photo, point, xy in zip(
            project.block.image_photos, project.block.image_points, project.block.image_xy, strict=True
        )
    }
    for each in truth()["observations"]:
        np.testing.assert_allclose(
            found[each["photo"], each["point"]], [each["column"], each["row"]], rtol=0, atol=1e-9
        )
    assert project.sizes == ((4000, 3000), (3000, 4000))
    assert [project.block.point_ids[row] for row in project.checks] == ["CHK-1", "CHK-2"]
    assert sum(isinstance(each, Position) for each in project.block.observations) == 6


def test_the_sample_with_noise_comes_out_as_the_dense_adjustment():
    check_adjustment(with_control(with_noise(formats.read(sample("project")))))


def test_the_small_sample_has_no_more_than_it_needs():
    project = formats.read(sample("project_small"))
    started = first_values(project.block)
    result = adjust(started.usable())
    known = truth()["photos"]
    for name, position in zip(result.block.photo_ids, result.photo_positions, strict=True):
        np.testing.assert_allclose(position, known[name]["centre"], atol=1e-6)
    matrices = Attitudes.of("omega_phi_kappa", result.photo_attitudes).values("matrix_to_photo")
    for name, matrix in zip(result.block.photo_ids, matrices, strict=True):
        np.testing.assert_allclose(matrix, known[name]["rotation"], atol=1e-6)
    assert project.lacks[0].fields["option"] == option_sd("images")


@pytest.mark.parametrize(
    ("delimiter", "decimal", "ending"),
    [(",", ".", "\n"), (";", ",", "\r\n"), ("\t", ",", "\n"), (" ", ".", "\r")],
)
def test_tables_are_read_in_every_usual_dress(example, delimiter, decimal, ending):
    plain = formats.read(example)
    for path in example.glob("*.csv"):
        rows = [line.split(",") for line in path.read_text().splitlines() if not line.startswith("#")]
        order = np.random.default_rng(1).permutation(len(rows[0]))
        text = [
            delimiter.join(
                row[k].replace(".", decimal) if row is not rows[0] else row[k].upper() for k in order
            )
            for row in rows
        ]
        path.write_bytes(b"\xef\xbb\xbf" + ending.join(["# a comment", *text, ""]).encode())
    project = formats.read(example)
    same_blocks(plain.block, project.block)
    assert adjust(project.block).variance_of_unit_weight == pytest.approx(
        adjust(plain.block).variance_of_unit_weight
    )


def test_a_large_table_is_read_by_the_quick_way_as_by_the_slow_one(tmp_path, monkeypatch):
    random = np.random.default_rng(5)
    rows = [
        f"IMG {k // 40}.jpg, p{k % 977},{x!r},{y!r}"
        for k, (x, y) in enumerate(random.uniform(-1e4, 1e4, (4000, 2)).tolist())
    ]
    path = tmp_path / "images.csv"
    path.write_text("\n".join(["photo,point,column,row", *rows, ""]))
    monkeypatch.setattr(delimited, "LARGE", 1 << 30)
    slow = read_columns(path, numbers={"column", "row"})
    monkeypatch.setattr(delimited, "LARGE", 100)
    fast = read_columns(path, numbers={"column", "row"})
    assert isinstance(fast.cells["column"], np.ndarray)
    assert not isinstance(slow.cells["column"], np.ndarray)
    for name in ("photo", "point"):
        assert fast.names(name).names == slow.names(name).names
        np.testing.assert_array_equal(fast.names(name).rows, slow.names(name).rows)
    for name in ("column", "row"):
        np.testing.assert_array_equal(fast.numbers(name), slow.numbers(name))
    assert fast.place(17) == slow.place(17)


def test_angles_in_other_units_and_representations(example):
    plain = formats.read(example).block
    lines = (example / "photos.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines if line and not line.startswith("#")][1:]
    matrices = [
        np.array(m)
        for m in __import__("photogram")
        .Attitudes.of("omega_phi_kappa", plain.photo_attitudes)
        .values("matrix_to_photo")
    ]
    flip = np.diag([1.0, -1.0, -1.0])
    head = "photo,camera,x,y,z,"
    names = ",".join(f"m{i}{j}" for i in "123" for j in "123")
    cases = {
        'angle = "gon"': (
            "omega,phi,kappa",
            [[repr(float(each) / 0.9) for each in row[5:]] for row in rows],
        ),
        'angle = "dms"': (
            "omega,phi,kappa",
            [[dms(float(each)) for each in row[5:]] for row in rows],
        ),
        'attitude = "matrix"': (names, [[repr(float(each)) for each in m.ravel()] for m in matrices]),
        'attitude = "matrix"\nrotation = "photo_to_object"': (
            names,
            [[repr(float(e)) for e in m.T.ravel()] for m in matrices],
        ),
        'attitude = "matrix"\nphoto = "y_down"': (
            names,
            [[repr(float(e)) for e in (flip @ m).ravel()] for m in matrices],
        ),
    }
    settings = (example / "project.toml").read_text()
    for words, (columns, values) in cases.items():
        section = "[units]" if words.startswith("angle") else "[axes]"
        (example / "project.toml").write_text(settings.replace(section, f"{section}\n{words}", 1))
        body = [",".join([*row[:5], *own]) for row, own in zip(rows, values, strict=True)]
        (example / "photos.csv").write_text("\n".join([head + columns, *body, ""]))
        found = formats.read(example).block
        np.testing.assert_allclose(found.photo_attitudes, plain.photo_attitudes, atol=1e-12)


def dms(angle):
    """Return an angle of one decimal in degrees, minutes and seconds."""
    return f"{'-' if angle < 0 else ''}{int(abs(angle))} {round((abs(angle) % 1) * 60)} 0.0"


def test_every_kind_of_observation_comes_back(tmp_path):
    made = simulate(
        strips=2, photos_per_strip=3, points_per_photo=12, control="corners", check_points=2, seed=4
    )
    block = made.block
    photos, points = block.photo_ids, block.point_ids
    lever, shift, drift = (
        LeverArm("lever", [0.1, 0.0, -0.2], 0.05),
        Shift("flight"),
        Drift("flight", epoch=0.0),
    )
    body = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    boresight = Boresight("imu", body, np.radians(0.5))
    covariance = np.array([[4.0, 1.0, 0.5], [1.0, 5.0, -0.3], [0.5, -0.3, 9.0]]) * 1e-4
    free = next(row for row in range(len(points)) if not np.isfinite(block.point_positions[row]).any())
    camera = Camera("brown", {"c": -152.0, "xp": 0.01, "K1": 1e-8}, {"c": np.inf, "K1": 1e-9}, name="A")
    observations = [
        *(
            Position(
                name,
                block.photo_positions[row],
                covariance=covariance,
                lever_arm=lever,
                shift=shift,
                drift=drift,
                time=float(row),
            )
            for row, name in enumerate(photos)
        ),
        *(Attitude(name, np.eye(3), sd=1e-3, boresight=boresight) for name in photos[:3]),
        Distance(points[0], points[1], 123.25, 0.01),
        Difference(points[1], points[2], [np.nan, np.nan, 1.5], sd=0.002),
        Control(points[free], [10.0, 20.0, 30.0], covariance=covariance),
    ]
    block = block.replace(
        principal_distances=None, cameras=[camera], photo_cameras=None, observations=observations
    )
    block = block.replace(
        photo_cameras=[0, 1, 0, 1, 0, 0],
        cameras=[camera, camera.replace(name="B")],
        mounts=[
            Mount(photos[1], photos[0], sensor := Sensor("0/B", [0.5, 0.0, 0.1], np.eye(3), 0.01)),
            Mount(photos[3], photos[2], sensor),
        ],
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        photo_positions_observed=None,
        photo_attitudes_observed=None,
    )
    project = formats.Project(
        block=block,
        path=tmp_path,
        title="made",
        sizes=(None, None),
        pixel_mm=(None, None),
        starts=made.block.point_positions,
    )
    assert formats.cannot_hold(project, "plain") == []
    other = formats.read(written(project, tmp_path / "there")).block
    assert sorted(each.KIND for each in other.observations) == sorted(each.KIND for each in observations)
    by_kind = {
        kind: [each for each in other.observations if kind == each.KIND]
        for kind in ("position", "attitude", "control", "difference")
    }
    first = by_kind["position"][0]
    np.testing.assert_allclose(first.precision, covariance, rtol=1e-14)
    assert all(each.lever_arm is first.lever_arm for each in by_kind["position"])
    np.testing.assert_allclose(first.lever_arm.value, [0.1, 0.0, -0.2])
    np.testing.assert_allclose(first.lever_arm.deviations, 0.05)
    assert first.shift is not None
    assert [each.time for each in by_kind["position"]] == list(range(6))
    np.testing.assert_allclose(by_kind["attitude"][0].boresight.attitude, body, atol=1e-12)
    np.testing.assert_allclose(by_kind["control"][0].precision, covariance, rtol=1e-14)
    np.testing.assert_allclose(by_kind["difference"][0].observed, [np.nan, np.nan, 1.5])
    assert [(each.photo, each.frame) for each in other.mounts] == [
        (each.photo, each.frame) for each in block.mounts
    ]
    np.testing.assert_allclose(other.mounts[0].sensor.position, [0.5, 0.0, 0.1])
    np.testing.assert_allclose(other.mounts[0].sensor.deviations, 0.01, rtol=1e-12)
    assert [each.parameters for each in other.cameras] == [each.parameters for each in block.cameras]
    np.testing.assert_array_equal(other.cameras[0].deviations, camera.deviations)


def test_a_round_trip_gives_the_same_adjustment(example, tmp_path):
    one = formats.read(example)
    two = formats.read(written(one, tmp_path / "again"))
    first, second = adjust(one.block, tolerance=1e-9), adjust(two.block, tolerance=1e-9)
    order = [two.block.point_ids.index(name) for name in one.block.point_ids]
    assert (np.abs(second.point_positions[order] - first.point_positions) < 1e-9 * first.point_sd).all()
    assert (np.abs(second.photo_positions - first.photo_positions) < 1e-9 * first.photo_sd[:, :3]).all()


# What is refused


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("images.csv", "DJI_0101,t03", "DJI_0101,t04", ["images.csv", "record", "already"]),
        (
            "images.csv",
            "DJI_0101,t03",
            "DJI_0101,",
            ["images.csv", "record 5", "error.column point: error.no-name"],
        ),
        ("images.csv", "DJI_0101,t03", "DJI_0101,NaN", ["record 5", "error.column point: error.no-name NaN"]),
        ("images.csv", "DJI_0101,t03", "DJI_0101,T03", ["images.csv", "error.column point: cells.similar"]),
        ("images.csv", "DJI_0101,t03", "dji_0101,t03", ["record 5", "column photo"]),
        (
            "images.csv",
            "DJI_0101,t03,",
            "DJI_0101,t03,x",
            ["record 5", "error.column column: error.number x", "|DJI_0101,t03,x"],
        ),
        ("images.csv", "DJI_0101,t03,", "DJI_0101,t03,nan,", ["record 5"]),
        ("images.csv", "photo,point,column,row", "photo,point,colum,row", ["record 2", "missing"]),
        ("photos.csv", "DJI_0102,", "DJI_0101,", ["photos.csv", "record 5", "error.repeated photo"]),
        ("photos.csv", "DJI_0102,drone", "DJI_0102,phone", ["record 5", "column camera", "phone"]),
        ("cameras.csv", "opencv", "opncv", ["cameras.csv", "record 4", "column model", "opncv"]),
        ("cameras.csv", "drone,opencv,4000", "drone,opencv,4e3.", ["record 4", "column width"]),
        ("control.csv", "south-2,", "south-1,", ["control.csv", "error.repeated point"]),
        ("control.csv", ",check", ",chek", ["control.csv", "column use", "chek"]),
        ("gnss.csv", "DJI_0103", "DJI_0203", ["gnss.csv", "column photo", "DJI_0203"]),
        ("distances.csv", "south-1", "south-9", ["distances.csv", "column to", "south-9"]),
        (
            "project.toml",
            "[units]",
            "[unit]",
            ["project.toml", "record", "error.unknown.close table unit units"],
        ),
        (
            "project.toml",
            "images = 0.5",
            "image = 0.5",
            ["project.toml", "error.unknown.close key image images"],
        ),
        (
            "project.toml",
            "images = 0.5",
            "images = -0.5",
            ["project.toml", "error.key sd images: error.not-negative"],
        ),
        (
            "project.toml",
            "format = 1 ",
            "format = 7 ",
            ["project.toml", "error.key project format: plain.version"],
        ),
        ("project.toml", "format = 1 ", "format = = ", ["project.toml", "record 6"]),
    ],
)
def test_a_fault_is_named_with_file_row_and_column(example, file, old, new, words):
    change(example / file, old, new)
    with pytest.raises(InputError) as refused:
        formats.read(example)
    for word in words:
        assert word in f"{refused.value} {traced(refused.value)}"


def test_names_that_differ_by_blanks_inside_are_an_error(example):
    text = (example / "images.csv").read_text().replace("t01", "t 2").replace("t03", "t  2")
    (example / "images.csv").write_text(text)
    with rejected("error.column point: cells.similar t  2 t 2"):
        formats.read(example)


def test_two_files_of_one_table_and_a_missing_one(example):
    shutil.copy(example / "images.csv", example / "images.txt")
    with rejected("plain.two-files images images.csv,images.txt"):
        formats.read(example)
    change(example / "project.toml", '# images = "measurements.txt"', 'images = "measurements.txt"')
    with rejected("error.key tables images: error.absent file"):
        formats.read(example)


def test_a_table_under_another_name_is_remarked_on(example):
    assert "plain.unread-tables" not in [each.code for each in formats.read(example).messages]
    (example / "gnss.csv").rename(example / "gnns.csv")
    (example / "wishes.csv").write_text("a,b\n")
    (remark,) = [each for each in formats.read(example).messages if each.code == "plain.unread-tables"]
    assert traced(remark) == "plain.unread-tables plain.similar gnns.csv gnss,wishes.csv"


def test_a_point_that_is_known_twice_must_be_the_same(example):
    (example / "points.csv").write_text("point,x,y,z\nsouth-1,1,2,3\n")
    with rejected("plain.other-position south-1 x"):
        formats.read(example)


@pytest.mark.parametrize("seed", range(5))
def test_damaged_projects_end_in_a_message(example, tmp_path, seed):
    assert check_damaged(example, tmp_path / "damaged", None if seed else "plain", 100, seed) > 30


def test_tables_of_parquet_are_read_as_those_of_text(example):
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    parquet = pytest.importorskip("pyarrow.parquet")
    plain = formats.read(example)
    table = read_columns(example / "images.csv")
    columns = {
        "photo": pyarrow.array(table.texts("photo")).dictionary_encode(),
        "point": table.texts("point"),
        "column": table.numbers("column"),
        "row": table.numbers("row"),
    }
    (example / "images.csv").unlink()
    parquet.write_table(pyarrow.table(columns), example / "images.parquet", compression="zstd")
    other = formats.read(example)
    assert other.block.point_ids == plain.block.point_ids
    np.testing.assert_array_equal(other.block.image_xy, plain.block.image_xy)
    # Names of digits are whole numbers in many tables; each group of rows has a dictionary of its own.
    of_name = {name: 100 + row for row, name in enumerate(dict.fromkeys(columns["point"]))}
    digits = [of_name[name] for name in columns["point"]]
    numbered = pyarrow.table({**columns, "point": pyarrow.array(digits, pyarrow.int32())})
    parquet.write_table(numbered, example / "images.parquet", row_group_size=7)
    (example / "control.csv").unlink(), (example / "distances.csv").unlink()
    found = formats.read(example).block
    np.testing.assert_array_equal(found.image_xy, plain.block.image_xy)
    assert [found.point_ids[row] for row in found.image_points] == list(map(str, digits))
    columns["point"] = [*columns["point"][:-1], None]
    parquet.write_table(pyarrow.table(columns), example / "images.parquet")
    with rejected("error.column point: error.no-name"):
        formats.read(example)
    (example / "images.parquet").write_bytes(b"PAR1 and no more")
    with rejected("error.parse Parquet Parquet magic bytes not found"):
        formats.read(example)


def test_a_geographic_block_whose_frame_nobody_has_said_is_written_in_degrees(tmp_path):
    """Its coordinates must not be taken for metres when they are read again."""
    block = simulate(strips=1, photos_per_strip=3, spheroid=Spheroid.wgs84(), origin=(0.15, 0.83, 0.0)).block
    cameras = [Camera("perspective", {"c": float(block.principal_distances[0])}, name="camera")]
    block = block.replace(principal_distances=None, cameras=cameras, photo_cameras=None)
    starts = np.full(block.point_positions.shape, np.nan)
    project = formats.Project(
        block=block, path=tmp_path, title="made", sizes=(None,), pixel_mm=(None,), starts=starts
    )
    assert (project.frame.kind, project.block.frame) == ("geographic", project.frame)
    found = formats.read(written(project, tmp_path / "there")).block
    assert found.geographic
    np.testing.assert_allclose(found.photo_positions, block.photo_positions, rtol=1e-12)
    with rejected("plain.frame-of-block topocentric geographic"):
        project.replace(frame=formats.Frame("topocentric"))
    flat = simulate(strips=1, photos_per_strip=3).block
    with rejected("plain.frame-of-block geographic rectangular"):
        project.replace(block=flat, frame=formats.Frame("geographic"))


# Headings of other tables, units, coverage factors


def head_of(path, *pairs):
    """Give columns other headings, and their numbers other units: heading before, after, factor."""
    table = list(csv.reader(line for line in path.read_text().splitlines() if not line.startswith("#")))
    for old, new, factor in pairs:
        k = table[0].index(old)
        table[0][k] = new
        for row in table[1:]:
            row[k] = row[k] if factor is None or not row[k] else repr(float(row[k]) * factor)
    path.write_text("\n".join(",".join(row) for row in table) + "\n")


def same_project(found, expected):
    for name in ("image_xy", "image_sd", "point_positions", "point_sd", "photo_positions"):
        np.testing.assert_allclose(getattr(found.block, name), getattr(expected.block, name), rtol=1e-12)


def test_tables_of_images_have_the_headings_of_tables_of_pixels(example):
    expected = formats.read(example)
    pairs = (("photo", "Image"), ("point", "track"), ("column", "u [px]"), ("row", "v (px)"))
    head_of(example / "images.csv", *((old, new, None) for old, new in pairs))
    same_project(formats.read(example), expected)


def test_units_and_coverage_factors_of_headings(example):
    control = example / "control.csv"
    lines = [line for line in control.read_text().splitlines() if not line.startswith("#")]
    more = ["sd_x,sd_y,sd_z", *["0.02,0.03,0.04"] * (len(lines) - 1)]
    control.write_text("\n".join(map(",".join, zip(lines, more, strict=True))) + "\n")
    expected = formats.read(example)
    axes = [(axis, f"{axis.upper()} [mm]", 1000.0) for axis in "xyz"]
    sds = [(f"sd_{axis}", f"U_{axis} (k=2) [mm]", 2000.0) for axis in "xyz"]
    head_of(example / "control.csv", *axes, *sds)
    head_of(example / "photos.csv", *((axis, f"{axis} (m)", None) for axis in "xyz"))
    project = formats.read(example)
    same_project(project, expected)
    remark = next(each for each in project.messages if each.file and each.file.name == "control.csv")
    assert "u_x (k=2) [mm] is sd_x in mm, divided by k = 2" in remark.text


def test_units_of_tables_without_a_system_are_those_of_the_project(example):
    text = "from,to,distance [mm],U (k=2) [mm]\nnorth-1,south-1,12345,4\n"
    (example / "distances.csv").write_text(text)
    (found,) = (each for each in formats.read(example).block.observations if each.KIND == "distance")
    assert (float(np.ravel(found.observed)[0]), float(np.ravel(found.sd)[0])) == pytest.approx(
        (12.345, 0.002)
    )
    for old, new in (("[mm],U", "[deg],U"), ("distance [mm]", "distance (k=2)"), ("k=2", "k=0")):
        (example / "distances.csv").write_text(text.replace(old, new))
        with pytest.raises(InputError) as caught:
            formats.read(example)
        assert (caught.value.file, caught.value.record) == (example / "distances.csv", 1)


def test_images_name_the_photos_of_a_project_without_a_table_of_photos(example):
    expected = formats.read(example)
    (example / "photos.csv").unlink()
    found = formats.read(example)
    assert set(found.block.photo_ids) == set(expected.block.photo_ids)
    assert np.isnan(found.block.photo_positions).all()
    cameras = (example / "cameras.csv").read_text().splitlines()
    rows = [line for line in cameras if not line.startswith("#")]
    other = rows[1].split(",")
    other[0] = "other"
    (example / "cameras.csv").write_text("\n".join([*rows, ",".join(other)]) + "\n")
    with rejected("plain.which-camera"):
        formats.read(example)
    table = [line for line in (example / "images.csv").read_text().splitlines() if not line.startswith("#")]
    name = rows[1].split(",")[0]
    lines = [f"{table[0]},camera", *(f"{line},{name}" for line in table[1:])]
    (example / "images.csv").write_text("\n".join(lines) + "\n")
    assert {each.name for each in formats.read(example).block.cameras} >= {name}
    lines[1] = lines[1].removesuffix(name) + "other"
    (example / "images.csv").write_text("\n".join(lines) + "\n")
    with rejected("plain.other-camera"):
        formats.read(example)


def test_a_written_project_keeps_the_comments_of_its_settings(example, tmp_path):
    pytest.importorskip("tomlkit")
    project = formats.read(example)
    again = formats.read(written(project, tmp_path / "again"))
    text = (tmp_path / "again" / "project.toml").read_text()
    head = (example / "project.toml").read_text().partition("[project]")[0]
    assert head.startswith("#")
    assert text.startswith(head)
    assert re.search(r"format = 1 +# version of the schema", text)
    assert again.frame == project.frame


@pytest.mark.parametrize(
    ("table", "column", "words"),
    [
        ("cameras", "weights", cameras.Weights),
        ("cameras", "readout_direction", moving_photos.Direction),
        ("trajectories", "interpolation", trajectories.Interpolation),
        ("trajectories", "position_axes", trajectories.PositionAxes),
        ("trajectories", "angles", trajectories.Angles),
        ("boards", "kind", board.BoardKind),
        ("boards", "shape", options.Shape),
        ("boards", "regularise", options.Regularisation),
    ],
)
def test_declared_words_are_those_of_the_classes(table, column, words):
    declared = TABLES[table].words[column]
    assert set(declared) == set(get_args(words))


def test_the_settings_of_the_example_show_declared_keys_and_words():
    keys = {(key.section, key.name): key for key in KEYS}
    section, shown = "", set()
    for line in (EXAMPLE / "project.toml").read_text().splitlines():
        if head := re.match(r"(?:# )?\[(\w+)\]", line):
            section = head[1]
        elif (entry := re.match(r"(?:# )?(\w+) = .*?(?:  +# (.*))?$", line)) and (section, entry[1]) in keys:
            shown.add((section, entry[1]))
            words = keys[section, entry[1]].words.split()
            if words and entry[2] and " | " in entry[2]:
                listed = entry[2].split(" | ")
                expected = [word for word in words if word != "free"]  # Of earlier versions
                assert {*listed} - {"..."} <= {*expected} if "..." in listed else listed == expected, line
    assert {key for key in keys if key[0] in ("units", "axes", "adjust")} <= shown
