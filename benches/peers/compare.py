"""One simulated block, adjusted by photogram and solved by gtsam; prints one Markdown table.

python benches/peers/compare.py --strips 20 --photos 50 --seed 1
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import TypeVar

import gtsam_block
from agreement import Agreement
from start import intersections

import photogram

T = TypeVar("T")


@dataclass
class Clock:
    """Wall-clock and processor seconds of some repetitions."""

    wall: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)

    def time(self, work: Callable[[], T]) -> T:
        """Do the work once and note how long it takes."""
        wall, processor = time.perf_counter(), time.process_time()
        done = work()
        self.wall.append(time.perf_counter() - wall)
        self.processor.append(time.process_time() - processor)
        return done


@dataclass
class Ours:
    """photogram's adjustment of a block, on so many threads (None: all processors)."""

    block: photogram.Block
    threads: int | None
    clock: Clock = field(default_factory=Clock)

    def run(self) -> None:
        """Adjust, with every covariance and redundancy number."""
        self.result = self.clock.time(lambda: photogram.adjust(self.block, threads=self.threads))


@dataclass
class Theirs:
    """gtsam's solution of a block from given initial points, with one of its settings."""

    block: photogram.Block
    points: gtsam_block.Floats
    setting: str
    clock: Clock = field(default_factory=Clock)
    building: Clock = field(default_factory=Clock)

    def run(self) -> None:
        """Build the graph and solve it."""
        self.problem = self.building.time(lambda: gtsam_block.factor_graph(self.block, self.points))
        optimizer = gtsam_block.SETTINGS[self.setting]
        run, values = self.clock.time(lambda: gtsam_block.solve(self.problem, optimizer))
        self.solution = gtsam_block.read_out(self.block, run, values)


def main() -> int:
    """Run the comparison; the exit status is 1 when the solutions differ."""
    arguments = _arguments()
    block = photogram.simulate(
        strips=arguments.strips, photos_per_strip=arguments.photos, seed=arguments.seed
    ).block
    points = intersections(block)
    ours = [Ours(block, None), Ours(block, 1)]
    theirs = [Theirs(block, points, setting) for setting in arguments.gtsam]
    sides: list[Ours | Theirs] = [*ours, *theirs]
    for _ in range(arguments.repetitions):
        # In turn, so that all meet the same machine.
        for side in sides:
            side.run()

    best = ours[0].result
    agreements = [Agreement.of(best, side.problem, side.solution) for side in theirs]
    print(_heading(block, best, arguments))
    print(_table(ours, theirs, agreements))
    print(_footnotes(arguments))
    if all(agreements) and all(side.result.converged for side in ours):
        return 0
    print("The solutions do NOT agree: the times above mean nothing.", file=sys.stderr)
    return 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="photogram and gtsam on one simulated block")
    parser.add_argument("--strips", type=int, default=20, help="number of strips (default %(default)s)")
    parser.add_argument("--photos", type=int, default=50, help="photographs in a strip (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the simulated block (default %(default)s)")
    parser.add_argument("--repetitions", type=int, default=5, help="of every side (default %(default)s)")
    parser.add_argument(
        "--gtsam",
        nargs="+",
        choices=list(gtsam_block.SETTINGS),
        default=list(gtsam_block.SETTINGS)[:1],
        help="settings of gtsam, a column each (default: the fastest)",
    )
    arguments = parser.parse_args()
    if min(arguments.strips, arguments.photos, arguments.repetitions) < 1:
        parser.error("numbers of strips, photographs and repetitions must be positive")
    return arguments


def _heading(block: photogram.Block, result: photogram.Result, arguments: argparse.Namespace) -> str:
    unknowns = 6 * len(block.photo_ids) + 3 * int(result.used_points.sum())
    return (
        f"{arguments.strips} strips of {arguments.photos} photographs (seed {arguments.seed}): "
        f"{len(block.photo_ids):,} photographs, {len(block.point_ids):,} points, "
        f"{len(block.image_photos):,} image points, {unknowns:,} unknowns, "
        f"{result.degrees_of_freedom:,} degrees of freedom.\n"
    )


def _table(ours: list[Ours], theirs: list[Theirs], agreements: list[Agreement]) -> str:
    fastest = min(ours[0].clock.wall)
    clocks = [side.clock for side in ours] + [side.clock for side in theirs]
    sums = [side.result.sums_of_squares.total for side in ours]
    sums += [side.solution.weighted_sum_of_squares for side in theirs]
    freedom = ours[0].result.degrees_of_freedom
    none = ["" for _ in ours]
    rows: list[tuple[str, Iterable[str]]] = [
        ("", [_name(side) for side in ours] + [f"gtsam, {side.setting}" for side in theirs]),
        ("---", ["---:" for _ in clocks]),
        (
            "computed",
            ["solution, all covariances, all redundancy numbers" for _ in ours]
            + ["solution only" for _ in theirs],
        ),
        ("seconds, best", [f"**{min(clock.wall):.3f}**" for clock in clocks]),
        ("seconds, median", [f"{statistics.median(clock.wall):.3f}" for clock in clocks]),
        ("processor seconds, best", [f"{min(clock.processor):.3f}" for clock in clocks]),
        ("ratio of the best to photogram", [f"{min(clock.wall) / fastest:.2f}" for clock in clocks]),
        (
            "building the graph, not counted",
            none + [f"{min(side.building.wall):.3f}" for side in theirs],
        ),
        (
            "iterations",
            [str(len(side.result.iterations)) for side in ours]
            + [str(side.solution.iterations) for side in theirs],
        ),
        ("weighted sum of squares", [f"{total:.6f}" for total in sums]),
        ("sigma0", [f"{(total / freedom) ** 0.5:.9f}" for total in sums]),
        ("start: sum of squares differs by", none + [f"{a.start:.0e}" for a in agreements]),
        ("end: sum of squares differs by", none + [f"{a.end:.0e}" for a in agreements]),
        ("photos differ by at most (sd)", none + [f"{a.photos:.0e}" for a in agreements]),
        ("points differ by at most (sd)", none + [f"{a.points:.0e}" for a in agreements]),
    ]
    return "\n".join(f"| {label} | {' | '.join(cells)} |" for label, cells in rows) + "\n"


def _name(side: Ours) -> str:
    return "photogram" if side.threads is None else f"photogram, {side.threads} thread"


def _footnotes(arguments: argparse.Namespace) -> str:
    return (
        f"{arguments.repetitions} repetitions in turn, from equal initial photographs and points. Seconds of "
        "photogram are `adjust()` as a whole, with the intersection of the initial points; those of gtsam "
        "are ordering and `optimize()`. gn is Gauss-Newton, lm Levenberg-Marquardt, each by multifrontal "
        "Cholesky in the ordering named (schur: points first); gtsam's wheels run on one thread.\n\n"
        f"{_processor()}, {os.cpu_count()} processors; Python {platform.python_version()}, "
        f"photogram {version('photogram')}, gtsam {version('gtsam')}."
    )


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


if __name__ == "__main__":
    sys.exit(main())
