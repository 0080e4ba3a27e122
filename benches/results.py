"""How long the result of a simulated block takes to be judged, written as Parquet, and read again.

python benches/results.py [STRIPSxPHOTOS]
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from photogram import adjust, read_result, simulate

Made = TypeVar("Made")


def timed(what: str, work: Callable[[], Made]) -> Made:
    """Print how long some work takes, and return what it makes."""
    wall, processor = time.perf_counter(), time.process_time()
    made = work()
    took = time.perf_counter() - wall, time.process_time() - processor
    print(f"{what:<28}{took[0]:8.2f} s{took[1]:8.2f} s of processor time", flush=True)
    return made


def main(size: str) -> None:
    """Simulate and adjust a block, write its result and read it."""
    strips, photos = (int(number) for number in size.split("x"))
    # The first verdict of a process imports its modules.
    adjust(simulate(strips=2, photos_per_strip=4).block).verdict  # noqa: B018
    block = timed("simulated", lambda: simulate(strips=strips, photos_per_strip=photos).block)
    print(f"{len(block.photo_ids)} photos, {len(block.point_ids)} points, {len(block.image_xy)} image points")
    result = timed("adjusted", lambda: adjust(block, covariance="verdict"))
    timed("verdict", lambda: result.verdict)
    with tempfile.TemporaryDirectory() as folder:
        timed("written as Parquet", lambda: result.to_parquet(folder))
        megabytes = sum(os.path.getsize(path) for path in Path(folder).iterdir()) / 1e6
        print(f"{megabytes:.0f} MB")
        timed("read again", lambda: read_result(folder))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "200x250")
