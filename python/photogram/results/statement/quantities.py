"""Quantities of an adjusted block with a budget of uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.arrays import value_field
from photogram.arguments.objects import require_name
from photogram.arguments.types import Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import unknown_name
from photogram.network.block import Block
from photogram.network.rays import local_axes
from photogram.results.covariance import Item, adjusted, used_rows
from photogram.results.statement.request import invalid
from photogram.results.unknowns import units
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import Result

_AXES = {"x": 0, "y": 1, "z": 2, "e": 0, "n": 1, "h": 2, "east": 0, "north": 1, "height": 2}
"""Alternative names of coordinates, in addition to those of the block."""
PRINCIPAL = ("f", "fx", "c")  # Names of principal distances
TOGETHER = 256  # Number of points in a block of distances


@dataclass(frozen=True, eq=False)
class Wanted:
    name: str  # The requested name: `point C08 z`
    subject: Phrase  # Its name as a message
    items: tuple[Item, ...]  # Its arguments: see :class:`photogram.results.Covariances`
    function: Callable[..., Any]  # Its arguments are an array for each item, complex ones too
    unit: str  # Unit of its value; empty for plain numbers


def wanted(result: Result, asked: Any) -> Wanted:
    """Return a requested quantity; refuse unknown items and unused points.

    `point NAME z`, `distance NAME NAME`, `camera NAME f`, `photo NAME x`, `unknown NAME x`; or a mapping of
    items to gradients of a linear function, `{("point", "C08"): [0, 0, 1]}`.
    """
    if isinstance(asked, Mapping):
        return _linear(result, asked)
    words = asked.split() if isinstance(asked, str) else []
    if len(words) < 3:
        raise InputError(phrase("request.quantity", value=value_field(asked)))
    kind = words[0]
    if kind == "distance":
        return _distance(result, asked, _two(result.block, words[1:]))
    kinds = adjusted(result).things
    if kind not in kinds or kind == "step":
        raise InputError(unknown_name("kind of quantity", kind, kinds))
    name, component = " ".join(words[1:-1]), words[-1]
    things = kinds[kind]
    require_name(kind, name, things.ids)
    names = things.components[list(things.ids).index(name)]
    lower = [each.lower() for each in names]
    own = _AXES.get(component.lower()) if kind in ("point", "photo") and component not in names else None
    if own is None:
        if component.lower() not in lower:
            raise InputError(unknown_name(f"component of {kind} {name}", component, names))
        own = names.index(component) if component in names else lower.index(component.lower())
    if kind == "point":
        used_rows(result, [name])
    subject = Phrase(f"quantity.{kind}", {"of": component_of(name, Phrase(f"axis.{component}"))})
    return Wanted(asked, subject, ((kind, name),), lambda x: x[own], _unit(result, kind, name, own))


def component_of(name: str, axis: Phrase) -> Phrase:
    return Phrase("named.component", {"name": name, "axis": axis})


def chosen(result: Result, checks: Sequence[str]) -> list[Wanted]:
    """Return three quantities for the first page.

    The check point, or tie point, with the median standard deviation of height; the longest distance between
    these points; the principal distance if it was estimated.
    """
    block = result.block
    own = set(checks)
    rows = np.flatnonzero([name in own for name in block.point_ids])
    if not len(rows):
        rows = np.flatnonzero(result.used_points & (result.point_kinds == "pass"))
    found = []
    if len(rows):
        order = rows[np.argsort(result.point_sd[rows, 2], kind="stable")]
        found.append(wanted(result, f"point {block.point_ids[order[(len(order) - 1) // 2]]} z"))
    if len(rows) > 1:
        first, second = _farthest(result, rows)
        found.append(_distance(result, f"distance {first} {second}", (first, second)))
    for camera in result.cameras:
        free = [name for name, sd in zip(camera.names, camera.sd.tolist(), strict=True) if sd > 0]
        for name in PRINCIPAL:
            if name in free:
                return [*found, wanted(result, f"camera {camera.name} {name}")]
    return found


def _farthest(result: Result, rows: Indices) -> tuple[str, str]:
    places = local_axes(result.block).positions(result.point_positions[rows])
    best, ends = -1.0, (0, 0)
    for first in range(0, len(rows), TOGETHER):
        squares = ((places[first : first + TOGETHER, np.newaxis] - places) ** 2).sum(axis=2)
        own = np.unravel_index(int(np.argmax(squares)), squares.shape)
        if squares[own] > best:
            best, ends = float(squares[own]), (first + int(own[0]), int(own[1]))
    names = result.block.point_ids
    return names[rows[min(ends)]], names[rows[max(ends)]]


def _two(block: Block, words: Sequence[str]) -> tuple[str, str]:
    """Return the names of two points; names may contain blanks."""
    known = set(block.point_ids)
    for cut in range(1, len(words)):
        names = " ".join(words[:cut]), " ".join(words[cut:])
        if known.issuperset(names):
            return names
    lacking = next((word for word in words if word not in known), words[0])
    raise InputError(unknown_name("point", lacking, block.point_ids))


def _distance(result: Result, name: str, ends: tuple[str, str]) -> Wanted:
    used_rows(result, ends)
    if ends[0] == ends[1]:
        raise InputError(phrase("request.distance", point=ends[0]))
    spheroid = result.block.spheroid

    def between(x: Any, y: Any) -> Any:
        if spheroid is not None:
            x, y = (_geocentric(each, spheroid.a, spheroid.b) for each in (x, y))
        return (((x - y) ** 2).sum()) ** 0.5

    items = tuple(("point", each) for each in ends)
    subject = Phrase("quantity.distance", {"of": " ".join(ends)})
    return Wanted(name, subject, items, between, result.block.linear_unit)


def _geocentric(x: Any, a: float, b: float) -> Any:
    """Return geocentric coordinates of geographic ones; also complex numbers."""
    sp, cp = np.sin(x[1]), np.cos(x[1])
    across = a / (1 - (1 - (b / a) ** 2) * sp**2) ** 0.5
    level = (across + x[2]) * cp
    return np.array([level * np.cos(x[0]), level * np.sin(x[0]), ((b / a) ** 2 * across + x[2]) * sp])


def _linear(result: Result, gradients: Mapping[Any, Any]) -> Wanted:
    items, parts = [], []
    for item, gradient in gradients.items():
        values = np.asarray(gradient, dtype=float)
        if not (isinstance(item, tuple) and len(item) == 2) or not np.isfinite(values).all():
            raise InputError(phrase("request.gradient", value=value_field((item, gradient))))
        width = len(adjusted(result).selected(item).values)
        if item[0] == "point":
            used_rows(result, [str(item[1])])
        if values.shape != (width,):
            raise invalid(f"gradient of {item[0]} {item[1]}", "error.count", count=width, actual=values.size)
        items.append(item)
        parts.append(values)
    if not items:
        raise InputError(phrase("request.gradient", value=value_field(gradients)))
    parts_of = [Phrase(f"quantity.{kind}", {"of": own}) for kind, own in items]
    subject = Phrase("quantity.linear", {"quantities": parts_of})
    return Wanted(
        str(subject), subject, tuple(items), lambda *x: sum(g @ v for g, v in zip(parts, x, strict=True)), ""
    )


def _unit(result: Result, kind: str, name: str, component: int) -> str:
    block = result.block
    if kind in ("point", "photo"):
        angle = component >= 3 or (block.geographic and component < 2)
        return "rad" if angle else block.linear_unit
    if kind == "camera":
        return units(next(each.camera for each in result.cameras if each.name == name))[component]
    return next(each.units[component] for each in result.unknowns if each.name == name)
