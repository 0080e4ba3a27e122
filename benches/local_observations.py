"""Observations of single points: the time of an adjustment with and without them.

python benches/local_observations.py 10x20 20x50      strips x photographs
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from photogram import Block, adjust, simulate
from photogram.network import Control

SD = 0.3
"""Standard deviation of a coordinate (m)."""


def blocks(size: str) -> dict[str, Block]:
    """Return a simulated block without and with observations of each pass point."""
    strips, photos = (int(number) for number in size.split("x"))
    block = simulate(strips=strips, photos_per_strip=photos, seed=1).block
    positions, rng = adjust(block).point_positions, np.random.default_rng(1)
    free = np.flatnonzero(np.isinf(block.point_sd).all(axis=1) & np.isfinite(positions).all(axis=1))
    roots = SD * (np.eye(3) + np.tril(rng.uniform(-0.5, 0.5, (len(free), 3, 3)), -1))
    observed = positions[free] + np.einsum("nij,nj->ni", roots, rng.normal(size=(len(free), 3)))
    given, heights, coordinates = np.array(block.point_positions), *np.repeat([block.point_sd], 2, axis=0)
    given[free], heights[free, 2], coordinates[free] = observed, SD, SD
    names = [block.point_ids[point] for point in free]
    controls = Control.from_arrays(
        point=names, position=observed, covariance=roots @ roots.transpose(0, 2, 1)
    )
    return {
        "without": block,
        "heights": block.replace(point_positions=given, point_sd=heights),
        "coordinates": block.replace(point_positions=given, point_sd=coordinates),
        "covariances": block.replace(observations=[controls]),
    }


def main() -> None:
    """Print a table: least times of several runs in turn, and ratios to the block without them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="+")
    parser.add_argument("--runs", type=int, default=5)
    given = parser.parse_args()
    print("| photos | points | observed | steps | s | cpu s | ratio | cpu ratio |")
    print("| ---: | ---: | :--- | ---: | ---: | ---: | ---: | ---: |")
    for size in given.sizes:
        all_blocks = blocks(size)
        times: dict[str, list[tuple[float, float]]] = {name: [] for name in all_blocks}
        steps = {name: len(adjust(block).iterations) for name, block in all_blocks.items()}
        for _ in range(given.runs):
            for name, block in all_blocks.items():
                wall, processor = time.perf_counter(), time.process_time()
                adjust(block)
                times[name].append((time.perf_counter() - wall, time.process_time() - processor))
        least = {name: np.min(own, axis=0) for name, own in times.items()}
        for name, block in all_blocks.items():
            (seconds, processor), ratio = least[name], least[name] / least["without"]
            counts = f"{len(block.photo_ids):,} | {len(block.point_ids):,} | {name} | {steps[name]}"
            print(f"| {counts} | {seconds:.3f} | {processor:.3f} | {ratio[0]:.2f} | {ratio[1]:.2f} |")


if __name__ == "__main__":
    main()
