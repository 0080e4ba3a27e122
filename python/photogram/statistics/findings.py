"""Findings for the verdict on an adjustment: tests by type, other information.

Every program provides the same :class:`Findings`; :func:`photogram.statistics.verdict.verdict` assesses them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.statistics.distributions import (
    LEVEL,
    critical_chi_square,
    critical_fisher,
    log_chi_square,
    log_fisher,
)
from photogram.statistics.limits import GlobalTest, externally_studentized
from photogram.words import Phrase

Text = str | Phrase
"""A message or a name: a code with fields, or a text without code."""


@dataclass(frozen=True, eq=False)
class Tested:
    """Tests of observations of one type: single components, or groups."""

    kind: Text  # Observation type, in the plural
    values: Floats  # Test values in any shape; NaN if nothing is tested
    name: Callable[[tuple[int, ...]], Text]  # Names the observation at an index of `values`
    # `w` (standard normal), `t` (Student with `second` degrees of freedom), `T` (chi-square with `dimension`)
    # or `F` (`dimension` and `second`)
    statistic: str = "w"
    dimension: ArrayLike = 1.0
    second: ArrayLike = math.inf
    held: bool = False  # Whether these are fixed values, which cannot be removed
    rows: Indices | None = (
        None  # (k,) rows of groups among images, points, ...; None if these are the indices
    )

    def at(self, place: tuple[int, ...]) -> Tested:
        marks = np.zeros(np.shape(self.values), dtype=bool)
        marks[place] = True
        return self._some(marks)

    def _some(self, marks: Bools) -> Tested:
        dimension, second = (
            np.broadcast_to(np.asarray(each), marks.shape)[marks] for each in (self.dimension, self.second)
        )
        return replace(self, values=self.values[marks], dimension=dimension, second=second)

    def largest(self) -> tuple[int, ...] | None:
        """Return the first index of the least probable value; None without values."""
        if self._alike:
            sizes = np.abs(self.values)
        else:
            # Of chi-square values with the same degrees of freedom, the largest is the least probable.
            marks = ~np.isnan(self.values)
            if self.statistic == "T":
                marks = self._above(lambda _, values: float(np.nextafter(values.max(), -math.inf)))
            sizes = np.full(marks.shape, math.nan)
            sizes[marks] = -self._some(marks).log_probability()
        sizes = np.where(np.isnan(sizes), -math.inf, sizes)
        if not sizes.size or sizes.max() == -math.inf:
            return None
        return tuple(int(each) for each in np.unravel_index(int(sizes.argmax()), sizes.shape))

    def beyond(self, level: float, factor: float = 1.0) -> list[tuple[float, tuple[int, ...]]]:
        """Return log p-values below the level with indices; see :meth:`log_probability`."""
        # Only values beyond the limit of their degrees of freedom need a probability.
        if self._alike:
            dimension, second = float(np.asarray(self.dimension)), float(np.asarray(self.second))
            limit = math.sqrt(critical_fisher(level, dimension, second) * dimension)
            marks = np.abs(self.values) > limit * (factor if math.isinf(second) else 1.0)
        elif self.statistic == "T":
            marks = self._above(lambda dimension, _: critical_chi_square(level, dimension) * factor**2)
        else:
            marks = self.log_probability(factor) < math.log(level)
        places = np.argwhere(marks).tolist()
        log_p = self._some(marks).log_probability(factor).tolist()
        return [(each, tuple(place)) for each, place in zip(log_p, places, strict=True)]

    def _above(self, limit: Callable[[float, Floats], float]) -> Bools:
        """Mark values of T above a limit, which depends on the degrees of freedom and all values of these."""
        found = np.zeros(np.shape(self.values), dtype=bool)
        for dimension, marks in self._by_dimension:
            found |= marks & (self.values > limit(dimension, self.values[marks]))
        return found

    @cached_property
    def _by_dimension(self) -> list[tuple[float, Bools]]:
        """The degrees of freedom of T, each with a mask of its values."""
        tested = ~np.isnan(self.values)
        own = np.broadcast_to(np.asarray(self.dimension, dtype=np.float64), tested.shape)
        return [(each, tested & (own == each)) for each in np.unique(own[tested]).tolist() if each > 0]

    @property
    def _alike(self) -> bool:
        """Whether all values are w or t of the same degrees of freedom."""
        return self.statistic in "wt" and np.ndim(self.dimension) == 0 and np.ndim(self.second) == 0

    def log_probability(self, factor: float = 1.0) -> Floats:
        """Return logarithms of p-values for standard deviations multiplied by a factor.

        The factor does not affect t and F, whose unit weight is estimated from the residuals.
        """
        return self._as_given if factor == 1.0 else self._log_probability(factor)

    @cached_property
    def _as_given(self) -> Floats:
        return self._log_probability(1.0)

    def _log_probability(self, factor: float) -> Floats:
        squares = np.where(np.isnan(self.values), math.nan, np.abs(self.values))
        if self.statistic in "wt":
            squares = squares**2
        if self.statistic in "wT":
            return log_chi_square(squares / factor**2, self.dimension)
        return log_fisher(squares, self.dimension, self.second)

    def studentized(self, weighted_sum_of_squares: float, degrees_of_freedom: float) -> Self:
        """Return tests with the unit weight of other observations: t for w, F for T."""
        omega, f = weighted_sum_of_squares, degrees_of_freedom
        if self.statistic == "w":
            t = externally_studentized(self.values, omega, f)
            return replace(self, values=t, statistic="t", second=max(f - 1, 1))
        if self.statistic != "T":
            return self
        dimension = np.asarray(self.dimension, dtype=np.float64)
        others = f - dimension
        with np.errstate(divide="ignore", invalid="ignore"):
            left = np.maximum(omega - self.values, 1e-12 * omega) / others
            values = np.where(others > 0, self.values / dimension / left, math.nan)
        return replace(self, values=values, statistic="F", second=np.where(others > 0, others, math.nan))


@dataclass(frozen=True, eq=False)
class Agreement:
    """Agreement of n points of known values with an adjustment that did not use them."""

    points: Tested  # Separate test of each point, T_i = d_i' C_ii^-1 d_i
    # Joint test of all points with cross covariances; None without these, or without points
    together: GlobalTest | None
    sd: Floats  # (n, k) standard deviations of the differences: roots of C_ii
    # Fields of the difference of the point at an index, given its (k,) standard deviations
    apart: Callable[[tuple[int, ...], Floats], Mapping[str, Any]]
    # Indices and differences of all known values, with their covariance; None if not tested together
    joint: tuple[Indices, Floats, Floats] | None = None

    def difference(self, place: tuple[int, ...]) -> Phrase:
        fields = self.apart(place, self.sd[place[0]])
        return Phrase("part.check", {"name": self.points.name(place), **fields})


@dataclass(frozen=True)
class Systematic:
    kind: Text  # observation type
    sentence: Text  # result of the test: pattern, size, effect
    statistic: str
    distribution: str
    dof: tuple[float, ...]
    value: float
    probability: float  # p-value
    level: float
    # Whether the pattern is large enough to matter: with a small probability the model is likely wrong
    large: bool = False
    # Decrease of the weighted sum of squares with the pattern, if requested
    fall: float = 0.0
    subject: Text = ""

    @property
    def significant(self) -> bool:
        return self.probability < self.level


@dataclass(frozen=True)
class TypeFactor:
    """Agreement of the given standard deviations of a type of observation with its residuals.

    If these standard deviations are too small by a factor F, the sum of squares q has the expectation r +
    (F^2 - 1) s, s the sum of R_ij^2. q r / s is approximately a multiple of chi-square with r^2 / s degrees
    of freedom (Satterthwaite 1946). Without s, it is replaced by r, its largest value.
    """

    group: Text
    squares: float  # q and r: weighted sum of squares, and sum of redundancy numbers
    redundancy: float
    median: float = math.nan  # Factor of the standard deviations from the median test value
    sd: float = math.nan  # The given standard deviation of images, with its unit; NaN if there are several
    unit: str = ""
    spread: float = math.nan  # s; NaN if it is not required
    # Of a type with s: factor of the largest likelihood, and the gain of its logarithm
    likeliest: tuple[float, float] | None = None

    @property
    def _spread(self) -> float:
        return self.redundancy if math.isnan(self.spread) else self.spread

    @property
    def _freedom(self) -> float:
        return self.redundancy**2 / self._spread

    @property
    def factor(self) -> float:
        """Factor of the standard deviations, by likelihood or from the expectation of q."""
        return math.sqrt(self.squares / self.redundancy) if self.likeliest is None else self.likeliest[0]

    @property
    def log_odds(self) -> float:
        """Log odds of this factor against none; minus infinity if it is small or of few values."""
        enough = self.redundancy >= (1.0 if self.likeliest is None else LEAST_REDUNDANCY)
        if not (enough and min(self.factor, self.median) > NOMINAL and self.factor < LARGEST_FACTOR):
            return -math.inf
        gain = self._log_likelihood(self.factor) - self._log_likelihood(1.0)
        gain = gain if self.likeliest is None else self.likeliest[1]
        return gain - math.log(self._freedom) / 2

    @property
    def is_rejected(self) -> bool:
        """Whether these standard deviations are notably too small at the level 0.001."""
        if not self.redundancy >= LEAST_REDUNDANCY or not min(self.factor, self.median) > NOMINAL:
            return False
        limit = critical_chi_square(TYPE_LEVEL, self._freedom)
        return self.squares / self.redundancy * self._freedom > limit

    @property
    def undetected(self) -> float:
        """The smallest factor that a test of the level 0.001 detects with the power 0.80; else infinite."""
        if not self.redundancy > 0:
            return math.inf
        limit, least = (critical_chi_square(level, self._freedom) for level in (TYPE_LEVEL, 0.80))
        return math.sqrt(1.0 + (limit / least - 1.0) * self.redundancy / self._spread)

    def opposes(self, factor: float) -> bool:
        """Whether a common factor of all standard deviations makes those of this type wrong.

        log L(theta) = -r log(theta) - q / (2 theta^2), theta the factor. Smaller standard deviations require
        evidence: L must increase. Larger ones are refused if L decreases, unless the given ones are nominal,
        that is much too large.
        """
        gain = self._log_likelihood(factor) - self._log_likelihood(1.0)
        if factor < 1.0:
            return gain < EVIDENCE
        nominal = self._log_likelihood(1 / NOMINAL) - self._log_likelihood(1.0) > EVIDENCE
        return gain < -EVIDENCE and not nominal

    def _log_likelihood(self, factor: float) -> float:
        return -self.redundancy * math.log(factor) - self.squares / 2 * factor**-2


@dataclass(frozen=True)
class GroupFactor:
    group: Text
    factor: float  # Required factor of the standard deviations: the root of the component
    interval: tuple[float, float]  # 95 percent, of the factor
    significant: bool  # Whether it differs significantly from 1, and by enough to affect weights


IMAGES, CONTROL_POINTS = Phrase("test.images"), Phrase("test.control")  # Types of observations
MOST: Mapping[Text, float] = {
    IMAGES: 0.05,
    CONTROL_POINTS: 1 / 3,
}  # Largest removable shares
ALTERNATIVES = 20.0  # Odds up to which less likely errors are alternatives

NEARLY = 0.97  # Least ratio of decreases of the sum of squares that second-order terms of an error explain

NEARLY_EXCHANGED = 0.75
"""This ratio of an exchanged principal point: second-order terms of hundreds of pixels are large in close
range, and a principal point or a lens with more parameters explains them too."""

EVIDENCE = 2.0  # Difference of log likelihoods that decides: 1.92 at the ends of a 95 percent interval
LARGEST_FACTOR = 30.0  # Largest plausible factor of the standard deviations of a type
NOMINAL = 1.5  # Factor by which nominal standard deviations are too large at least
TYPE_LEVEL = 0.001  # Significance level of the standard deviations of a type
LEAST_REDUNDANCY = 0.5  # Of a type with a known s: below, q is a nearly singular mixture
MOST_OTHERS = 0.05  # Of all other types; one observation of each may be removed


@dataclass(frozen=True)
class Removed:
    """Observations that data snooping or a robust loss removed."""

    # Removed observations in order: name and other members of the log
    removed: Sequence[Mapping[str, Any]]
    # Numbers of removed and of all groups by type of observation
    counts: Mapping[Text, tuple[int, int]] = field(default_factory=dict)
    number: int | None = None  # number of removed observations if not all are listed
    rivals: Sequence[Text] = ()  # observations that are inseparable from these
    exchanged: Sequence[Text] = ()  # exchanged names among them
    kept: Sequence[Text] = ()  # suspects that were not removed, with the reason
    # Suspects of which one has an error, and the observations do not show which
    disputed: Sequence[Text] = ()

    @property
    def total(self) -> int:
        return len(self.removed) if self.number is None else self.number

    def share(self, kind: Text) -> float:
        removed, all_ = self.counts.get(kind, (0, 1))
        return removed / all_

    @property
    def excessive(self) -> list[Text]:
        """Types of which too many observations were removed."""
        return [
            kind
            for kind, (removed, all_) in self.counts.items()
            if removed > MOST.get(kind, max(MOST_OTHERS, 1 / all_)) * all_
        ]


@dataclass(frozen=True, kw_only=True)
class Findings:
    status: str  # `converged`, or another end of the iteration
    observations: Sequence[Tested]  # Tests of single observations or groups of every type
    degrees_of_freedom: float  # f
    global_test: GlobalTest | None = None  # Test of all residuals; None if not possible
    untested: Text = Phrase("untested.weight")  # Reason for a missing global test
    undetermined: Sequence[Text] = ()  # Unknowns that the observations do not determine, or hardly
    duplicates: Sequence[Text] = ()  # Photos and points that were entered twice
    hints: Sequence[Text] = ()  # Accepted hypotheses on mistakes in the data
    exchanged: Sequence[Text] = ()  # Names that are probably exchanged
    shortfall: Phrase | None = None  # A required accuracy that the result misses
    spoiled: Text = ""  # Reason why gross errors make the result unusable, if the program determined it
    doubtful: Sequence[Text] = ()  # Stars: exposures whose identification is doubtful or rejected
    # Agreement of independent known values with the result; None if missing or untested
    checks: Agreement | None = None
    changed: Sequence[Text] = ()  # Differences between occasions that should have the same values
    systematic: Sequence[Systematic] = ()  # Tests of patterns
    components: Sequence[GroupFactor] = ()
    types: Sequence[TypeFactor] = ()  # All types of observations; images if the global test rejects
    odds: float = -math.inf  # Largest log odds of an error in common, or of a single one
    # Detected common errors of sets of observations, and whether they forbid the use
    common: Sequence[Text] = ()
    common_is_harmful: bool = False
    of_checks: Sequence[Text] = ()  # Single errors that explain differences of check points
    # Undetectable errors that affect many points, the worst first
    unchecked: Sequence[Text] = ()
    snooped: Removed | None = None
    robust: bool = False  # Whether a robust loss removed them
    unsupported: Sequence[Text] = ()  # Points with too few images that the loss does not remove
    # Observations rejected by initial orientation that do not fit the adjusted network; None without any
    set_aside: Removed | None = None
    # Whether all photos are fixed, so that their errors are in all residuals
    intersected: bool = False
    scaled: bool = True  # Whether covariances are scaled by the unit variance of the residuals
    computed: bool = True  # Whether redundancy numbers were computed, which the tests need
    remarks: Sequence[Text] = ()  # Further lines below the headline
    # Advice with which the program removes gross errors, weights fixed control, estimates cameras, searches
    # for mistakes of the input and continues iterations; None if it cannot
    can_snoop: bool = False
    weigh: Phrase | None = None
    calibrate: Phrase | None = None
    check: Phrase = Phrase("how.check")
    take_out: Phrase | None = None
    iterate: Phrase | None = None
    # Further advice if nothing forbids the use, and if a rule does
    if_usable: Sequence[Text] = ()
    if_withheld: Sequence[Text] = ()
    level: float = LEVEL  # Of the global test, and of all single tests together
