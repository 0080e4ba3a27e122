"""`photogram convert-lens`: what it writes, and how it ends."""

import ast
import csv
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from photogram.cli import app
from photogram.targets.mrcal import read_lens
from photogram.words import phrase

NAMES = {"lensmodel": "LENSMODEL_OPENCV4", "imagersize": [640, 480]}
VALUES = [520.0, 521.0, 318.0, 236.0, -0.2, 0.05, 1e-3, -5e-4]


@pytest.fixture
def lens(tmp_path):
    path = tmp_path / "left.cameramodel"
    path.write_text(f"# a comment\n{NAMES | {'intrinsics': VALUES, 'extrinsics': [0.0] * 6}!r}\n")
    return path


def run(*arguments):
    return CliRunner().invoke(app, ["convert-lens", *map(str, arguments)])


def test_the_new_camera_is_written_where_it_can_be_held(lens, tmp_path):
    out = tmp_path / "out"
    done = run(lens, "--to", "opencv5", "--out", out, "--json", tmp_path / "c.json", "--tolerance", "1e-4")
    assert done.exit_code == 0, done.output
    assert "left: opencv_pinhole as opencv_pinhole" in done.output
    camera, size = read_lens(out / "mrcal" / "left.cameramodel")
    assert size == (640, 480)
    np.testing.assert_allclose(camera.values[:8], VALUES, rtol=1e-5, atol=1e-8)
    document = json.loads((tmp_path / "c.json").read_text())
    assert document["largest"] < 1e-4
    assert np.shape(document["difference"]) == (1, 40, 60, 2)
    rows = list(csv.DictReader((out / "difference.csv").read_text().splitlines()))
    assert len(rows) == 2400
    assert (float(rows[59]["column"]), float(rows[59]["row"])) == (639.0, 0.0)
    assert {each.name for each in out.iterdir()} >= {"report.txt", "opencv_yaml", "ros_camera_info"}


def test_a_difference_beyond_the_tolerance_ends_with_4(lens):
    done = run(lens, "--to", "simple_pinhole", "--tolerance", "1")
    assert done.exit_code == 4
    assert "largest at" in done.output


def test_knots_are_read_again_as_they_were_written(lens, tmp_path):
    assert (
        run(lens, "--to", "splined_stereographic", "--knots", "9x8", "--out", tmp_path / "s").exit_code == 0
    )
    path = tmp_path / "s" / "mrcal" / "left.cameramodel"
    camera, _ = read_lens(path)
    assert camera.knots.shape == (8, 9, 2)
    assert ast.literal_eval(path.read_text())["intrinsics"][4:] == camera.knots.ravel().tolist()
    back = run(path, "--to", "opencv4", "--tolerance", "0.5")
    assert back.exit_code == 0, back.output


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--to", "opencv9"], 1, "opencv9"),
        (["--to", "opencv5", "--knots", "9"], 2, "two numbers"),
        (["--to", "opencv5", "--distance", "near"], 2, "a list of distances"),
        (["--to", "opencv5", "--distance", "1,inf"], 1, str(phrase("targets.infinite"))),
        (["--to", "opencv5", "--plots"], 2, "--out"),
    ],
)
def test_what_makes_no_sense_is_refused(lens, arguments, code, message):
    done = run(lens, *arguments)
    assert done.exit_code == code
    assert message in done.output


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lensmodel": "LENSMODEL_LATLON"}, "LENSMODEL_LATLON"),
        (
            {"intrinsics": VALUES[:5]},
            "LENSMODEL_OPENCV4: must have 8 values, got 5",
        ),
        ({"imagersize": None}, str(phrase("targets.mrcal-no-model"))),
    ],
)
def test_lenses_that_are_not_taken_are_named(tmp_path, changes, message):
    path = tmp_path / "bad.cameramodel"
    path.write_text(repr(NAMES | {"intrinsics": VALUES} | changes))
    done = run(path, "--to", "opencv5")
    assert done.exit_code == 1
    assert message in done.output
