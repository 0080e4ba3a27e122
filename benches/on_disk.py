"""A simulated block on disk, adjusted in parts without ever being in memory as a whole: docs/distributed.md.

python benches/on_disk.py 400x500 --workers 2 --parts 64 --memory 4GiB [--folder DIR]     Linux

The project is written by a process of its own. A folder that is given keeps project and run: a run that was
ended goes on there.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow
from pyarrow import parquet

from peak import peak_memory
from photogram import simulate
from photogram.adjustment.adjustment import Progress
from photogram.distributed import Division
from photogram.distributed.division import bytes_of
from photogram.distributed.executors import connected
from photogram.formats import ReadOptions, to_files
from photogram.formats.in_parts import document, on_disk
from photogram.formats.project import Project
from photogram.network.block import Block
from photogram.show.forms import text

ROWS = 2**20
"""Of the table of images, written together."""


def write_project(size: str, folder: Path) -> None:
    """Write a simulated block as a plain project whose images lie in Parquet."""
    strips, photos = (int(number) for number in size.split("x"))
    block = simulate(strips=strips, photos_per_strip=photos, seed=1).block
    folder.mkdir(parents=True)
    for name, content in to_files(_without_images(block, folder), "plain").items():
        if name != "images.csv":
            (folder / name).write_bytes(content)
    photos, points = pyarrow.array(block.photo_ids), pyarrow.array(block.point_ids)
    text, number = pyarrow.string(), pyarrow.float64()
    types = {"photo": text, "point": text, "x": number, "y": number, "sd": number}
    with parquet.ParquetWriter(folder / "images.parquet", pyarrow.schema(types)) as file:
        for start in range(0, len(block.image_xy), ROWS):
            own = slice(start, start + ROWS)
            columns = {
                "photo": photos.take(pyarrow.array(block.image_photos[own])),
                "point": points.take(pyarrow.array(block.image_points[own])),
                "x": block.image_xy[own, 0],
                "y": block.image_xy[own, 1],
                "sd": block.image_sd[own, 0],
            }
            file.write_table(pyarrow.table(columns))


def _without_images(block: Block, folder: Path) -> Project:
    """Return photos, cameras and control alone."""
    control = np.flatnonzero(np.isfinite(block.point_sd).any(axis=1))
    rows = np.flatnonzero(np.isin(block.image_points, control))[:1]
    held = block.replace(
        point_ids=[block.point_ids[row] for row in control],
        point_positions=block.point_positions[control],
        point_sd=block.point_sd[control],
        image_photos=block.image_photos[rows],
        image_points=np.searchsorted(control, block.image_points[rows]),
        image_xy=block.image_xy[rows],
        image_sd=block.image_sd[rows],
    )
    count = max(len(block.cameras), 1)
    starts = np.full((len(control), 3), np.nan)
    none = (None,) * count
    return Project(block=held, path=folder, title="", sizes=none, pixel_mm=none, starts=starts)


def size_on_disk(folder: Path) -> float:
    """Return GiB of all files of a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 2**30


def progress_since(start: float) -> Callable[[Progress], None]:
    """Return a callback that prints each iteration."""

    def print_iteration(progress: Progress) -> None:
        if progress.iteration is not None:
            done = progress.iteration.number, time.perf_counter() - start
            print(f"iteration {done[0]} after {done[1]:,.0f} s", file=sys.stderr, flush=True)

    return print_iteration


def adjust_in_parts(project: Path, run: Path, workers: int, parts: int, memory: str) -> None:
    """Adjust a project; print the plan, the result, and its time and memory."""
    print(f"the project takes {size_on_disk(project):.2f} GiB on disk", flush=True)
    with connected("local", workers, bytes_of(memory)) as client:
        division = Division(cluster=client, parts=parts, memory=memory)
        start = time.perf_counter()
        with on_disk(project, ReadOptions(), run, division) as opened:
            plan = opened.plan()
            print(f"divided and planned in {time.perf_counter() - start:,.0f} s")
            print(text(plan.document()), flush=True)
            start = time.perf_counter()
            outcome = opened.adjust(progress_since(start))
            seconds = time.perf_counter() - start
            print(text(document(opened, outcome)))
        peaks = client.run(peak_memory)
    print(f"adjusted in {seconds:,.0f} s; parts, states and results take {size_on_disk(run):.2f} GiB on disk")
    for _, peak in sorted(peaks.items()):
        print(f"peak of a worker {peak / 2**20:,.0f} MiB")
    print(f"peak of this process {peak_memory() / 2**20:,.0f} MiB")


def main() -> None:
    """Simulate, write, adjust."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("size", metavar="STRIPSxPHOTOS")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--parts", type=int, default=8)
    parser.add_argument("--memory", default="1GiB")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--project-only", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.project_only:
        write_project(given.size, given.folder)
        return
    with TemporaryDirectory() as temporary:
        folder = given.folder or Path(temporary)
        project = folder / "project"
        if not project.exists():
            own = [sys.executable, __file__, given.size, "--project-only", "--folder", str(project)]
            subprocess.run(own, check=True)
        adjust_in_parts(project, folder / "run", given.workers, given.parts, given.memory)


if __name__ == "__main__":
    main()
