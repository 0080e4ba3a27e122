"""A weak collection: an object on a turntable, nearly parallel rays, a camera for each photo.

python benches/turntable.py [--photos 177] [--points 4217] [--rays 31] [--distance 175] [--seed 0]

Prints how many steps the adjustment takes, with all covariances, and how long.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from photogram import collection


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--photos", type=int, default=177)
    parser.add_argument("--points", type=int, default=4217)
    parser.add_argument("--rays", type=int, default=31)
    parser.add_argument("--distance", type=float, default=175.0)
    parser.add_argument("--seed", type=int, default=0)
    shape = vars(parser.parse_args())
    start = collection.simulate_turntable(**shape).collection
    begin, begin_cpu = time.perf_counter(), time.process_time()
    result = collection.adjust(start)
    seconds, cpu = time.perf_counter() - begin, time.process_time() - begin_cpu
    focal = np.abs(result.photo_parameters[:, 6])
    share = np.median(np.sqrt(result.photo_cofactors[:, 6, 6]) / focal)
    print("| photos | points | images | status | steps | formations | s | cpu s | sd of f / f | sigma0 |")
    print("|---:|---:|---:|---|---:|---:|---:|---:|---:|---:|")
    sigma0 = np.sqrt(result.variance_of_unit_weight or np.nan)
    print(
        f"| {shape['photos']} | {shape['points']:,} | {len(start.image_xy):,} | {result.status} |"
        f" {len(result.iterations)} | {result.formations} | {seconds:.1f} | {cpu:.1f} | {share:.2f} |"
        f" {sigma0:.4f} |"
    )


if __name__ == "__main__":
    main()
