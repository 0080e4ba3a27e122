"""What help and options of all commands have in common."""

import re

import pytest
from typer.main import get_command

from files.test_guards import COMMANDS
from photogram.cli import app
from photogram.cli.options import declarations


def parameters():
    """Return the options of all commands that are shown, with the names of the commands."""

    def walk(command, name):
        if hasattr(command, "commands"):
            for part, own in command.commands.items():
                yield from walk(own, f"{name} {part}".strip())
        else:
            yield from ((name, each) for each in command.params if each.param_type_name == "option")

    return [(name, each) for name, each in walk(get_command(app), "") if not each.hidden]


def test_every_declaration_is_an_option_with_a_panel_and_a_short_help():
    panels = {panel for panel, _, _ in declarations().values()}
    assert {each.rich_help_panel for _, each in parameters()} <= panels
    names = {name.rpartition(".")[2] for name in declarations()}
    assert {each.name for _, each in parameters()} - {"help"} <= names
    texts = {name: text for name, (panel, _, text) in declarations().items() if panel != "Commands"}
    assert {name: text for name, text in texts.items() if len(text) > 90} == {}


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_no_type_of_a_switch(run, name, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    shown = run(*name.split(), "--help")
    assert shown.exit_code == 0
    assert "<bool>" not in shown.output
    assert "BOOLEAN" not in shown.output


def test_help_of_adjust_has_panels_and_three_examples(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = run("adjust", "--help").output
    for panel in ("Input", "Results", "Adjustment", "Gross errors", "In parts", "Run"):
        assert f"─ {panel} ─" in text
    assert " ".join(text.split("Examples:")[1].split()).count("`photogram adjust ") == 3
    assert len(text.splitlines()) < 195


def test_options_of_one_name_are_written_alike():
    """One metavar and one default each, but where a command has a reason."""
    reasons = {
        "out",
        "control",
        "format",
        "scale",
        "decimals",
        "sd",
        "level",
        "unit_weight",
        "tolerance",
        "without",
        # Of a lens and of its terms, of formats and of lenses, of splines and of trajectories.
        "camera",
        "cameras",
        "model",
        "to",
        "knots",
        # `--iterations` of blocks, `--max-iterations` of collections.
        "max_iterations",
    }
    shown = {}
    for name, each in parameters():
        if each.name not in reasons:
            shown.setdefault(each.name, {}).setdefault((each.metavar, tuple(each.opts)), []).append(name)
    assert {option: ways for option, ways in shown.items() if len(ways) > 1} == {}


@pytest.mark.parametrize("name", ["plan", "collection", "perspective-center", "absolute-orientation"])
def test_pictures_of_an_example_need_no_directory(run, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(name, "--example", "--plots", "--no-html")
    assert result.exit_code == 0, result.output
    (folder,) = (each for each in tmp_path.iterdir() if each.is_dir())
    assert re.fullmatch("example-(planned|adjusted|resected|oriented)", folder.name)
    assert list(folder.glob("*.png"))


def test_plan_takes_an_example_or_projects(run):
    refused = run("plan", "somewhere", "--example")
    assert refused.exit_code == 2
    assert "must not be combined with DIR" in refused.stderr


def test_adjust_snoops_at_a_level(run, tmp_path):
    refused = run("adjust", "--example", "--snoop", "--level", "1.5", "--out", str(tmp_path / "out"))
    assert refused.exit_code == 2
    taken = run(
        *("adjust", "--example", "--snoop", "--level", "0.001", "--unit-weight", "unknown", "--no-html"),
        *("--out", str(tmp_path / "out")),
    )
    assert taken.exit_code == 0, taken.output
    assert "0.001" in (tmp_path / "out" / "report.txt").read_text()
