"""The tables of an adjusted collection; photos and points are numbers from 0."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.collection.result import AdjustedCollection
from photogram.results.axes import image_axes
from photogram.results.network_tables import TABLES, Terms, terms_of
from photogram.show.methods import columns_of
from photogram.show.quantity import Axis, Quantity, frame

__all__: list[str] = []


@columns_of.register(AdjustedCollection)
def _columns(result: AdjustedCollection, what: str) -> dict[str, Any]:
    return frame(TABLES[what](result))


@terms_of.register(AdjustedCollection)
def _terms(result: AdjustedCollection) -> Terms:
    given = result.collection
    named = zip(given.parameters, given.units, strict=True)
    return Terms(
        photos=np.arange(len(result.photo_parameters)),
        points=np.arange(len(result.point_positions)),
        photo_axes=tuple(Axis.of(name, unit, f"_{unit}".rstrip("_")) for name, unit in named),
        point_axes=tuple(Axis.of(name, "") for name in "XYZ"),
        image_axes=image_axes("px"),
        photo_values=result.photo_parameters,
        layers={"Rotations": slice(0, 3), "Translations": slice(3, 6), "Cameras": slice(6, None)},
        parts={"parameters": slice(None)},
        of_photos=(
            Quantity(
                result.photo_images,
                name="images",
                member="images",
                about="number of images",
                head="Images",
                decimals=0,
            ),
        ),
    )
