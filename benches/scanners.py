"""Line scanners in orbit, each image with a trajectory of its own, all covariances: docs/performance.md.

python benches/scanners.py 2000 50000     images; four images a point, 200 measures an image; Linux
python benches/scanners.py 230000 --parts 128 --workers 2 --memory 8GiB --folder DIR      docs/distributed.md

Corrections have 12 coefficients an image: degree 0 of the position, degree 2 of the rotation, all weighted.
In parts the block is simulated and divided by a process of its own, and never in memory again. A folder that
is given keeps the run, which goes on there where it was ended.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from on_disk import progress_since, size_on_disk
from peak import forget_peak, peak_memory
from photogram import Block, Camera, adjust
from photogram.adjustment.adjustment import core_options
from photogram.adjustment.options import AdjustOptions
from photogram.arguments.types import Floats, Indices
from photogram.distributed import Division
from photogram.distributed.adjust import opened
from photogram.distributed.division import bytes_of
from photogram.distributed.executors import connected
from photogram.distributed.run import MANIFEST, partition
from photogram.formats.in_parts import document
from photogram.memory import give_back, resident_memory
from photogram.network.attitudes import Attitudes
from photogram.network.moving_photos import Lines, LineSensor, Timed
from photogram.network.trajectories import Polynomial, Table, Trajectory
from photogram.show.forms import text

ALTITUDE, SPEED, APART, LENGTH = 100e3, 1.6e3, 10e3, 35e3
"""Metres above the ground and in a second, between orbits, and of ground that an image covers along one."""
C, PITCH, LINE = -100.0, 0.007, 0.006
"""Principal distance and pitch in millimetres, seconds a line."""
ACROSS = 4
"""Orbits from which a point is seen."""
SD = {"image": 0.0035, "position": 20.0, "rotation": np.array([1e-4, 3e-5, 3e-5]), "control": 5.0}
"""Millimetres, metres, radians by degree, metres."""


TOGETHER = 2**20
"""Images of points that are simulated at once."""


def measured(images: Indices, points: Floats, begins: Floats, c: Floats, r: Floats) -> Floats:
    """Return (n, 2) sample and line of (n, 3) points in images: the time at which each is on its line."""
    half = LENGTH / SPEED / 2
    times = (points[:, 1] - begins[images, 1]) / SPEED
    for _ in range(4):
        s = ((times - half) / half)[:, np.newaxis]
        about = r[0][images] + r[1][images] * s + r[2][images] * s**2
        at = begins[images] + c[images] + times[:, np.newaxis] * [0.0, SPEED, 0.0]
        u = np.einsum("nji,nj->ni", Attitudes.of("rotation_vector", about).matrices, points - at)
        times += u[:, 1] / SPEED
    return np.column_stack([C * u[:, 0] / u[:, 2] / PITCH, times / LINE])


def simulated(count: int, points_per_image: int = 50) -> tuple[Block, int]:
    """Return a block of about so many images, and how many coefficients it has."""
    random = np.random.default_rng(1)
    orbits = max(ACROSS, round(np.sqrt(count / 2)))
    along = -(-count // orbits)
    orbit, number = (each.ravel() for each in np.indices((orbits, along)))
    # Every other orbit begins half an image later, so that images along one hang together through the next.
    begins = np.column_stack(
        [orbit * APART, (number + orbit % 2 / 2) * LENGTH, np.full(orbits * along, ALTITUDE)]
    )
    n = orbits * along * points_per_image
    ground = np.column_stack(
        [
            random.uniform((ACROSS / 2 - 1) * APART, (orbits - ACROSS / 2) * APART, n),
            random.uniform(LENGTH / 2, along * LENGTH, n),
            random.uniform(-1e3, 1e3, n),
        ]
    )
    ground = ground[np.lexsort((ground[:, 0] // APART, ground[:, 1] // LENGTH))]
    first = np.floor(ground[:, 0] / APART).astype(int) - ACROSS // 2 + 1
    of = first[:, np.newaxis] + np.arange(ACROSS)
    which = np.floor(ground[:, 1, np.newaxis] / LENGTH - of % 2 / 2).astype(int)
    there = (of >= 0) & (of < orbits) & (which >= 0) & (which < along)
    points = np.nonzero(there)[0]
    images = (of * along + which)[there]
    c = random.normal(0, SD["position"], (len(begins), 3))
    r = random.normal(0, 1, (3, len(begins), 3)) * SD["rotation"][:, np.newaxis, np.newaxis]
    xy = np.empty((len(images), 2))
    for start in range(0, len(images), TOGETHER):
        some = slice(start, start + TOGETHER)
        xy[some] = measured(images[some], ground[points[some]], begins, c, r)
    # An error in the focal plane, as lines: what the image moves by in one.
    xy += random.normal(0, SD["image"], xy.shape) / [PITCH, -C / ALTITUDE * SPEED * LINE]
    control = np.zeros(n, dtype=bool)
    control[::500] = True
    half, steps = LENGTH / SPEED / 2, np.linspace(0.0, LENGTH / SPEED, 4)
    sensor = LineSensor((PITCH, 0.0), 0.0)
    # Each image begins its own clock a minute after the one before.
    lines = Lines([[0.0, 0.0, LINE]])
    level = np.broadcast_to(np.eye(3), (4, 3, 3))
    basis = Polynomial(2, half, half, sd=np.repeat(SD["rotation"][:, np.newaxis], 3, axis=1))
    timed = [
        Timed(
            str(k),
            Trajectory(
                str(k),
                Table(steps, begin + steps[:, np.newaxis] * [0.0, SPEED, 0.0], steps, level),
                position=Polynomial(0, half, half, sd=SD["position"]),
                rotation=basis,
            ),
            lines=lines,
            line_sensor=sensor,
        )
        for k, begin in enumerate(begins)
    ]
    block = Block(
        photo_ids=[each.photo for each in timed],
        photo_positions=begins,
        photo_attitudes=np.zeros((len(begins), 3)),
        cameras=[Camera("perspective", {"c": C})],
        photo_cameras=np.zeros(len(begins), dtype=int),
        point_positions=np.where(control[:, np.newaxis], ground + random.normal(0, 5.0, (n, 3)), np.nan),
        point_sd=np.where(control[:, np.newaxis], SD["control"], np.inf) * np.ones(3),
        image_photos=images,
        image_points=points,
        image_xy=xy,
        image_sd=SD["image"],
        timed=timed,
    )
    return block, 12 * len(begins)


def row(count: int, ordering: Any) -> str:
    """Adjust a block in this process, and return a row of the table."""
    block, coefficients = simulated(count)
    give_back()
    before = resident_memory() or 0
    forget_peak()
    start, processor = time.perf_counter(), time.process_time()
    result = adjust(block, ordering=ordering)
    seconds, processor = time.perf_counter() - start, time.process_time() - processor
    peak = (peak_memory() - before) / 2**30
    print(result.seconds, file=sys.stderr)
    sigma0, unknowns = np.sqrt(result.variance_of_unit_weight), coefficients + 3 * len(block.point_ids)
    return (
        f"| {ordering} | {len(block.photo_ids):,} | {len(block.image_xy):,} | {unknowns:,}"
        f" | {len(result.iterations)} | {sigma0:.3f} | {seconds:.1f} | {processor:.1f}"
        f" | {peak:.2f} |"
    )


def source(images: int) -> str:
    """Return what tells a simulated block from others."""
    return f"{images} images of scanners"


def divide(images: int, parts: int, run: Path) -> None:
    """Simulate a block, and write its parts into the folder of a run."""
    block, _ = simulated(images)
    partition(block, run, parts, core_options(AdjustOptions()), source(images))


def in_parts(images: int, parts: int, workers: int, memory: str, run: Path) -> None:
    """Adjust a block whose parts lie in a folder; print the plan, what came of it and what it took."""
    start = time.perf_counter()
    if not (run / MANIFEST).exists():
        own = [sys.executable, __file__, str(images), "--divide", "--parts", str(parts), "--folder", str(run)]
        subprocess.run(own, check=True)
        seconds = time.perf_counter() - start
        print(f"simulated and divided in {seconds:,.0f} s, {size_on_disk(run):.2f} GiB on disk")

    def divided(_: int) -> Any:
        raise AssertionError("the parts lie in the folder")

    with connected("local", workers, bytes_of(memory)) as client:
        division = Division(cluster=client, parts=parts, memory=memory)
        with opened(run, source(images), images, divided, divided, division, None) as own_run:
            start = time.perf_counter()
            print(own_run.plan().report())
            print(f"planned in {time.perf_counter() - start:,.0f} s", flush=True)
            start = time.perf_counter()
            outcome = own_run.adjust(progress_since(start))
            seconds = time.perf_counter() - start
            print(text(document(own_run, outcome)))
        peaks, processors = client.run(peak_memory), client.run(time.process_time)
    print(f"adjusted in {seconds:,.0f} s; parts, states and results take {size_on_disk(run):.2f} GiB on disk")
    for worker, peak in sorted(peaks.items()):
        print(f"peak of a worker {peak / 2**20:,.0f} MiB, {processors[worker]:,.0f} s of a processor")
    print(f"peak of this process {peak_memory() / 2**20:,.0f} MiB")


def main() -> None:
    """Print the table, each row from a process of its own; or what came of a block in parts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("images", nargs="+", type=int)
    parser.add_argument("--ordering", default="auto", help="of the images; see photogram.adjust")
    parser.add_argument("--parts", type=int, help="adjust in so many parts")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--memory", default="8GiB", help="of a worker")
    parser.add_argument("--folder", type=Path, help="of the run; kept")
    parser.add_argument("--row", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--divide", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.divide:
        divide(given.images[0], given.parts, given.folder)
        return
    if given.parts:
        with TemporaryDirectory() as temporary:
            run = given.folder or Path(temporary) / "run"
            in_parts(given.images[0], given.parts, given.workers, given.memory, run)
        return
    if given.row:
        print(row(given.images[0], given.ordering), flush=True)
        return
    print("| ordering | images | measures | unknowns | steps | sigma0 | s | cpu s | GiB |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|---:|", flush=True)
    for images in given.images:
        options = ["--row", str(images), "--ordering", given.ordering]
        subprocess.run([sys.executable, __file__, *options], check=True)


if __name__ == "__main__":
    main()
