"""Tables of reports as text: quantities side by side, each row on one line or on several."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.show.angles import degrees_minutes_seconds
from photogram.show.quantity import Axis, Quantity

if TYPE_CHECKING:
    from photogram.show.page import Fact


@dataclass(frozen=True)
class Field:
    """What stands in one place of each row: texts of one width under a head."""

    head: str
    texts: Sequence[str]


def field(
    quantity: Quantity, width: int, form: str | Sequence[str] = "", head: str = "{name} {unit}", gap: str = ""
) -> list[Field]:
    """Return a quantity as fields, one for each of its components.

    Parameters
    ----------
    quantity
        Numbers are set to the right, names to the left.
    width
        Of each; 0 for as many characters as it takes. A column of longer names is one character wider than
        the longest name.
    form
        How numbers are written, `.3f`, all of them or those of each component; with fewer digits where they
        are too long; those that are not finite are `-` unless the quantity has a word for them. How
        components are, `{name}` or `{name} {unit}`.
    head
        `{name}` and `{unit}` stand for those of the component; where each row has one, for their common unit.
    gap
        What stands before each.
    """
    if quantity.kind == "name":
        plain = [*map(str, np.asarray(quantity.values).tolist())]
        if quantity.of is not None:
            written = form if form and isinstance(form, str) else "{name} {unit}"
            components = [written.format(name=axis.name, unit=axis.small).rstrip() for axis in quantity.axes]
            plain = [components[k] for k in quantity.of.tolist()]
        above, *texts = padded([head.format(name="", unit="").strip(), *plain], width)
        return [Field(f"{gap}{above}", [f"{gap}{text}" for text in texts])]
    values = quantity.outward()
    forms = [form] * max(len(quantity.axes), 1) if isinstance(form, str) else form
    if quantity.single:
        units = {unit_of(quantity, axis) for axis in quantity.axes}
        common = units.pop() if len(units) == 1 else ""
        axis = quantity.axes[0] if len(quantity.axes) == 1 else Axis("", common, small=common)
        of = [0] * len(values) if quantity.of is None else quantity.of.tolist()
        return [_numbers(quantity, axis, values, width, [forms[k] for k in of], head, gap)]
    return [
        _numbers(quantity, axis, column, width, [own] * len(column), head, gap)
        for axis, column, own in zip(quantity.axes, values.T, forms, strict=True)
    ]


def padded(texts: Iterable[str], least: int) -> list[str]:
    """Return the texts of a column, with blanks to one width: `least`, or one more than the longest text.

    A `least` of 0 adds no blanks.
    """
    column = list(texts)
    width = least and max(least, 1 + max(map(len, column), default=0))
    return [f"{text:<{width}}" for text in column]


def _numbers(
    quantity: Quantity, axis: Axis, values: Floats, width: int, forms: Sequence[str], head: str, gap: str
) -> Field:
    unit = unit_of(quantity, axis)
    named = f"{gap}{head.format(name=axis.name, unit=unit).strip():>{width}}"
    if quantity.kind == "value" and axis.angle == "dms":
        texts = [degrees_written(value, 5) if math.isfinite(value) else "-" for value in values.tolist()]
        return Field(named, [f"{gap}{text:>{width}}" for text in texts])
    plain = values.tolist()
    patterns = {form: f"{gap}%{width}{form}" for form in set(forms)}
    texts = [patterns[form] % value for form, value in zip(forms, plain, strict=True)]
    if width and max(map(len, texts), default=0) > width + len(gap):
        short = f"{gap}%{width}.{max(width - 8, 1)}g"
        texts = [
            text if len(text) <= width + len(gap) else short % value
            for text, value in zip(texts, plain, strict=True)
        ]
    words: Mapping[float, str] = quantity.words or {}
    odd = ~np.isfinite(values)
    for number in words:
        odd = odd | (values == number)
    for row in np.flatnonzero(odd).tolist():
        texts[row] = f"{gap}{words.get(float(values[row]), '-'):>{width}}"
    return Field(named, texts)


def unit_of(quantity: Quantity, axis: Axis) -> str:
    """Return the unit in which people read a component of a quantity."""
    if quantity.kind == "number":
        return ""
    if quantity.kind == "value":
        return {"dms": "", "deg": "deg"}.get(axis.angle, axis.unit)
    return axis.small


def degrees_written(angle: float, decimals: int) -> str:
    """Return an angle in degrees, minutes and seconds with decimals."""
    degrees, minutes, seconds = degrees_minutes_seconds(angle, decimals)
    width = decimals + 3 if decimals else 2
    return f"{'-' if angle < 0 else ''}{degrees} {minutes:02d} {seconds:0{width}.{decimals}f}"


def fact_lines(facts: Sequence[Fact]) -> list[str]:
    """Return named figures, one under the other, with their units and, in brackets, what is said of them."""
    names = [
        fact.name if fact.name[1:2].isupper() else fact.name[:1].lower() + fact.name[1:] for fact in facts
    ]
    width = max([35, *map(len, names)])
    return [
        f"{name:<{width}} {f'{fact.value} {fact.unit}'.rstrip()}{f' ({fact.note})' if fact.note else ''}"
        for name, fact in zip(names, facts, strict=True)
    ]


def table_lines(*rows: Sequence[Field]) -> list[str]:
    """Return a table: heads, then of each thing a line for each of the given rows; nothing without things.

    Of rows without heads there is no line of heads.
    """
    if not rows[0][0].texts:
        return []
    heads = ["".join(each.head for each in row).rstrip() for row in rows]
    found = [head for head in heads if head]
    texts = [map("".join, zip(*(each.texts for each in row), strict=True)) for row in rows]
    for of_one in zip(*texts, strict=True):
        found += of_one
    return found
