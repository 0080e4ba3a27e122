"""Accuracy figures of check points by component, horizontal and 3D.

RMSE of n differences is the root of their mean square and includes a bias. Horizontal figures use points with
both plan coordinates, 3D figures points with all three.
"""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.results.statement.comparison import PARTS, Compared
from photogram.results.statement.honest import (
    Bias,
    PointTests,
    Prediction,
    Surface,
    bias,
    point_tests,
    prediction,
    surface,
)
from photogram.statistics.distributions import critical_normal, critical_student
from photogram.statistics.error_radii import (
    circular_error,
    mixture_circular,
    mixture_linear,
    sample_radius,
    upper_order,
)

PROBABILITIES = (0.9, 0.95)
INSIDE = 0.95


@dataclass(frozen=True)
class Sized:
    """Differences of a component (`e`, `n`, `h`), or radial (`plan`, `all`)."""

    n: int  # Number of differences
    # Of components; NaN for radial figures; the sd is NaN for one point
    mean: float
    sd: float
    rmse: float  # Root mean square
    # The largest difference and its point
    largest: float
    point: str


@dataclass(frozen=True)
class Radius:
    # k = ceil(p n), and the k-th smallest: NaN without points
    order: int
    sample: float
    # Order statistic that exceeds the quantile with 95 percent probability if points are independent; None
    # if there are too few
    upper_order: int | None
    upper: float | None


@dataclass(frozen=True, eq=False)
class Figures:
    n: int  # Number of points
    parts: dict[str, Sized | None]  # By `e`, `n`, `h`, `plan`, `all`
    # In plan (radial) and height; 1: of differences, 2: of the survey
    rmse_h1: float
    rmse_v1: float
    rmse_h2: float
    rmse_v2: float
    prediction: dict[str, Prediction | None]  # By part; see :mod:`photogram.results.statement.honest`
    bias: dict[str, Bias | None]  # By component
    points: PointTests  # Tests of single points
    inside: dict[str, int]  # Number of points inside 95 percent in height, and in space
    radii: dict[str, Radius | None]  # `ce90`, `le90`, `ce95`, `le95` of the sample
    # (2, 2) `sum d d' / n` in plan, and the same radii from moments, the bias inside
    moments: Floats
    of_moments: dict[str, float]
    # `ce90`, `le90` from s2 Q_ii: the mean probability of the points is 90 percent
    mixture: dict[str, float]
    surface: Surface | None  # Of the heights

    @property
    def rmse_h(self) -> float:
        """`sqrt(RMSE_H1^2 + RMSE_H2^2)`."""
        return math.hypot(self.rmse_h1, self.rmse_h2)

    @property
    def rmse_v(self) -> float:
        """`sqrt(RMSE_V1^2 + RMSE_V2^2)`."""
        return math.hypot(self.rmse_v1, self.rmse_v2)

    @property
    def rmse_3d(self) -> float:
        """`sqrt(RMSE_H^2 + RMSE_V^2)`."""
        return math.hypot(self.rmse_h, self.rmse_v)

    def without_survey(self, part: str) -> float:
        """Return `sqrt(RMSE_1^2 - RMSE_2^2)` of `h` or `v`; NaN below the survey."""
        first, second = (self.rmse_h1, self.rmse_h2) if part == "h" else (self.rmse_v1, self.rmse_v2)
        square = first**2 - second**2
        return math.sqrt(square) if square >= 0 else math.nan


def figures(found: Compared, coverage: float = 0.95) -> Figures | None:
    """Return figures of check points, and biases with uncertainties, or None."""
    if not len(found):
        return None
    k = critical_student(1.0 - coverage, found.second)
    d = np.where(found.counted, found.differences, np.nan)
    plan, heights = np.hypot(d[:, 0], d[:, 1]), d[:, 2]
    sizes = dict(zip(PARTS, (*d.T, plan, np.sqrt((d**2).sum(axis=1))), strict=True))
    in_plan, in_height = np.isfinite(plan), np.isfinite(heights)
    # Survey relative to datum: errors that cancel in the differences also count.
    survey, own = found.survey_sd**2 + found.common_sd**2, d[in_plan, :2]
    moments = own.T @ own / len(own) if len(own) else np.full((2, 2), np.nan)
    of_moments, finite = dict[str, float](), np.isfinite(moments).all()
    for p in PROBABILITIES:
        circular = float(circular_error(moments[np.newaxis], p)[0]) if finite else math.nan
        linear = root_mean(heights**2) * critical_normal(1.0 - p)
        of_moments |= {f"ce{round(100 * p)}": circular, f"le{round(100 * p)}": linear}
    blocks = found.blocks(found.product)
    ellipses, sd = blocks[in_plan, :2, :2], np.sqrt(blocks[in_height, 2, 2])
    tests = point_tests(found)
    return Figures(
        n=len(found),
        parts={part: _sized(own, found.names, radial=part in ("plan", "all")) for part, own in sizes.items()},
        rmse_h1=root_mean(plan**2),
        rmse_v1=root_mean(heights**2),
        rmse_h2=root_mean(np.where(in_plan, survey[:, 0] + survey[:, 1], np.nan)),
        rmse_v2=root_mean(np.where(in_height, survey[:, 2], np.nan)),
        prediction={part: prediction(found, part) for part in PARTS},
        bias={part: bias(found, part, k) for part in ("e", "n", "h")},
        points=tests,
        inside=_inside(tests, in_height),
        radii=_radii(plan[in_plan], np.abs(heights[in_height])),
        moments=moments,
        of_moments=of_moments,
        mixture={
            "ce90": mixture_circular(ellipses, 0.9) if len(ellipses) else math.nan,
            "le90": mixture_linear(sd, 0.9) if len(sd) else math.nan,
        },
        surface=surface(found),
    )


def _sized(values: Floats, names: tuple[str, ...], *, radial: bool = False) -> Sized | None:
    own = np.flatnonzero(np.isfinite(values))
    if not len(own):
        return None
    some = values[own]
    worst = int(own[np.argmax(np.abs(some))])
    mean = math.nan if radial else float(some.mean())
    sd = math.nan if radial or len(own) < 2 else float(some.std(ddof=1))
    return Sized(len(own), mean, sd, root_mean(some**2), float(abs(values[worst])), names[worst])


def root_mean(squares: Floats) -> float:
    """Return the root mean of known values; NaN without any."""
    known = squares[np.isfinite(squares)]
    return math.sqrt(float(known.mean())) if known.size else math.nan


def _inside(tests: PointTests, in_height: np.ndarray) -> dict[str, int]:
    limits = {
        k: _photocore.chi_square_quantile(1 - INSIDE, k, upper=True)
        for k in np.unique(tests.dimension[tests.dimension > 0]).tolist()
    }
    of_points = np.array([limits.get(k, math.nan) for k in tests.dimension.tolist()])
    one = math.sqrt(_photocore.chi_square_quantile(1 - INSIDE, 1, upper=True))
    with np.errstate(invalid="ignore"):
        return {
            "h": int((np.abs(tests.normalised[:, 2]) <= one)[in_height].sum()),
            "three": int((of_points >= tests.T).sum()),
        }


def _radii(plan: Floats, heights: Floats) -> dict[str, Radius | None]:
    found: dict[str, Radius | None] = {}
    for p in PROBABILITIES:
        for name, values in (("ce", plan), ("le", heights)):
            upper = upper_order(len(values), p) if len(values) else None
            largest = None if upper is None else float(np.sort(values)[upper - 1])
            own = Radius(*sample_radius(values, p), upper, largest) if len(values) else None
            found[f"{name}{round(100 * p)}"] = own
    return found
