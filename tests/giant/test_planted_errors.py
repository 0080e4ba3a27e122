"""Errors planted in simulated projects by `benches/giant_check.py`, as docs/giant-check.md shows them."""

import runpy
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benches" / "giant_check.py"
KINDS = [
    "nothing",
    "exchanged names",
    "mirrored photo, x",
    "mirrored photo, y",
    "mirrored block, x",
    "mirrored block, y",
    "names of a photo scrambled",
    "control 500 m",
    "exchanged control",
    "exchanged control, image 1 mm",
]


@pytest.mark.parametrize("kind", KINDS)
def test_planted_errors_are_named_and_nothing_else(kind, monkeypatch, capsys):
    # Projects on which no limit was chosen.
    monkeypatch.setattr(sys, "argv", [str(SCRIPT), "--first", "3000", "--projects", "5", kind])
    runpy.run_path(str(SCRIPT), run_name="__main__")
    (row,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith(f"| {kind} ")]
    projects, errors, named, spoilt, false = (int(cell) for cell in row.split("|")[2:-1])
    assert (projects, named, spoilt, false) == (5, errors, 0, 0)
    assert (errors > 0) == (kind != "nothing")
