"""The command line: exit codes, what is written and what is not."""

import inspect
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import typer
from rich.markup import render

import photogram
from photogram.cli import app
from photogram.cli.commands import application
from photogram.cli.plan import OfPython
from photogram.cli.plan import simulate as simulate_command
from photogram.giant import read_project
from photogram.network import SimulationOptions
from photogram.words import Phrase

SMALL = ["--strips", "2", "--photos-per-strip", "4", "--points-per-photo", "30"]
OUTPUTS = {"FRAMES", "GROUND", "RESTART", "report.html", "report.txt"}


@pytest.fixture
def project(run, tmp_path):
    """Simulate a small project."""
    result = run("simulate", tmp_path / "block", *SMALL)
    assert result.exit_code == 0, result.output
    return tmp_path / "block"


def names(directory):
    return {path.name for path in directory.iterdir()}


def damage(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


# Help


def test_help_names_the_commands(run):
    result = run("--help")
    assert result.exit_code == 0
    for word in ("giant", "simulate", "--version", "Exit codes"):
        assert word in result.output


def helps(command, name="photogram"):
    """Yield every text of help of a command and of what is below it."""
    yield name, command.help or ""
    for parameter in command.params:
        yield f"{name} {parameter.name}", getattr(parameter, "help", None) or ""
    for below, inner in getattr(command, "commands", {}).items():
        yield from helps(inner, f"{name} {below}")


def test_the_list_of_commands_says_what_their_own_helps_begin_with():
    whole, listed = typer.main.get_command(app), typer.main.get_command(application(""))
    assert list(whole.commands) == list(listed.commands)
    for name, command in listed.commands.items():
        assert whole.commands[name].help.split("\n\n")[0] == command.help


def test_no_help_loses_words_in_brackets_which_are_taken_for_a_style():
    texts = list(helps(typer.main.get_command(app)))
    assert len(texts) > 100
    for name, text in texts:
        assert render(text).plain == text, name


def test_version_and_usage(run):
    assert run("--version").output.split()[0] == "photogram"
    for arguments in (
        ["giant"],
        ["giant", "x", "--example"],
        ["giant", "x", "--ordering", "best"],
        ["nothing"],
    ):
        assert run(*arguments).exit_code == 2


def test_the_package_is_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "photogram", "adjust", "nowhere"], capture_output=True, check=False
    )
    assert (done.returncode, b"nowhere" in done.stderr) == (1, True)


# giant


@pytest.mark.giant("2", "unit 6: printout")
@pytest.mark.giant("2", "unit 8: updated FRAMES, only when the solution converges")
@pytest.mark.giant("2", "units 11-19: no scratch files are left")
@pytest.mark.giant("2", "units 8 and 20 are readable as unit 3")
def test_section_2_a_project_is_adjusted(run, project, tmp_path):
    before = {path.name: path.read_bytes() for path in project.iterdir()}
    result = run("giant", project, "--json", tmp_path / "result.json")
    assert result.exit_code == 0, result.output
    assert "converged" in result.output
    assert "standard deviation of unit weight" in result.output
    assert names(tmp_path / "block-adjusted") == OUTPUTS
    assert {path.name: path.read_bytes() for path in project.iterdir()} == before
    document = json.loads((tmp_path / "result.json").read_bytes())
    assert document["status"] == "converged"

    adjusted = read_project_with(project, tmp_path / "block-adjusted", tmp_path / "again")
    positions = np.array([photo["position"] for photo in document["photos"]])
    assert np.abs(np.array([frame.position for frame in adjusted.frames]) - positions).max() < 1e-4
    assert all(frame.position_sd == (0, 0, 0) for frame in adjusted.frames)


def read_project_with(project, adjusted, directory):
    """Read the project again, with the adjusted stations in place of its own."""
    directory.mkdir()
    for path in project.iterdir():
        (directory / path.name).write_bytes(path.read_bytes())
    (directory / "FRAMES").write_bytes((adjusted / "FRAMES").read_bytes())
    return read_project(directory)


def test_a_restart_needs_fewer_iterations(run, project, tmp_path):
    assert run("giant", project, "--json", "first.json").exit_code == 0
    read_project_with(project, tmp_path / "block-adjusted", tmp_path / "again")
    assert run("giant", "again", "--json", "second.json").exit_code == 0
    first, second = (json.loads((tmp_path / name).read_bytes()) for name in ("first.json", "second.json"))
    assert len(second["iterations"]) < len(first["iterations"])
    assert second["weighted_sum_of_squares"]["plates"] == pytest.approx(
        first["weighted_sum_of_squares"]["plates"]
    )


