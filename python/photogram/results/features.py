"""Features that fit adjusted points, with their joint covariance (docs/features.md)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import number, probability, value_field
from photogram.arguments.objects import require_name
from photogram.arguments.types import Floats
from photogram.errors import AdjustmentError, InputError, message_of
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message, by_name, unknown_name
from photogram.results.covariance import Covariances, used_rows
from photogram.show import quantity
from photogram.show.page import Drawing, Part, Section, Text, about
from photogram.show.quantity import Axis, Table, for_people, members, of_each
from photogram.statistics.distributions import LEVEL, critical_student, log_chi_square, log_fisher
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    import pandas as pd

    from photogram import Result


_UNIT = "unit of values, residuals and deviations of this row; empty if dimensionless"
_EXPANDED = "expanded uncertainty, k times the standard deviation"
KINDS = ("distance", "line", "plane", "circle", "sphere", "cylinder")

Definition = tuple[str, str | Sequence[str]]
"""A type with its points: names, or patterns such as `hole-*`."""


@dataclass(frozen=True)
class Quantity:
    # `distance`, `diameter`, `centre x`, `axis x` or `normal x`, `straightness`, `flatness`, `roundness`,
    # `sphericity`, `cylindricity`
    name: str
    # The value with its standard deviation; components of axes and normals are plain numbers, all others are
    # lengths
    value: float
    sd: float
    expanded: float  # U = k sd
    unit: str  # The linear unit of the block; empty for plain numbers


@dataclass(frozen=True, eq=False)
class Feature:
    """A feature through n adjusted points; `feature["diameter"]` returns a quantity.

    Attributes
    ----------
    name, kind
        Its name, and one of `distance`, `line`, `plane`, `circle`, `sphere`, `cylinder`.
    points
        The names of the points.
    quantities
        Its q quantities.
    covariance
        (q, q) their joint covariance.
    deviations, deviation_sd
        (n, d) distances of the points from the feature, and their standard deviations: positive outside, or
        on the side of the normal of a plane. Circles have two: in the plane, and perpendicular to it. (0, 1)
        for a distance.
    statistic, freedom, probability
        The test whether point errors explain the deviations: d' C_d^- d, the number of independent
        deviations, and the probability of a larger sum for a perfect form. None if a test is not possible.
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
        found: Quantity = by_name(self.quantities, name, "quantity")
        return found

    @property
    def form(self) -> str:
        """The result of the test of form; empty without a test."""
        if self.probability is None:
            return ""
        return about(f"form.{'deviates' if self.probability < LEVEL else 'agrees'}")


@dataclass(frozen=True, eq=False)
class Features:
    """Features of an adjusted block; `features["bore"]` returns a feature.

    Attributes
    ----------
    features
        All features.
    k
        The coverage factor: U = k sd.
    coverage
        The probability that defines k; None if k was given.
    freedom
        Degrees of freedom of the variance of unit weight, which define k with the probability; infinite if
        the variance is known.
    remarks
        Necessary assumptions of values and standard deviations.
    """

    features: tuple[Feature, ...]
    k: float = 2.0
    coverage: float | None = None
    freedom: float = math.inf
    remarks: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Feature:
        found: Feature = by_name(self.features, name, "feature")
        return found

    def __iter__(self) -> Iterator[Feature]:
        """Iterate over the features."""
        return iter(self.features)

    def __len__(self) -> int:
        return len(self.features)

    @property
    def definitions(self) -> dict[str, Definition]:
        """Definitions of the features, the argument of :func:`photogram.features`."""
        return {each.name: (each.kind, each.points) for each in self}

    def table(self) -> pd.DataFrame:
        """Return the quantities as a data frame: value, sd, k and U = k sd of each."""
        return Table("quantities", "", quantity_columns(self)).frame()

    def deviation_table(self) -> pd.DataFrame:
        """Return the deviations of the points from their features as a data frame."""
        return Table("deviations", "", deviation_quantities(self)).frame()


def quantity_columns(features: Features) -> list[quantity.Quantity]:
    every = [(each, own) for each in features for own in each.quantities]
    axes, of = tuple(Axis.of(own.name, own.unit) for _, own in every), np.arange(len(every))
    text, number = (partial(quantity.Quantity, kind=kind) for kind in ("name", "number"))
    value: Any = partial(quantity.Quantity, axes=axes, kind="value", of=of)
    expanded = [own.expanded for _, own in every]
    return [
        text([each.name for each, _ in every], name="feature", about="name of the feature", head="Feature"),
        text([each.kind for each, _ in every], name="kind", about="what it is"),
        number([len(each.points) for each, _ in every], name="points", about="number of points"),
        text([own.name for _, own in every], name="quantity", about="what is said of it", head="Quantity"),
        text([own.unit for _, own in every], name="unit", about=_UNIT, head="Unit"),
        value(np.array([own.value for _, own in every]), name="value", about="adjusted", head="Value"),
        value(np.array([own.sd for _, own in every]), name="sd", about="standard deviation", head="sd"),
        number([features.k] * len(every), name="k", about="coverage factor"),
        value(np.array(expanded), name="expanded", about=_EXPANDED, head="U = k sd"),
    ]


