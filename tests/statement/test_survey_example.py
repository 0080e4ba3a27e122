"""The packaged example of the statement: the golden block, with settings and comments of its own."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from golden_statement import BLOCK

from example_scripts import load
from photogram import adjust, formats

EXAMPLE = Path(str(files("photogram") / "examples" / "survey"))


def rows(path):
    return [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]


def test_its_tables_are_those_of_the_golden_block():
    tables = {path.name for path in EXAMPLE.glob("*.csv")}
    assert tables == {path.name for path in BLOCK.glob("*.csv")}
    for name in tables:
        assert rows(EXAMPLE / name) == rows(BLOCK / name), name


def test_its_statement_is_what_its_page_says():
    project = formats.read(EXAMPLE)
    assert project.lacks == ()
    assert project.statement["classes"] == {"h": 0.05, "v": 0.08}
    found = adjust(project.block, unit_variance="unity").statement(**project.statement)
    assert found.exit == 0
    # The combined figures of the golden data.
    assert found.figures["rmse_h"] == pytest.approx(0.0340176341792, rel=1e-6)
    assert found.figures["rmse_v"] == pytest.approx(0.04495903524, rel=1e-6)
    verdicts = found.standards.asprs.verdicts
    assert verdicts == {"h": "met with confidence", "v": "met with confidence"}


def test_the_script_states_in_own_words_and_takes_an_area_apart(tmp_path, capsys):
    script = load("accuracy_statement")
    found = script.main(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {
        "statement.html",
        "statement.pdf",
        "statement.json",
    }
    printed = capsys.readouterr().out
    assert "We stand by our standard deviations: 30 check points agree (factor 1.06)." in printed
    square_metres, gradient = script.area(script.corners(found.result))
    joint = found.result.covariance(("point", list(script.CORNERS)))
    whole = np.column_stack([gradient, np.zeros(4)]).ravel()
    expanded = 1.959964 * np.sqrt(whole @ joint @ whole)
    assert f"area of the lot: {square_metres:.1f} m2, U = {expanded:.1f} m2 (k = 1.96)" in printed