@pytest.mark.giant("2", "units 8 and 9: save flags, COMMON columns 9 and 7")
@pytest.mark.giant("14", "2 column 9: 1 does not save")
def test_section_2_save_flags_of_common(run, project, tmp_path):
    damage(project / "COMMON", "0100000000100", "0100001010100")
    assert run("giant", project, "--quiet").exit_code == 0
    assert names(tmp_path / "block-adjusted") == {"RESTART", "report.html", "report.txt"}


def test_quiet_prints_nothing(run, project):
    result = run("giant", project, "--quiet", "--threads", "1", "--ordering", "rcm")
    assert (result.exit_code, result.output) == (0, "")


@pytest.mark.giant("2", "unit 20: updated FRAMES, always written")
@pytest.mark.giant("6", "iteration limit: column 14, default 4")
@pytest.mark.giant("14", "5 not converged at the limit: unit 20 only")
def test_section_2_as_published_stops_at_the_limit_of_common(run, project, tmp_path):
    common = project / "COMMON"
    title, job = common.read_text().splitlines()
    common.write_text(f"{title}\n{job[:13]}1{job[14:]}\n")
    result = run("giant", project, "--as-published", "--json", "result.json")
    assert result.exit_code == 3
    assert "not converged" in result.output
    assert names(tmp_path / "block-adjusted") == {"RESTART", "report.html", "report.txt"}
    assert json.loads(Path("result.json").read_bytes())["status"] == "not converged"
    assert run("giant", project).exit_code == 0


@pytest.mark.giant("6", "stations are never held exactly; fixed only in intersection mode")
def test_section_6_intersection_only_leaves_the_stations(run, project, tmp_path):
    title, job = (project / "COMMON").read_text().splitlines()
    (project / "COMMON").write_text(f"{title}\n{job[:9]}1{job[10:]}\n")
    # Photos that are held where they were guessed leave residuals that nobody can use.
    assert run("giant", project, "--quiet").exit_code == 4
    before, after = (
        read_project(project),
        read_project_with(project, tmp_path / "block-adjusted", tmp_path / "again"),
    )
    assert [frame.position for frame in after.frames] == [frame.position for frame in before.frames]


def test_remarks_are_in_the_summary_the_report_and_the_document(run, tmp_path):
    assert run("simulate", "block", *SMALL, "--control", "none").exit_code == 0
    result = run("giant", "block", "--json", "result.json")
    assert result.exit_code == 0
    remark = str(Phrase("giant.no-control"))
    assert "\nVerdict\n  Accepted" in result.output
    assert remark in " ".join(result.output.split())
    assert remark in " ".join(Path("block-adjusted", "report.txt").read_text().split())
    assert any(remark in message for message in json.loads(Path("result.json").read_bytes())["messages"])


def test_an_adjustment_that_fails_writes_nothing(run, project, tmp_path, monkeypatch):
    def fail(*_arguments, **_options):
        raise photogram.RankError("the observations do not determine photo [1]", ["1"], [])

    monkeypatch.setattr(photogram, "adjust", fail)
    result = run("giant", project)
    assert (result.exit_code, result.stdout) == (3, "")
    assert result.stderr == "error: the observations do not determine photo [1]\n"
    assert names(tmp_path) == {"block"}


def test_bad_input_writes_nothing(run, project, tmp_path):
    record = (project / "IMAGES").read_text().splitlines()[3]
    damage(project / "IMAGES", record, record[:10] + "       NaN" + record[20:])
    result = run("giant", project, "--json", tmp_path / "result.json")
    assert result.exit_code == 1
    assert result.stdout == ""
    assert (
        f"{project / 'IMAGES'}, record 4: columns 11-20 (F10.3): must be a number, got '       NaN'"
        in result.stderr
    )
    assert f"|{record[:10]}       NaN{record[20:]}|" in result.stderr
    assert "Traceback" not in result.output
    assert names(tmp_path) == {"block"}


@pytest.mark.parametrize("missing", ["COMMON", "GROUND"])
def test_a_missing_file(run, project, tmp_path, missing):
    (project / missing).unlink()
    result = run("giant", project)
    assert (result.exit_code, result.stdout) == (1, "")
    assert f"{missing} is missing" in result.stderr
    assert names(tmp_path) == {"block"}


