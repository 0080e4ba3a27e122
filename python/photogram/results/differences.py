"""Differences of values and standard deviations of two results."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.results.covariance import Things, adjusted
from photogram.results.result import Result, least_turns
from photogram.words import Phrase, phrase

_KINDS = ("photo", "point", "camera", "unknown")


@dataclass(frozen=True)
class Largest:
    size: float = 0.0  # 0 without differences
    # Empty without differences
    kind: str = ""
    name: str = ""
    component: str = ""

    @property
    def phrase(self) -> Phrase:
        return Phrase(f"differences.size{'.of' if self.kind else ''}", vars(self))

    def __str__(self) -> str:
        return str(self.phrase)


@dataclass(frozen=True)
class Differences:
    """Differences of a second result from a first one, for their common unknowns.

    Attributes
    ----------
    values
        The largest difference of adjusted values, in standard deviations of the first result.
    deviations
        The largest difference of standard deviations, relative to the first result.
    variance
        Ratio of the variances of unit weight, second to first; None if one is missing.
    alone
        Items that only one result contains or has adjusted, by type.
    compared
        The number of compared unknowns.
    """

    values: Largest
    deviations: Largest
    variance: float | None
    alone: dict[str, list[str]]
    compared: int

    def __str__(self) -> str:
        lines = [
            phrase("differences.compared", n=self.compared),
            phrase("differences.values", largest=self.values.phrase),
            phrase("differences.deviations", largest=self.deviations.phrase),
        ]
        if self.variance is not None:
            lines.append(phrase("differences.variance", ratio=self.variance))
        lines += [phrase("differences.alone", kind=kind, names=own) for kind, own in self.alone.items()]
        return "\n".join(map(str, lines))


def differences(first: Result, second: Result) -> Differences:
    """Return the differences between two results for items with equal names.

    Attitudes may differ by full rotations. For unknowns without standard deviation or fixed in the first
    result, only standard deviations are compared.

    Parameters
    ----------
    first, second
        Results of one block, or of different blocks with photos, points, cameras or unknowns of equal names.

    Raises
    ------
    InputError
        If an argument is not a result of a block, or the results have nothing in common.
    """
    for each in (first, second):
        if not isinstance(each, Result):
            raise InputError(phrase("adjusted.not-a-block", value=type(each).__name__))
    one, two = adjusted(first).things, adjusted(second).things
    values, deviations = Largest(), Largest()
    alone: dict[str, list[str]] = {}
    compared = 0
    for kind in _KINDS:
        mine, theirs = _by_name(one[kind]), _by_name(two[kind])
        shared = [key for key in mine if key in theirs]
        pairs = (np.array([own[key] for key in shared], dtype=float) for own in (mine, theirs))
        (value, sd), (other, other_sd) = (own.reshape(-1, 2).T for own in pairs)
        known = np.isfinite(value) & np.isfinite(other)
        compared += int(np.count_nonzero(known))
        missing = {name for name, _ in mine.keys() ^ theirs.keys()}
        missing |= {shared[row][0] for row in np.flatnonzero(np.isfinite(value) != np.isfinite(other))}
        if missing:
            alone[kind] = sorted(missing)
        steps = other - value
        if kind == "photo":
            turning = np.array(
                [component in ("omega", "phi", "kappa") for _, component in shared], dtype=bool
            )
            steps = np.where(turning, least_turns(steps), steps)
        with np.errstate(divide="ignore", invalid="ignore"):
            values = _larger(values, steps / sd, kind, shared)
            deviations = _larger(deviations, np.where(other_sd == sd, 0.0, other_sd / sd - 1), kind, shared)
    if not compared:
        raise InputError(phrase("adjusted.nothing-common"))
    variances = first.variance_of_unit_weight, second.variance_of_unit_weight
    ratio = None if not variances[0] or variances[1] is None else variances[1] / variances[0]
    return Differences(values, deviations, ratio, alone, compared)


def _by_name(things: Things) -> dict[tuple[str, str], list[float]]:
    """Return values and standard deviations by names of items and components."""
    rows = zip(things.ids, things.components, things.values, things.sd, strict=True)
    return {
        (name, component): pair
        for name, components, *numbers in rows
        for component, *pair in zip(components, *numbers, strict=True)
    }


def _larger(before: Largest, sizes: Floats, kind: str, keys: Sequence[tuple[str, str]]) -> Largest:
    found = np.where(np.isfinite(sizes), np.abs(sizes), 0.0)
    if not len(found) or not found.max() > before.size:
        return before
    row = int(found.argmax())
    return Largest(float(found[row]), kind, *keys[row])
