"""Commands with a result on the console write it as a JSON document, too."""

import csv
import inspect
import io
import json
import re
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from files.test_guards import COMMANDS, EXAMPLES
from photogram.formats import read, read_marks, read_metadata

METADATA = Path(__file__).parents[1] / "data" / "statement" / "metadata"
POINTS = EXAMPLES / "absolute_orientation" / "points.csv"
WITHOUT = {"new", "simulate", "statement"}
ARGUMENTS = {"convert": ["bundle.out"], "absolute-orientation relative": ["strip.csv"]}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def options(name):
    return inspect.signature(COMMANDS[name]).parameters


def document(run, *words, code=0):
    """Run a command with `--json` and return its console text and its document."""
    done = run(*words, "--json", "document.json")
    assert done.exit_code == code, done.output
    assert "document.json" in done.stdout.splitlines()[-1]
    found = json.loads(Path("document.json").read_bytes())
    assert found["program"].startswith("photogram ")
    return done.stdout, found


def figure(console, name):
    """Return the integer behind a name on the console."""
    return int(re.search(rf"^ *{name} +(\d+)", console, re.MULTILINE)[1])


def codes(messages):
    assert all(each["text"] for each in messages)
    return [each["code"] for each in messages]


def test_all_commands_with_a_result_on_the_console_have_the_option():
    assert {name for name in COMMANDS if "json" not in options(name)} == WITHOUT


@pytest.mark.parametrize("name", [name for name in COMMANDS if {"example", "json"} <= {*options(name)}])
def test_examples_have_a_document(run, name):
    switches = ["--no-html"] if "no_html" in options(name) else []
    done = run(*name.split(), "--example", *ARGUMENTS.get(name, []), "-q", "--json", "r.json", *switches)
    assert done.exit_code in (0, 4), done.output
    assert json.loads(Path("r.json").read_bytes())["program"].startswith("photogram ")


def test_documents_of_conversions_list_the_losses(run):
    console, found = document(run, "convert", EXAMPLES / "project", "bundle.out")
    assert found["written"] == {"path": "bundle.out", "format": "bundler"}
    assert {"lost.names", "lost.control", "lost.observations"} <= {*codes(found["lost"])}
    unwrapped = " ".join(console.split())
    assert all(each["text"] in unwrapped for each in found["lost"])
    assert found["photos"] == figure(console, "photos")
    assert found["median_residual"] == pytest.approx(
        float(re.search(r"median residual +(\S+)", console)[1]), 0.01
    )
    _, described = document(run, "info", EXAMPLES / "project")
    assert {name: value for name, value in found.items() if name not in ("written", "lost")} == described
    _, complete = document(run, "convert", EXAMPLES / "project", "tables")
    assert complete["written"]["format"] == "plain"
    assert complete["lost"] == []


def test_documents_of_metadata_count_the_sources(run):
    metadata = read_metadata(METADATA)
    console, found = document(run, "metadata", METADATA)
    for name in ("pictures", "tables", "photos"):
        assert found[name] == len(getattr(metadata, name)) == figure(console, name)
    assert found["positions"] == {"XMP": 1, "geo.txt": 3}
    assert found["position_sd"] == metadata.sources()
    assert found["flights"] == [{"flight": "metadata", "photos": 4, "rtk": 2}]
    assert codes(found["messages"]) == ["photos.other-table"] * 2
    assert Path(found["path"]) == METADATA


def test_documents_of_marks_have_counts_and_assumptions(run):
    console, found = document(run, "film", "marks", EXAMPLES / "archive", "--out", "micmac")
    assert (
        found["files"]
        == figure(console, "files")
        == sum(path.is_file() for path in Path("micmac").rglob("*"))
    )
    assert found["messages"] == []
    console, found = document(run, "film", "marks", "micmac")
    marks = read_marks(Path("micmac"))
    assert found["marks"] == len(marks.places) == figure(console, "marks")
    assert found["photos"] == len(marks.readings) == figure(console, "photos")
    assert found["readings"] == figure(console, "readings")
    assert codes(found["messages"]) == [each.code for each in marks.remarks] == ["micmac.side-down"]


