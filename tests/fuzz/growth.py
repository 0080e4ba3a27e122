"""Whether memory grows with adjustments and reports: `python -m tests.fuzz.growth`."""

from __future__ import annotations

import argparse
import gc
from collections.abc import Callable
from pathlib import Path

import photogram
from photogram.memory import give_back, resident_memory

from .page import machine, write_section

__all__ = ["growth"]

ADJUSTMENTS, REPORTS, FIRST = 500, 300, 0.2
"""Of the page; what the first part of them takes (caches, modules, the allocator's own) is not counted."""


def growth(action: Callable[[], object], times: int) -> tuple[int, int]:
    """Return the resident bytes of this process after the first part of many times, and after all."""
    first = max(int(FIRST * times), 1)
    found = []
    for count in (first, times - first):
        for _ in range(count):
            action()
        gc.collect()
        give_back()
        found.append(resident_memory() or 0)
    return found[0], found[1]


def main() -> None:
    """Adjust and report, and say what is held."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.growth", description=__doc__)
    parser.add_argument("--page", type=Path, help="page whose section on memory gets the figures")
    asked = parser.parse_args()
    block = photogram.simulate(strips=3, photos_per_strip=6, points_per_photo=30, seed=1).block
    result = photogram.adjust(block)
    rows = ["| action | times | memory after a fifth of them | memory at the end |", "|---|---:|---:|---:|"]
    actions: list[tuple[str, int, Callable[[], object]]] = [
        ("adjustments", ADJUSTMENTS, lambda: photogram.adjust(block)),
        ("reports for the browser", REPORTS, result.to_html),
    ]
    for what, times, action in actions:
        before, after = (f"{each / 2**20:.1f} MiB" for each in growth(action, times))
        rows.append(f"| {what} | {times} | {before} | {after} |")
    lines = [
        f"A block of {len(block.photo_ids)} photos and {len(block.image_xy)} image observations"
        f" on {machine()}.",
        "",
        *rows,
    ]
    print("\n".join(lines))
    if asked.page:
        write_section(asked.page, "growth", lines)


if __name__ == "__main__":
    main()
