"""No output of any command is ever an input, a directory, or another output, by whatever name."""

import inspect
import os
import shutil
from importlib.resources import files
from itertools import combinations
from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.models import ArgumentInfo

from photogram.cli import app
from photogram.cli.job import Job, with_job
from photogram.cli.options import Reads, Writes, roles

EXAMPLES = Path(str(files("photogram") / "examples"))
PROJECT = ("COMMON", "CAMERAS", "IMAGES", "FRAMES", "GROUND")

# The words of each command without its outputs, and the files that it then reads.
RUNS = {
    "giant adjust": (["giant", "galveston"], [f"galveston/{name}" for name in PROJECT]),
    "giant check": (["giant", "check", "galveston"], [f"galveston/{name}" for name in PROJECT]),
    "absolute-orientation orient": (
        [
            *("absolute-orientation", "stations.csv", "--points", "points.csv"),
            *("--restart", "former.json", "--method", "report"),
        ],
        ["stations.csv", "points.csv", "former.json"],
    ),
    "absolute-orientation transform": (
        ["absolute-orientation", "transform", "former.json", "points.csv"],
        ["former.json", "points.csv"],
    ),
    "absolute-orientation relative": (
        ["absolute-orientation", "relative", "project"],
        ["project/images.csv"],
    ),
    "comparator calibrate": (
        ["comparator", "comparator-3.txt", "--grid", "grid.csv", "--no-plots"],
        ["comparator-3.txt", "grid.csv"],
    ),
    "comparator correct": (
        ["comparator", "correct", "former.json", "points.csv"],
        ["former.json", "points.csv"],
    ),
    "comparator compare": (
        ["comparator", "compare", "former.json", "later.json"],
        ["former.json", "later.json"],
    ),
    "collection": (["collection", "ring.txt"], ["ring.txt"]),
    "calibrate": (["calibrate", "corners.csv"], ["corners.csv"]),
    "certificate": (["certificate", "rc10.toml"], ["rc10.toml"]),
    "camera compare": (["camera", "compare", "rc10.toml", "later.toml"], ["rc10.toml", "later.toml"]),
    "film compare": (["film", "archive"], ["archive/images.csv", "archive/rc10-2345.toml"]),
    "film marks": (["film", "marks", "archive"], ["archive/fiducial_images.csv"]),
    "convert-lens": (["convert-lens", "project", "--to", "opencv5"], ["project/images.csv"]),
    "perspective-center": (["perspective-center", "grid.deck"], ["grid.deck"]),
    "stellar-camera plate": (["stellar-camera", "plate.toml"], ["plate.toml", "stars.csv", "images.csv"]),
    "stellar-camera exposures": (["stellar-camera", "exposures", "night.toml"], ["night.toml", "images.csv"]),
    "stellar-camera places": (
        ["stellar-camera", "places", "--utc", "1966-03-01T21:03:05", "--catalogue", "catalogue.csv"],
        ["catalogue.csv"],
    ),
    "adjust": (["adjust", "project"], ["project/images.csv", "project/project.toml"]),
    "check": (["check", "project"], ["project/images.csv"]),
    "features": (["features", "project", "--distance", "d=south-1,t01"], ["project/images.csv"]),
    "info": (["info", "project"], ["project/images.csv"]),
    "metadata": (["metadata", "flight"], ["flight/geo.txt"]),
    "convert": (["convert", "project"], ["project/images.csv"]),
    "new": (["new"], []),
    "plan": (["plan", "galveston", "second"], ["galveston/FRAMES", "second/GROUND"]),
    "simulate": (["simulate"], []),
    "statement": (["statement", "project", "--sd", "check=0.02"], ["project/images.csv"]),
}
FOLDERS = {
    "stellar-camera plate": "stellar",
    "stellar-camera exposures": "exposures",
    "calibrate": "board",
    "certificate": "certificate",
    "camera compare": "certificate",
}


def registered(typer_app=app, before=""):
    """Return the functions of all commands by their names."""
    found = {}
    for command in typer_app.registered_commands:
        name = command.name or command.callback.__name__.replace("_", "-")
        found[before + name] = command.callback
    for group in typer_app.registered_groups:
        found |= registered(group.typer_instance, f"{group.typer_instance.info.name} ")
    return found


