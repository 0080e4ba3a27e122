"""The verdict as commands end by it."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from photogram.cli import app
from photogram.giant import Project, read_project, write_project


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(app, [str(each) for each in arguments])


@pytest.fixture
def project(run, tmp_path):
    """Return a block whose images have standard deviations of half the size."""
    assert run("simulate", "block", "--strips", 2, "--photos-per-strip", 4, "--seed", 5).exit_code == 0
    block = read_project(tmp_path / "block").to_block()
    write_project(Project.from_block(block.replace(image_sd=block.image_sd / 2)), tmp_path / "half")
    return tmp_path / "half"


def test_warnings_count_where_they_are_asked_to(run, project):
    done = run("giant", project, "--json", "result.json")
    assert done.exit_code == 0, done.output
    assert done.output.startswith("Verdict\n  Weights too optimistic")
    document = json.loads(Path("result.json").read_bytes())["verdict"]
    assert (document["code"], document["exit"], document["warning"]) == ("weights", 0, True)
    assert run("giant", project, "--strict", "--quiet").exit_code == 4
    assert "Verdict\n-------\nWeights too optimistic" in Path("half-adjusted", "report.txt").read_text()


@pytest.mark.parametrize(
    ("arguments", "sets"),
    [
        (("collection", "--example"), None),
        (("absolute-orientation", "--example"), None),
        (("perspective-center", "--example"), "sets"),
    ],
)
def test_examples_can_be_used(run, arguments, sets):
    done = run(*arguments, "--json", "result.json", "--out", "o")
    assert done.exit_code == 0, done.output
    document = json.loads(Path("result.json").read_bytes())
    for one in document[sets] if sets else [document]:
        assert one["verdict"]["exit"] == 0
        assert one["verdict"]["tests"]
        assert one["verdict"]["headline"].partition("\n")[0] in done.output


def test_a_comparator_has_a_verdict(run):
    done = run("comparator", "--example", "--out", "o", "--json", "result.json", "--no-plots", "--date", "x")
    assert done.exit_code == 0, done.output
    text = Path("result.json").read_text()
    assert '"verdict"' in text
    assert done.output.count("Verdict") >= 1


def test_stars_have_a_verdict(run):
    pytest.importorskip("erfa")
    done = run("stellar-camera", "--example", "--out", "o", "--json", "result.json")
    assert done.exit_code == 0, done.output
    document = json.loads(Path("result.json").read_bytes())["verdict"]
    names = [test["name"].partition(":")[0] for test in document["tests"]]
    assert {"plate coordinates", "places of stars"} <= set(names)
