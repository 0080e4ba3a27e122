"""The packaged example of the statement: the golden block, with settings and comments of its own."""

from importlib.resources import files
from pathlib import Path

import pytest
from golden_statement import block_path

from photogram import adjust, formats

EXAMPLE = Path(str(files("photogram") / "examples" / "survey"))


def rows(path):
    return [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]


def test_its_tables_are_those_of_the_golden_block():
    tables = {path.name for path in EXAMPLE.glob("*.csv")}
    assert tables == {path.name for path in block_path().glob("*.csv")}
    for name in tables:
        assert rows(EXAMPLE / name) == rows(block_path() / name), name


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
