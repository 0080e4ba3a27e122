"""An accuracy statement: a survey adjusted, what a client is told, and the budget of a function of one's own.

python examples/accuracy_statement.py [DIRECTORY]

The survey is that of `photogram new --kind survey`. One sentence is a firm's own. The function is the area
of a lot between four points: its uncertainty is taken apart by its gradient. With a directory the page is
written there, as HTML, PDF and JSON (needs `photogram[report,pdf]`).
"""

from __future__ import annotations

import sys
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from photogram import Result, Statement, adjust, formats, statement

EXAMPLE = Path(str(files("photogram") / "examples" / "survey"))
CORNERS = ("C01", "C26", "C30", "C05")
"""Of the lot, counter-clockwise."""
OWN = {"honest.yes": "We stand by our standard deviations: {n} check points agree (factor {factor})."}
"""Sentences that stand for those of the language; fields in braces are filled in."""


def area(plan: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """Return the area of a polygon of (n, 2) corners, and its (n, 2) gradient."""
    following, before = np.roll(plan, -1, axis=0), np.roll(plan, 1, axis=0)
    across = following - before
    gradient = 0.5 * np.column_stack([across[:, 1], -across[:, 0]])
    return 0.5 * float((plan * gradient).sum()), gradient


def corners(result: Result) -> NDArray[np.float64]:
    """Return the (4, 2) adjusted positions of the corners in plan."""
    rows = [result.block.point_ids.index(name) for name in CORNERS]
    return result.point_positions[rows, :2]


def main(directory: Path | None = None) -> Statement:
    """Adjust, state, and print; write the page where a directory is given."""
    project = formats.read(EXAMPLE)
    result = adjust(project.block, unit_variance="unity")
    found = statement(result, **{**project.statement, "text": OWN, "date": "2026-05-01"})

    print(found.headline)
    for each in found.sentences[:3]:
        print("*", each["text"])
    asprs = found.standards.asprs
    assert asprs is not None
    print("classes:", asprs.verdicts)

    square_metres, gradient = area(corners(result))
    function = {("point", name): [*own, 0.0] for name, own in zip(CORNERS, gradient.tolist(), strict=True)}
    budget = found.budget(function)
    print(f"area of the lot: {square_metres:.1f} m2, U = {budget['expanded']:.1f} m2 (k = {budget['k']:.2f})")
    for kind, own in budget["by_kind"].items():
        print(f"  {kind:12}{own['sd']:6.2f} m2 {100 * own['share']:5.1f} %")
    if directory is not None:
        found.to_html(directory / "statement.html")
        found.to_pdf(directory / "statement.pdf")
        found.to_json(directory / "statement.json")
    return found


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
