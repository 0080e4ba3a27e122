"""A block adjusted in parts, one after the other, as one that is larger than memory would be.

Prints the plan, and how far the result is from that of one process.
"""

from __future__ import annotations

import numpy as np

from photogram import Block, Result, adjust, adjust_in_parts, simulate
from photogram.distributed import Division, plan_in_parts

PARTS = 4


def flown(seed: int = 11) -> Block:
    """Return a block of 80 photographs."""
    return simulate(strips=4, photos_per_strip=20, points_per_photo=40, seed=seed).block


def apart(found: Result, whole: Result) -> tuple[float, float]:
    """Return by how much photos differ, in standard deviations, and redundancy numbers."""
    sd = np.sqrt(np.diagonal(whole.photo_cofactors, axis1=1, axis2=2))
    values = [np.hstack([each.photo_positions, each.photo_attitudes]) for each in (found, whole)]
    return float(np.abs((values[0] - values[1]) / sd).max()), float(
        np.abs(found.redundancy - whole.redundancy).max()
    )


def main() -> None:
    """Plan, adjust in parts and in one process, and compare."""
    block = flown()
    division = Division(parts=PARTS)
    print(plan_in_parts(block, division).report())
    found, whole = adjust_in_parts(block, division), adjust(block)
    values, redundancy = apart(found, whole)
    print(f"photos differ by {values:.0e} standard deviations, redundancy numbers by {redundancy:.0e}")


if __name__ == "__main__":
    main()
