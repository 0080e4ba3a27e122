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
    # The command names its file in the head and among the key figures.
    parts, report = result.report().split("\n\n")[1:], Path("out/report.txt").read_text()
    assert [part for part in parts if part not in report and not part.startswith("Key figures\n")] == []
    assert result.converged


def test_snooping_and_messages_come_along(run):
    assert run("adjust", EXAMPLE, "--out", "out", "--parquet", "data", "--quiet").exit_code == 0
    assert (
        run("adjust", EXAMPLE, "--out", "out", "--parquet", "again", "--loss", "huber", "--quiet").exit_code
        == 0
    )
    one, two = read_result("data"), read_result("again")
    assert two.loss is not None
    assert 0 < differences(one, two).values.size < 5
    assert [str(each) for each in one.messages] == [str(each) for each in read_result("data").messages]


def test_a_folder_that_is_the_input_is_refused(run):
    shutil.copytree(EXAMPLE, "quarry")
    done = run("adjust", "quarry", "--parquet", "quarry/images.csv")
    assert done.exit_code == 1
    assert "must be a folder" in done.output
    for place in ("quarry", "./quarry/"):
        done = run("adjust", "quarry", "--parquet", place)
        assert done.exit_code == 1
        assert "the results must not be written over the input" in " ".join(done.output.split())
    assert not list(Path("quarry").glob("*.parquet"))


def test_a_result_is_a_project_to_go_on_with(run):
    assert (
        run("adjust", EXAMPLE, "--out", "out", "--parquet", "data", "--loss", "huber", "--quiet").exit_code
        == 0
    )
    told = run("info", "data")
    assert told.exit_code == 0, told.output
    assert "result as data (Parquet)" in told.output
    done = run("adjust", "data", "--parquet", "again", "--map", "map.gpkg", "--quiet")
    assert done.exit_code == 0, done.output
    one, two = read_result("data"), read_result("again")
    assert (two.loss, two.unit_variance) == (one.loss, one.unit_variance)
    assert len(two.iterations) < len(one.iterations)
    # A robust loss converges linearly: both ended within a small part of a standard deviation.
    assert differences(one, two).values.size < 1e-3
    assert Path("map.gpkg").exists()
    assert run("convert", "data", "plain", "--to", "plain").exit_code == 0
    assert formats.read(Path("plain")).block.photo_ids == one.block.photo_ids


def test_a_free_result_goes_on_in_its_datum(run):
    project = Path("free")
    shutil.copytree(EXAMPLE, project)
    for name in ("control", "gnss", "distances"):
        (project / f"{name}.csv").unlink()
    assert run("adjust", project, "--datum", "inner", "--parquet", "data", "--quiet").exit_code == 0
    assert run("adjust", "data", "--parquet", "again", "--quiet").exit_code == 0
    one, two = read_result("data"), read_result("again")
    assert two.datum.kind == one.datum.kind == "inner constraints"
    assert differences(one, two).deviations.size < 1e-3


def test_results_of_collections_are_no_projects(run):
    assert run("collection", "--example", "--parquet", "data", "--quiet").exit_code == 0
    done = run("info", "data")
    assert done.exit_code == 1
    assert "got a collection" in " ".join(done.output.split())
