"""Axes, names and quantities of the photos, points and images of every network."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.geometry import lengths_of_units
from photogram.results.parts import Iteration, Terms
from photogram.show.quantity import Axis, Link, Quantity, column

if TYPE_CHECKING:
    from photogram import Result
    from photogram.results.network import AdjustedNetwork


TURNS = tuple(Axis.turned(name, "deg") for name in ("omega", "phi", "kappa"))  # Of attitudes


def point_axes(block: Block) -> tuple[Axis, ...]:
    """Return the axes of points and stations; geographic plan coordinates are angles."""
    unit = block.linear_unit
    if block.geographic:
        return Axis.turned("longitude", "dms"), Axis.turned("latitude", "dms"), Axis.of("height", unit)
    return tuple(Axis.of(name, unit) for name in "XYZ")


def image_axes(unit: str) -> tuple[Axis, ...]:
    """Return the axes of image coordinates; residuals in mm have micrometres."""
    small, factor = ("um", 1000.0) if unit == "mm" else (unit, 1.0)
    return tuple(Axis(name, unit, "", f"_{unit}", small, factor) for name in "xy")


def component_axis(name: str, unit: str) -> Axis:
    """Return the axis of a component; small rotations are displayed in seconds of arc."""
    return Axis.turned(name) if unit == "rad" else Axis.of(name, unit)


def block_terms(result: Result) -> Terms:
    block, axes = result.block, point_axes(result.block)
    point_kinds = result.point_kinds[result.used_points]
    lengths = None
    if block.geographic and len(result.photo_positions):
        lengths = lengths_of_units(result.photo_positions.mean(axis=0, keepdims=True), block.spheroid)[0]
    return Terms(
        photos=np.array(block.photo_ids, dtype=object),
        points=np.array(block.point_ids, dtype=object),
        photo_axes=(*axes, *TURNS),
        point_axes=axes,
        image_axes=image_axes(block.image_unit),
        photo_values=np.hstack([result.photo_positions, result.photo_attitudes]),
        layers={"Positions": slice(0, 3), "Attitudes": slice(3, 6)},
        parts={"position": slice(0, 3), "attitude_rad": slice(3, 6)},
        of_points=(Quantity(point_kinds, (), "name", "kind", "kind", "what it is", "Kind"),),
        kinds=tuple(result.kinds.values()),
        observation_rows=np.array(block.observations.core_order, dtype=np.int64),
        lengths=lengths,
        linear_unit=block.linear_unit,
        split=True,
    )


_FREE = {np.inf: "free", 0.0: "fixed"}


def names(terms: Terms, kind: str, rows: Indices, member: str = "", *, here: bool = False) -> Quantity:
    """Return names of photos or points with links to rows, or as link targets."""
    every = terms.photos if kind == "photo" else terms.points
    return Quantity(
        every[rows],
        kind="name",
        name=kind,
        member=member,
        about=f"name of the {kind}",
        head=kind.capitalize(),
        link=Link(kind, rows, here),
    )


def part(each: Quantity, of: slice) -> Quantity:
    return replace(each, values=each.values[:, of], axes=each.axes[of])


def photos(result: AdjustedNetwork) -> list[Quantity]:
    terms = result._terms
    rows = np.arange(len(terms.photos))
    return [
        names(terms, "photo", rows, "id" if terms.identity == "id" else "", here=True),
        *terms.of_photos,
        Quantity(
            terms.photo_values, terms.photo_axes, "value", name="", member=terms.parts, head="{}", figures=6
        ),
        deviation(result.photo_sd, terms.photo_axes, member=""),
    ]


def points(result: AdjustedNetwork) -> list[Quantity]:
    """Return the used points: names, rays, coordinates, standard deviations."""
    terms, used = result._terms, np.flatnonzero(result.used_points)
    rays, places, sd = result.point_rays[used], result.point_positions[used], result.point_sd[used]
    return [
        names(terms, "point", used, terms.identity, here=True),
        *terms.of_points,
        column("rays", rays, "Rays", decimals=0),
        Quantity(places, terms.point_axes, "value", name="", member="position", head="{}", figures=7),
        deviation(sd, terms.point_axes, member=""),
    ]


def images(result: AdjustedNetwork, rows: Indices | None = None) -> list[Quantity]:
    """Return used images, or some: residuals, redundancy numbers, test values."""
    terms, used = result._terms, np.flatnonzero(result.used_images) if rows is None else rows
    axes = terms.image_axes
    return [
        names(terms, "photo", result.given.image_photos[used], "photo"),
        names(terms, "point", result.image_points[used], "point"),
        Quantity(
            result.residuals[used], axes, "deviation", name="residual", member=f"residual_{axes[0].unit}"
        ),
        redundancy(result.redundancy[used], axes),
        test_value(result.standardized[used], axes),
    ]


def plan_deviations(terms: Terms, sd: Floats) -> list[Quantity]:
    """Return (n, 3 or more) sd in plan as lengths if coordinates are angles."""
    if terms.lengths is None:
        return []
    axes = tuple(Axis.of(name, terms.linear_unit) for name in ("east", "north"))
    return [Quantity(sd[:, :2] * terms.lengths[:2], axes, "deviation", head="sd {}", decimals=4)]


def _observed(result: AdjustedNetwork, kind: str) -> list[Quantity]:
    """Return prior, posterior, difference and test of observed components."""
    terms, own = result._terms, result.control if kind == "point" else result.stations
    axes, adjusted, sd = terms.point_axes, result.point_positions, result.point_sd
    given = result.given.point_positions
    if kind == "photo":
        axes, adjusted, sd = terms.photo_axes, terms.photo_values, result.photo_sd
        given = adjusted + result.photo_residuals
    rows = own.rows

    def members(what: str) -> Any:
        if not terms.split:
            return what
        of_photo = {f"attitude_{what}_rad": slice(3, 6)} if kind == "photo" else {}
        return {f"position_{what}": slice(0, 3), **of_photo}

    return [
        names(terms, kind, rows, terms.identity),
        Quantity(given[rows], axes, "value", head="Given"),
        Quantity(adjusted[rows], axes, "value", head="Adjusted"),
        difference(own.differences, axes, member=members("difference")),
        deviation(own.sd, axes, member=members("sd"), head="sd given", words=_FREE),
        Quantity(sd[rows], axes, "deviation", head="sd adjusted"),
        redundancy(own.redundancy, axes, seen=np.isfinite(own.sd) & (own.sd > 0)),
        test_value(0.0 - own.standardized, axes),  # With the sign of the differences
    ]


control = partial(_observed, kind="point")
stations = partial(_observed, kind="photo")
"""Points and photos as observations of their own coordinates and unknowns."""

# Columns of values and axes: adjusted minus given, standard deviations, redundancy numbers, w.
_MINUS = "adjusted minus given: {}"
_TEST = "residual over its standard deviation, a priori unit weight: {}"
difference = partial(
    Quantity, kind="difference", name="d", member="difference", about=_MINUS, head="Adjusted - given"
)
deviation = partial(
    Quantity, kind="deviation", name="sd", member="sd", about="standard deviation: {}", head="sd {}"
)
redundancy = partial(
    Quantity,
    name="redundancy",
    member="redundancy",
    about="redundancy number: {}",
    head="Redundancy",
    decimals=3,
)
test_value = partial(
    Quantity, name="standardized", member="standardized", about=_TEST, head="Test value w", decimals=2
)


def iteration_table(iterations: Sequence[Iteration]) -> list[Quantity]:
    rows = [(i.number, i.weighted_sum_of_squares, i.largest_change, i.damping) for i in iterations]
    number, squares, change, damping = np.array(rows).reshape(-1, 4).T
    return [
        Quantity(number.astype(int), member="number", head="Iteration", decimals=0),
        Quantity(squares, member="weighted_sum_of_squares", head="Weighted sum of squares", figures=7),
        Quantity(change, member="largest_change_sd", head="Largest change over sd"),
        Quantity(damping, member="damping", head="Damping", figures=2),
    ]


TABLES: dict[str, Callable[[AdjustedNetwork], list[Quantity]]] = {
    "photo": photos,
    "point": points,
    "image": images,
    "control": control,
    "station": stations,
}
