"""The options of an adjustment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from photogram.arguments.fields import Checked, option
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.adjustment.robust import Loss
    from photogram.network.datum import InnerConstraints, MinimumConstraints

DatumName = Literal["control", "minimum", "inner"]
UnitVariance = Literal["free", "constrained", "unity", "redundancy"]
CurrentVariance = Literal["constrained", "unity", "redundancy"]  # Without the default of the 1987 program
LossOrNone = Literal["none", "huber", "cauchy"]
Ordering = Literal["auto", "input", "rcm", "amd", "dissection", "graph-dissection"]


@dataclass(frozen=True)
class AsPublished:
    """The iteration of the 1987 program (GIANT guide, section 6).

    Attributes
    ----------
    percent
        Convergence limit: relative change of the weighted sum of squares between iterations, percent.
    """

    percent: float = 5.0


@dataclass(frozen=True, kw_only=True)
class AdjustOptions(Checked):
    """Options of :func:`photogram.adjust`, of a project, and of `photogram adjust`.

    Attributes
    ----------
    datum
        Datum of a free block: `minimum` constraints or `inner` constraints, or their points and photos
        (:class:`photogram.InnerConstraints`, :class:`photogram.MinimumConstraints`); see docs/datum.md. None:
        minimum constraints, selected if nothing else defines the datum. `control` in a project requires a
        datum of control.
    unit_variance
        Basis of the variance of unit weight. `constrained`: every weighted quantity is an observation.
        `unity`: the variance is 1. `redundancy`: redundancy numbers of image coordinates, control and
        additional observations (docs/weights.md). `free`, the default of the 1987 program (GIANT guide,
        Appendix E): image coordinates and ground control only; too large if photos or cameras are weighted.
        Covariances are scaled by the variance.
    loss
        Robust loss of image coordinates: `huber` or `cauchy`, of both coordinates of an image point together.
        None: least squares. `("huber", 2.0)` also specifies the scale in a-priori standard deviations,
        otherwise 1.50 for `huber` and 2.55 for `cauchy`. Variance, covariances and redundancy numbers refer
        to the weights modified by the loss (`image_weights`).
    covariance
        Whether to compute covariances, redundancy numbers and standardized residuals. `verdict`: a verdict or
        report will follow. The adjustment then takes about 5 % longer and stores data for the tests, if there
        is enough memory. This requires convergence, no loss and no inner constraints.
    tolerance
        Convergence limit: largest change of an unknown, as a fraction of its standard deviation (a-priori
        unit weight). The iteration also ends if the convergence rate predicts less than a tenth of it. A step
        that increases the sum of squares is damped (Levenberg-Marquardt). `AsPublished`: the criterion of the
        1987 program.
    max_iterations
        Maximum number of iterations. None: 50; 200 with a loss, which needs reweighting, or with free camera
        parameters, which converge slowly in weak networks; 400 with a splined lens, whose knots may depend on
        their priors only; 4 for `AsPublished`.
    ordering
        Elimination order of photos: input order, narrow band (reverse Cuthill-McKee), approximate minimum
        degree, nested dissection by positions, or by ties only. `auto` selects the order with the least
        predicted work.
    max_bias_ratio
        As in :meth:`photogram.Result.with_max_bias_ratio`; None: the default.

    Examples
    --------
    >>> from photogram import AdjustOptions, adjust, simulate
    >>> block = simulate(strips=1, photos_per_strip=3, seed=1).block
    >>> adjust(block, AdjustOptions(unit_variance="unity"), max_iterations=20).converged
    True
    """

    datum: DatumName | InnerConstraints | MinimumConstraints | None = option(None, kind=DatumName)
    unit_variance: UnitVariance = option("constrained", kind=CurrentVariance)
    loss: Loss | None = option(None, kind=LossOrNone, parse=lambda name: None if name == "none" else name)
    covariance: bool | Literal["verdict"] = True
    tolerance: float | AsPublished = 1e-5
    max_iterations: int | None = option(None, 1, name="--iterations")
    ordering: Ordering = "auto"
    max_bias_ratio: float | None = option(None, 0.0, is_open=True)

    def __post_init__(self) -> None:
        from photogram.adjustment.robust import loss_row
        from photogram.arguments.arrays import number, truth_value
        from photogram.arguments.objects import require
        from photogram.network.datum import check_datum

        super().__post_init__()
        loss_row(self.loss)
        check_datum(self.constraints)
        if not (isinstance(self.covariance, str) and self.covariance == "verdict"):
            truth_value("covariance", self.covariance)
        limit = self.tolerance.percent if isinstance(self.tolerance, AsPublished) else self.tolerance
        require(number("tolerance", limit) > 0, "tolerance", "positive", value=limit)

    @property
    def constraints(self) -> InnerConstraints | MinimumConstraints | None:
        """The constraints of the datum; None if observations define it, or minimum constraints if needed."""
        from photogram.network.datum import InnerConstraints, MinimumConstraints

        if self.datum == "inner":
            return InnerConstraints()
        if self.datum == "minimum":
            return MinimumConstraints()
        return None if self.datum == "control" else self.datum
