"""`photogram calibrate`, and what other commands make of the same path."""

import json
from importlib.resources import files

import numpy as np
import pytest
from given_targets import golden, left_table
from typer.testing import CliRunner

from golden_data import shared
from photogram import formats
from photogram.cli.commands import application
from photogram.targets import read

runner = CliRunner()


def run(*words):
    return runner.invoke(application(), [*map(str, words)])


@pytest.fixture(scope="module")
def left(tmp_path_factory):
    folder = tmp_path_factory.mktemp("left")
    (folder / "corners").mkdir()
    return left_table(folder / "corners")


@pytest.fixture(scope="module")
def calibrated(left):
    out, document = left.parent / "out", left.parent / "left.json"
    found = run("calibrate", left, "--out", out, "--json", document)
    return found, out, json.loads(document.read_text())


def test_one_command_from_corners_to_a_camera(calibrated):
    found, out, document = calibrated
    expected = golden("opencv_left")["left"]["solution"]
    camera = document["cameras"][0]
    values = {each["name"]: each["value"] for each in camera["parameters"]}
    assert values["fx"] == pytest.approx(expected["parameters"][0], abs=1e-4)
    assert document["board"]["shape"] == "held"
    assert [each["corners"] for each in document["views"]] == [54] * 13
    assert found.exit_code == document["verdict"]["exit"]
    text = (out / "report.txt").read_text()
    assert "Calibration with targets" in text.split("\n")[0]
    assert "nothing checks it: its relative error is that of every length" in text
    assert "count from 0 at the centre of the first" in text
    assert (out / "views.csv").read_text().startswith("view,pictures,corners,left_out,rms_px,redundancy,chi2")
    assert "Views" in (out / "report.html").read_text()


def test_the_adjusted_project_counts_pixels_from_the_corner(calibrated):
    _, out, document = calibrated
    project = formats.read(out / "adjusted")
    values = {each["name"]: each["value"] for each in document["cameras"][0]["parameters"]}
    camera = project.block.cameras[0]
    assert camera.parameters["cx"] == pytest.approx(values["cx"] + 0.5, abs=1e-9)
    first = golden("opencv_left")["corners"]["left"]["1"][0]
    assert project.block.image_xy[0] == pytest.approx(np.array(first) + 0.5)
    result = project.block  # adjusted values fit its images
    assert len(result.photo_ids) == 13


def test_other_commands_know_the_folder(left):
    told = run("info", left)
    assert told.exit_code == 0
    assert "corners of a board" in told.output
    assert "photos 13 (13 with a position) images 702 (of 54 points)" in " ".join(told.output.split())
    again = run("adjust", left, "--out", left.parent / "adjusted", "--no-html", "--quiet")
    assert again.exit_code in (0, 4)
    assert (left.parent / "adjusted" / "report.txt").exists()
    converted = run("convert", left, left.parent / "model-colmap")
    assert converted.exit_code == 0


def test_snooping_takes_gross_errors_out_and_says_which(left):
    out = left.parent / "snooped"
    words = (
        "calibrate",
        left,
        "--size",
        "640x480",
        "--sd",
        "images=0.15",
        "--snoop",
        "--out",
        out,
        "--no-html",
    )
    found = run(*words)
    assert found.exit_code in (0, 4)
    removed = (out / "removed.csv").read_text()
    assert "left02.jpg" in removed
    views = (out / "views.csv").read_text().split("\n")
    assert int(next(line for line in views if line.startswith("left02.jpg")).split(",")[3]) > 5


def test_outliers_as_mrcal_marks_them(left):
    calibration = read(left)
    plain, without = calibration.adjust(), calibration.adjust(outliers="mrcal")
    weighted = without.residuals
    assert np.abs(weighted).max() <= 5 * np.sqrt((weighted**2).mean())
    assert np.count_nonzero(~without.calibration.corners.use) > 5
    assert len(plain.residuals) == len(weighted) + np.count_nonzero(~without.calibration.corners.use)
    assert "targets.removed" in [each.code for each in without.messages]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--board", "9x6"], "requires spacing"),
        (["--board", "9by6", "--spacing", "25"], "must be two numbers"),
        (["--spacing", "25"], "requires board"),
        (["--sd", "control=1"], "images=S"),
        (["--snoop", "--loss", "huber"], "must not be combined with --loss"),
        (["--model", "pinhole9"], "pinhole"),
    ],
)
def test_what_does_not_go_is_refused(tmp_path, words, said):
    found = run("calibrate", files("photogram") / "examples" / "board", "--out", tmp_path / "none", *words)
    assert found.exit_code in (1, 2)
    assert said in " ".join(found.output.replace("│", " ").split())
    assert not (tmp_path / "none").exists()


def test_corners_of_mrcal_by_options_alone(tmp_path):
    out, document = tmp_path / "out", tmp_path / "out.json"
    words = ("--board", "10x10", "--spacing", "0.077", "--size", "6016x4016", "--shape", "points")
    found = run(
        "calibrate",
        shared("targets", "mrcal_corners.vnl"),
        *words,
        "--out",
        out,
        "--json",
        document,
        "--no-html",
    )
    assert found.exit_code in (0, 4)
    board = json.loads(document.read_text())["board"]
    # The board of the example is bent by a millimetre, as mrcal finds it.
    assert board["rms_out_of_plane"] == pytest.approx(3e-4, abs=2e-4)
    z = np.array([each["adjusted"] for each in board["points"]])[:, 2].reshape(10, 10)
    assert z[4:6, 4:6].mean() - z[[0, 0, -1, -1], [0, -1, 0, -1]].mean() == pytest.approx(-5e-4, abs=3e-4)
