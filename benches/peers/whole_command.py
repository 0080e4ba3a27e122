"""`photogram adjust` from files to report, phase by phase: python benches/peers/whole_command.py 20x50.

Simulated projects are adjusted by the command with its default outputs, each time in a new process; after
them come small commands. The fastest of several repetitions counts. Where gtsam is installed, its bare
solution of the same block is measured in turn with the command.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from page import table
from runs import Size

from photogram.formats import Project, to_files

HERE = Path(__file__).parent
PHOTOGRAM = [sys.executable, "-m", "photogram.cli"]
PHASES = (
    "start of Python and imports", "read", "adjust", "verdict", "tables", "report", "page with pictures",
)  # fmt: skip
REST, WHOLE, GTSAM = "everything else", "**whole command**", "gtsam, bare solution"
FIRST_SIX = """
from photogram import adjust, simulate
adjust(simulate(strips=2, photos_per_strip=3, seed=1).block)
"""

Seconds = dict[str, float]


def written_block(size: Size, folder: Path) -> tuple[Path, Path]:
    """Simulate a block in `folder`; return the stem of its files for a peer, and its project in tables."""
    stem, project = folder / "block", folder / "project"
    subprocess.run([sys.executable, HERE / "runs.py", str(size), "1", stem], check=True)
    with stem.with_suffix(".pickle").open("rb") as file:
        block, _ = pickle.load(file)
    cameras = len(block.cameras)
    unknown = np.full((len(block.point_ids), 3), np.nan)
    nothing = (None,) * cameras
    whole = Project(
        block=block, path=project, title="simulated", sizes=nothing, pixel_mm=nothing, starts=unknown
    )
    for name, content in to_files(whole, "plain").items():
        place = project / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
    return stem, project


def of_command(project: Path, folder: Path) -> Seconds:
    """Return the seconds of the phases of one run of the command, and of the whole."""
    out, record = folder / "out", folder / "record.json"
    shutil.rmtree(out, ignore_errors=True)
    began = time.monotonic()
    command = [HERE / "probe.py", str(began), record, project, "--out", out]
    # 3 and 4 judge the block, not the run.
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=False)
    whole = time.monotonic() - began
    if done.returncode not in (0, 3, 4) or not (out / "report.html").exists():
        raise RuntimeError(f"the command ended with {done.returncode}: {done.stderr}")
    phases: Seconds = json.loads(record.read_text())
    return phases | {REST: whole - sum(phases.values()), WHOLE: whole}


def of_gtsam(stem: Path, folder: Path) -> Seconds:
    """Return the seconds of gtsam's bare Gauss-Newton solution."""
    output = folder / "gtsam"
    subprocess.run([sys.executable, HERE / "side.py", "gtsam", stem, output, "0"], check=True)
    return {GTSAM: json.loads(output.with_suffix(".json").read_text())["seconds"]["solution"]}


def measured(size: Size, repetitions: int) -> Seconds:
    """Return the phases of the fastest command on a block, and gtsam's fastest solution if there is one."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        stem, project = written_block(size, folder)
        of_command(project, folder)  # compiles the modules and brings files into memory
        commands, peers = [], []
        for _ in range(repetitions):
            commands.append(of_command(project, folder))
            if find_spec("gtsam") is not None:
                peers.append(of_gtsam(stem, folder))
    return min(commands, key=lambda each: each[WHOLE]) | min(peers, key=lambda each: each[GTSAM], default={})


def phase_rows(found: list[Seconds]) -> Iterator[list[str]]:
    """Give the rows of the phases, a column for each block; at their end gtsam's, and the ratio to it."""
    for phase in (*PHASES, REST, WHOLE):
        yield [phase, *(f"{each[phase]:.3f}" for each in found)]
    if all(GTSAM in each for each in found):
        yield [GTSAM, *(f"{each[GTSAM]:.3f}" for each in found)]
        yield ["whole command / gtsam", *(f"{each[WHOLE] / each[GTSAM]:.2f}" for each in found)]


def small_rows(repetitions: int) -> Iterator[list[str]]:
    """Give the rows of the commands that a first impression consists of."""
    with tempfile.TemporaryDirectory() as name:
        for what, call in (
            ("`photogram --help`", lambda: of_process([*PHOTOGRAM, "--help"], name)),
            (
                "from the start of Python to six photographs adjusted",
                lambda: of_process([sys.executable, "-c", FIRST_SIX], name),
            ),
            (
                "`photogram adjust --example`, with its page",
                lambda: of_process([*PHOTOGRAM, "adjust", "--example"], name),
            ),
        ):
            yield [what, f"{least(call, repetitions):.3f}"]


def of_process(command: list[str], folder: str) -> float:
    """Return the seconds of a process."""
    began = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, cwd=folder)
    return time.perf_counter() - began


def least(call: Callable[[], float], repetitions: int) -> float:
    """Return the least of what several calls give, after one that does not count."""
    call()
    return min(call() for _ in range(repetitions))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="*", type=Size.parse, metavar="STRIPSxPHOTOS", help="blocks (20x50)")
    parser.add_argument("--repetitions", type=int, default=5, help="of each (5)")
    asked = parser.parse_args()
    sizes = asked.sizes or [Size(20, 50)]
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed package is compiled
    found = [measured(size, asked.repetitions) for size in sizes]
    heads = ["of the clock, s", *(f"{size.photos:,} photos" for size in sizes)]
    print(table(heads, phase_rows(found)))
    print(table(["of the clock", "seconds"], small_rows(asked.repetitions)), end="")


if __name__ == "__main__":
    main()