def unit_deviations(features: Features) -> Floats:
    """(1, q) smallest standard deviation among the quantities with the same unit."""
    smallest = [
        min((one.sd for one in each.quantities if one.unit == own.unit and one.sd > 0), default=math.nan)
        for each in features
        for own in each.quantities
    ]
    return np.array([smallest])


def deviation_quantities(features: Features) -> list[quantity.Quantity]:
    rows = [
        (each.name, point, across, each.quantities[0].unit, *numbers)
        for each in features
        for d, across in enumerate(directions(each.kind))
        for point, *numbers in zip(
            each.points, each.deviations[:, d].tolist(), each.deviation_sd[:, d].tolist(), strict=False
        )
    ]
    columns: list[tuple[str, quantity.Kind, str]] = [
        ("feature", "name", "name of the feature"),
        ("point", "name", "name of the point"),
        ("direction", "name", "of the deviation"),
        ("unit", "name", _UNIT),
        ("deviation", "value", "distance of the point from the feature"),
        ("sd", "value", "standard deviation"),
    ]
    return [
        quantity.Quantity([row[k] for row in rows], kind=kind, name=name, about=about)
        for k, (name, kind, about) in enumerate(columns)
    ]


def directions(kind: str) -> tuple[str, ...]:
    """Return the names of the deviations of points from a feature."""
    return {"circle": ("outward", "axial"), "plane": ("axial",)}.get(kind, ("outward",))


