"""An accuracy statement beside the adjustment that it states: check points together, three budgets.

python benches/statement.py 20x50 200x250 [--check-points 1000]
"""

from __future__ import annotations

import argparse
import os
import platform
import time

from photogram import adjust, simulate

BUDGETS = 3
"""Coordinates of check points and a distance between two of them."""


def main() -> None:
    """Print a line for each block: seconds of the adjustment and of the statement, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("shapes", nargs="*", default=["20x50"], help="strips x photos in a strip")
    parser.add_argument("--check-points", type=int, default=1000)
    parser.add_argument("--control-spacing", type=int, default=12, help="bases between control")
    given = parser.parse_args()
    machine = f"{platform.machine()}, {os.cpu_count()} processors"
    print(f"{machine}, {given.check_points} check points, {BUDGETS} budgets")
    print(f"{'photos':>8}{'points':>10}{'adjustment s':>14}{'statement s':>14}{'ratio':>8}")
    for shape in given.shapes:
        print(line(shape, given.check_points, given.control_spacing), flush=True)


def line(shape: str, check_points: int, spacing: int) -> str:
    """Return the figures of one block."""
    strips, photos = (int(each) for each in shape.split("x"))
    block = simulate(
        strips=strips, photos_per_strip=photos, check_points=check_points, control_spacing=spacing, seed=1
    ).block
    start = time.perf_counter()
    result = adjust(block)
    adjusted = time.perf_counter() - start
    first, *_, last = result.check_points.names
    quantities = (f"point {first} z", f"point {last} z", f"distance {first} {last}")
    result.verdict  # noqa: B018  # a command has it before it states anything
    start = time.perf_counter()
    result.statement(sd=0.02, budgets=quantities)
    stated = time.perf_counter() - start
    count, points = len(block.photo_ids), len(block.point_ids)
    return f"{count:>8}{points:>10}{adjusted:>14.2f}{stated:>14.2f}{stated / adjusted:>8.2f}"


if __name__ == "__main__":
    main()
