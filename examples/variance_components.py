"""Weights that are wrong, and what to do: a block whose second strip was measured by a less careful observer.

Prints the variance components, the variance as a function of the radius, and the tests of sums by photo; a
directory as argument gets the plots.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from photogram import Block, adjust, group_sums, simulate, variance_components, variance_function

FACTOR = 2.5
"""Of the errors of the second strip."""
GROWTH = 2.0
"""Variance at the edge of the frame over that in the middle, of all photos of another block."""


def measured(seed: int = 4) -> Block:
    """Return the block: all images are said to have the same standard deviation."""
    simulation = simulate(strips=3, photos_per_strip=5, points_per_photo=40, position_sd=0.2, seed=seed)
    second = np.array([name.startswith("02") for name in simulation.block.photo_ids])
    block, truth = simulation.block, simulation.truth
    errors = block.image_xy - truth.image_xy
    factors = np.where(second[block.image_photos], FACTOR, 1.0)[:, np.newaxis]
    return block.replace(image_xy=truth.image_xy + factors * errors)


def blurred(seed: int = 5) -> Block:
    """Return a block whose images are worse towards the edge of the frame."""
    simulation = simulate(strips=3, photos_per_strip=5, points_per_photo=100, seed=seed)
    block, truth = simulation.block, simulation.truth
    radius = np.linalg.norm(truth.image_xy, axis=1)
    factors = np.sqrt(0.5 + 0.5 * GROWTH * (radius / radius.max()) ** 2)[:, np.newaxis]
    return block.replace(image_xy=truth.image_xy + factors * (block.image_xy - truth.image_xy))


def main(pictures: Path | None) -> None:
    """Print what the residuals say of the weights."""
    block = measured()
    print(group_sums(adjust(block), "strip").report())
    components = variance_components(block, "strip")
    print(components.report())
    function = variance_function(blurred())
    print(function.report())
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
        components.plot().save(pictures / "components.svg")
        function.plot().save(pictures / "radius.svg")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
