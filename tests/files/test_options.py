"""Options mean the same for every command; none is hidden; shells complete them."""

import inspect
import os
import shutil
import subprocess
import sys
from dataclasses import fields
from importlib.resources import files
from pathlib import Path
from typing import get_args

import pytest
from typer.models import ArgumentInfo, OptionInfo

from photogram import AdjustOptions, formats
from photogram.cli import app
from photogram.cli.options import Writes
from photogram.formats.plain.settings import KEYS

PROMPT = [
    sys.executable,
    "-c",
    "import sys; sys.argv[0] = 'photogram'; from photogram.cli import main; main()",
]
"""The command under its own name, by which shells know it."""


def registered(typer_app=app, before=""):
    """Return the functions of all commands by their names."""
    found = {before + each.name: each.callback for each in typer_app.registered_commands}
    for group in typer_app.registered_groups:
        found |= registered(group.typer_instance, f"{group.typer_instance.info.name} ")
    return found


COMMANDS = registered()


def options(command):
    """Return the options of a command that are shown: kind and marks by name."""
    found = {}
    for parameter in inspect.signature(command, eval_str=True).parameters.values():
        kind, *marks = get_args(parameter.annotation)
        info = next(mark for mark in marks if isinstance(mark, OptionInfo | ArgumentInfo))
        if isinstance(info, OptionInfo):
            found[parameter.name] = kind, [mark for mark in marks if mark is not info]
    return found


@pytest.mark.parametrize("name", COMMANDS)
def test_an_option_means_the_same_for_every_command(name):
    shown = options(COMMANDS[name])
    same = {"json": [Writes.FILE], "out": [Writes.DIRECTORY], "plots": [], "quiet": [], "threads": []}
    if name == "metadata":
        same["out"] = [Writes.FILE]  # the specification has a table there
    for option, marks in same.items():
        assert shown.get(option, (None, marks))[1] == marks
    assert not {"plot", "pictures", "report"} & set(shown)
    assert "listing" not in shown or name == "giant adjust"
    assert "quiet" in shown or name == "comparator correct"
    assert "out" in shown or "plots" not in shown


def test_an_option_of_adjustments_is_a_key_of_projects_and_an_option_of_the_command(tmp_path):
    declared = {each.name: each.metadata["kind"] for each in fields(AdjustOptions) if each.metadata}
    keys = {each.field.removeprefix("options."): each for each in KEYS if each.section == "adjust"}
    assert set(declared) == set(keys)
    assert set(declared) <= set(options(COMMANDS["adjust"]))
    for name, words in declared.items():
        assert set(get_args(words)) <= set(keys[name].words.split())
    chosen = AdjustOptions(
        datum="inner", unit_variance="unity", loss="huber", max_iterations=7, max_bias_ratio=3.0
    )
    assert all(getattr(chosen, each.name) != each.default for each in fields(chosen) if each.metadata)
    project = formats.read(Path(str(files("photogram") / "examples" / "project"))).replace(options=chosen)
    for name, content in formats.to_files(project, "plain").items():
        (tmp_path / name).write_bytes(content)
    assert formats.read(tmp_path).options == chosen


def test_no_option_is_hidden():
    for command in COMMANDS.values():
        for parameter in inspect.signature(command, eval_str=True).parameters.values():
            marks = get_args(parameter.annotation)[1:]
            assert not any(isinstance(mark, OptionInfo) and mark.hidden for mark in marks)


def test_pictures_without_a_place_are_refused(run, tmp_path):
    examples = Path(str(files("photogram") / "examples"))
    for command in (["plan"], ["collection", str(examples / "collection" / "ring.txt")]):
        refused = run(*command, "--plots")
        assert refused.exit_code == 2
        assert "requires --out DIR" in refused.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("command", "ending", "head"),
    [
        ("plan --strips 1 --photos-per-strip 4", "svg", b"<svg"),
        ("perspective-center --example", "pdf", b"%PDF"),
        ("absolute-orientation --example", "svg", b"<svg"),
        ("stellar-camera --example", "png", b"\x89PNG"),
        ("stellar-camera --example", "pdf", b"%PDF"),
    ],
)
def test_pictures_have_the_format_that_is_asked_for(run, tmp_path, command, ending, head):
    pytest.importorskip("matplotlib")
    done = run(*command.split(), "--out", "o", "--plots", "--plot-format", ending)
    assert done.exit_code == 0, done.output
    pictures = [path for path in (tmp_path / "o").iterdir() if path.suffix in (".png", ".pdf", ".svg")]
    assert pictures
    assert all(path.suffix == f".{ending}" and path.read_bytes().startswith(head) for path in pictures)


def test_a_file_is_no_place_for_an_adjusted_collection(run, tmp_path):
    for name in ("adjusted.txt", "adjusted.txt.bz2"):
        refused = run("collection", "--example", "--out", name)
        assert refused.exit_code == 2
        assert "into which adjusted.txt is written" in refused.stderr
    assert not list(tmp_path.iterdir())


def test_nothing_is_told_of_results_that_could_not_be_written(run, tmp_path, monkeypatch):
    (tmp_path / "locked").mkdir()

    def full(*_):
        raise OSError(28, "No space left on device", str(tmp_path / "locked" / "report.txt"))

    monkeypatch.setattr("photogram.io.writing.OutputSet.write", full)
    for command in (
        ["stellar-camera", "--example", "--out", "locked"],
        ["giant", "--example", "--out", "locked"],
        ["collection", "--example", "--out", "locked"],
        ["perspective-center", "--example", "--out", "locked"],
        ["plan", "--strips", "1", "--photos-per-strip", "4", "--out", "locked"],
    ):
        done = run(*command)
        assert done.exit_code == 1, done.output
        assert done.stdout == ""


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_completion_is_printed(shell):
    environment = {**os.environ, "_PHOTOGRAM_COMPLETE": f"source_{shell}"}
    done = subprocess.run(PROMPT, env=environment, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    assert f"_COMPLETE=complete_{shell}" in done.stdout
    if shutil.which(shell) and shell == "bash":
        subprocess.run(["bash", "-n"], input=done.stdout, text=True, check=True)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("photogram pl", {"plan"}),
        ("photogram giant ", {"adjust", "check"}),
        ("photogram giant ch", {"check"}),
        ("photogram giant --o", {"--out", "--ordering", "--overwrite"}),
        ("photogram giant check --th", {"--threads"}),
        ("photogram giant block --ordering d", {"dissection"}),
        ("photogram perspective-center --p", {"--plots", "--plot-format"}),
    ],
)
def test_words_are_completed(line, expected):
    environment = {
        **os.environ,
        "_PHOTOGRAM_COMPLETE": "complete_bash",
        "COMP_WORDS": line,
        "COMP_CWORD": str(line.count(" ")),
    }
    done = subprocess.run(PROMPT, env=environment, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) == expected
