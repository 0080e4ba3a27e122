"""Mistakes made on purpose with a simulated block, and what `photogram.diagnose` says of each."""

from __future__ import annotations

import numpy as np

from photogram import Block, diagnose, simulate


def flown() -> Block:
    """Return two strips whose photos have rough initial poses and nothing else."""
    block = simulate(strips=2, photos_per_strip=5, tilt=0.03, seed=4).block
    return block.replace(
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        photo_positions_observed=None,
        photo_attitudes_observed=None,
    )


def mistakes(block: Block) -> dict[str, Block]:
    """Return the block with each mistake."""
    corner = (block.image_xy * [1, -1] + 115.0) / 0.006
    return {
        "no mistake": block,
        "pixels from the upper left corner": block.replace(image_xy=corner),
        "y down": block.replace(image_xy=block.image_xy * [1, -1]),
        "sign of the principal distance": block.replace(principal_distances=-block.principal_distances),
        "degrees read as radians": block.replace(photo_attitudes=np.degrees(block.photo_attitudes)),
        "positions in feet": block.replace(photo_positions=block.photo_positions / 0.3048),
        "X and Y exchanged": block.replace(photo_positions=block.photo_positions[:, [1, 0, 2]]),
    }


def main() -> None:
    """Print which mistakes are named of each."""
    for mistake, block in mistakes(flown()).items():
        print(f"{mistake}:")
        for said in diagnose(block).verdict.hints or ["nothing"]:
            print(f"    {said}")


if __name__ == "__main__":
    main()
