"""Columns of tables as Parquet has them: in radians, with unit and description beside the name.

Tables for people say units in the names of their columns, and have angles in degrees (`omega_deg`). Here the
same columns have plain names, small letters, and angles in radians; the unit stands in the metadata.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.io.parquet import Column, Repeated

__all__ = ["described", "plain_columns", "plain_name"]

_PREFIXES = {
    "residual_": "residual, observed minus adjusted: ",
    "sd_": "standard deviation: ",
    "redundancy_": "redundancy number: ",
    "test_": "residual over its standard deviation, a priori unit weight: ",
    "difference_": "adjusted minus given: ",
    "given_sd_": "standard deviation that was given, or is assumed: ",
}
_DESCRIPTIONS = {
    "photo": "name of the photo",
    "point": "name of the point",
    "camera": "name of the camera",
    "kind": "what it is",
    "of": "names of points and photos",
    "unknown": "name of the unknown",
    "component": "which of its components",
    "parameter": "which of its parameters",
    "feature": "name of the feature",
    "quantity": "what is said of it",
    "points": "number of points",
    "direction": "of the deviation",
    "deviation": "distance of the point from the feature",
    "k": "coverage factor",
    "expanded": "expanded uncertainty, k times the standard deviation",
    "model": "model of the camera",
    "unit": "unit of the numbers of this row; empty for plain numbers",
    "rays": "number of images",
    "images": "number of images",
    "x": "X",
    "y": "Y",
    "z": "Z",
    "longitude": "longitude, east positive",
    "latitude": "latitude",
    "height": "height",
    "omega": "omega",
    "phi": "phi",
    "kappa": "kappa",
    "given": "as it was given",
    "sd_given": "standard deviation that was given: infinite free, 0 held",
    "value": "adjusted",
    "change": "adjusted minus given",
    "sd": "standard deviation",
    "residual": "observed minus adjusted",
    "redundancy": "redundancy number",
    "assumed": "whether nothing was given: standard deviations of control are assumed",
    "statistic": "of the test: T, or F where the unit weight is estimated",
    "probability": "of a statistic as large where nothing is wrong",
    "test": "residual over its standard deviation, a priori unit weight",
}
_RENAMED = {"standardized": "test", "d": "difference"}
_SUFFIXES = ("_deg", "_rad", "_px", "_mm")
_TEXTS = (
    *("photo", "point", "camera", "kind", "of", "unknown", "component", "parameter", "model", "unit"),
    *("feature", "quantity", "direction"),
)
_PLAIN = ("redundancy", "test", "rays", "images", "assumed", "statistic", "probability")
_COUNTS = ("points", "k")
_OF_ROW = ("given", "sd_given", "value", "change", "sd", "residual", "expanded", "deviation")


def plain_name(name: str) -> str:
    """Return the name of a column without its unit, in small letters."""
    for suffix in _SUFFIXES:
        name = name.removesuffix(suffix)
    first, joined, rest = name.lower().partition("_")
    return _RENAMED.get(first, first) + joined + rest


def described(name: str) -> str:
    """Return what a column of this plain name has; nothing where the name says it."""
    if name in _DESCRIPTIONS:
        return _DESCRIPTIONS[name]
    for prefix, said in _PREFIXES.items():
        if name.startswith(prefix):
            return said + _DESCRIPTIONS.get(name.removeprefix(prefix), name.removeprefix(prefix))
    return ""


def plain_columns(table: Mapping[str, Any], linear_unit: str) -> list[Column]:
    """Return the columns of a table for people as Parquet has them."""
    found = []
    for name, values in table.items():
        plain = plain_name(name)
        if plain in _TEXTS:
            found.append(Column(plain, _names(values), "", described(plain)))
            continue
        numbers = np.asarray(values)
        if name.endswith("_deg"):
            numbers = np.radians(numbers)
        found.append(Column(plain, numbers, _unit(name, plain, linear_unit), described(plain)))
    return found


def _unit(name: str, plain: str, linear_unit: str) -> str:
    if plain.startswith(_PLAIN) or plain in _COUNTS:
        return "1"
    if plain in _OF_ROW:
        return "as the column unit says"
    if name.endswith(("_deg", "_rad")):
        return "rad"
    return next((suffix[1:] for suffix in ("_px", "_mm") if name.endswith(suffix)), linear_unit)


def _names(values: Sequence[Any]) -> Any:
    """Return names as a column of few different ones, numbers of photos and points as they are."""
    if isinstance(values, np.ndarray) and values.dtype.kind in "iu":
        return values
    places: dict[str, int] = {}
    rows = [places.setdefault(str(each), len(places)) for each in values]
    return Repeated(list(places), np.array(rows, dtype=np.int64))