def named_points(wanted: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return points by names and patterns, without repetition, in requested order."""
    known, found = set(names), {}
    for each in wanted:
        if each in known:
            found[each] = True
            continue
        matching = [name for name in names if fnmatchcase(name, each)]
        if not matching:
            absent = phrase("error.absent", kind="point", name=each)
            raise InputError(absent if {*"*?["} & {*each} else unknown_name("point", each, names))
        found |= dict.fromkeys(matching, True)
    return list(found)


def features_section(features: Features | None, picture: Drawing | None = None) -> Section:
    if not features:
        return Section("features", "Features", [])
    law = "given" if features.coverage is None else "normal" if math.isinf(features.freedom) else "student"
    note = about(
        f"coverage.{law}", k=features.k, p=100 * (features.coverage or 0.0), freedom=features.freedom
    )
    columns, by = quantity_columns(features), unit_deviations(features)
    parts: list[Part] = [Table("features", "Quantities of features", columns, note, deviations=by)]
    if tested := [each for each in features if each.statistic is not None]:
        forms = [
            of_each(tested, "name", kind="name", head="Feature"),
            quantity.Quantity([str(through(each)) for each in tested], kind="name", head="What"),
            of_each(tested, "statistic", head="T", figures=4),
            of_each(tested, "freedom", head="of", decimals=0),
            of_each(tested, "probability", kind="probability", head="p"),
            of_each(tested, "form", kind="name", head="Form"),
        ]
        parts.append(Table("forms", "Whether form is more than errors of points", for_people(forms)))
        parts += [] if picture is None else [picture]
    parts += [Text(each) for each in features.remarks]
    return Section("features", "Features", parts, about("features"))


def through(feature: Feature) -> Phrase:
    """Return the form of a feature and its points as a message."""
    first, *_, last = points = list(feature.points)
    if feature.kind == "distance":
        return Phrase("feature.distance", {"first": first, "last": last})
    form = Phrase(f"feature.{feature.kind}")
    return Phrase("feature.through", {"feature": form, "count": len(points), "points": points})


def features_members(features: Features) -> dict[str, Any]:
    found = []
    for each in features:
        across, tested = directions(each.kind), each.statistic is not None
        names = ["point", *across, *(f"sd_{name}" for name in across)]
        numbers = np.hstack([each.deviations, each.deviation_sd]).tolist()
        rows = zip(each.points, numbers, strict=False)
        form = members(each, "statistic", "freedom", "probability", sentence="form") if tested else None
        found.append(
            {
                **members(each, "name", "kind", "points", "covariance"),
                "quantities": [vars(own) for own in each.quantities],
                "deviations": [dict(zip(names, (point, *row), strict=True)) for point, row in rows],
                "form": form,
            }
        )
    return members(features, "k", "coverage", "remarks") | {"features": found}


def features(
    result: Result, definitions: Mapping[str, Definition], *, k: float = 2.0, coverage: float | None = None
) -> Features:
    """Fit distances, lines, planes, circles, spheres and cylinders to adjusted points.

    A feature has the minimum sum of squared distances to its points (Gaussian associated feature). All
    standard deviations follow from the joint covariance of the points (docs/features.md).

    Parameters
    ----------
    result
        An adjusted block with rectangular coordinates.
    definitions
        By the names of features a type (`distance`, `line`, `plane`, `circle`, `sphere`, `cylinder`) with
        names of points, or patterns of names: `{"bore": ("circle", ["hole-*"])}`.
    k
        The coverage factor of U = k sd.
    coverage
        A probability, for example 0.95, instead of k: k is from Student's distribution with the degrees of
        freedom of the variance of unit weight, or from the normal distribution if this variance is known.

    Raises
    ------
    InputError
        If a type or point does not exist, or the points are too few or do not determine a feature.
    AdjustmentError, OutOfMemoryError, KeyboardInterrupt
        As in :meth:`Result.covariances`.
    """
    fitted, empty = _fitting(result, k, coverage)
    return replace(empty, features=tuple(fitted(*each) for each in definitions.items()))


def with_features(result: Result, definitions: Mapping[str, Definition]) -> Result:
    """Return a result with features; its messages explain missing features."""
    if not definitions:
        return result
    found, messages = [], []
    try:
        fitted, empty = _fitting(result, 2.0, None)
    except (InputError, AdjustmentError) as error:
        message = Message(phrase("fit.none", reason=message_of(error)))
        return replace(result, messages=[*result.messages, message])
    for each in definitions.items():
        try:
            found.append(fitted(*each))
        except (InputError, AdjustmentError) as error:
            messages.append(Message(message_of(error)))
    told = [*result.messages, *messages, *(Message(each) for each in empty.remarks)]
    return replace(result, messages=told, features=replace(empty, features=tuple(found)))


def _fitting(
    result: Result, k: float, coverage: float | None
) -> tuple[Callable[[str, Definition], Feature], Features]:
    """Return the fitting function, and the common data of all features."""
    if result.geographic:
        raise InputError(phrase("fit.geographic"))
    freedom = result.freedom_of_scale
    if coverage is not None:
        k = critical_student(1.0 - probability("coverage", coverage), freedom)
    number("k", k, "positive")
    remarks = (str(phrase("fit.scale")),) if result.datum.has_chosen_scale else ()
    covariances = result.covariances()

    def fitted(name: str, definition: Definition) -> Feature:
        try:
            return _fitted(result, covariances, name, definition, k, freedom)
        except (InputError, AdjustmentError) as error:
            kind = InputError if isinstance(error, InputError) else AdjustmentError
            what = phrase("fit.named", name=name)
            raise kind(phrase("error.at", what=what, message=message_of(error))) from None

    return fitted, Features((), k, coverage, freedom, remarks)


def _fitted(
    result: Result, covariances: Covariances, name: str, definition: Definition, k: float, freedom: float
) -> Feature:
    if not (isinstance(definition, Sequence) and len(definition) == 2) or isinstance(definition, str):
        raise InputError(phrase("fit.definition", value=value_field(definition)))
    kind, wanted = definition
    require_name("kind of feature", str(kind), KINDS)
    block = result.block
    points = named_points([wanted] if isinstance(wanted, str) else wanted, block.point_ids)
    if kind == "distance" and len(points) != 2:
        raise InputError(phrase("fit.two-points", count=len(points)))
    rows = used_rows(result, points)
    joint = covariances.covariance(("point", points))
    own, values, covariance, deviations, test = _photocore.measured_feature(
        kind, result.point_positions[rows], joint
    )
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    quantities = tuple(
        Quantity(called, value, deviation, k * deviation, block.linear_unit if is_length else "")
        for (called, is_length), value, deviation in zip(own, values.tolist(), sd.tolist(), strict=True)
    )
    apart, apart_sd = (deviations[:, first : 2 * len(directions(kind)) : 2] for first in (0, 1))
    found = Feature(name, kind, tuple(points), quantities, covariance, apart, apart_sd)
    if test is None:
        return found
    statistic, beyond = test
    known = math.isinf(freedom)
    log = log_chi_square(statistic, beyond) if known else log_fisher(statistic / beyond, beyond, freedom)
    return replace(found, statistic=statistic, freedom=beyond, probability=math.exp(float(log)))
