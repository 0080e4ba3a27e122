"""Blocks that calibrate two cameras of eight parameters, beside the same with both known, and the peers.

python benches/peers/self_calibration.py [20x50 ...] [--repetitions N] [--without gtsam colmap]

photogram computes the adjustment with all covariances and redundancy numbers; gtsam (`Cal3DS2` as an unknown
that photos share, skew held) and pycolmap (OPENCV cameras, Ceres) the bare solution, from the same initial
values. The last columns are of a block of the same shape whose images have no distortion. All runs are
interleaved.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from gtsam_block import SETTINGS, poses
from machine import processor
from runs import Size
from start import intersections

import photogram
from photogram import Block, Camera
from photogram.network.rays import seen_without_lenses

FREE = dict.fromkeys(("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"), np.inf)
TRUE = (
    {"fx": 152.74, "fy": 152.76, "cx": 0.02, "cy": -0.015, "k1": -6e-4, "k2": 2e-4, "p1": 2e-5, "p2": -3e-5},
    {"fx": 152.60, "fy": 152.59, "cx": -0.01, "cy": 0.03, "k1": 4e-4, "k2": -1e-4, "p1": -2e-5, "p2": 1e-5},
)
START = {"fx": 152.7, "fy": 152.7, "cx": 0.0, "cy": 0.0}
"""A principal distance, as a certificate of long ago has it, and no distortion."""


def blocks(size: Size) -> dict[str, Block]:
    """Return a block that calibrates its two cameras, the same with both known, and one without lenses."""
    shape = {"strips": size.strips, "photos_per_strip": size.photos_per_strip, "seed": 1}
    true = [Camera("opencv", own, unit="mm", name=f"camera {n}") for n, own in enumerate(TRUE, 1)]
    start = [Camera("opencv", START, FREE, unit="mm", name=each.name) for each in true]
    made = {
        "plain": photogram.simulate(**shape),
        "known": photogram.simulate(**shape, cameras=true),
        "unknown": photogram.simulate(**shape, cameras=true, start_cameras=start),
    }
    return {name: each.block for name, each in made.items()}


def gtsam_solution(block: Block) -> Callable[[], float]:
    """Return what solves a block by gtsam and gives the weighted sum of squares."""
    import gtsam
    from gtsam.symbol_shorthand import K, L, X

    points = intersections(seen_without_lenses(block)[0])
    graph, initial = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for photo, pose in enumerate(poses(block)):
        initial.insert(X(photo), pose)
    for point, position in enumerate(points):
        initial.insertPoint3(L(point), position)
    for number, camera in enumerate(block.cameras):
        fx, fy, cx, cy, k1, k2, p1, p2 = camera.values
        initial.insert(K(number), gtsam.Cal3DS2(fx, fy, 0.0, cx, cy, k1, k2, p1, p2))
        skew = gtsam.noiseModel.Diagonal.Precisions(np.where(np.arange(9) == 2, 1e12, 0.0))
        graph.add(gtsam.PriorFactorCal3DS2(K(number), initial.atCal3DS2(K(number)), skew))
    noise = {tuple(sd): gtsam.noiseModel.Diagonal.Sigmas(sd) for sd in np.unique(block.image_sd, axis=0)}
    images = zip(block.image_photos, block.image_points, block.image_xy, block.image_sd, strict=True)
    for photo, point, xy, sd in images:
        camera = int(block.photo_cameras[photo])
        factor = gtsam.GeneralSFMFactor2Cal3DS2(xy, noise[tuple(sd)], X(photo), L(point), K(camera))
        graph.add(factor)
    held = np.isfinite(block.point_sd)
    known = np.where(held, block.point_positions, points)
    for control in np.flatnonzero(held.any(axis=1)):
        of_control = gtsam.noiseModel.Diagonal.Precisions(block.point_sd[control] ** -2.0)
        graph.add(gtsam.PriorFactorPoint3(L(control), known[control], of_control))

    def solve() -> float:
        run = SETTINGS["gn-colamd"](graph, initial)
        run.optimize()
        return 2.0 * float(run.error())

    return solve


def of_colmap(block: Block) -> Callable[[], float]:
    """Return the same by COLMAP."""
    from colmap_lenses import colmap_solution

    return colmap_solution(block)


PEERS: dict[str, Callable[[Block], Callable[[], float]]] = {"gtsam": gtsam_solution, "colmap": of_colmap}


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="*", type=Size.parse, default=[Size(20, 50)], metavar="STRIPSxPHOTOS")
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--without", nargs="*", choices=list(PEERS), default=[])
    arguments = parser.parse_args()
    print(f"{processor()}; seconds, the fastest of {arguments.repetitions}; cpu: of all processors\n")
    head = ["photos", "two of 8 unknown", "cpu", "steps", "both known", "cpu", "steps", "ratio", "of cpu"]
    head += ["no lenses", "cpu", "steps", "ratio", "of cpu"]
    peers = [name for name in PEERS if name not in arguments.without]
    for name in peers:
        head += [f"{name}, bare", f"{name} / photogram"]
    print("| " + " | ".join(head) + " |\n|" + "---:|" * len(head))
    for size in arguments.sizes:
        made = blocks(size)
        work: dict[str, Callable[[], object]] = {
            name: partial(photogram.adjust, block) for name, block in made.items()
        }
        seconds: dict[str, float] = dict.fromkeys([*work, *peers], np.inf)
        cpu = dict(seconds)
        found: dict[str, object] = {}
        for _ in range(arguments.repetitions):
            # A solution of a peer cannot be repeated from where it has ended.
            ready = work | {name: PEERS[name](made["unknown"]) for name in peers}
            for side, run in ready.items():
                start, start_cpu = time.perf_counter(), time.process_time()
                found[side] = run()
                seconds[side] = min(seconds[side], time.perf_counter() - start)
                cpu[side] = min(cpu[side], time.process_time() - start_cpu)
        print(row(size, seconds, cpu, found))


def row(size: Size, seconds: dict[str, float], cpu: dict[str, float], found: dict[str, object]) -> str:
    """Return a row of the table; the sums of squares must agree."""
    results = {side: result for side, result in found.items() if isinstance(result, photogram.Result)}
    cells = [f"{size.photos:,}"]
    for side in ("unknown", "known", "plain"):
        cells += [f"{seconds[side]:.2f}", f"{cpu[side]:.2f}", str(len(results[side].iterations))]
        if side != "unknown":
            cells += [f"{each['unknown'] / each[side]:.2f}" for each in (seconds, cpu)]
    for name in [name for name in PEERS if name in seconds]:
        ours, theirs = results["unknown"].sums_of_squares.total, float(str(found[name]))
        if abs(theirs / ours - 1.0) > 1e-4:
            raise SystemExit(f"The solutions do NOT agree: {ours} and {theirs} of {name}")
        cells += [f"{seconds[name]:.1f}", f"{seconds[name] / seconds['unknown']:.1f}"]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
