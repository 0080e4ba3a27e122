"""No command writes its results over what it has read."""

from importlib.resources import files
from pathlib import Path

import pytest
from typer.testing import CliRunner

from photogram import InputError
from photogram.cli import app
from photogram.cli.console import print_remark
from photogram.cli.job import Job
from photogram.io.writing import check_outputs

EXAMPLES = Path(str(files("photogram") / "examples"))


@pytest.mark.parametrize(
    "command",
    [
        ("perspective-center", "perspective_center/grid.deck", "--json"),
        ("absolute-orientation", "absolute_orientation/stations.csv", "--json"),
        ("absolute-orientation", "absolute_orientation/stations.csv", "--method", "report", "--trace"),
        ("comparator", "comparator/comparator-3.txt", "--no-plots", "--json"),
        ("stellar-camera", "stellar/plate.toml", "--json"),
        ("stellar-camera", "exposures", "exposures/night.toml", "--json"),
    ],
)
def test_inputs_are_spared(tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    name = next(word for word in command if "/" in word)
    for file in (EXAMPLES / name).parent.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    words = [Path(word).name if "/" in word else word for word in command]
    given = {path: path.read_bytes() for path in tmp_path.iterdir()}
    run = CliRunner().invoke(app, [*words, Path(name).name])
    assert run.exit_code == 1, run.output
    assert "must not be written over the input" in run.output
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == given


def test_another_name_of_an_input_is_known(tmp_path):
    (tmp_path / "a").write_text("a")
    (tmp_path / "link").symlink_to("a")
    check_outputs([tmp_path / "new"], [tmp_path / "a", tmp_path / "missing"])
    with pytest.raises(InputError, match="must not be written over the input"):
        check_outputs([tmp_path / "link"], [tmp_path / "a"])


def test_results_are_computed_in_turn_and_written_together(tmp_path):
    first, second = tmp_path / "first", tmp_path / "second"

    def later():
        assert not first.exists()
        return {second: b"2"}

    with Job() as job:
        assert job.write({first: b"1"}, later) == [first, second]
    assert (first.read_bytes(), second.read_bytes()) == (b"1", b"2")


def test_names_between_colons_are_no_emoji(capsys):
    print_remark("a:smile:b")
    assert "a:smile:b" in capsys.readouterr().err