def test_documents_of_strips_have_models_and_joints(run):
    console, found = document(run, "absolute-orientation", "relative", "--example", "strip.csv", code=4)
    photos = read(EXAMPLES / "project").block.photo_ids
    assert [each["photos"] for each in found["models"]] == [
        f"{one} {other}" for one, other in pairwise(photos)
    ]
    assert all(each["photos"] in console and each["status"] == "converged" for each in found["models"])
    assert [each["degrees_of_freedom"] for each in found["models"]] == [15, 13, 5, 6, 0]
    assert len(found["joints"]) == len(photos) - 2
    assert all(f"{each['rms']:.3}" in console.replace("0 ", " ") for each in found["joints"][1:3])
    assert codes(found["messages"]) == ["orientation.unchecked"]


def test_documents_of_transformed_points_have_their_covariances(run):
    assert run("absolute-orientation", "--example", "--json", "r.json", "-q").exit_code == 0
    console, found = document(run, "absolute-orientation", "transform", "r.json", POINTS, "points.csv")
    assert f"{len(found['points'])} points" in console
    with open("points.csv", newline="") as file:
        for row, point in zip(csv.DictReader(file), found["points"], strict=True):
            assert row["id"] == point["id"]
            for axis, name in enumerate("XYZ"):
                assert float(row[name]) == pytest.approx(point["position"][axis], abs=1e-6)
                assert float(row[f"sd_{name}"]) == pytest.approx(
                    point["covariance"][axis][axis] ** 0.5, abs=1e-6
                )
    before = json.loads(Path("r.json").read_bytes())["points"][-len(found["points"]) :]
    assert [each["id"] for each in before] == [each["id"] for each in found["points"]]
    for name in ("position", "covariance"):
        values = [[each[name] for each in points] for points in (before, found["points"])]
        np.testing.assert_allclose(*values, rtol=1e-6, atol=1e-10)


@pytest.mark.parametrize("out", [[], ["corrected.csv"]])
def test_documents_of_corrections_have_the_remarks(run, out):
    assert run("comparator", "--example", "--out", "o", "--no-plots", "-q").exit_code == 0
    Path("measured.csv").write_text("point,x_um,y_um\n1,200000,100000\n2,300000,20000\n")
    words = ["o/correction.json", "measured.csv", *out, "--extrapolate", "--json", "remarks.json"]
    done = run("comparator", "correct", *words)
    assert done.exit_code == 0, done.output
    found = json.loads(Path("remarks.json").read_bytes())
    assert codes(found["messages"]) == ["comparators.outside"]
    assert found["messages"][0]["text"] in done.stderr
    # Without OUT, standard output is the table, and nothing else.
    text = Path("corrected.csv").read_text() if out else done.stdout
    assert [row["in_range"] for row in csv.DictReader(io.StringIO(text))] == ["yes", "no"]
    assert not out or "written: corrected.csv, remarks.json" in done.stdout


def test_documents_of_places_have_the_number_of_stars(run):
    pytest.importorskip("erfa")
    Path("catalogue.csv").write_text(
        "id,ra_deg,dec_deg,pm_ra_mas,pm_dec_mas,parallax_mas,magnitude\n1,10,20,0,0,0,1\n2,11,20,0,0,0,9\n"
    )
    words = ("--utc", "1966-03-01T21:03:05", "--catalogue", "catalogue.csv")
    console, found = document(run, "stellar-camera", "places", "stars.csv", *words)
    assert {**found, "program": ""} == {"program": "", "utc": "1966-03-01T21:03:05", "stars": 1}
    assert "1 stars at 1966-03-01T21:03:05" in console


def test_documents_of_features_have_the_verdict(run):
    _, found = document(run, "features", "--example")
    assert (found["verdict"]["exit"], found["verdict"]["code"]) == (0, "accepted")


@pytest.mark.parametrize("taken", ["geo.txt", "DJI_0001.JPG"])
def test_documents_spare_the_files_of_a_flight(run, taken):
    shutil.copytree(METADATA, "flight")
    shutil.copy(METADATA / "head.jpg", "flight/DJI_0001.JPG")
    before = Path("flight", taken).read_bytes()
    done = run("metadata", "flight", "--json", f"flight/{taken}")
    assert done.exit_code == 1
    assert "must not be written over the input" in done.stderr
    assert Path("flight", taken).read_bytes() == before


def test_no_output_remains_without_its_document(run):
    done = run("convert", EXAMPLES / "project", "bundle.out", "--json", "/dev/full")
    assert done.exit_code == 1
    assert not Path("bundle.out").exists()
