"""Results of all adjustments: arrays, covariances, test values."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import MISSING
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.arrays import finite_rows, freeze_fields, number, standard_deviations
from photogram.arguments.equality import Valued
from photogram.arguments.types import Floats, Indices
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, fields, replace
from photogram.messages import Message
from photogram.network.core_arrays import CoreNetwork, CoreOptions
from photogram.network.motion import Given
from photogram.results.covariance import Adjusted, Covariances, Failure, Propagated, Selection
from photogram.results.parts import Iteration, Observed
from photogram.show.methods import Documented, Judged
from photogram.statistics.limits import GlobalTest, global_test
from photogram.statistics.reliability import standardized
from photogram.summaries import Rows
from photogram.words import phrase

if TYPE_CHECKING:
    import pandas as pd

    from photogram.io.writing import Content
    from photogram.plots import Plots
    from photogram.results.hypotheses import Hypotheses
    from photogram.results.network_trial import NetworkTrial
    from photogram.results.parts import Terms
    from photogram.results.reliability import Reliability, ReliabilitySummary
    from photogram.statistics.findings import Removed

JUDGED = 100_000  # Largest number of images for which `repr` shows the verdict
REMARKS = 5  # Number of messages of a `repr`
LEVEL, POWER = 0.001, 0.80  # Significance level and power of minimal detectable errors
MAX_BIAS_RATIO = 5.0  # Permitted effect of undetected errors on points, in standard deviations


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class AdjustedNetwork(Valued, Judged, Documented, ABC):
    """An adjusted network of P photos with k unknowns, n points and m image points.

    All arrays are in the order of the input. Values that were excluded from the adjustment are NaN. Residuals
    are observed minus computed. Cofactors refer to a priori unit weight; covariances are cofactors times the
    variance of unit weight. Arrays are read-only.

    Attributes
    ----------
    status
        `converged`, `not converged` or `diverged`.
    messages
        Messages that did not stop the adjustment.
    loss
        Name and scale of the robust loss of the image points; None for least squares.
    initial_weighted_sum_of_squares, iterations
        The history; with a loss, sums of losses.
    degrees_of_freedom, variance_of_unit_weight
        The variance is None without degrees of freedom; covariances are then scaled by 1. Degrees of freedom
        are a whole number unless the unit variance is based on redundancy numbers.
    photo_cofactors
        (P, k, k).
    photo_redundancy
        (P, k) redundancy numbers of weighted unknowns as observations; 0 unless weighted.
    point_positions
        (n, 3) adjusted.
    point_cofactors
        (n, 3, 3).
    point_redundancy
        (n, 3) redundancy numbers of weighted coordinates as observations; 0 unless weighted.
    point_rays
        (n,) number of images; 0 for excluded points.
    residuals
        (m, 2) in the unit of the image coordinates.
    redundancy
        (m, 2) redundancy numbers.
    standardized
        (m, 2) residual / (standard deviation x root of redundancy number), a priori unit weight (Baarda's w);
        NaN without redundancy.
    image_weights
        (m,) weight factors of image points by the loss; 1 without a loss.
    ordering, predictions
        The used ordering of photos, and the predicted multiply-adds of one factorisation for each tested
        ordering; NaN if the network is too large for an ordering.
    operations, formations, seconds
        Predicted multiply-adds of each phase, the number of formations of the normal equations, and the
        duration of each phase in seconds.
    options, state
        Options and final state of the core, from which covariances are computed.
    snooped
        The observations that data snooping removed before; None without data snooping.
    max_bias_ratio
        Standard deviations from which on an undetected error of a point counts for the verdict; see
        :meth:`with_max_bias_ratio`.
    """

    status: str
    messages: list[Message]
    loss: tuple[str, float] | None
    initial_weighted_sum_of_squares: float
    iterations: list[Iteration]
    degrees_of_freedom: float
    variance_of_unit_weight: float | None
    photo_cofactors: Floats
    photo_redundancy: Floats
    point_positions: Floats
    point_cofactors: Floats
    point_redundancy: Floats
    point_rays: Indices
    residuals: Floats
    redundancy: Floats
    standardized: Floats
    image_weights: Floats
    ordering: str
    predictions: Mapping[str, float]
    operations: Mapping[str, float]
    formations: int
    seconds: Mapping[str, float]
    options: CoreOptions
    state: _photocore.BlockState
    snooped: Removed | None = None
    max_bias_ratio: float = MAX_BIAS_RATIO

    def __post_init__(self) -> None:
        freeze_fields(self)

    _BESIDE: ClassVar[frozenset[str]] = frozenset(
        {"seconds", "operations", "predictions", "formations", "state"}
    )

    def brief(self) -> tuple[str, Rows]:
        """Return a summary of the adjustment for its `repr` and notebooks."""
        from photogram.show.page import about, significant  # only required for a summary

        used = self.used_images
        rms = np.sqrt((self.residuals[used] ** 2).mean(axis=0)) if used.any() else np.zeros(2)
        s0 = self.variance_of_unit_weight
        x, y = rms.tolist()
        points = {"n": int(self.used_points.sum()), "all": len(self.point_rays)}
        rows = [
            ("status", about("brief.status", status=self.status, n=len(self.iterations))),
            ("photos", about("count", n=len(self.photo_cofactors))),
            ("points", about("brief.used", **points)),
            ("images", about("brief.used", n=int(used.sum()), all=len(used))),
            ("residuals", about("brief.residuals", x=x, y=y, unit=self.given.image_unit)),
            ("freedom", about("brief.freedom", n=self.degrees_of_freedom)),
            ("sigma0", about("brief.a-priori") if s0 is None else significant(math.sqrt(s0), 4)),
        ]
        # Tests of many observations require some time.
        if len(used) <= JUDGED:
            rows.insert(0, ("verdict", self.verdict.headline))
        if self.loss is not None:
            rows.append(("loss", about("loss", name=self.loss[0], scale=self.loss[1])))
        rows += [("remark", str(message).splitlines()[0]) for message in self.messages[:REMARKS]]
        if len(self.messages) > REMARKS:
            rows.append(("", about("brief.more-remarks", n=len(self.messages) - REMARKS)))
        rows.append(("see", ".report(), .plot, .photo_table(), .point_table(), .image_table(), .to_json()"))
        title, kind = getattr(self.given, "title", ""), type(self.given).__name__.lower()
        return about(f"brief.{kind}", title=f": {title}" if title else ""), rows

    @property
    @abstractmethod
    def given(self) -> Given: ...

    @classmethod
    def taken_over(cls, solution: _photocore._NetworkSolution, **found: Any) -> Self:
        """Copy the attributes of a solution of the core, except those in `found`."""
        found["initial_weighted_sum_of_squares"] = solution.initial_sum_of_squares
        found["iterations"] = [Iteration(*row) for row in solution.iterations]
        given = [each.name for each in fields(cls) if each.name not in found and each.default is MISSING]
        return cls(**found, **{name: getattr(solution, name) for name in given})

    @property
    def geographic(self) -> bool:
        """Whether plan coordinates are angles."""
        return self.given.geographic

    @property
    @abstractmethod
    def sum_and_freedom(self) -> tuple[float, float]: ...

    @property
    def known_weight(self) -> bool:
        """Whether standard deviations are given, so that the unit weight is known."""
        return True

    @property
    def global_test(self) -> GlobalTest | None:
        """The test of all residuals together; None without degrees of freedom."""
        return global_test(*self.sum_and_freedom)

    @property
    @abstractmethod
    def _terms(self) -> Terms: ...

    @abstractmethod
    def _plot_data(self) -> Any: ...

    @abstractmethod
    def _trial(self) -> NetworkTrial: ...

    @abstractmethod
    def _core_network(self) -> CoreNetwork: ...

    def _factor(self) -> _photocore.BlockCovariances:
        return self._core_network().covariances(self.state, threads=0, progress=None)

    @property
    def covariance_scale(self) -> float:
        """The scale of covariances: the variance of unit weight, or 1 without one."""
        return 1.0 if self.variance_of_unit_weight is None else self.variance_of_unit_weight

    @property
    def photo_covariances(self) -> Floats:
        """(P, k, k) covariances of photo unknowns, scaled by the unit weight variance.

        Blocks have k = 6: X, Y, Z in the linear unit (longitude and latitude in radians, height), then omega,
        phi, kappa in radians. These angles are the numbers of `photo_attitudes` with the definition by
        `block.photo_to_ground`; `Result.photo_rotation_covariances` uses rotation vectors. Collections have
        the parameters `collection.parameters`, in their order.
        """
        return self.photo_cofactors * self.covariance_scale

    @property
    def point_covariances(self) -> Floats:
        """(n, 3, 3) covariances, scaled by the variance of unit weight."""
        return self.point_cofactors * self.covariance_scale

    @property
    def photo_sd(self) -> Floats:
        """(P, k) standard deviations of the unknowns of photos."""
        return standard_deviations(self.photo_cofactors, self.covariance_scale)

    @property
    def point_sd(self) -> Floats:
        """(n, 3) standard deviations."""
        return standard_deviations(self.point_cofactors, self.covariance_scale)

    @abstractmethod
    def _adjusted(self) -> Adjusted: ...

    @abstractmethod
    def _refused(self, error: Failure) -> Exception: ...

    def covariances(self) -> Covariances:
        """Return an object that computes covariances between any unknowns from one factor.

        The normal equations are formed and factored once, at the adjusted values. The object contains the
        factor, and deleting the object releases its memory.

        Raises
        ------
        AdjustmentError
            If unknowns are not determined.
        OutOfMemoryError
            If the memory is not sufficient for the factor.
        KeyboardInterrupt
            If the user presses Ctrl-C.
        """
        return Covariances(self._adjusted(), self._factor, self._refused, self.covariance_scale)

    def covariance(self, a: Selection, b: Selection | None = None) -> Floats:
        """Return the covariance matrix of a selection, or between two selections.

        For several selections use one object of :meth:`covariances`, which describes selections and errors.
        """
        return self.covariances().covariance(a, b)

    def propagate(
        self, function: Callable[..., Any], unknowns: Selection, *, bias: bool = False
    ) -> Propagated:
        """Return a function of unknowns with covariance; see `Covariances.propagate`."""
        return self.covariances().propagate(function, unknowns, bias=bias)

    def reliability(
        self, *, level: float = LEVEL, power: float = POWER, unit_weight: str = "known"
    ) -> Reliability:
        """Return detectable gross errors and effects of others (docs/blunders.md).

        The computation requires a factorisation and a selected inverse at the adjusted values. With a robust
        loss it adjusts by least squares, without observations whose weight the loss reduces to less than 0.1.

        Parameters
        ----------
        level, power
            Significance level and power of the test of an observation: alpha0, beta0.
        unit_weight
            `known`, or `unknown`: estimated by the adjustment, which makes errors harder to detect.

        Raises
        ------
        InputError
            If an option is invalid.
        OutOfMemoryError, KeyboardInterrupt
            As in :meth:`covariances`.
        """
        from photogram.results.reliability import Reliability, downweighted

        trial, lost = self._trial(), None
        if self.loss is not None:
            lost = downweighted(trial, self._terms, self.image_weights, self.used_images)
            trial.out = lost.out
        return Reliability(trial, self.covariances, lost, level=level, power=power, unit_weight=unit_weight)

    @property
    @abstractmethod
    def reliability_summary(self) -> ReliabilitySummary | None:
        """The reliability summary of reports, with tests of all groups.

        None without redundancy numbers or convergence.
        """

    def _hypothesis_facts(self) -> dict[str, Any]:
        """Return additional facts for hypotheses; empty by default."""
        return {}

    def _hypotheses(self) -> Hypotheses:
        summary = self.reliability_summary
        if summary is None:
            raise AdjustmentError(phrase("hypothesis.untested"))
        return summary.hypotheses

    def hypotheses(self) -> pd.DataFrame:
        """Return errors of sets and observations with tests as a data frame.

        A row for each hypothesis: code, name, number of parameters, statistic T, p, log odds against no
        error, and the estimated error in the units of the observations.

        Raises
        ------
        AdjustmentError
            If the adjustment has not converged or has no redundancy.
        """
        return self._hypotheses().tests().frame()

    def external_reliability(self) -> pd.DataFrame:
        """Return effects of undetected errors as a data frame, a row for each hypothesis.

        Columns are the redundancy, the minimal detectable bias (MDB), and its largest effect on any function
        of the unknowns in standard deviations. They also include the number of points that it moves by more
        than `max_bias_ratio` standard deviations, and the largest change of a point.

        Raises
        ------
        AdjustmentError
            As in :meth:`hypotheses`.
        """
        return self._hypotheses().external_reliability().frame()

    def with_max_bias_ratio(self, ratio: float | None) -> Self:
        """Return the result with a verdict that permits larger or smaller effects of undetected errors.

        Parameters
        ----------
        ratio
            Standard deviations from which on an undetected error of a point counts; None: unchanged. If such
            an error moves too many points, the verdict is `accepted-not-checked` (docs/tests.md).

        Raises
        ------
        InputError
            If the ratio is not a positive number.
        """
        if ratio is None:
            return self
        return replace(self, max_bias_ratio=number("max_bias_ratio", ratio, "positive"))

    @property
    def image_points(self) -> Indices:
        """(m,) the point of each image."""
        return self.given.image_points

    @property
    def image_given_sd(self) -> Floats:
        """(m, 2) standard deviations a priori of the image coordinates."""
        return self.given.image_sd

    @property
    @abstractmethod
    def photo_residuals(self) -> Floats: ...

    @property
    @abstractmethod
    def photo_given_sd(self) -> Floats: ...

    @property
    def point_differences(self) -> Floats:
        """(n, 3) adjusted minus given coordinates; NaN if not given."""
        return self.point_positions - self.given.point_positions

    @property
    def point_residuals(self) -> Floats:
        """(n, 3) observed minus adjusted weighted components; 0 if fixed, NaN if free."""
        return np.where(np.isfinite(self.point_given_sd), -self.point_differences, np.nan)

    @property
    def point_given_sd(self) -> Floats:
        """(n, 3) a priori sd of coordinates: infinite if free, zero if fixed."""
        return self.given.point_sd

    @property
    def photo_standardized(self) -> Floats:
        """(P, k) `photo_residuals` / (sd x root of redundancy number); NaN unless weighted."""
        return standardized(self.photo_residuals, self.photo_given_sd, self.photo_redundancy)

    @property
    def point_standardized(self) -> Floats:
        """(n, 3) `point_residuals` / (sd x root of redundancy number); NaN unless weighted."""
        return standardized(self.point_residuals, self.point_given_sd, self.point_redundancy)

    @property
    def stations(self) -> Observed:
        """Photos with a weighted or fixed unknown, as observations of their unknowns."""
        rows = np.flatnonzero(np.isfinite(self.photo_given_sd).any(axis=1))
        parts = (self.photo_residuals, self.photo_given_sd, self.photo_redundancy, self.photo_standardized)
        return Observed(rows, *(part[rows] for part in parts))

    @property
    def control(self) -> Observed:
        """Used points with a weighted or fixed coordinate, as observations."""
        rows = np.flatnonzero(self.used_points & np.isfinite(self.point_given_sd).any(axis=1))
        parts = (self.point_residuals, self.point_given_sd, self.point_redundancy, self.point_standardized)
        return Observed(rows, *(part[rows] for part in parts))

    @property
    def used_points(self) -> NDArray[np.bool_]:
        """(n,) whether a point was used."""
        return self.point_rays > 0

    @cached_property
    def used_images(self) -> NDArray[np.bool_]:
        """(m,) whether an image was used."""
        taken: NDArray[np.bool_] = self.used_points[self.image_points] & finite_rows(self.residuals)
        taken.flags.writeable = False
        return taken

    @property
    def converged(self) -> bool:
        """Whether the criterion of convergence was met."""
        return self.status == "converged"

    @property
    def plot(self) -> Plots:
        """Plots: `plot.network()`, `.residuals()`, `.tests()` ... (docs/pictures.md)."""
        from photogram.plots import Plots

        return Plots(self)

    def to_parquet(self, directory: str | PathLike[str]) -> None:
        """Write the result as tables in Parquet for `photogram.read_result`.

        `docs/results.md` lists files and columns. Either all files are written or none is changed.

        Raises
        ------
        ModuleNotFoundError
            If pyarrow is not installed.
        OSError
            If a file cannot be written.
        """
        folder = Path(directory)
        from photogram.io.writing import write_whole  # only required for writing

        write_whole({folder / name: content for name, content in self._files().items()})

    @abstractmethod
    def _files(self) -> Mapping[str, Content]: ...

    @abstractmethod
    def _table(self, what: str) -> pd.DataFrame:
        """Return a table by the type of its items."""

    def photo_table(self) -> pd.DataFrame:
        """Return adjusted photos as a data frame: values, sd, attitudes in degrees."""
        return self._table("photo")

    def point_table(self) -> pd.DataFrame:
        """Return adjusted points as a data frame: rays, values, sd, angles in degrees."""
        return self._table("point")

    def image_table(self) -> pd.DataFrame:
        """Return image observations as a data frame: residuals, redundancy, tests."""
        return self._table("image")

    def test_table(self) -> pd.DataFrame:
        """Return the tests of all observations as a data frame, a row for each component.

        Columns are the type (`image`, `control`, `station`, ...), row, photo and point of the observation,
        component and unit. They also include residual, standard deviation, redundancy number, smallest
        detectable error (level 0.001, power 0.8), test value `w` (or `t` if the unit weight is estimated) and
        its probability `p`. The last column marks the outliers of the verdict.
        """
        return self._table("test")

    def control_table(self) -> pd.DataFrame:
        """Return control as a data frame: residuals, redundancy, test values."""
        return self._table("control")

    def station_table(self) -> pd.DataFrame:
        """Return weighted and fixed photos as a data frame: residuals, redundancy, tests."""
        return self._table("station")