def test_results_never_go_over_a_project(run, project, tmp_path):
    result = run("giant", project, "--out", project)
    assert result.exit_code == 1
    assert "over the input" in result.stderr
    assert run("giant", project, "--out", project, "--overwrite").exit_code == 1

    assert run("simulate", "other", *SMALL).exit_code == 0
    before = {path.name: path.read_bytes() for path in Path("other").iterdir()}
    result = run("giant", project, "--out", "other")
    assert result.exit_code == 1
    assert "must not contain another project, got COMMON, CAMERAS, IMAGES; add --overwrite" in result.stderr
    assert {path.name: path.read_bytes() for path in Path("other").iterdir()} == before
    assert run("giant", project, "--out", "other", "--overwrite").exit_code == 0
    assert Path("other", "FRAMES").read_bytes() != before["FRAMES"]


def test_an_output_that_cannot_be_written_leaves_nothing_half_done(run, project, tmp_path):
    (tmp_path / "taken").touch()
    result = run("giant", project, "--json", tmp_path / "taken" / "result.json")
    assert result.exit_code == 1
    assert "taken" in result.stderr
    assert "Traceback" not in result.output
    assert not any(path.is_file() for path in (tmp_path / "block-adjusted").glob("*"))


def test_read_only_data_are_adjusted_into_the_current_directory(run, project, tmp_path, monkeypatch):
    inside = tmp_path / "here"
    inside.mkdir()
    monkeypatch.chdir(inside)
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != tmp_path)
    assert run("giant", project).exit_code == 0
    assert names(inside) == {"block-adjusted"}
    assert names(inside / "block-adjusted") == OUTPUTS


def test_the_packaged_example(run, tmp_path):
    result = run("giant", "--example")
    assert result.exit_code == 0, result.output
    assert names(tmp_path) == {"galveston-adjusted"}
    assert names(tmp_path / "galveston-adjusted") == OUTPUTS


def test_components_and_the_unit_variance_of_redundancy_numbers(run, tmp_path):
    options = ("--components", "kind", "--unit-variance", "redundancy")
    result = run("giant", "--example", *options, "--json", "result.json")
    assert result.exit_code in (0, 4), result.output
    assert names(tmp_path / "galveston-adjusted") == OUTPUTS | {"components.txt"}
    assert "Variance components" in result.output
    text = (tmp_path / "galveston-adjusted" / "components.txt").read_text()
    assert "images" in text
    assert "Factor of sd" in text
    report = (tmp_path / "galveston-adjusted" / "report.txt").read_text()
    assert "based on redundancy numbers" in report
    assert "Redundancy by kind of observation" in report
    document = json.loads(Path("result.json").read_bytes())
    assert document["unit_variance"] == "redundancy"
    assert document["redundancy"]["total"] == pytest.approx(round(document["redundancy"]["total"]), abs=1e-5)


def test_components_of_a_collection(run):
    result = run("collection", "--example", "--components", "component", "--out", "out")
    assert result.exit_code in (0, 4), result.output
    assert "images, x" in Path("out/components.txt").read_text()


def test_strasbourg(run, strasbourg):
    result = run("giant", strasbourg / "giant", "--out", "out", "--json", "result.json")
    # One of the two published check points is 0.3 m off, four standard deviations of the difference.
    assert result.exit_code == 4, result.output
    assert "Check points disagree with the adjustment: 1) 410, -0.294 m in Y" in result.output
    document = json.loads(Path("result.json").read_bytes())
    expected = json.loads((strasbourg / "giant" / "expected.json").read_bytes())
    for group in ("plates", "ground"):
        assert document["weighted_sum_of_squares"][group] == pytest.approx(
            expected["weighted_sum_of_squares"][group], rel=1e-6
        )
    report = " ".join(Path("out/report.txt").read_text().split())
    assert "check points 0.13218 0.20781 0.38845" in report


