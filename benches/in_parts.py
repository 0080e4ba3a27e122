"""What adjustments in parts take on up to 64 workers, by counted work and traffic: docs/distributed.md.

python benches/in_parts.py [--write docs/distributed.md] [--photos 500000]
python benches/in_parts.py --run 50x100 --workers 2 --parts 8 --memory 1GiB --alone   a real one, printed
python benches/in_parts.py --scanners 5000 --parts 16 --memory 1GiB --alone           scanners in orbit

Rates are measured beside: one thread adjusts 5,000 simulated photographs. Nothing of the large blocks is
formed: their work, memory and traffic are counted on the tree that nested dissection gives, and a list
scheduler puts the nodes on workers.
"""

from __future__ import annotations

import argparse
import math
import re
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from peak import peak_memory
from photogram import Block, adjust, adjust_in_parts, simulate
from photogram.distributed import Division, plan_in_parts
from photogram.distributed.cut import FORMATION, Counts, Incidence, Tree, counted_work
from photogram.distributed.division import bytes_of
from photogram.distributed.executors import connected
from photogram.distributed.plan import Times, scheduled
from scanners import simulated

BANDWIDTH = 1.25e9 / 2
"""Bytes a second between two workers: half of 10 Gbit Ethernet."""
ITERATIONS = 4
WORKERS = (1, 2, 4, 8, 16, 32, 64)
WEAK = 7_800
"""Photographs for each worker."""
PARTS = 4
"""For each worker."""
IMAGES = 100.0
"""Of a photograph."""


Row = tuple[int, int, Tree, Counts, tuple[Times, float]]


class Rates:
    """Seconds for a multiply-add, or an image point, of one thread."""

    def __init__(self) -> None:
        block = simulate(strips=50, photos_per_strip=100, seed=1).block
        result = adjust(block, threads=1)
        seconds, operations, images = result.seconds, result.operations, len(block.image_xy)
        forming = FORMATION * images + operations["reduction"]
        self.formation = seconds["form"] / result.formations / forming
        self.factor = seconds["factor"] / result.formations / operations["factor"]
        self.solution = seconds["solve"] / result.formations / images
        self.inverse = seconds["invert"] / operations["inverse"]
        self.cofactors = seconds["cofactors"] / images
        self.inverse_of_factor = operations["inverse"] / operations["factor"]

    def __str__(self) -> str:
        return (
            f"{1e-9 / self.formation:.2f}, {1e-9 / self.factor:.1f} and {1e-9 / self.inverse:.1f} x 10⁹"
            " multiply-adds a second in formation, factorisation and inversion"
        )

    def times(self, tree: Tree, counts: Counts, workers: int) -> tuple[Times, float]:
        """Return what the schedule takes, and the seconds that one worker would, without waiting."""
        up = self.formation * counts.formation + self.factor * counts.factor
        down = self.solution * counts.images
        inversion = self.inverse * self.inverse_of_factor * counts.factor + self.cofactors * counts.images
        traffic = counts.contribution_bytes, counts.step_bytes, counts.cofactor_bytes
        work = ITERATIONS * float(up.sum() + down.sum()) + float(inversion.sum())
        return scheduled(tree, up, down, inversion, traffic, workers, BANDWIDTH), work


