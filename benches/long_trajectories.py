"""Line scanners on long trajectories, a knot a second or more, all covariances: docs/moving.md.

python benches/long_trajectories.py flights jitter [--part P]      P of the points, 1 by default; Linux

`flights`: an aircraft with three lines, 40 strips in four hours; positions by GNSS, attitudes by an inertial
unit and a knot every second. `jitter`: three lines on one orbit, 20,000 knots of the attitude.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time

import numpy as np

from peak import forget_peak, peak_memory
from photogram import Block, adjust, simulate
from photogram.memory import give_back, resident_memory
from photogram.network.simulation_options import LineScanner
from photogram.network.trajectories import Polynomial, Spline


def flights(part: float) -> Block:
    """Return 40 strips of three lines, with about two million points."""
    second = Spline(every=1.0)
    return simulate(
        strips=40,
        photos_per_strip=27,
        points_per_photo=round(5_300 * part),
        flying_height=1500.0,
        motion=LineScanner(lines=3, position=second, rotation=second),
        position_error=0.5,
        attitude_error=2e-4,
        position_sd=0.05,
        attitude_sd=5e-5,
        seed=1,
    ).block


def jitter(part: float) -> Block:
    """Return a strip of three lines whose attitude jitters, with about a hundred thousand points."""
    scanner = LineScanner(
        lines=3, every=0.5, position=Polynomial(2), rotation=Spline(every=0.02, degree=1), speed=70.0
    )
    return simulate(
        strips=1,
        photos_per_strip=10,
        points_per_photo=round(20_000 * part),
        motion=scanner,
        position_error=0.5,
        attitude_error=2e-5,
        position_sd=0.05,
        attitude_sd=5e-5,
        seed=1,
    ).block


CASES = {"flights": flights, "jitter": jitter}


def row(case: str, part: float) -> str:
    """Adjust a case in this process, and return a row of the table."""
    block = CASES[case](part)
    give_back()
    before = resident_memory() or 0
    forget_peak()
    start, processor = time.perf_counter(), time.process_time()
    result = adjust(block)
    seconds, processor = time.perf_counter() - start, time.process_time() - processor
    peak = (peak_memory() - before) / 2**30
    print(result.seconds, file=sys.stderr)
    bases = [basis for each in block.all_trajectories for basis in (each.position, each.rotation)]
    knots = sum(basis.count for basis in bases if isinstance(basis, Spline)) // (
        2 if case == "flights" else 1
    )
    coefficients = 3 * sum(basis.count for basis in bases if basis is not None)
    sigma0 = np.sqrt(result.variance_of_unit_weight or np.nan)
    return (
        f"| {case} | {len(block.all_trajectories)} | {knots:,} | {len(block.point_ids):,}"
        f" | {len(block.image_xy):,} | {len(block.observations):,}"
        f" | {coefficients + 3 * len(block.point_ids):,} | {len(result.iterations)} | {sigma0:.3f}"
        f" | {seconds:.1f} | {processor:.1f} | {peak:.2f} |"
    )


def main() -> None:
    """Print the table, each row from a process of its own."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="+", choices=CASES)
    parser.add_argument("--part", type=float, default=1.0, help="of the points")
    parser.add_argument("--row", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.row:
        print(row(given.cases[0], given.part), flush=True)
        return
    print("| case | trajectories | knots | points | measures | records | unknowns", end="")
    print(" | steps | sigma0 | s | cpu s | GiB |")
    print("|---|" + "---:|" * 11, flush=True)
    for case in given.cases:
        subprocess.run([sys.executable, __file__, case, "--part", str(given.part), "--row"], check=True)


if __name__ == "__main__":
    main()