COMMANDS = registered()


def outputs(name, role=Writes.FILE):
    return [option for option, each in roles(COMMANDS[name]).items() if each is role]


def words(name, **given):
    """Return the command line of a command with all arguments, and values for some of its outputs."""
    found = list(RUNS[name][0])
    parameters = inspect.signature(COMMANDS[name], eval_str=True).parameters
    for option, role in roles(COMMANDS[name]).items():
        marks = parameters[option].annotation.__metadata__
        if isinstance(role, Writes) and any(isinstance(each, ArgumentInfo) for each in marks):
            found.append(given.pop(option, "other"))
    for option, value in given.items():
        found += [f"--{option.replace('_', '-')}", value]
    return found


@pytest.fixture
def place(tmp_path, request):
    """Lay out what the commands read."""
    name = request.node.callspec.params["name"]
    folders = (
        [FOLDERS[name]]
        if name in FOLDERS
        else ["absolute_orientation", "comparator", "collection", "perspective_center"]
    )
    for folder in folders:
        for file in (EXAMPLES / folder).iterdir():
            if file.is_file():
                shutil.copy(file, tmp_path)
    for project in ("galveston", "second"):
        shutil.copytree(EXAMPLES / "galveston", tmp_path / project)
    for project in ("project", "archive"):
        shutil.copytree(EXAMPLES / project, tmp_path / project)
    (tmp_path / "flight").mkdir()
    (tmp_path / "flight" / "geo.txt").write_text("EPSG:4979\nDJI_0001.JPG 8.5 47.3 500\n")
    (tmp_path / "former.json").write_text("{}")
    (tmp_path / "later.json").write_text("{}")
    (tmp_path / "later.toml").write_text("[certificate]\n")
    (tmp_path / "grid.csv").write_text("point,x_um,y_um\n1,0,0\n")
    (tmp_path / "catalogue.csv").write_text(
        "id,ra_deg,dec_deg,pm_ra_mas,pm_dec_mas,parallax_mas,magnitude\n1,10,20,0,0,0,1\n"
    )
    return tmp_path


def content(directory):
    return {path: path.read_bytes() for path in directory.rglob("*") if path.is_file()}


def same(path):
    return path


def spelt_otherwise(path):
    return path.parent / ".." / path.parent.name / "." / path.name


def symbolic_link(path):
    link = path.parent / "by-symbolic-link"
    link.symlink_to(path.name)
    return link


def hard_link(path):
    link = path.parent / "by-hard-link"
    os.link(path, link)
    return link


ALIASES = (same, spelt_otherwise, symbolic_link, hard_link)


def test_every_command_is_known_here_and_has_its_job():
    assert set(COMMANDS) == set(RUNS)
    for name, command in COMMANDS.items():
        assert "job" in inspect.signature(inspect.unwrap(command)).parameters, name
        assert any(outputs(name, each) for each in Writes), name


def test_a_path_that_says_nothing_of_its_use_is_refused_when_the_command_is_made():
    def forgetful(job: Job, listing: Annotated[Path | None, typer.Option()] = None) -> None:
        raise AssertionError(job, listing)

    with pytest.raises(TypeError, match="listing must be marked as one of Reads or Writes"):
        with_job()(forgetful)


def test_words_that_may_be_files_are_marked_too():
    assert roles(COMMANDS["comparator calibrate"])["grid"] is Reads.FILE


@pytest.mark.parametrize(
    ("name", "option", "source", "alias"),
    [
        (name, option, source, alias)
        for name, (_, sources) in RUNS.items()
        for option in outputs(name)
        for number, source in enumerate(sources)
        for alias in (ALIASES if number == 0 else ALIASES[-1:])
    ],
)
def test_no_output_goes_over_an_input(run, place, name, option, source, alias):
    target = alias(place / source)
    before = content(place)
    result = run(*words(name, **{option: target}))
    assert result.exit_code == 1, result.output
    assert f"{target}: the result must not be " in result.stderr
    assert "over the input" in result.stderr or "of the project" in result.stderr
    assert content(place) == before


