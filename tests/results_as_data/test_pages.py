"""What docs/results.md and the command line promise of results as data."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from photogram import differences, formats, read_result

pytest.importorskip("pyarrow", reason="pyarrow is not installed")

DOCS = Path(__file__).parents[2] / "docs"
EXAMPLE = Path(formats.__path__[0]).parent / "examples" / "project"


def blocks(page):
    """Return the Python of a page."""
    return re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)


def test_the_page_of_results_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(EXAMPLE, "quarry")
    names = {}
    for each in blocks("results.md"):
        exec(each, names)
    assert "values differ by at most 0 standard" in capsys.readouterr().out
    np.testing.assert_allclose(names["matrices"], names["result"].photo_covariances, rtol=1e-12)
    assert names["order"] == ["x", "y", "z", "omega", "phi", "kappa"]


@pytest.mark.parametrize("command", ["adjust", "giant", "collection"])
def test_commands_write_results_as_data(run, command):
    done = run(command, "--example", "--parquet", "data", "--json", "result.json", "--out", "out")
    assert done.exit_code == 0, done.output
    result = read_result("data")
    assert result.report() in Path("out/report.txt").read_text()
    assert result.converged


def test_snooping_and_messages_come_along(run):
    assert run("adjust", EXAMPLE, "--parquet", "data", "--quiet").exit_code == 0
    assert run("adjust", EXAMPLE, "--parquet", "again", "--loss", "huber", "--quiet").exit_code == 0
    one, two = read_result("data"), read_result("again")
    assert two.loss is not None
    assert 0 < differences(one, two).values.size < 5
    assert [str(each) for each in one.messages] == [str(each) for each in read_result("data").messages]


def test_a_folder_that_is_the_input_is_refused(run):
    shutil.copytree(EXAMPLE, "quarry")
    done = run("adjust", "quarry", "--parquet", "quarry/images.csv")
    assert done.exit_code == 1
    assert "is not a directory" in done.output