def test_as_a_process(project):
    command = [sys.executable, "-m", "photogram.cli", "giant", str(project), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    (project / "FRAMES").unlink()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert "FRAMES is missing" in done.stderr
    assert "Traceback" not in done.stderr


# simulate


def test_the_options_of_simulate_are_the_options_of_the_function():
    options = inspect.signature(simulate_command).parameters
    for name, field in SimulationOptions.__dataclass_fields__.items():
        if name not in OfPython.names:
            assert options[name].default == field.default
    assert "motion" not in options


@pytest.mark.giant("1", "fictitious data generator: simulated projects")
def test_section_1_simulate_writes_a_project_and_its_truth(run, tmp_path):
    result = run("simulate", "block", *SMALL, "--blunders", "3", "--seed", "7")
    assert result.exit_code == 0
    assert "8 photographs" in result.output
    assert names(tmp_path / "block") == {"COMMON", "CAMERAS", "IMAGES", "FRAMES", "GROUND", "truth.json"}
    project = read_project("block")
    truth = json.loads(Path("block", "truth.json").read_bytes())
    assert [photo["id"] for photo in truth["photos"]] == [frame.name for frame in project.frames]
    errors = np.array([photo["position"] for photo in truth["photos"]]) - [
        frame.position for frame in project.frames
    ]
    assert 5 < errors.std() < 60
    assert len(truth["blunders"]) == 3
    assert truth["units"]["position"] == "X, Y, Z in m"
    again = run("simulate", "block", *SMALL)
    assert again.exit_code == 1
    assert all(
        name in again.stderr for name in ("CAMERAS", "COMMON", "FRAMES", "GROUND", "IMAGES", "--overwrite")
    )
    assert run("simulate", "block", *SMALL, "--overwrite").exit_code == 0


def test_simulate_in_geographic_space(run):
    options = ["--spheroid", "clarke1866", "--origin", "-95", "29.5", "10", "--photo-to-ground"]
    assert run("simulate", "block", *SMALL, *options).exit_code == 0
    project = read_project("block")
    assert project.common.geographic
    assert project.common.photo_to_ground
    positions = project.to_block().photo_positions
    assert np.degrees(positions[:, :2]).mean(axis=0) == pytest.approx([-95, 29.5], abs=0.01)
    truth = json.loads(Path("block", "truth.json").read_bytes())
    assert truth["photos"][0]["position"][:2] == pytest.approx(
        np.degrees(positions[0, :2]).tolist(), abs=0.002
    )
    assert run("giant", "block", "--quiet").exit_code == 0


def test_simulate_refuses_impossible_blocks(run, tmp_path):
    for option, value in (("--strips", "0"), ("--image-sd", "0"), ("--forward-overlap", "0.5")):
        result = run("simulate", "block", option, value)
        assert result.exit_code == 2
        assert option in result.stderr
    result = run("simulate", "block", *SMALL, "--control-sd", "0")
    assert result.exit_code == 1
    assert "must not be fixed" in result.stderr
    assert names(tmp_path) == set()


def test_weights_too_weak_for_a_datum_are_an_error_with_the_remark_that_explains_it(run, tmp_path):
    low = ["--flying-height", "300", "--relief", "10", "--points-per-photo", "200", "--position-error", "3"]
    assert (
        run(
            "simulate", "block", "--strips", "1", "--photos-per-strip", "3", *low, "--control", "none"
        ).exit_code
        == 0
    )
    result = run("giant", "block")
    assert result.exit_code == 3
    assert str(Phrase("giant.no-control")) in " ".join(result.stderr.split())
    assert str(Phrase("adjust.no-datum.large-sd")) in " ".join(result.stderr.split())
    assert names(tmp_path) == {"block"}


@pytest.mark.parametrize(
    ("command", "package", "extra"),
    [
        (["perspective-center", "--example", "--out", "o", "--plots"], "matplotlib", "plots"),
        (["absolute-orientation", "--example", "--out", "o", "--plots"], "matplotlib", "plots"),
        (["stellar-camera", "--example", "--plots"], "matplotlib", "plots"),
        (["plan", "--strips", "1", "--out", "o", "--plots"], "matplotlib", "plots"),
    ],
)
def test_a_package_of_an_extra_that_is_not_there_is_named(
    run, tmp_path, monkeypatch, command, package, extra
):
    loaded = [name for name in sys.modules if name.partition(".")[0] == package]
    for name in loaded:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, package, None)
    for module in ("photogram.perspective_center.document", "photogram.planning.networks"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    result = run(*command)
    assert result.exit_code == 1
    assert f"{package} is required; run pip install 'photogram[{extra}]'" in result.stderr
    assert not list(tmp_path.iterdir())
