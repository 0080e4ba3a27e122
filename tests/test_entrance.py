"""What every command does with its packaged example: exit code, streams, files, the last line."""

import inspect
import re
from importlib.resources import files
from pathlib import Path

import pytest

from files.test_guards import COMMANDS, RUNS
from photogram.cli import app
from photogram.cli.options import Writes, roles

PACKAGE = str(files("photogram").joinpath("examples"))
ELSE = {"plan": ["--strips", "2", "--photos-per-strip", "4"], "new": ["made"], "simulate": ["made"]} | {
    "convert-lens": ["camera.cameramodel", "--to", "opencv5"],
    "stellar-camera places": ["stars.csv", "--utc", "1966-03-01T21:03:05"],
}
"""Words of commands that need no input, or no example of it."""
NEEDED = {"absolute-orientation relative": ["stations.csv"], "convert": ["made"]}
"""Words beside --example."""
CHANGED = {"absolute-orientation relative": 4, "camera compare": 4, "comparator compare": 4}
"""Exit codes of examples that have something to find."""
PAGED = [name for name, command in COMMANDS.items() if "html" in inspect.signature(command).parameters]


def words(name, where):
    """Return a command with its example, or with what it needs in the place of one."""
    parameters = inspect.signature(COMMANDS[name]).parameters
    if "example" in parameters:
        return [*name.split(), "--example", *NEEDED.get(name, [])]
    if name in ELSE:
        return [*name.split(), *ELSE[name]]
    return [word if word in name.split() else str(where.get(word, word)) for word in RUNS[name][0]]


@pytest.fixture
def where(run, tmp_path, monkeypatch):
    """Go to an empty folder that knows where results are made that commands take as input."""
    monkeypatch.chdir(tmp_path)
    return {name: Path(PACKAGE) / name for name in ("galveston", "archive")}


def with_inputs(run, name, where):
    """Make what a command reads that reads results of another one."""
    if name == "absolute-orientation transform":
        run("absolute-orientation", "--example", "--json", "former.json", "--quiet")
        where["points.csv"] = Path(PACKAGE) / "absolute_orientation" / "points.csv"
        return ["out.csv"]
    if name == "convert-lens":
        run("calibrate", "--example", "--to", "mrcal", "--out", "made", "--quiet")
        Path("camera.cameramodel").write_bytes(next(Path("made", "mrcal").iterdir()).read_bytes())
    if name == "metadata":
        Path("flight").mkdir()
        Path("flight/geo.txt").write_text("EPSG:4979\nDJI_0001.JPG 8.5 47.3 500\n")
    if name == "comparator correct":
        run("comparator", "--example", "--no-plots", "--quiet")
        where["former.json"] = Path("comparator-calibrated", "correction.json")
        where["points.csv"] = Path("points.csv")
        where["points.csv"].write_text("point,x_um,y_um\n1,100000,200000\n")
        return ["out.csv"]
    return []


def listed(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", COMMANDS)
def test_example(run, name, where, tmp_path):
    further = with_inputs(run, name, where)
    before = listed(tmp_path)
    result = run(*words(name, where), *further)
    assert result.exit_code == CHANGED.get(name, 0), result.output
    # Results are on standard output; beside them nothing but remarks, and those of extras that are absent.
    assert result.stdout.strip()
    said = [line for line in result.stderr.splitlines() if line.strip()]
    assert all(line.startswith("remark: ") for line in said), said
    assert PACKAGE not in result.output
    # What was written is named, and nothing else was written; the report to open is named last.
    lines = result.stdout.rstrip().splitlines()
    made = listed(tmp_path) - before
    told = {
        str(Path(path).resolve().relative_to(tmp_path.resolve()))
        for line in lines
        if (found := re.match("written: (.*)", line))
        for path in found[1].split(", ")
    }
    assert told == made
    pages = [path for path in made if path.endswith(".html")]
    if name in PAGED:
        assert ("open in a browser: " in lines[-1]) == bool(pages)
        assert lines[-1].removeprefix("open in a browser: ") in pages or not pages


@pytest.mark.parametrize("name", COMMANDS)
def test_quiet_prints_nothing(run, name, where):
    further = with_inputs(run, name, where)
    result = run(*words(name, where), *further, "--quiet")
    assert result.exit_code == CHANGED.get(name, 0), result.output
    assert result.output == ""


@pytest.mark.parametrize("name", COMMANDS)
def test_wrong_usage_ends_with_2_on_standard_error(run, name, where):
    result = run(*name.split(), "--no-such-option")
    assert result.exit_code == 2
    assert not result.stdout
    assert "--no-such-option" in result.stderr


def test_commands_with_a_directory_of_results_have_a_report():
    made = {name for name, command in COMMANDS.items() if roles(command).get("out") is Writes.DIRECTORY}
    assert set(PAGED) <= made
    # The report of `features` is that of `adjust`; the page of `statement` is its result.
    bare = {*("convert", "convert-lens", "features", "film marks", "new", "simulate", "statement")}
    assert made - set(PAGED) <= bare


def test_help_of_parents_names_their_commands(run):
    for group in app.registered_groups:
        parent = group.typer_instance.info.name
        said = re.sub(r"\s+", " ", run(parent, "--help").output)
        for command in group.typer_instance.registered_commands[1:]:
            assert f"photogram {parent} {command.name}:" in said
    assert run("giant").exit_code == 2


def test_progress_is_told_in_words():
    from photogram import Progress
    from photogram.cli.job import shown

    lines = []
    tell = shown(lines.append, "weighted sum of squares", 1.0)
    tell(Progress("form", 61, 100, None))
    assert lines == ["normal equations 61 %"]


def test_quiet_plans_of_projects_print_no_remarks(run):
    loud, quiet = (run("plan", "--example", *words) for words in ((), ("--quiet",)))
    assert "GROUND, record 19: control point SH954202" in loud.stderr
    assert "remark: galveston" in loud.stderr
    assert (quiet.stdout, quiet.stderr) == ("", "")


def test_quiet_plans_of_parts_print_nothing(run):
    loud, quiet = (run("adjust", "--example", "--plan", *words) for words in ((), ("--quiet",)))
    assert "parts" in loud.stdout
    assert (quiet.exit_code, quiet.output) == (0, "")
