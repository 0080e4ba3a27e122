"""Distribution of check points: quadrants, spacing, area, heights.

Requirements are a fifth of the points in each quadrant and a spacing of a tenth of the diagonal (NSSDA,
FGDC-STD-007.3-1998); others are in section 4 of the specification of the statement. Failures are messages.
"""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.hull import hull, outside

SHARE_ASKED, SPACING_ASKED = 0.2, 0.1
FAR = 1 / 3  # Distance from check points relative to the diagonal
CELLS = 200  # Grid for the area far from check points, along each side


@dataclass(frozen=True)
class Layout:
    """Distribution of n check points in a block."""

    count: int  # n
    diagonal: float  # Diagonal of the block's bounding box in plan, linear unit
    # Shares of the points: x and y low, x high and y low, x low and y high, both high. Points on a middle
    # line count as low.
    share_in_quadrants: tuple[float, float, float, float]
    least_spacing_over_diagonal: float  # Spacing of two points relative to the diagonal; NaN for one point
    # Share of the block's area that is farther from all points than a third of the diagonal; NaN if the block
    # is a line
    share_of_area_far: float
    # Range of the heights of the points over that of the block; NaN if the block is level
    share_of_heights: float
    outside_control: int  # The number of points outside the hull of the control points in plan

    @property
    def even(self) -> bool:
        """Whether each quadrant has the required share of points."""
        return min(self.share_in_quadrants) >= SHARE_ASKED

    @property
    def apart(self) -> bool:
        """Whether all points have the required spacing."""
        return not self.least_spacing_over_diagonal < SPACING_ASKED


def layout(points: Floats, extent: Floats, control: Floats) -> Layout | None:
    """Return the distribution of check points; None for equal plan positions.

    `points` are (n, 3) east, north, height of the check points, n at least 1, NaN for unknown heights;
    `extent` (m, 3) are the positions of the block, which define its box and hull; `control` (k, 3).
    """
    own, block = points[:, :2], extent[:, :2]
    low, high = block.min(axis=0), block.max(axis=0)
    diagonal = math.hypot(*(high - low))
    if not diagonal > 0:
        return None
    above = own > (low + high) / 2
    heights, known = (each[np.isfinite(each)] for each in (extent[:, 2], points[:, 2]))
    span = np.ptp(heights) if heights.size else 0.0
    quadrants = np.bincount(above[:, 0] + 2 * above[:, 1], minlength=4) / len(own)
    middles = (np.arange(CELLS) + 0.5) / CELLS
    grid = low + (high - low) * np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    inside = grid[~outside(grid, hull(block))]
    far = _photocore.nearest_points(inside, own, FAR * diagonal) < 0
    return Layout(
        len(own),
        diagonal,
        (float(quadrants[0]), float(quadrants[1]), float(quadrants[2]), float(quadrants[3])),
        _least_spacing(own) / diagonal,
        float(np.mean(far)) if len(inside) else math.nan,
        float(np.ptp(known) / span) if known.size and span > 0 else math.nan,
        int(outside(own, hull(control[:, :2])).sum()) if len(control) else len(own),
    )


def _least_spacing(plan: Floats) -> float:
    if len(plan) < 2:
        return math.nan
    reach = 1.001 * float(np.linalg.norm(np.ptp(plan, axis=0)))
    if not reach > 0:
        return 0.0
    neighbours = _photocore.nearest_points(plan, plan, reach, np.arange(len(plan)))
    return float(np.hypot(*(plan - plan[neighbours]).T).min())
