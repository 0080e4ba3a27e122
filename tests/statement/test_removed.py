"""Removed observations: a statement lists all of them, also after the result was saved and read again."""

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from golden_statement import BLOCK

import photogram
from photogram.collection import simulate
from photogram.formats import read
from photogram.results.statement import tables
from photogram.show.forms import written


@pytest.fixture(scope="module")
def snooped():
    """Return the golden block after data snooping, with 1 m added to y of one control point."""
    block = read(BLOCK).block
    positions = block.point_positions.copy()
    positions[block.point_ids.index("G03"), 1] += 1.0
    return photogram.snoop(block.replace(point_positions=positions), unit_variance="unity")


def listed(stated, table="table.removed"):
    """Return the rows of the table of removed observations on the page."""
    (annex,) = [each for each in stated.document().sections if each.key == "annex-e"]
    found = [part for part in annex.parts if getattr(part, "title", "") == stated.texts(table)]
    return [*zip(*(column.cells for column in written(found[0]).columns), strict=True)] if found else []


def keys(stated):
    return {each["key"] for each in stated.assumptions}


def test_a_removed_control_point_is_part_of_all_documents(snooped):
    stated = snooped.result.statement(budgets=())
    assert stated.to_pdf().startswith(b"%PDF")
    assert b"control point G03" in stated.to_html()
    (removed,) = json.loads(stated.to_json())["removed"]
    assert removed == {"name": snooped.removed[0].name, "reason": "snooping"}
    assert "assume.removed" in keys(stated)
    assert len(listed(stated)) == 1


def test_the_removed_observations_survive_parquet(snooped, tmp_path):
    snooped.result.to_parquet(tmp_path / "saved")
    again = photogram.read_result(tmp_path / "saved")
    assert [each["name"] for each in again.snooped.removed] == [each.name for each in snooped.removed]
    assert again.snooped == snooped.result.snooped
    assert again.verdict == snooped.verdict
    assert again.verdict.code == "usable-after-removal"
    one, two = (each.statement(budgets=()) for each in (snooped.result, again))
    assert one.removed == two.removed
    assert one.assumptions == two.assumptions


def test_a_saved_collection_keeps_the_removed_observations(tmp_path):
    collection = simulate(seed=1).collection
    xy = collection.image_xy.copy()
    xy[7] += 40.0
    found = photogram.snoop(collection.replace(image_xy=xy))
    assert found.removed
    found.result.to_parquet(tmp_path / "saved")
    again = photogram.read_result(tmp_path / "saved")
    assert again.snooped == found.result.snooped
    assert again.verdict.code == found.verdict.code


def test_every_removed_observation_has_its_row(snooped, monkeypatch):
    aside = tuple(f"image of point C{k:02} on photo 301" for k in range(1, 17))
    stated = replace(snooped.result, set_aside=aside).statement(budgets=(), removed=["control point G01"])
    assert len(stated.removed) == len(listed(stated)) == 18
    assert [reason for _, reason in stated.removed] == ["snooping", *["first values"] * 16, "earlier"]
    said = next(each["text"] for each in stated.assumptions if each["key"] == "assume.removed")
    assert said.startswith("18 ")
    monkeypatch.setattr(tables, "MAX_REMOVED_OBSERVATIONS", 5)
    assert len(listed(stated)) == 5
    assert stated.texts("table.removed.note", shown=5, all=18) in stated.to_html().decode()


def test_adjust_writes_all_files_and_a_saved_result_is_stated_alike(run, tmp_path):
    shutil.copytree(BLOCK, "site")
    for path in Path("site").iterdir():
        path.chmod(0o644)
    control = Path("site/control.csv")
    text = control.read_text()
    row = next(line for line in text.splitlines() if line.startswith("G03,"))
    cells = row.split(",")
    cells[2] = str(float(cells[2]) + 1.0)
    control.write_text(text.replace(row, ",".join(cells)))
    done = run("adjust", "site", "--snoop", "--statement", "--out", "out", "--parquet", "data", "--no-html")
    assert done.exit_code == 0, done.output
    names = ("report.txt", "removed.csv", "statement/statement.pdf", "statement/statement.html")
    assert all(Path("out", name).is_file() for name in names)
    assert run("statement", "data", "--out", "again").exit_code == 0
    one, two = (
        json.loads(Path(each, "statement.json").read_text())["removed"] for each in ("out/statement", "again")
    )
    assert one == two
    (row,) = csv.DictReader(Path("again/removed.csv").read_text().splitlines())
    assert row == {"observation": one[0]["name"], "reason": "snooping"}