@pytest.mark.parametrize(
    ("name", "one", "other"),
    [(name, *pair) for name in RUNS for pair in combinations(outputs(name), 2)],
)
def test_no_two_outputs_share_a_place(run, place, name, one, other):
    (place / "link").symlink_to("result")
    for first, second in (("result", "result"), ("result", "./Result"), ("link", "result")):
        before = content(place)
        result = run(*words(name, **{one: first, other: second}))
        assert result.exit_code == 1, result.output
        assert "another result has this name" in result.stderr
        assert content(place) == before
    result = run(*words(name, **{one: "result", other: "result/deeper"}))
    assert result.exit_code == 1
    assert "result: a directory for other results has this name" in result.stderr


@pytest.mark.parametrize(("name", "option"), [(name, option) for name in RUNS for option in outputs(name)])
def test_a_directory_is_no_place_for_a_file(run, place, name, option):
    before = content(place)
    for directory in (".", "galveston", "galveston/.."):
        result = run(*words(name, **{option: directory}))
        assert result.exit_code == 1
        assert f"{directory}: the output must be a file" in result.stderr
    assert content(place) == before


@pytest.mark.parametrize(
    ("name", "option"), [(name, option) for name in RUNS for option in outputs(name, Writes.DIRECTORY)]
)
def test_a_file_is_no_directory_for_results(run, place, name, option):
    (place / "file").write_text("old")
    result = run(*words(name, **{option: "file"}))
    assert result.exit_code == 1
    assert "file: must be a folder, but is a file" in result.stderr
    for other in outputs(name):
        result = run(*words(name, **{option: "results", other: "results"}))
        assert result.exit_code == 1
        assert "a directory for other results has this name" in result.stderr
    assert not (place / "results").exists()


@pytest.mark.parametrize("name", ["giant adjust", "giant check", "plan"])
@pytest.mark.parametrize("target", ["images.json", "Ground", "COMMON.txt"])
def test_no_output_makes_a_project_ambiguous(run, place, name, target):
    for option in outputs(name):
        result = run(*words(name, **{option: f"galveston/{target}"}))
        assert result.exit_code == 1, result.output
        of_project = Path(target).stem.upper()
        assert f"{target}: the file must not have the name of {of_project} of the project" in result.stderr
        assert not (place / "galveston" / target).exists()


@pytest.mark.parametrize("name", ["giant adjust"])
def test_a_project_that_is_overwritten_gets_no_second_files(run, place, name):
    (place / "second" / "GROUND").rename(place / "second" / "ground.txt")
    before = content(place)
    result = run(*words(name, out="second"), "--overwrite")
    assert result.exit_code == 1, result.output
    assert "second/ground.txt: a project must have one file GROUND" in result.stderr
    assert content(place) == before


@pytest.mark.parametrize("name", ["giant adjust"])
def test_the_default_directory_may_be_a_link_to_the_input(run, place, name):
    (place / "galveston-adjusted").symlink_to("galveston")
    before = content(place)
    result = run(*words(name))
    assert result.exit_code == 1, result.output
    assert "must not be written over the input" in result.stderr
    assert content(place) == before


@pytest.mark.parametrize("name", ["comparator calibrate"])
def test_files_of_an_output_directory_spare_the_inputs(run, place, name):
    (place / "comparator-3.txt").rename(place / "listing.txt")
    before = content(place)
    result = run("comparator", "listing.txt", "--no-plots", "--out", place)
    assert result.exit_code == 1, (name, result.output)
    assert "listing.txt: the result must not be written over the input" in result.stderr
    assert content(place) == before


@pytest.mark.parametrize(
    ("name", "taken"),
    [
        ("giant adjust", "report.txt"),
        ("comparator calibrate", "correction.json"),
        ("stellar-camera plate", "camera.json"),
        ("stellar-camera exposures", "report.txt"),
    ],
)
def test_files_of_an_output_directory_spare_the_other_results(run, place, name, taken):
    before = content(place)
    line = [
        word for word in words(name, out="out", json=f"out/{taken}") if word not in ("--grid", "grid.csv")
    ]
    result = run(*line)
    assert result.exit_code == 1, result.output
    assert "another result has this name" in result.stderr
    assert content(place) == before


