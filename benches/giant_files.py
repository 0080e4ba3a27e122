"""Time the GIANT files of a large project: reading, making a block, writing. Prints one Markdown table."""

from __future__ import annotations

import argparse
import os
import platform
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from photogram import simulate
from photogram.giant import Project, read_project, write_project
from photogram.giant.files import NAMES
from photogram.network.geometry import Spheroid

T = TypeVar("T")


def main() -> None:
    """Time projects of one size in rectangular and geographic space."""
    arguments = parser().parse_args()
    print(f"{machine()}; seconds of processor time\n")
    print("| object space | " + " | ".join(NAMES) + " | read | to_block | write | together |")
    print("|---|" + "---:|" * (len(NAMES) + 4))
    for space, spheroid, everywhere in (
        ("rectangular", None, False),
        ("geographic", Spheroid.clarke_1866(), False),
        ("geographic, every point in GROUND", Spheroid.clarke_1866(), True),
    ):
        simulation = simulate(
            strips=arguments.strips,
            photos_per_strip=arguments.photos,
            points_per_photo=arguments.points,
            spheroid=spheroid,
        )
        block = simulation.block
        if everywhere:  # as in the adjusted file of a block, unit 9
            block = block.replace(point_positions=simulation.truth.point_positions)
        print(row(space, Project.from_block(block)))


def parser() -> argparse.ArgumentParser:
    """Describe the options."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--strips", type=int, default=100)
    options.add_argument("--photos", type=int, default=100, help="photographs of a strip")
    options.add_argument("--points", type=int, default=100, help="points of a photograph")
    return options


def machine() -> str:
    """Return processor, cores and Python."""
    model = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.exists():
        names = [line for line in information.read_text().splitlines() if line.startswith("model name")]
        model = names[0].partition(":")[2].strip() if names else model
    return f"{model}, {os.cpu_count()} processors, Python {platform.python_version()}"


def row(space: str, project: Project) -> str:
    """Write, read and assemble one project; return the row of the table."""
    with tempfile.TemporaryDirectory() as place:
        directory = Path(place) / "project"
        writing, _ = timed(lambda: write_project(project, directory))
        counts = [(directory / name).read_bytes().count(b"\n") for name in NAMES]
        reading, again = timed(lambda: read_project(directory))
    assembling, _ = timed(again.to_block)
    seconds = (reading, assembling, writing, reading + assembling + writing)
    cells = [space, *(f"{count:,}" for count in counts), *(f"{second:.2f}" for second in seconds)]
    return f"| {' | '.join(cells)} |"


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """Return the processor time that something takes, and its result."""
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


if __name__ == "__main__":
    main()
