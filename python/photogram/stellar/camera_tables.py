"""Camera parameters of plates and nights: table, correlations, significance; tests and findings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import replace
from photogram.show.quantity import Axis, Kind, Quantity, Table, component
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE
from photogram.stellar.parameters import GRAD, SIGNIFICANT
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.statistics.verdict import Verdict
    from photogram.stellar import CalibratedNight, Result


MAX_WORST_COORDINATES = 25
CORRELATED = 0.95  # Correlations above this cause a warning

Unit = tuple[str, str, float]  # Base unit of values, printed unit, and their factor
MM, UM_OF_M, UM = ("m", "mm", 1e3), ("m", "um", 1e6), ("um", "um", 1.0)
SECONDS, ARC_SECONDS, PIXELS = ("s", "s", 1.0), ("arcsec", "arcsec", 1.0), ("px", "px", 1.0)
ARCSEC_OF_RAD = ("rad", "arcsec", 1 / ARCSEC)
DEGREES, GRADS = ("rad", "deg", math.degrees(1)), ("rad", "grads", 1 / GRAD)


def names_column(values: Iterable[object], head: str, member: str = "") -> Quantity:
    return Quantity(np.fromiter(values, object), (), "name", member or None, member, head=head)


def column(
    values: ArrayLike,
    unit: Unit | None,
    head: str,
    decimals: int | None,
    member: str = "",
    parts: str = "",
    **more: Any,
) -> Quantity:
    """Return numbers (n,), or (n, k) of k comma-separated parts; None: without a unit."""
    large, small, factor = unit or ("", "", 1.0)
    axes = tuple(Axis(part, large, small=small, factor=factor) for part in parts.split(", "))
    numbers = np.reshape(np.asarray(values, dtype=float), (-1, len(axes)) if len(axes) > 1 else -1)
    kind: Kind = "deviation" if unit else "number"
    texts = {"name": member or None, "member": member, "head": head, "decimals": decimals}
    return Quantity(numbers, axes, kind, **{**texts, **more})


def correlations(covariance: Floats) -> Floats:
    """Return the correlations of a covariance matrix; zero for fixed parameters."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0))
    scale = np.divide(1.0, sd, out=np.zeros_like(sd), where=sd > 0)
    return np.asarray(covariance * np.outer(scale, scale), float)


def correlated(names: Sequence[str], covariance: Floats) -> list[tuple[str, str, float]]:
    """Return pairs of parameters with correlations above 0.95, and the correlations."""
    matrix = correlations(covariance)
    pairs = np.argwhere(np.triu(np.abs(matrix) > CORRELATED, 1)).tolist()
    return [(names[i], names[j], float(matrix[i, j])) for i, j in pairs]


def correlation_remarks(pairs: Sequence[tuple[str, str, float]]) -> Iterator[Phrase]:
    for first, second, correlation in pairs:
        yield phrase("stars.correlation", first=first, second=second, correlation=correlation)


def significance(names: Sequence[str], values: Floats, covariance: Floats) -> dict[str, float]:
    """Return the ratio of each estimated parameter to its mean error."""
    errors = np.sqrt(np.maximum(np.diag(covariance), 0))
    rows = zip(names, np.abs(values), errors, strict=True)
    return {name: float(value / error) for name, value, error in rows if error > 0}


def correlated_members(pairs: Sequence[tuple[str, str, float]]) -> list[dict[str, object]]:
    return [{"parameters": [a, b], "correlation": correlation} for a, b, correlation in pairs]


def parameter_table(
    axes: tuple[Axis, ...],
    values: Floats,
    errors: Floats,
    given: Floats | None,
    ratios: Mapping[str, float],
    more: Sequence[Quantity] = (),
    *,
    note: str = "",
    about: str = "",
) -> Table:
    """Return camera parameters by names and units (n,), with mean errors: 0 if fixed.

    `given` are (2, n) prior values and mean errors, infinite if free and 0 if fixed. `ratios` contains terms
    over their mean errors by name, `more` additional columns.
    """
    of, before = np.arange(len(axes)), []
    value = Quantity(values, axes, "difference", "value", "value", head="Value", figures=9, of=of)
    deviation = Quantity(errors, axes, "deviation", words={0.0: "fixed"}, of=of)
    if given is not None:
        words = {0.0: "fixed", np.inf: "free"}
        before = [
            replace(value, values=given[0], name=None, member="", head="Given"),
            replace(deviation, values=given[1], head="Mean error before", words=words),
        ]
    columns = [
        Quantity([axis.name for axis in axes], kind="name", name="parameter"),
        component(axes, of)[0],
        *before,
        value,
        replace(deviation, values=errors, name="mean_error", member="mean_error", head="Mean error"),
        Quantity([ratios.get(axis.name, np.nan) for axis in axes], head="Over its mean error", decimals=1),
        Quantity([axis.unit for axis in axes], kind="name", name="unit", member="unit"),
        *more,
    ]
    return Table("parameters", "Parameters", columns, note, about, errors, keyed=True)


def matrix_table(key: str, title: str, names: Sequence[str], matrix: Floats, **form: Any) -> Table:
    return Table(
        key,
        title,
        [names_column(names, "Parameter"), Quantity(matrix, tuple(map(Axis, names)), head="{}", **form)],
    )


