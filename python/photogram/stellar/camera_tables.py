"""Camera parameters of plates and nights: table, correlations, significance."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.io.angles import ARCSEC
from photogram.lazy_dataclasses import replace
from photogram.show.quantity import Axis, Kind, Quantity, Table, component
from photogram.stellar.parameters import GRAD
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.statistics.findings import Tested
    from photogram.statistics.verdict import Verdict

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
