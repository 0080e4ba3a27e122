"""Times and memory of calibrations with square plates: four cases, three pointings on each point.

python benches/comparator_plates.py 40 200
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time

import numpy as np

from photogram import comparator


def calibration(columns: int) -> None:
    """Simulate and calibrate one plate; print processor time and peak memory after each stage."""
    grid = comparator.Grid.square(columns, spacing_um=200_000.0 / (columns - 1), sigma_um=0.3)
    errors = {"pointing_um": 0.9, "random_um": 0.6, "grid_um": 0.3}
    sequence = np.concatenate([np.repeat(grid.points, 3), np.repeat(grid.points[:1], 3)])
    session = comparator.simulate_calibration(grid, seed=1, sequence=sequence, **errors).session
    print(f"{columns} x {columns} points, {4 * len(sequence)} readings")
    begun = time.process_time()
    made = comparator.calibrate(session)
    report("adjusted", begun)
    print(
        f"  grid {made.sigma_grid_um(1):.4f} um (true 0.3), random {made.joint.random_um:.4f} um (true 0.6)"
    )
    comparator.listing(made)
    report("and listing", begun)
    made.to_json()
    report("and document", begun)


def report(stage: str, begun: float) -> None:
    """Print processor time since the begin, and the most memory so far."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"  {stage:13} {time.process_time() - begun:6.1f} s of processor time, {peak:6.0f} MiB", flush=True)


def main() -> None:
    """Calibrate each plate in a process of its own, so that peaks of memory do not mix."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("columns", type=int, nargs="+", help="points along a side of the plate")
    chosen = parser.parse_args().columns
    if len(chosen) == 1:
        calibration(chosen[0])
        return
    for columns in chosen:
        subprocess.run([sys.executable, __file__, str(columns)], check=True)


if __name__ == "__main__":
    main()