def worst_table(verdict: Verdict, tests: Tested, residuals: Floats, unit: Unit) -> Table:
    """Return the image coordinates with the largest test values, with outliers marked."""
    order = np.argsort(-np.nan_to_num(np.abs(tests.values)), axis=None, kind="stable")
    places = np.unravel_index(order[:MAX_WORST_COORDINATES], tests.values.shape)
    names = (tests.name(place) for place in zip(*(each.tolist() for each in places), strict=True))
    marked = verdict.marks(tests.kind, tests.values.shape)[places]
    columns = [
        names_column(map(str, names), "Image coordinate"),
        column(residuals[places], unit, "Residual", 3),
        column(tests.values[places], None, f"Test value {tests.statistic}", 2, marked=marked),
    ]
    note = f"The {len(marked)} image coordinates of the largest test values."
    return Table("worst", "Worst observations", columns, note)


_AXES = ("right ascension", "declination")


def _testable(values: Floats, redundancy: Floats) -> Floats:
    return np.where(np.nan_to_num(redundancy) > TESTABLE, values, np.nan)


def _sizes(tested: Tested) -> Tested:
    return replace(tested, values=np.abs(tested.values))


def _stars(values: Floats, redundancy: Floats, names: Sequence[str]) -> Tested:
    def star(index: tuple[int, ...]) -> Phrase:
        return phrase("stars.place", axis=_AXES[index[1]], star=names[index[0]])

    return Tested(phrase("stars.places"), _testable(values, redundancy), star)


def plate_standardized(result: Result, unit: float | None = None) -> list[Tested]:
    """Return standardized residuals of a plate for a mean error of unit weight; None: the one in use."""
    unit = unit or result.mean_error or math.nan
    problem, solved = result.problem, result.solved

    def image(index: tuple[int, ...]) -> Phrase:
        star = problem.star_ids[problem.image_stars[index[0]]]
        point = problem.image_points[index[0]]
        return phrase("stars.plate-coordinate", axis="xy"[index[1]], point=point, star=star)

    images = Tested(
        phrase("stars.plate-coordinates"), _testable(solved.standardized / unit, solved.redundancy), image
    )
    return [images, _stars(solved.star_standardized / unit, solved.star_redundancy, problem.star_ids)]


def plate_tests(result: Result) -> list[Tested]:
    """Return the sizes of the tests of a plate: w for a given unit weight (option 14), else t."""
    if result.problem.options.mean_error:
        return [_sizes(each) for each in plate_standardized(result)]
    squares, freedom = sum(result.solved.sums), result.degrees_of_freedom
    return [_sizes(each).studentized(squares, freedom) for each in plate_standardized(result, unit=1.0)]


def plate_findings(result: Result) -> Findings:
    given = bool(result.problem.options.mean_error)
    weak = [name for name, ratio in result.significance().items() if ratio < SIGNIFICANT]
    return Findings(
        status="converged" if result.converged else "not converged",
        observations=plate_tests(result),
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.test,
        untested=Phrase("untested.freedom" if given else "untested.mean-error"),
        scaled=not given,
        spoiled=result.spoiled,
        if_usable=[
            *([Phrase("advice.weak-terms", {"names": weak})] if weak else []),
            Phrase("advice.camera-of-plate"),
        ],
        if_withheld=[Phrase("advice.camera-withheld")],
    )


def night_standardized(result: CalibratedNight) -> list[Tested]:
    """Return residuals of exposures over their standard deviations for the given pixel sd."""
    found, catalogue, unit = result.calibration, result.night.catalogue, result.calibration.mean_error

    def image(index: tuple[int, ...]) -> Phrase:
        (x, y), exposure = found.xy[index[0]].tolist(), result.names[found.exposures[index[0]]]
        return phrase("stars.pixel-coordinate", axis="xy"[index[1]], x=x, y=y, exposure=exposure)

    images = Tested(
        phrase("stars.image-coordinates"), _testable(unit * found.standardized, found.redundancy), image
    )
    names = [catalogue.ids[star] for star in found.catalogue.tolist()]
    return [images, _stars(unit * found.star_standardized, found.star_redundancy, names)]


def night_tests(result: CalibratedNight) -> list[Tested]:
    """Return the tests of exposures: t, since the pixel standard deviation is assumed."""
    found = result.calibration
    squares, freedom = found.mean_error**2 * found.degrees_of_freedom, found.degrees_of_freedom
    return [each.studentized(squares, freedom) for each in night_standardized(result)]


def night_findings(result: CalibratedNight) -> Findings:
    doubtful = [
        Phrase("part.exposure", {"name": str(name), "odds": float(odds)})
        for name, odds in result.doubtful.items()
    ]
    return Findings(
        status=result.calibration.status,
        observations=night_tests(result),
        degrees_of_freedom=result.calibration.degrees_of_freedom,
        global_test=result.test,
        untested=Phrase("untested.freedom"),
        doubtful=[*doubtful, *([Phrase("part.mostly-left-out")] if result.mostly_left_out else [])],
        if_usable=[Phrase("advice.camera-of-night")],
        if_withheld=[Phrase("advice.cameras-withheld")],
    )
