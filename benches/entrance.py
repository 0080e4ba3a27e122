"""What a first impression waits for, beside its limits: python benches/entrance.py.

Processor time of whole processes, median of several; modules are compiled before, as they are after an
installation by pip.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from photogram import adjust, simulate

PHOTOGRAM = [sys.executable, "-m", "photogram.cli"]
PROCESSES: tuple[tuple[str, float | None, list[str]], ...] = (
    ("`photogram --help`", 0.25, [*PHOTOGRAM, "--help"]),
    ("`import photogram`", 0.15, [sys.executable, "-c", "import photogram"]),
    ("`from photogram import adjust`", None, [sys.executable, "-c", "from photogram import adjust"]),
    ("`photogram giant --example --no-html`", 0.7, [*PHOTOGRAM, "giant", "--example", "--no-html"]),
    ("`photogram adjust --example --no-html`", 0.7, [*PHOTOGRAM, "adjust", "--example", "--no-html"]),
    ("`photogram giant --example`, which draws its report", 0.7, [*PHOTOGRAM, "giant", "--example"]),
    ("`photogram adjust --example`, which draws its report", 0.7, [*PHOTOGRAM, "adjust", "--example"]),
)
"""What is run, its limit in seconds if it has one, and the command."""
BLOCK_LIMIT = 0.010
"""Of five photos, seconds."""
FIRST_LIMIT = 1.2
"""Of the first call of a process: its processor time over that of later ones."""
SIZES = ((1, 6), (20, 50), (50, 100))
"""Blocks whose first call is measured: strips, and photos of each."""
CALLS = """
import sys, time
from photogram import adjust, simulate

block = simulate(strips=int(sys.argv[1]), photos_per_strip=int(sys.argv[2]), seed=1).block
for _ in range(4):
    began = time.process_time()
    adjust(block)
    print(time.process_time() - began)
"""


def of_processes(command: list[str], repetitions: int, environment: Mapping[str, str], folder: Path) -> float:
    """Return the median of the processor time of a command, seconds."""

    def once() -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, capture_output=True, env=environment, cwd=folder)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    once()
    return statistics.median(once() for _ in range(repetitions))


def of_five_photos(repetitions: int) -> float:
    """Return the median of the processor time of the adjustment of a block of five photos, seconds."""
    block = simulate(strips=1, photos_per_strip=5, points_per_photo=20, seed=1).block
    return of_calls(lambda: adjust(block), repetitions)


def of_first_calls(size: tuple[int, int], repetitions: int) -> tuple[float, float]:
    """Return medians of the processor time of first calls, and of the least of the next three calls."""
    command = [sys.executable, "-c", CALLS, *map(str, size)]
    runs = []
    for _ in range(repetitions):
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        runs.append([float(each) for each in printed.split()])
    return statistics.median(run[0] for run in runs), statistics.median(min(run[1:]) for run in runs)


def of_calls(call: Callable[[], object], repetitions: int) -> float:
    """Return the median of the processor time of a call after a first one, seconds."""
    call()
    times = []
    for _ in range(repetitions):
        began = time.process_time()
        call()
        times.append(time.process_time() - began)
    return statistics.median(times)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=7, help="of each (7)")
    asked = parser.parse_args()
    print("| what | of processor, s | limit, s |")
    print("|---|---:|---:|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        environment["PYTHONPYCACHEPREFIX"] = str(Path(folder, "compiled"))
        for what, limit, command in PROCESSES:
            seconds = of_processes(command, asked.repetitions, environment, Path(folder))
            print(f"| {what} | {seconds:.2f} | {'' if limit is None else f'{limit:.2f}'} |", flush=True)
    seconds = of_five_photos(asked.repetitions)
    print(f"| `adjust` of a block of five photos | {seconds:.4f} | {BLOCK_LIMIT:.4f} |")
    for size in SIZES:
        first, later = of_first_calls(size, asked.repetitions)
        what = f"first `adjust` of a process, {size[0] * size[1]:,} photos; later calls take {later:.4f}"
        print(f"| {what} | {first:.4f} | {FIRST_LIMIT * later:.4f} |", flush=True)


if __name__ == "__main__":
    main()
