"""Where the errors come from: the analysis of variance (NOAA TR NOS 57, equations 66 to 68, figure 30)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.comparator.combined_solution import CombinedLinear, CombinedPolynomial
    from photogram.comparator.pointing import Precision
    from photogram.comparator.rigid import RigidFit

__all__ = ["AxisSigma", "VarianceAnalysis", "analyse_variance", "difference"]

NM = 1000.0


@dataclass(frozen=True)
class AxisSigma:
    """Standard deviations of x, of y, and their root mean square, micrometres."""

    x: float
    y: float

    @property
    def total(self) -> float:
        """Root mean square of both axes."""
        return math.sqrt((self.x**2 + self.y**2) / 2)

    def truncated(self) -> AxisSigma:
        """Return both cut to whole nanometres, as SIGX and SIGY in the INTEGER array CAL of the listing."""
        return AxisSigma(math.floor(self.x * NM) / NM, math.floor(self.y * NM) / NM)


@dataclass(frozen=True)
class VarianceAnalysis:
    """The lines of figure 30, standard deviations in micrometres.

    Attributes
    ----------
    before
        Of the free adjustments: everything.
    after_linear, after_nonlinear
        What the linear parameters leave; what the polynomials leave (None without).
    pointing
        Of a mean.
    grid
        Of a grid coordinate.
    linear, nonlinear, random
        Their shares; 0 where the difference of variances is negative (`negative` names it).
    negative
        Names of the components whose estimated variance is negative.
    """

    before: AxisSigma
    after_linear: AxisSigma
    after_nonlinear: AxisSigma | None
    pointing: AxisSigma
    grid: float
    linear: float
    nonlinear: float
    random: float
    negative: tuple[str, ...]

    @property
    def components_um(self) -> dict[str, float]:
        """Standard deviations by component (equation 66)."""
        return {
            "linear": self.linear,
            "nonlinear": self.nonlinear,
            "grid": self.grid,
            "pointing": self.pointing.total,
            "random": self.random,
            "total": self.before.total,
        }


def difference(total: float, *parts: float) -> tuple[float, bool]:
    """Return the root of total^2 less squares of the parts (0 if negative), and whether it was."""
    variance = total**2 - sum(part**2 for part in parts)
    return math.sqrt(max(0.0, variance)), variance < 0


def analyse_variance(
    free: Sequence[RigidFit],
    linear: CombinedLinear,
    nonlinear: CombinedPolynomial | None,
    pointing: Precision,
    grid_um: float,
    *,
    as_listed: bool = False,
) -> VarianceAnalysis:
    """Split the total error into linear, nonlinear, grid, pointing and random.

    Parameters
    ----------
    free
        The free adjustments of the measurements.
    linear, nonlinear
        The combined adjustments; without polynomials the nonlinear share is 0.
    pointing
        Pooled precision of all pointings (equation 30).
    grid_um
        Standard deviation of a grid coordinate.
    as_listed
        Cut the sigmas after the linear stage (SIGX, SIGY) to whole nanometres first: the listing takes them
        back from the INTEGER array of its cards, those after the nonlinear stage it still has.
    """
    before = _pooled(free, sum(len(fit.residuals.points) - 1.5 for fit in free))
    # nu of equation 57 counts both axes.
    after_linear = _pooled(linear.cases, linear.degrees_of_freedom / 2)
    after = AxisSigma(*nonlinear.sigma_um) if nonlinear else None
    if as_listed:
        after_linear = after_linear.truncated()
    last = after or after_linear
    means = pointing.mean_sd_um if pointing.degrees_of_freedom > 0 else (0.0, 0.0)
    mean_pointing = AxisSigma(*means)
    shares = {
        "linear": difference(before.total, after_linear.total),
        "nonlinear": difference(after_linear.total, last.total),
        "random": difference(last.total, grid_um, mean_pointing.total),
    }
    return VarianceAnalysis(
        before=before,
        after_linear=after_linear,
        after_nonlinear=after,
        pointing=mean_pointing,
        grid=grid_um,
        linear=shares["linear"][0],
        nonlinear=shares["nonlinear"][0],
        random=shares["random"][0],
        negative=tuple(name for name, (_, negative) in shares.items() if negative),
    )


def _pooled(fits: Sequence[RigidFit], dof: float) -> AxisSigma:
    squares = np.array([fit.residuals.squares_um2[:2] for fit in fits]).sum(axis=0) / dof
    return AxisSigma(math.sqrt(squares[0]), math.sqrt(squares[1]))
