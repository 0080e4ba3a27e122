"""Time and memory of large blocks, all covariances included, and what is predicted: docs/performance.md.

python benches/large.py 200x250 400x500     strips x photographs; Linux
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from unittest.mock import patch

from peak import forget_peak, peak_memory
from photogram import adjust, simulate
from photogram.errors import OutOfMemoryError
from photogram.memory import give_back, resident_memory


def predicted(block: object) -> float:
    """Return the GiB that the adjustment says it needs, which it does where there are fewer."""
    with patch("photogram.network.core_arrays.available_memory", lambda: 1):
        try:
            adjust(block)
        except OutOfMemoryError as error:
            needed = re.search(r"([\d.]+) GiB", str(error))
            if needed is not None:
                return float(needed[1])
    raise SystemExit("the adjustment does not say what it needs")


def row(size: str) -> str:
    """Adjust a block in this process, and return a row of the table."""
    strips, photos = (int(number) for number in size.split("x"))
    block = simulate(strips=strips, photos_per_strip=photos, seed=1).block
    needed = predicted(block)
    give_back()
    before = resident_memory() or 0
    forget_peak()
    start, processor = time.perf_counter(), time.process_time()
    result = adjust(block)
    seconds, processor = time.perf_counter() - start, time.process_time() - processor
    peak = (peak_memory() - before) / 2**30
    return (
        f"| {len(block.photo_ids):,} | {len(block.image_xy):,} | {len(result.iterations)} | {seconds:.1f}"
        f" | {processor:.1f} | {needed:.2f} | {peak:.2f} | {peak / needed:.2f} |"
    )


def main() -> None:
    """Print the table, each row from a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="+")
    parser.add_argument("--row", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.row:
        print(row(given.sizes[0]), flush=True)
        return
    print("| photos | image points | steps | s | cpu s | GiB predicted | GiB taken | ratio |")
    print("|---:|---:|---:|---:|---:|---:|---:|---:|", flush=True)
    for size in given.sizes:
        subprocess.run([sys.executable, __file__, "--row", size], check=True)


if __name__ == "__main__":
    main()
