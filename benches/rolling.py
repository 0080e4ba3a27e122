"""A rolling shutter beside the same block of frames, all covariances included: docs/moving.md.

python benches/rolling.py 20x50 50x100     strips x photographs

Both are adjusted three times in turn in one process; the fastest of each counts.
"""

from __future__ import annotations

import argparse
import time

from photogram import Block, adjust, simulate
from photogram.network.simulated_images import RollingShutter


def seconds(block: Block) -> tuple[float, int]:
    """Return what an adjustment takes, and its iterations."""
    start = time.perf_counter()
    result = adjust(block)
    return time.perf_counter() - start, len(result.iterations)


def row(size: str) -> str:
    """Return a row of the table."""
    strips, photos = (int(number) for number in size.split("x"))
    options = {"strips": strips, "photos_per_strip": photos, "seed": 1}
    frames = simulate(**options).block
    rolling = simulate(**options, motion=RollingShutter(0.03, readout_sd=0.003)).block
    runs = [(seconds(frames), seconds(rolling)) for _ in range(3)]
    (of_frames, steps), (of_rolling, own) = (min(each) for each in zip(*runs, strict=True))
    ratio = of_rolling / of_frames
    return (
        f"| {len(frames.photo_ids):,} | {len(frames.image_xy):,} | {of_frames:.2f} | {steps}"
        f" | {len(rolling.image_xy):,} | {of_rolling:.2f} | {own} | {ratio:.1f} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="+")
    print("| photos | image points | frames, s | steps | image points | rolling, s | steps | ratio |")
    print("|---:|---:|---:|---:|---:|---:|---:|---:|", flush=True)
    for size in parser.parse_args().sizes:
        print(row(size), flush=True)


if __name__ == "__main__":
    main()
