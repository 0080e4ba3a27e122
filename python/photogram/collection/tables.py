"""The tables of an adjusted collection: named columns; photos and points are numbers from 0."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from photogram.collection.adjusted import AdjustedCollection
from photogram.results.tables import images, named, observed
from photogram.show.ways import columns_of

__all__ = ["table"]

AXES = ("X", "Y", "Z")


@columns_of.register(AdjustedCollection)
def table(result: AdjustedCollection, what: str) -> dict[str, Any]:
    """Return the columns of photos, points, images, control or stations."""
    return _TABLES[what](result)


def _photos(result: AdjustedCollection) -> dict[str, Any]:
    names = _parameters(result)
    return {
        "photo": np.arange(len(result.photo_parameters)),
        "images": result.photo_images,
        **named(names, result.photo_parameters),
        **named(names, result.photo_sd, "sd_"),
    }


def _points(result: AdjustedCollection) -> dict[str, Any]:
    used = result.used_points
    return {
        "point": np.flatnonzero(used),
        "rays": result.point_rays[used],
        **named(AXES, result.point_positions[used]),
        **named(AXES, result.point_sd[used], "sd_"),
    }


def _images(result: AdjustedCollection) -> dict[str, Any]:
    used, collection = result.used_images, result.collection
    return {
        "photo": collection.image_photos[used],
        "point": collection.image_points[used],
        **images(result, "px"),
    }


def _control(result: AdjustedCollection) -> dict[str, Any]:
    return {"point": result.control.rows, **observed(AXES, result.control)}


def _stations(result: AdjustedCollection) -> dict[str, Any]:
    return {"photo": result.stations.rows, **observed(_parameters(result), result.stations)}


def _parameters(result: AdjustedCollection) -> list[str]:
    """Return the names of parameters with their units."""
    given = result.collection
    return [f"{name}_{unit}".rstrip("_") for name, unit in zip(given.parameters, given.units, strict=True)]


_TABLES: dict[str, Callable[[AdjustedCollection], dict[str, Any]]] = {
    "photo": _photos,
    "point": _points,
    "image": _images,
    "control": _control,
    "station": _stations,
}