def grid(photos: int) -> tuple[np.ndarray, Incidence]:
    """Return a square block, 60 % forward and 30 % side overlap: points on three photos along, two across."""
    rows = max(round(math.sqrt(photos * 1.6 / 4)), 1)
    columns = round(photos / rows)
    across, along = (each.ravel() for each in np.mgrid[:rows, :columns])
    first = (across[:, None] + np.arange(2)[None]).clip(max=rows - 1)
    second = (along[:, None] + np.arange(3)[None]).clip(max=columns - 1)
    vertices = np.unique(
        (first[:, :, None] * columns + second[:, None, :]).reshape(rows * columns, 6)
        + rows * columns * np.arange(rows * columns)[:, None]
    )
    places = np.column_stack([1.0 * along, 1.6 * across, np.zeros(rows * columns)])
    count = rows * columns
    return places, Incidence(vertices % count, vertices // count, count)


def table(title: str, rows: Sequence[Row]) -> list[str]:
    """Return a table of Markdown."""
    lines = [
        f"**{title}**",
        "",
        "| workers | photographs | parts | unknowns at the top | largest node, GiB | up and down, s"
        " | inversion, s | whole, s | between workers, GiB | at work |",
        "| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for workers, photos, tree, counts, (times, work) in rows:
        whole = times.whole(ITERATIONS)
        moved = ITERATIONS * (times.moved_up + times.moved_down) + times.moved_inversion
        lines.append(
            f"| {workers} | {photos:,} | {(len(tree) + 1) // 2} | {6 * counts.photos[tree.root]:,}"
            f" | {counts.memory_bytes.max() / 2**30:.2f} | {times.up + times.down:.1f}"
            f" | {times.inversion:.1f} | {whole:.0f} | {moved / 2**30:.2f} | {work / (whole * workers):.0%} |"
        )
    return [*lines, ""]


def page(photos: int) -> list[str]:
    """Return what the page shows."""
    rates = Rates()
    places, incidence = grid(photos)
    images = np.full(len(places), IMAGES)
    strong = []
    for workers in WORKERS:
        tree, counts = counted_work(places, images, lambda: [incidence], PARTS * workers)
        strong.append((workers, len(places), tree, counts, rates.times(tree, counts, workers)))
    weak = []
    for workers in WORKERS:
        own, edges = grid(WEAK * workers)
        images = np.full(len(own), IMAGES)
        tree, counts = counted_work(own, images, lambda edges=edges: [edges], PARTS * workers)
        weak.append((workers, len(own), tree, counts, rates.times(tree, counts, workers)))
    return [
        f"Workers have one thread. The rates were measured on this machine: {rates}.",
        f"Two workers transfer {BANDWIDTH / 1e6:.0f} MB/s. The times include {ITERATIONS} iterations and the"
        f" inversion with all covariances. There are {IMAGES:.0f} image points in a photograph, and {PARTS}"
        " parts for each worker. At work: time of one worker without waiting, over the time of all workers.",
        "",
        *table(f"Strong scaling: {len(places):,} photographs", strong),
        *table(f"Weak scaling: about {WEAK:,} photographs a worker", weak),
    ]


def carried_out(block: Block, workers: int, parts: int, memory: str, *, alone: bool) -> None:
    """Adjust a block on a cluster on this machine; print the plan and what came of it."""
    with connected("local", workers, bytes_of(memory)) as client, TemporaryDirectory() as folder:
        division = Division(cluster=client, parts=parts, memory=memory, folder=folder)
        plan = plan_in_parts(block, division)
        print(plan.report(), flush=True)
        before = client.run(peak_memory)
        start = time.perf_counter()
        found = adjust_in_parts(block, division)
        seconds = time.perf_counter() - start
        after = client.run(peak_memory)
    print(f"{found.status} after {len(found.iterations)} iterations, {seconds:.1f} s, results merged")
    for address, peak in sorted(after.items()):
        grown = (peak - before.get(address, 0)) / 2**20
        print(f"peak of a worker {peak / 2**20:,.0f} MiB, {grown:,.0f} MiB above what it began with")
    if alone:
        start = time.perf_counter()
        whole = adjust(block)
        print(f"in one process {time.perf_counter() - start:.1f} s, {len(whole.iterations)} iterations")
        sd = np.sqrt(np.diagonal(whole.photo_cofactors, axis1=1, axis2=2))[:, :3]
        apart = np.abs((found.photo_positions - whole.photo_positions) / sd).max()
        scale = np.diagonal(whole.photo_cofactors, axis1=1, axis2=2)
        cofactors = np.abs(np.diagonal(found.photo_cofactors, axis1=1, axis2=2) / scale - 1).max()
        redundancy = np.abs(found.redundancy - whole.redundancy).max()
        print(
            f"photos differ by {apart:.0e} standard deviations, their cofactors by {cofactors:.0e},"
            f" redundancy numbers by {redundancy:.0e}"
        )


def main() -> None:
    """Print the tables, or write them into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run")
    parser.add_argument("--scanners", type=int)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--parts", type=int, default=8)
    parser.add_argument("--memory", default="1GiB")
    parser.add_argument("--alone", action="store_true")
    parser.add_argument("--write", type=Path)
    parser.add_argument("--photos", type=int, default=500_000)
    given = parser.parse_args()
    if given.run or given.scanners:
        if given.scanners:
            block, _ = simulated(given.scanners)
        else:
            strips, photos = (int(number) for number in given.run.split("x"))
            block = simulate(strips=strips, photos_per_strip=photos, seed=1).block
        carried_out(block, given.workers, given.parts, given.memory, alone=given.alone)
        return
    text = "\n".join(page(given.photos))
    print(text)
    if given.write:
        whole = given.write.read_text(encoding="utf-8")
        marks = r"(<!-- scaling -->\n).*?(<!-- end of scaling -->)"
        changed = re.sub(marks, lambda found: found[1] + text + "\n" + found[2], whole, flags=re.DOTALL)
        given.write.write_text(changed, encoding="utf-8")


if __name__ == "__main__":
    main()
