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


def counts(kind, first, projects, monkeypatch, capsys):
    """Run the script; return projects, errors, named errors, projects with false findings, false findings."""
    options = ["--first", str(first), "--projects", str(projects), kind]
    monkeypatch.setattr(sys, "argv", [str(SCRIPT), *options])
    runpy.run_path(str(SCRIPT), run_name="__main__")
    (row,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith(f"| {kind} ")]
    return tuple(int(cell) for cell in row.split("|")[2:-1])


@pytest.mark.parametrize("kind", KINDS)
def test_planted_errors_are_named_and_nothing_else(kind, monkeypatch, capsys):
    # Projects on which no limit was chosen.
    projects, errors, named, spoilt, false = counts(kind, 3000, 5, monkeypatch, capsys)
    assert (projects, named, spoilt, false) == (5, errors, 0, 0)
    assert (errors > 0) == (kind != "nothing")


def test_a_wrong_initial_station_spoils_no_neighbour(monkeypatch, capsys):
    """Good images of the neighbours were called gross errors: 5 in the first project, 6 in the other."""
    assert counts("initial station 2 km off", 2027, 2, monkeypatch, capsys) == (2, 2, 2, 0, 0)
