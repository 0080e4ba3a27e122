"""Features through adjusted points, distances to cylinders, as they are told (docs/features.md)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, TypeVar

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import nearest, unknown_name
from photogram.statistics.distributions import LEVEL
from photogram.words import phrase

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["KINDS", "Definition", "Feature", "Features", "Quantity", "named_points"]

T = TypeVar("T", "Quantity", "Feature")
KINDS = ("distance", "line", "plane", "circle", "sphere", "cylinder")

Definition = tuple[str, str | Sequence[str]]
"""A kind with the points that it goes through: names, or patterns such as `hole-*`."""


@dataclass(frozen=True)
class Quantity:
    """A quantity of a feature.

    Attributes
    ----------
    name
        `distance`, `diameter`, `centre x`, `axis x` or `normal x`, `straightness`, `flatness`, `roundness`,
        `sphericity`, `cylindricity`.
    value, sd
        The value with its standard deviation; components of axes and normals are plain numbers, all others
        are lengths.
    expanded
        U = k sd.
    unit
        The linear unit of the block; empty for plain numbers.
    """

    name: str
    value: float
    sd: float
    expanded: float
    unit: str


@dataclass(frozen=True, eq=False)
class Feature:
    """A feature through n adjusted points; `feature["diameter"]` is one of its quantities.

    Attributes
    ----------
    name, kind
        What it is called, and one of `distance`, `line`, `plane`, `circle`, `sphere`, `cylinder`.
    points
        The names of the points.
    quantities
        What is said of it, q quantities.
    covariance
        (q, q) their joint covariance.
    deviations, deviation_sd
        (n, d) distances of the points from it, and their standard deviations: outside positive; of a plane on
        the side of its normal. Of a circle two: in its plane, and out of it. (0, 1) for a distance.
    statistic, freedom, probability
        Whether the deviations together are more than errors of the points: d' C_d^- d, the deviations that
        count in it, and the probability of a sum as large where the form is perfect. None where that cannot
        be tested.
    """

    name: str
    kind: str
    points: tuple[str, ...]
    quantities: tuple[Quantity, ...]
    covariance: Floats
    deviations: Floats
    deviation_sd: Floats
    statistic: float | None = None
    freedom: int | None = None
    probability: float | None = None

    def __getitem__(self, name: str) -> Quantity:
        """Return a quantity by its name."""
        return _named(self.quantities, name, f"the {self.kind} {self.name} has no quantity")

    @property
    def form(self) -> str:
        """What the test says of the deviations, in words; empty where there is none."""
        if self.probability is None:
            return ""
        if self.probability < LEVEL:
            return "the form deviates: more than standard deviations of points explain"
        return "no deviation of form is proved: standard deviations of points explain all"


@dataclass(frozen=True, eq=False)
class Features:
    """Features of an adjusted block; `features["bore"]` is one of them.

    Attributes
    ----------
    features
        All of them.
    k
        The coverage factor: U = k sd.
    coverage
        The probability from which k comes; None where k was given.
    freedom
        Degrees of freedom of the variance of unit weight, with which k follows from the probability; infinite
        where it is known.
    remarks
        What values and standard deviations rest on, where that has to be known.
    """

    features: tuple[Feature, ...]
    k: float = 2.0
    coverage: float | None = None
    freedom: float = math.inf
    remarks: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Feature:
        """Return a feature by its name."""
        return _named(self.features, name, "there is no feature")

    def __iter__(self) -> Iterator[Feature]:
        """Go through the features."""
        return iter(self.features)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.features)

    @property
    def definitions(self) -> dict[str, Definition]:
        """What they go through, as :func:`photogram.features` takes it."""
        return {each.name: (each.kind, each.points) for each in self}

    def columns(self) -> dict[str, Any]:
        """Return a row for each quantity, as named columns."""
        rows = [
            (
                each.name,
                each.kind,
                len(each.points),
                *(own.name, own.unit, own.value, own.sd),
                self.k,
                own.expanded,
            )
            for each in self
            for own in each.quantities
        ]
        names = ("feature", "kind", "points", "quantity", "unit", "value", "sd", "k", "expanded")
        return {name: [row[k] for row in rows] for k, name in enumerate(names)}

    def deviation_columns(self) -> dict[str, Any]:
        """Return a row for each deviation of a point, as named columns."""
        rows = [
            (each.name, point, across, each.quantities[0].unit, *numbers)
            for each in self
            for d, across in enumerate(directions(each.kind))
            for point, *numbers in zip(
                each.points, each.deviations[:, d].tolist(), each.deviation_sd[:, d].tolist(), strict=False
            )
        ]
        names = ("feature", "point", "direction", "unit", "deviation", "sd")
        return {name: [row[k] for row in rows] for k, name in enumerate(names)}

    def table(self) -> pd.DataFrame:
        """Return the quantities as a data frame: value, standard deviation, k and U = k sd of each."""
        import pandas as pd

        return pd.DataFrame(self.columns())

    def deviation_table(self) -> pd.DataFrame:
        """Return the deviations of the points from their features as a data frame."""
        import pandas as pd

        return pd.DataFrame(self.deviation_columns())


def directions(kind: str) -> tuple[str, ...]:
    """Return in which directions points deviate from a feature."""
    return {"circle": ("outward", "axial"), "plane": ("axial",)}.get(kind, ("outward",))


def named_points(wanted: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return points by names and patterns, each once, in the order in which they are asked for."""
    known, found = set(names), {}
    for each in wanted:
        if each in known:
            found[each] = True
            continue
        matching = [name for name in names if fnmatchcase(name, each)]
        if not matching:
            if {*"*?["} & {*each} or len(names) > 10_000:
                raise InputError(phrase("error.absent", kind="point", name=each))
            raise InputError(unknown_name("point", each, names))
        found |= dict.fromkeys(matching, True)
    return list(found)


def _named(all_: Sequence[T], name: str, lacking: str) -> T:
    for each in all_:
        if each.name == name:
            return each
    raise KeyError(f"{lacking} {name!r}{nearest(name, [each.name for each in all_])}")
