"""Quantities for conditions of verdicts: critical values, exceedances, sizes."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import asdict, dataclass, replace
from photogram.statistics.distributions import (
    bonferroni,
    critical_chi_square,
    critical_fisher,
    critical_normal,
    critical_student,
)
from photogram.statistics.findings import (
    NEARLY,
    NEARLY_EXCHANGED,
    Agreement,
    Findings,
    Systematic,
    Tested,
    Text,
)
from photogram.statistics.limits import NOTABLE_FACTOR, GlobalTest
from photogram.words import Phrase

FEW = 5  # With fewer degrees of freedom tests detect large disagreement only

BEYOND = 2.0  # Multiple of critical values above which observations of a robust adjustment are gross errors

ENOUGH = 20  # Smallest number of test values for a median

EXPLAINED, SINGLE = 0.8, 0.2
"""Parts of the excess of the sum of squares: least part of a lens, largest part of one observation."""

LENS_PARAMETERS = 7  # Parameters of the lens model whose decrease of the sum of squares is known

WITHHELD = 0.001  # Significance level of check points that forbid the use of the result

SUSPECT = 0.01  # Significance level of check points that the verdict names

MEDIAN = 0.6744897501960817  # Median of the absolute value of a standard normal variable

MISSING_LENS = "hypothesis.camera-radial"  # Code of an error that only a wider camera model removes

EXCHANGED = "hypothesis.camera-exchanged"  # Code of an exchanged principal point

GLOBAL = Phrase("test.global")  # Type of the test of all residuals together

Beyond = tuple[float, Tested, tuple[int, ...]]
"""Logarithm of the probability, observation type, and index of a rejected test."""


@dataclass(frozen=True)
class Test:
    kind: Text  # type of the tested observations
    subject: Text
    statistic: str  # Its symbol: `s^2`, `w`, `t`, `T`, `F`, or of a pattern of residuals
    distribution: str  # `chi2`, `F`, `normal`, `t`, ...
    dof: tuple[float, ...]
    value: float
    # Lower and upper limit; None without such a limit
    limits: tuple[float | None, float | None]
    # p-value; `log10_p` for values that underflow
    p: float
    log10_p: float  # Its decimal logarithm
    level: float  # Level that p is compared with
    tests: int  # Number of tests: the level is a part of their joint level (Bonferroni)
    accepted: bool  # Whether p is no less than the level

    @property
    def name(self) -> str:
        return f"{self.kind}: {self.subject}" if self.subject else str(self.kind)

    def document(self) -> dict[str, Any]:
        own = asdict(self)
        del own["kind"], own["subject"]
        return {"name": self.name, **own}


class Evidence:
    def __init__(self, found: Findings) -> None:
        self.found = found
        self.test = found.global_test
        self.codes: list[str] = []  # of the rules that fit, in their order

    @cached_property
    def number(self) -> int:
        return sum(self._count(each) for each in self.found.observations)

    @staticmethod
    def _count(tested: Tested) -> int:
        return int(np.count_nonzero(~np.isnan(tested.values)))

    @cached_property
    def level(self) -> float:
        return bonferroni(self.found.level, self.number)

    @cached_property
    def rejected(self) -> bool:
        """Whether the global test rejects because residuals are too large."""
        return self.test is not None and self.test.rejected_high

    @cached_property
    def high(self) -> bool:
        """Whether residuals are too large by a factor that matters."""
        return self.test is not None and self.test.problem() is not None

    @cached_property
    def low(self) -> bool:
        """Whether residuals are too small by a factor that matters."""
        return self.test is not None and self.test.rejected_low and self.test.factor < 1 / NOTABLE_FACTOR

    @cached_property
    def robust(self) -> float | None:
        """The factor of the median test value, robust to a quarter of gross errors, or None."""
        values = [_relative(each) for each in self.found.observations if each.statistic in "wT"]
        together = np.concatenate(values) if values else np.zeros(0)
        return float(np.median(together)) if together.size >= ENOUGH else None

    def beyond(self, factor: float = 1.0) -> list[Beyond]:
        """Return rejected tests for scaled standard deviations, in the order of p."""
        found: list[tuple[float, int, tuple[int, ...], Tested]] = []
        for order, each in enumerate(self.found.observations):
            found += [(log_p, order, place, each) for log_p, place in each.beyond(self.level, factor)]
        found.sort(key=lambda item: item[:3])
        return [(log_p, each, place) for log_p, _, place, each in found]

    @cached_property
    def single(self) -> list[Beyond]:
        """Rejected tests for the given standard deviations."""
        return self.beyond()

    @property
    def outlying(self) -> list[Beyond]:
        """Outliers of the assessment: tests beyond their critical values.

        Critical values include a common factor of all standard deviations if it is notable or gross errors
        are named.
        """
        return self.gross if self.high or "gross-errors" in self.codes else self.single

    def places(self) -> dict[Text, list[tuple[int, ...]]]:
        """Return indices of outliers by type: rows, and components of single ones."""
        found: dict[Text, list[tuple[int, ...]]] = {}
        for _, each, place in self.outlying:
            own = place if each.rows is None else (int(each.rows[place[0]]),)
            found.setdefault(each.kind, []).append(own)
        return found

    def outliers(self) -> list[Phrase]:
        """Return for each observation type with outliers their number and the worst."""
        factor = self.factor_of_limits if self.outlying is self.gross else 1.0
        counts = {kind: len(places) for kind, places in self.places().items()}
        worst = {each.kind: (each, place) for _, each, place in reversed(self.outlying)}
        found = []
        for kind, count in counts.items():
            tested, place = worst[kind]
            limit = _test_at(tested, place, self.level, self.number).limits[1] or math.nan
            scale = {"w": factor, "T": factor**2}.get(tested.statistic, 1.0)
            fields = {
                "n": count,
                "all": self._count(tested),
                "kind": kind,
                "statistic": tested.statistic,
                "limit": limit * scale,
                "value": float(tested.values[place]),
                "name": tested.name(place),
            }
            scaled = {"factor": factor} if scale > 1 else {}
            found.append(Phrase(f"line.outliers{'.scaled' if scaled else ''}", {**fields, **scaled}))
        return found

    @cached_property
    def factor_of_limits(self) -> float:
        """The common factor of all standard deviations in tests of gross errors."""
        return self._common(self.robust) if self.rejected and self.single and self.robust is not None else 1.0

    @cached_property
    def gross(self) -> list[Beyond]:
        """Rejected tests after a common scaling of all standard deviations.

        With few observations, the factor is estimated from the others (externally studentized test).
        """
        if self.found.robust:
            return self.beyond(BEYOND * self.factor_of_limits)
        if not self.rejected or not self.single:
            return self.single
        if self.robust is not None:
            return self.beyond(self.factor_of_limits)
        test = self.test
        assert test is not None
        omega, f = test.weighted_sum_of_squares, test.degrees_of_freedom
        studentized = [each.studentized(omega, f) for each in self.found.observations]
        return Evidence(replace(self.found, observations=studentized)).beyond()

    def _common(self, robust: float) -> float:
        """Return the common factor of all standard deviations for tests of observations.

        If the median indicates a factor, and all residuals indicate nearly the same, the factor of all
        residuals is used. The median of a few hundred may be wrong by a tenth.
        """
        alike = NOTABLE_FACTOR <= robust <= self.factor <= NOTABLE_FACTOR * robust
        return self.factor if alike else max(robust, 1.0)

    def _of_each_check(self, checks: Agreement, level: float) -> float:
        """Return the level of the test of each check point; the joint test has the other half."""
        part = 1.0 if checks.together is None else 0.5
        return bonferroni(part * level, self._count(checks.points))

    def disagreement(self, level: float) -> list[Phrase]:
        """Return check points that disagree at a level, singly or together."""
        checks = self.found.checks
        if checks is None:
            return []
        beyond = checks.points.beyond(self._of_each_check(checks, level))
        if beyond:
            return [checks.difference(place) for _, place in sorted(beyond)]
        test = checks.together
        if test is None or not test.probability_above < level / 2 or test.factor <= NOTABLE_FACTOR:
            return []
        return [Phrase("part.checks", {"factor": factor_of(test)})]

    @cached_property
    def pattern(self) -> bool:
        return any(each.significant and each.large for each in self.found.systematic)

    @cached_property
    def lens(self) -> bool:
        """Whether a lens explains nearly all of the excess, and no single observation.

        Then the residuals are caused by a wrong lens, not by gross errors. But a few huge errors distort all
        residuals, and the distortion resembles a lens as well.
        """
        fall, single = self._falls
        if not fall or not self.high or self.test is None or self.found.exchanged:
            return False
        # An error in common with fewer parameters explains the same residuals better, unless it is a lens.
        rivals = 0.0 if self.common_code == MISSING_LENS else 2 * self.found.odds
        part = NEARLY_EXCHANGED if self.common_code == EXCHANGED else NEARLY
        if fall < max(rivals + LENS_PARAMETERS * math.log(max(self.number, 2)), rivals / part):
            return False
        too_much = self.test.weighted_sum_of_squares - self.test.degrees_of_freedom
        return fall > EXPLAINED * too_much and single < SINGLE * too_much

    @property
    def common_code(self) -> str:
        """Code of the likeliest error in common; empty without one."""
        for each in self.found.common:
            named = each.fields.get("named") if isinstance(each, Phrase) else None
            return named.code if isinstance(named, Phrase) else ""
        return ""

    @property
    def lens_first(self) -> bool:
        """Whether a lens explains more of the excess than any single observation."""
        fall, single = self._falls
        return fall > single and not self.found.exchanged

    @cached_property
    def _falls(self) -> tuple[float, float]:
        """Decreases of the sum of squares with a lens, and without one observation."""
        patterns = (each.fall for each in self.found.systematic if each.significant and each.large)
        # Tests t and F are not decreases.
        powers = {"w": 2, "T": 1}
        single = (
            float(each.values[place]) ** powers[each.statistic]
            for _, each, place in self.gross
            if each.statistic in powers
        )
        return max(patterns, default=0.0), max(single, default=0.0)

    @cached_property
    def factor(self) -> float:
        """The factor of residuals relative to the expected ones; NaN if unknown."""
        return self.test.factor if self.test is not None else math.nan

    def interval(self) -> Phrase:
        assert self.test is not None
        return factor_of(self.test)

    def named(self, tests: list[Beyond]) -> list[Phrase]:
        return [
            part_of(each.name(place), each.statistic, float(each.values[place])) for _, each, place in tests
        ]

    def remarks(self) -> list[Text]:
        """Return remarks: size of the factor, few degrees of freedom, missing tests."""
        lines: list[Text] = self._statistics()
        test = self.test
        rejected = test is not None and (test.rejected_low or (test.rejected_high and not self.gross))
        if rejected and not (self.high or self.low):
            lines.append(Phrase("line.small-factor", {"factor": self.factor}))
        lines += [each.sentence for each in self.found.systematic if each.significant and not each.large]
        if self.found.hints:
            lines.append(Phrase("line.hints"))
        f = self.found.degrees_of_freedom
        if 0 < f < FEW:
            lines.append(Phrase("line.few", {"freedom": f}))
        return lines

    def _statistics(self) -> list[Text]:
        """Return the tests that decide about single observations."""
        if not self.found.computed:
            return [Phrase("line.no-redundancy")]
        if not self.number or self.found.degrees_of_freedom < 1:
            return []
        tested = {each.statistic for each in self.found.observations if self._count(each)}
        fields = {
            "observations": Phrase("judged.single" if tested & {"w", "t"} else "judged.groups"),
            "statistics": [Phrase(f"judged.{statistic}") for statistic in "wtTF" if statistic in tested],
            "level": self.found.level,
            "n": self.number,
        }
        return [Phrase("line.tests", fields)]

    def tests(self) -> list[Test]:
        """Return the global test, largest tests by type, and tests of patterns."""
        whole = [] if self.test is None else [_whole(self.test)]
        largest = [(each, self.level, self.number) for each in self.found.observations]
        if (checks := self.found.checks) is not None:
            if checks.together is not None:
                whole.append(
                    replace(_whole(checks.together), kind=Phrase("test.checks_together"), statistic="T/m")
                )
            own = self._of_each_check(checks, SUSPECT)
            largest.append((checks.points, own, self._count(checks.points)))
        found = [
            _test_at(each, place, level, number)
            for each, level, number in largest
            if (place := each.largest()) is not None
        ]
        return [*whole, *found, *map(_of_pattern, self.found.systematic)]


def part_of(name: Text, statistic: str, value: float) -> Phrase:
    return Phrase("part.test", {"name": name, "statistic": statistic, "value": value})


def factor_of(test: GlobalTest) -> Phrase:
    low, high = test.interval
    return Phrase("part.factor", {"factor": test.factor, "low": low, "high": high})


def _relative(tested: Tested) -> Floats:
    """Return test values over the median of their distribution, as sd factors."""
    values = tested.values[~np.isnan(tested.values)]
    if tested.statistic == "w":
        return np.asarray(np.abs(values) / MEDIAN)
    dimension = np.broadcast_to(np.asarray(tested.dimension), tested.values.shape)[~np.isnan(tested.values)]
    medians = np.empty_like(values)
    for each in np.unique(dimension).tolist():
        medians[dimension == each] = critical_chi_square(0.5, each)
    return np.asarray(np.sqrt(values / medians))


_CRITICAL: dict[str, tuple[str, Callable[..., float]]] = {
    "w": ("normal", critical_normal),
    "t": ("t", critical_student),
    "T": ("chi2", critical_chi_square),
    "F": ("F", critical_fisher),
}  # Distributions of test values, and critical values for a level and degrees of freedom


def _whole(test: GlobalTest) -> Test:
    f, reference = test.degrees_of_freedom, test.reference_dof
    return Test(
        kind=GLOBAL,
        subject="",
        statistic="s^2",
        distribution="chi2/f" if math.isinf(reference) else "F",
        dof=(f,) if math.isinf(reference) else (f, reference),
        value=test.variance,
        limits=test.limits,
        p=test.probability,
        log10_p=test.log10_probability,
        level=test.level,
        tests=1,
        accepted=not (test.rejected_high or test.rejected_low),
    )


def _of_pattern(pattern: Systematic) -> Test:
    same = ("kind", "subject", "statistic", "distribution", "dof", "value", "level")
    shared: dict[str, Any] = {name: getattr(pattern, name) for name in same}
    p, accepted = pattern.probability, not pattern.significant
    log10_p = math.log10(p) if p > 0 else -math.inf
    return Test(**shared, limits=(None, None), p=p, log10_p=log10_p, tests=1, accepted=accepted)


def _test_at(tested: Tested, place: tuple[int, ...], level: float, number: int) -> Test:
    one = tested.at(place)
    dimension, second = float(np.asarray(one.dimension)[0]), float(np.asarray(one.second)[0])
    least = float(one.log_probability()[0])
    dof = {"w": (), "t": (second,), "T": (dimension,)}.get(tested.statistic, (dimension, second))
    distribution, critical = _CRITICAL[tested.statistic]
    limit = critical(level, *dof)
    return Test(
        kind=tested.kind,
        subject=tested.name(place),
        statistic=tested.statistic,
        distribution=distribution,
        dof=dof,
        value=float(tested.values[place]),
        limits=(-limit if tested.statistic in "wt" else None, limit),
        p=math.exp(least),
        log10_p=least / math.log(10),
        level=level,
        tests=number,
        accepted=not least < math.log(level),
    )
