"""Measurements that do not agree with the others: single pointings, and means of points after the adjustment.

Standard deviations are not known beforehand, so that residuals are judged against those of the other
measurements (externally studentized, :mod:`photogram.statistics`). Outliers of the adjustment are taken out
and the rest adjusted anew until none is left: what the correction is then tells how much harm they do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.case import PlacedCase, exchanged
from photogram.comparator.combined_solution import (
    CombinedLinear,
    CombinedPolynomial,
    combine_linear,
    combine_polynomial,
)
from photogram.comparator.fits import fit_affine, fit_rigid, rotation_matrix
from photogram.comparator.grid import Grid
from photogram.comparator.readings import Case
from photogram.comparator.reduction import Reduction
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.statistics.limits import externally_studentized, studentized_limit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Bools = NDArray[np.bool_]

__all__ = ["FarPointing", "Outlier", "Screening", "far_pointings", "screen"]

ROUNDS = 30
"""Adjustments at most; each takes out what is at least half as far off as the farthest."""
LEAST_POINTS = 6
"""A case keeps so many points, or it is not screened any further."""
LEAST_UM = 1e-3
"""Nothing below a nanometre is an outlier: residuals of measurements without error are rounding."""
MATCH = 0.1
"""A point measured where another is expected is within this part of their distance of it."""


@dataclass(frozen=True)
class FarPointing:
    """A pointing that does not agree with the others of its case.

    Attributes
    ----------
    case, point, row
        Numbers of case and point; which pointing of the case, from 0.
    deviation_um
        From the mean of the point, in the coordinate that is off.
    ratio
        The deviation over its standard deviation, by the other pointings of the case.
    """

    case: int
    point: int
    row: int
    deviation_um: float
    ratio: float


@dataclass(frozen=True)
class Outlier:
    """A measured point that does not agree with the adjustment of the others.

    Attributes
    ----------
    case, point
        Numbers.
    off_um
        Measured less expected comparator coordinates, by the adjustment without outliers.
    ratio
        The residual over its standard deviation when it was taken out.
    instead
        The point of the plate that is expected there; None for none.
    """

    case: int
    point: int
    off_um: tuple[float, float]
    ratio: float
    instead: int | None

    @property
    def distance_um(self) -> float:
        """How far it is off."""
        return math.hypot(*self.off_um)


@dataclass(frozen=True)
class Screening:
    """What the search for outliers of the adjustment found.

    Attributes
    ----------
    outliers
        Case by case, point by point.
    limit
        Of the ratios, for all coordinates together at the level of 5 percent.
    change_um
        How much the outliers change corrected coordinates: root mean square over the measured places, free of
        rotation and translation. 0 without outliers.
    sigma_um
        Standard deviation of unit weight of the adjustment without them.
    ratios
        Of each case, (k, 2): the test values of all its points before any was taken out, without signs.
    freedom
        Degrees of freedom of that adjustment.
    """

    outliers: tuple[Outlier, ...]
    limit: float
    change_um: float
    sigma_um: float
    ratios: tuple[Floats, ...]
    freedom: float

    @property
    def harmful(self) -> bool:
        """Whether outliers falsify corrected coordinates by more than a coordinate is uncertain."""
        return self.change_um > self.sigma_um


def far_pointings(cases: Sequence[Case]) -> list[FarPointing]:
    """Find pointings that do not agree with the others of their case.

    Each deviates from the mean of its point (of its leg, where legs were measured); deviations in x and in y
    of a case have one standard deviation each.
    """
    tests = 2 * sum(len(case.points) for case in cases)
    found = []
    for case in cases:
        _, group, counts = np.unique(
            np.column_stack([case.points, case.legs]), axis=0, return_inverse=True, return_counts=True
        )
        group = group.ravel()
        freedom = len(group) - len(counts)
        offsets = case.xy_um - case.xy_um[0]
        sums = np.column_stack([np.bincount(group, weights=column) for column in offsets.T])
        deviations = offsets - (sums / counts[:, np.newaxis])[group]
        redundancy = (1 - 1 / counts)[group]
        limit = studentized_limit(freedom, tests)
        ratios = np.zeros_like(deviations)
        repeated = redundancy > 0
        for axis, own in enumerate(deviations.T):
            w = own[repeated] / np.sqrt(redundancy[repeated])
            ratios[repeated, axis] = externally_studentized(w, float(own @ own), freedom)
        ratios[np.abs(deviations) <= LEAST_UM] = 0.0
        worst = np.abs(ratios).argmax(axis=1)
        rows = np.arange(len(worst))
        for row in np.flatnonzero(np.abs(ratios[rows, worst]) > limit).tolist():
            deviation, ratio = float(deviations[row, worst[row]]), float(ratios[row, worst[row]])
            found.append(FarPointing(case.number, int(case.points[row]), row, deviation, abs(ratio)))
    return found


def screen(
    cases: Sequence[PlacedCase],
    stage: CombinedLinear | CombinedPolynomial,
    grids: Mapping[int, Grid],
) -> Screening:
    """Find measured points that do not agree with the adjustment of the others, in the last stage."""
    kept = list(cases)
    removed: list[tuple[int, int, float]] = []
    clean, limit = stage, math.inf
    first: tuple[tuple[Floats, ...], float] | None = None
    for _ in range(ROUNDS):
        tests, freedom = _ratios(kept, clean)
        first = first or (tuple(tests), freedom)
        ratios = [own.max(axis=1) for own in tests]
        limit = studentized_limit(freedom, 2 * sum(len(own) for own in ratios))
        worst = max(float(own.max()) for own in ratios)
        if not worst > limit:
            break
        chosen = [own >= max(limit, worst / 2) for own in ratios]
        remaining = [_without(case, out) for case, out in zip(kept, chosen, strict=True)]
        if min(len(case.points) for case in remaining) < LEAST_POINTS:
            break
        try:
            clean = _adjust(remaining, with_polynomial=isinstance(stage, CombinedPolynomial))
        except AdjustmentError:
            break
        for k, (case, own, out) in enumerate(zip(kept, ratios, chosen, strict=True)):
            removed += [(k, int(case.points[row]), float(own[row])) for row in np.flatnonzero(out)]
        kept = remaining
    outliers = tuple(
        _outlier(cases[k], grids[cases[k].case.plate], clean, k, point, ratio)
        for k, point, ratio in sorted(removed)
    )
    change = _change(stage, clean, cases) if outliers else 0.0
    assert first is not None
    return Screening(outliers, limit, change, clean.sigma0_um, *first)


def _ratios(
    cases: Sequence[PlacedCase], stage: CombinedLinear | CombinedPolynomial
) -> tuple[list[Floats], float]:
    """Return externally studentized residuals of each case, (k, 2) without signs.

    And the degrees of freedom: the trace of R R^T.
    """
    reduction = Reduction.of(stage)
    residuals = np.vstack([fit.residuals.comparator_um for fit in stage.cases])
    left = reduction.variances()
    checked = left > 1e-6
    w = np.divide(residuals, np.sqrt(np.maximum(left, 0.0)), out=np.zeros_like(residuals), where=checked)
    freedom = reduction.squares_of_units()
    ratios = externally_studentized(w, float((residuals**2).sum()), freedom)
    ratios[~checked | (np.abs(residuals) <= LEAST_UM) | np.isnan(ratios)] = 0.0
    ends = np.cumsum([len(case.points) for case in cases])[:-1]
    return np.split(np.abs(ratios), ends), freedom


def _without(case: PlacedCase, out: Bools) -> PlacedCase:
    keep = ~out
    return replace(
        case,
        readings=[own for own, stays in zip(case.readings, keep.tolist(), strict=True) if stays],
        points=case.points[keep],
        counts=case.counts[keep],
        means_um=case.means_um[keep],
        grid_um=case.grid_um[keep],
    )


def _adjust(cases: Sequence[PlacedCase], *, with_polynomial: bool) -> CombinedLinear | CombinedPolynomial:
    fits = [fit_affine(case.points, case.means_um, case.grid_um) for case in cases]
    linear = combine_linear(cases, fits)
    return combine_polynomial(cases, linear) if with_polynomial else linear


def _outlier(
    case: PlacedCase,
    grid: Grid,
    stage: CombinedLinear | CombinedPolynomial,
    index: int,
    point: int,
    ratio: float,
) -> Outlier:
    """Compare a measured point with where the adjustment of the others expects it and its neighbours."""
    fit = stage.cases[index]
    row = int(np.flatnonzero(case.points == point)[0])
    found = stage.correction.apply(case.means_um[row : row + 1])[0]
    plate = exchanged(grid.xy_um, case.orientation.left_handed)
    expected = (plate - fit.translation_um) @ rotation_matrix(fit.rotation_rad)
    own = expected[int(np.flatnonzero(grid.points == point)[0])]
    nearest = int(np.hypot(*(expected - found).T).argmin())
    near = math.dist(expected[nearest], found) < MATCH * math.dist(expected[nearest], own)
    off = found - own
    return Outlier(
        case.number,
        point,
        (float(off[0]), float(off[1])),
        ratio,
        int(grid.points[nearest]) if near else None,
    )


def _change(
    stage: CombinedLinear | CombinedPolynomial,
    clean: CombinedLinear | CombinedPolynomial,
    cases: Sequence[PlacedCase],
) -> float:
    """Root mean square by which two corrections differ at the measured places, rotation and shift apart."""
    places = np.vstack([case.means_um for case in cases])
    numbers = np.arange(len(places))
    with_them, without = stage.correction.apply(places), clean.correction.apply(places)
    residuals = fit_rigid(numbers, with_them, without).residuals.grid_um
    return math.sqrt(float((residuals**2).mean()))
