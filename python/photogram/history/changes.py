"""Comparison of values with covariances that were determined on several occasions.

x(i) of the occasions i = 1 ... k have the covariance C. Without changes they have one mean, and Omega = r'
C^-1 r of the residuals about its estimate is chi-square with (k - 1) m degrees of freedom. For each of the m
quantities separately, with its own block of C, hypotheses add a column z to the mean:

* drift: z(i) = t(i) - mean t;
* a step between two occasions: z(i) = 0 before, 1 after;
* a single occasion that is off: z(i) = 1 there;
* a regressor, such as the temperature: z(i) = u(i) - mean u.

Let R = C^-1 - C^-1 A (A' C^-1 A)^-1 A' C^-1, with the columns A of the model. The size of a hypothesis is s =
z' R x / z' R z, and its variance 1 / z' R z. t = z' R x / sqrt(z' R z) is standard normal if it is false
(Student with the degrees of freedom of an estimated C). The largest |t| of a quantity is accepted if its
probability is below the level over the number of all tests (Bonferroni). It then remains in the model, and
the others are tested again. The method is independent of the type of values.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import date

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, value_field
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.distributions import LEVEL, bonferroni, critical_student, log_chi_square, log_fisher
from photogram.statistics.findings import Systematic
from photogram.statistics.fits import Fit
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import Phrase, phrase

YEAR = 365.2425  # days
MOST = 3  # Largest number of changes of one quantity


@dataclass(frozen=True)
class Change:
    """An accepted change of a quantity."""

    kind: str  # `drift`, `step`, `single`, or the name of a regressor
    # size, sd: per unit of time, after minus before, off, or per unit of the regressor
    size: float
    sd: float
    statistic: float  # t
    log10_p: float
    at: int | None  # First occasion after a step, or the single one; None for others
    sentence: str


@dataclass(frozen=True, eq=False)
class Series:
    """One quantity on all occasions."""

    name: str
    unit: str
    values: Floats  # (k,) as given
    sd: Floats
    mean: float  # weighted mean over all occasions
    mean_sd: float
    model: Floats  # (k,) mean with the accepted changes
    off: Floats  # (k,) value minus mean of the others, for a control chart
    off_sd: Floats
    drift: float  # per unit of time; NaN if all times are equal
    drift_sd: float
    steps: Floats  # (k - 1,) t of a step before occasions 2 ... k; NaN if there is none
    test: GlobalTest | None  # Chi-square of the residuals about the mean
    changes: tuple[Change, ...]  # accepted changes, the most certain first


@dataclass(frozen=True, eq=False)
class History:
    """Values on several occasions, compared."""

    # Names of the occasions, and their times in the unit of time
    occasions: tuple[str, ...]
    times: Floats
    series: tuple[Series, ...]  # The quantities
    constancy: GlobalTest  # Joint test of all changes, with all covariances
    # Number of single tests, their level together, and the largest accepted |t|
    tests: int
    level: float
    limit: float

    @property
    def sentences(self) -> list[str]:
        """Sentences on the changes, the most certain first."""
        changes = [change for own in self.series for change in own.changes]
        return [each.sentence for each in sorted(changes, key=lambda each: each.log10_p)]

    @property
    def has_changed(self) -> bool:
        """Whether a change is certain, or the test of constancy fails."""
        return bool(self.sentences) or self.constancy.problem() is not None

    def systematic(self, whose: str) -> Systematic:
        """Return the test of constancy for a verdict."""
        test = self.constancy
        known = math.isinf(test.reference_dof)
        return Systematic(
            kind=whose,
            subject=Phrase("test.constancy"),
            sentence=Phrase("pattern.constancy", {"whose": whose}),
            statistic="s^2",
            distribution="chi2/f" if known else "F",
            dof=(test.degrees_of_freedom,) if known else (test.degrees_of_freedom, test.reference_dof),
            value=test.variance,
            probability=test.probability_above,
            level=self.level,
        )


@dataclass(frozen=True)
class Dates:
    """Years and names of k occasions."""

    years: list[float]
    names: list[str]


def dates_of(days: Sequence[date], names: Sequence[str]) -> Dates:
    """Return the dates of occasions: days, with file names if two are on one day."""
    written = [day.isoformat() for day in days]
    called = [
        day if written.count(day) == 1 else f"{day} ({name})"
        for day, name in zip(written, names, strict=True)
    ]
    return Dates([day.year + (day - date(day.year, 1, 1)).days / YEAR for day in days], called)


_Hypothesis = tuple[Floats, tuple[str, int | None], Phrase]
"""The column (k,) of a possible change, its kind with its occasion, and its words."""


def history(
    values: ArrayLike,
    covariance: ArrayLike,
    *,
    times: ArrayLike | None = None,
    occasions: Sequence[str] = (),
    names: Sequence[str] = (),
    units: Sequence[str] = (),
    unit_of_time: str = "occasion",
    regressors: Mapping[str, tuple[ArrayLike, str]] | None = None,
    freedom: float = math.inf,
    level: float = LEVEL,
) -> History:
    """Compare values of several occasions: constancy, drift, steps, single ones.

    `values` (k, m) are m quantities on k occasions in ascending order of `times`. `covariance` is the
    covariance of one occasion (k, m, m), or of all values (k, m, k, m), estimated with `freedom` degrees of
    freedom. `regressors` are other causes by name: (k,) values and their unit. `level` is the probability of
    a false alarm of the test of constancy, and of all single tests together.
    """
    x = np.asarray(values, dtype=np.float64)
    if x.ndim != 2 or len(x) < 2 or not np.isfinite(x).all():
        raise InputError(phrase("history.values", actual=str(x.shape)))
    k, m = x.shape
    c = _together(np.asarray(covariance, dtype=np.float64), k, m)
    t = np.arange(float(k)) if times is None else np.asarray(times, dtype=np.float64)
    if t.shape != (k,) or not (np.diff(t) >= 0).all():
        raise InputError(phrase("history.times", count=k, value=value_field(times)))
    named = tuple(occasions) or tuple(f"occasion {i + 1}" for i in range(k))
    hypotheses = _hypotheses(t, named, unit_of_time, regressors or {})
    tests = m * len(hypotheses)
    quantities = names or [f"value {j + 1}" for j in range(m)]
    of_units = units or [""] * m
    if (given := [len(named), len(quantities), len(of_units)]) != [k, m, m]:
        raise InputError(phrase("history.names", occasions=k, quantities=m, given=given))
    series = tuple(
        _series(
            x[:, j], c[:, j, :, j], hypotheses, quantities[j], of_units[j], freedom, bonferroni(level, tests)
        )
        for j in range(m)
    )
    mean = np.tile(np.eye(m), (k, 1))
    whole = Fit.of(x.ravel(), c.reshape(k * m, k * m), mean)
    constancy = global_test(whole.omega, (k - 1) * m, level, freedom)
    assert constancy is not None
    limit = critical_student(bonferroni(level, tests), freedom)
    return History(named, t, series, constancy, tests, level, limit)


def _together(covariance: Floats, k: int, m: int) -> Floats:
    whole = covariance
    if covariance.shape == (k, m, m):
        whole = np.zeros((k, m, k, m))
        whole[np.arange(k), :, np.arange(k), :] = covariance
    if whole.shape != (k, m, k, m) or not np.isfinite(whole).all():
        raise InputError(phrase("history.covariance", k=k, m=m, actual=str(whole.shape)))
    return whole


def _hypotheses(
    t: Floats, named: Sequence[str], unit: str, regressors: Mapping[str, tuple[ArrayLike, str]]
) -> list[_Hypothesis]:
    """Return the hypotheses; with two occasions, only a step."""
    k, found = len(t), list[_Hypothesis]()
    for i in range(1, k):
        if t[i] > t[i - 1]:
            words = phrase("history.step", before=named[i - 1], after=named[i])
            found.append(((np.arange(k) >= i).astype(float), ("step", i), words))
    if k > 2 and t[-1] > t[0]:
        found.append((t - t.mean(), ("drift", None), phrase("history.drift", unit=unit)))
        # The first or the last occasion alone is a step.
        inner = range(1, k - 1)
        found += [(np.eye(k)[i], ("single", i), phrase("history.single", day=named[i])) for i in inner]
    for name, (given, of_what) in regressors.items():
        u = np.asarray(given, dtype=np.float64)
        if u.shape != (k,) or not np.isfinite(u).all():
            raise argument_error(name, "numbers", count=k, value=value_field(given))
        if k > 2 and np.ptp(u) > 0:
            words = phrase("history.regressor", name=name, unit=of_what)
            found.append((u - u.mean(), (name, None), words))
    if not found:
        raise InputError(phrase("history.equal-times", count=k))
    return found


def _log10_p(t: float, freedom: float) -> float:
    log_p = log_chi_square(t**2, 1.0) if math.isinf(freedom) else log_fisher(t**2, 1.0, freedom)
    return float(log_p) / math.log(10)


def _series(
    x: Floats,
    covariance: Floats,
    hypotheses: list[_Hypothesis],
    name: str,
    unit: str,
    freedom: float,
    level: float,
) -> Series:
    """Test a quantity, accept changes by certainty, and fit them jointly."""
    k, columns = len(x), np.column_stack([column for column, _, _ in hypotheses])
    with np.errstate(invalid="raise", divide="raise"):
        first = fit = Fit.of(x, covariance, np.ones((k, 1)))
    sizes, deviations = fit.tested(columns)
    t = sizes / deviations
    steps, drift = np.full(k - 1, math.nan), (math.nan, math.nan)
    for column, (_, (kind, at), _) in enumerate(hypotheses):
        if kind == "step":
            assert at is not None
            steps[at - 1] = t[column]
        elif kind == "drift":
            drift = float(sizes[column]), float(deviations[column])
    off, off_sd = fit.tested(np.eye(k))
    accepted: list[tuple[int, float]] = []
    while len(accepted) < min(MOST, k - 1) and not np.isnan(t).all():
        best = int(np.nanargmax(np.abs(t)))
        if _log10_p(t[best], freedom) >= math.log10(level):
            break
        accepted.append((best, float(t[best])))
        changed = columns[:, [column for column, _ in accepted]]
        fit = Fit.of(x, covariance, np.column_stack([np.ones(k), changed]))
        sizes, deviations = fit.tested(columns)
        t = sizes / deviations
    changes = []
    for row, (column, value) in enumerate(accepted, 1):
        _, (kind, at), words = hypotheses[column]
        size, sd = float(fit.parameters[row]), math.sqrt(float(fit.cofactors[row, row]))
        told = phrase("history.size", size=size, sd=sd, unit=f" {unit}".rstrip())
        what = Phrase(words.code, {**words.fields, "size": told})
        sentence = str(phrase("history.changed", quantity=name, what=what, t=value))
        changes.append(Change(kind, size, sd, value, _log10_p(value, freedom), at, sentence))
    return Series(
        name=name,
        unit=unit,
        values=x,
        sd=np.sqrt(np.diag(covariance)),
        mean=float(first.parameters[0]),
        mean_sd=math.sqrt(float(first.cofactors[0, 0])),
        model=x - fit.residuals,
        off=off,
        off_sd=off_sd,
        drift=drift[0],
        drift_sd=drift[1],
        steps=steps,
        test=global_test(first.omega, k - 1, reference_dof=freedom),
        changes=tuple(changes),
    )
