"""What `photogram calibrate` says of the uncertainty of cameras, and what it is asked."""

import json
from importlib.resources import files

import pytest
from typer.testing import CliRunner

from photogram.cli.commands import application

runner = CliRunner()


def run(*words):
    return runner.invoke(application(), ["calibrate", *map(str, words)])


@pytest.fixture(scope="module")
def board():
    return files("photogram") / "examples" / "board"


def test_maps_cross_validation_and_views_to_take_next(board, tmp_path):
    document = tmp_path / "left.json"
    asked = ("--distance", "inf,0.5", "--suggest", 1, "--plots", "--json", document)
    found = run(board, *asked, "--out", tmp_path / "out")
    assert "worst where the board was seen" in found.output
    assert "cross-validation" in found.output
    assert "view to take next" in found.output
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"map-camera-infinity.csv", "map-camera-0.5.npz", "map-camera-0.5.png"} <= written
    assert "cross-validation-camera-infinity.png" in written
    assert "Uncertainty of projection" in (tmp_path / "out" / "report.html").read_text()
    told = json.loads(document.read_text())
    assert [each["distance"] for each in told["maps"]] == [None, 0.5]
    assert len(told["maps"][0]["sd"]) == 40
    assert told["cross_validation"][0]["splits"][0]["tests"][0]["dof"] == 9
    assert told["suggested_views"][0]["views"][0]["largest"] < told["suggested_views"][0]["largest_before"]


def test_another_calibration_is_compared(board, tmp_path):
    found = run(board, "--compare", board, "--cross-validate", "none", "--out", tmp_path / "out")
    assert "100 percent of the corners are the same" in found.output


def test_what_is_needed_decides_the_exit_code(board, tmp_path):
    usual = (board, "--loss", "cauchy", "--cross-validate", "none", "--no-html")
    plain = run(*usual, "--out", tmp_path / "plain").exit_code
    assert run(*usual, "--need", 100, "--out", tmp_path / "much").exit_code == plain
    little = run(*usual, "--need", 0.001, "--out", tmp_path / "little", "--json", tmp_path / "little.json")
    assert little.exit_code == 4
    verdict = json.loads((tmp_path / "little.json").read_bytes())["verdict"]
    codes = [message["code"] for message in verdict["messages"]]
    assert "verdict.not-accurate-enough" in codes
    assert "advice.nothing" not in codes


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--distance", "-1"), "list of distances"),
        (("--distance", "far"), "list of distances"),
        (("--cross-validate", "1"), "odd, halves, none"),
        (("--datum", "board"), "corners"),
    ],
)
def test_what_is_not_understood_is_refused(board, tmp_path, words, said):
    found = run(board, *words, "--out", tmp_path / "out")
    assert found.exit_code == 2
    assert said in found.output
