"""Calibrations with targets, all covariances and maps of 60 x 40 pixels included: docs/targets.md.

python benches/targets.py FOLDER     of opencv8-0.cameramodel and splined-0.cameramodel of mrcal

Where mrcal can be imported, its own optimization from the same start stands beside it.
"""

from __future__ import annotations

import argparse
import importlib
import math
import time
from pathlib import Path

from photogram.targets import read
from photogram.targets.uncertainty import uncertainty_map

MODELS = ("opencv8-0", "splined-0")


def row(path: Path) -> str:
    """Return a row of the table."""
    calibration = read(path)
    start = time.perf_counter()
    found = calibration.adjust()
    adjusted = time.perf_counter()
    for distance in (math.inf, 1.0):
        uncertainty_map(found, 0, distance)
    mapped = time.perf_counter()
    result = found.result
    cost = result.sums_of_squares.total
    return (
        f"{path.stem:12} {adjusted - start:8.2f} s {mapped - adjusted:8.2f} s {_of_mrcal(path)}"
        f"   {result.status}, {len(result.iterations)} iterations, {cost:.6f}"
    )


def _of_mrcal(path: Path) -> str:
    """Return what mrcal's optimization takes."""
    try:
        mrcal = importlib.import_module("mrcal")
    except ImportError:
        return "      no mrcal"
    inputs = mrcal.cameramodel(str(path)).optimization_inputs()
    start = time.perf_counter()
    mrcal.optimize(**inputs)
    return f"{time.perf_counter() - start:12.2f} s"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    print(f"{'':12} {'adjusted':>10} {'two maps':>10} {'mrcal':>14}")
    for name in MODELS:
        print(row(folder / f"{name}.cameramodel"), flush=True)


if __name__ == "__main__":
    main()
