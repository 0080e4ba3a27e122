"""Plots of an adjustment: all plots as files, and two plots side by side in one figure.

python examples/pictures.py DIRECTORY

The block is the test field of examples/self_calibration.py.
"""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib.figure import Figure
from self_calibration import measured

from photogram import Result, adjust


def side_by_side(result: Result) -> Figure:
    """Return the network and the correlations of the camera in one figure."""
    figure = Figure(figsize=(14.0, 6.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    result.plot.network().on(left)
    result.plot.correlations().on(right)
    right.set_title("correlations of the lens parameters", loc="left")
    return figure


def main(arguments: list[str]) -> None:
    """Write the plots."""
    folder = Path(arguments[0] if arguments else ".")
    folder.mkdir(parents=True, exist_ok=True)
    result = adjust(measured())
    written = result.plot.save(folder, "svg")
    side_by_side(result).savefig(folder / "side-by-side.png")
    print(", ".join(path.name for path in written))


if __name__ == "__main__":
    main(sys.argv[1:])