def test_the_packaged_example_is_an_input(run, tmp_path):
    packaged = EXAMPLES / "collection" / "ring.txt"
    before = packaged.read_bytes()
    result = run("collection", "--example", "--json", packaged)
    assert result.exit_code == 1
    assert "must not be written over the input" in result.stderr
    assert packaged.read_bytes() == before


def outside(folder, name, target, settings="project.toml"):
    """Move a file of a project to another folder."""
    target.parent.mkdir(exist_ok=True)
    shutil.move(folder / name, target)
    path = folder / settings
    moved = os.path.relpath(target, folder)
    text = path.read_text()
    known = text.replace(f'"{name}"', f'"{moved}"')
    path.write_text(known if known != text else text.replace("[tables]", f'[tables]\nimages = "{moved}"'))


@pytest.mark.parametrize("output", [("info", "--json"), ("adjust", "--quiet", "--no-html", "--json")])
@pytest.mark.parametrize("is_file", [False, True])
def test_a_table_outside_the_folder_of_its_project_is_an_input(run, tmp_path, output, is_file):
    project = tmp_path / "project"
    shutil.copytree(EXAMPLES / "project", project)
    outside(project, "images.csv", tmp_path / "other" / "images.csv")
    before = content(tmp_path)
    for path in (tmp_path / "other" / "images.csv", *([project / "photos.csv"] if is_file else [])):
        command, *options = output
        result = run(command, project / "project.toml" if is_file else project, *options, path)
        assert result.exit_code == 1
        assert f"{path.name}: the result must not be written over the input" in result.stderr
        assert content(tmp_path) == before


@pytest.mark.parametrize(
    ("kind", "package", "options"),
    [("parquet", "pyarrow", ["info", "--json"]), ("xlsx", "openpyxl", ["adjust", "--no-html", "--xlsx"])],
)
def test_a_binary_table_outside_the_folder_of_its_project_is_an_input(run, tmp_path, kind, package, options):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip(package)
    project, images = tmp_path / "project", tmp_path / f"other.{kind}"
    shutil.copytree(EXAMPLES / "project", project)
    table = pandas.read_csv(project / "images.csv", comment="#")
    outside(project, "images.csv", images)
    table.to_parquet(images) if kind == "parquet" else table.to_excel(images, index=False)
    before = images.read_bytes()
    command, *words = options
    result = run(command, project, *words, images)
    assert result.exit_code == 1
    assert "must not be written over the input" in result.stderr
    assert images.read_bytes() == before


def test_a_certificate_outside_the_folder_of_its_project_is_an_input(run, tmp_path):
    archive, certificate = tmp_path / "archive", tmp_path / "cameras" / "rc10.toml"
    shutil.copytree(EXAMPLES / "archive", archive)
    outside(archive, "rc10-2345.toml", certificate)
    before = certificate.read_bytes()
    result = run("info", archive, "--json", certificate)
    assert result.exit_code == 1
    assert "must not be written over the input" in result.stderr
    assert certificate.read_bytes() == before


@pytest.mark.parametrize("plan", [(), ("--plan", "4", "--field", "60", "--size", "1600x1200")])
def test_the_board_of_a_calibration_is_an_input(run, tmp_path, plan):
    shutil.copytree(EXAMPLES / "board", tmp_path / "views")
    board = tmp_path / "board.toml"
    shutil.move(tmp_path / "views" / "board.toml", board)
    before = board.read_bytes()
    path = () if plan else (tmp_path / "views",)
    result = run("calibrate", *path, *plan, "--board", board, "--json", board, "--no-html")
    assert result.exit_code == 1
    assert "must not be written over the input" in result.stderr
    assert board.read_bytes() == before


def test_results_may_be_written_again(run, tmp_path):
    shutil.copytree(EXAMPLES / "project", tmp_path / "project")
    line = ("adjust", tmp_path / "project", "--json", tmp_path / "result.json", "--no-html", "--quiet")
    assert [run(*line).exit_code for _ in range(2)] == [0, 0]
