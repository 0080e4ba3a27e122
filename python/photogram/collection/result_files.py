"""Files of the result of a collection in a folder; photos and points are numbered from 0."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.io.parquet import Column
from photogram.io.writing import Content
from photogram.network.geometry import Frame
from photogram.results.network_tables import TABLES
from photogram.results.result_files import (
    GIVEN_SD,
    REDUNDANCY,
    TRIANGLE,
    Part,
    image_parts,
    point_parts,
    sheet,
    written,
)

if TYPE_CHECKING:
    from photogram.collection import AdjustedCollection


KIND = "collection"
_AXES = ("x", "y", "z")
_TABLES = {"control": "control", "stations": "station"}  # Tables of files, with their types


def collection_files(result: AdjustedCollection) -> dict[str, Content]:
    given = result.collection
    leading = {
        "photos": [_numbers("photo", np.arange(len(given.photo_parameters)))],
        "points": [_numbers("point", np.arange(len(given.point_positions)))],
        "images": [_numbers("photo", given.image_photos), _numbers("point", given.image_points)],
    }
    tables = {name: sheet(TABLES[kind](result)) for name, kind in _TABLES.items()}
    summary = {
        "camera": given.camera,
        "status": result.status,
        "degrees_of_freedom": result.degrees_of_freedom,
        "cost": result.cost,
    }
    parts = collection_parts(given.parameters, given.units)
    return written(result, KIND, "collection", parts, leading, tables, Frame(), summary)


def collection_parts(names: tuple[str, ...], units: tuple[str, ...]) -> dict[str, list[Part]]:
    """Return the columns of the tables of a collection."""
    known = tuple(unit or "1" for unit in units)
    plain = ("1",) * len(names)
    photos = [
        Part("photo_images", ("images",), ("1",), "number of image points"),
        Part("photo_parameters", names, known, "adjusted {}"),
        Part("photo_sd", names, known, "standard deviation of {}", "derived", "sd_"),
        Part("photo_cofactors", names, known, TRIANGLE, "matrix", "covariance"),
        Part("photo_redundancy", names, plain, REDUNDANCY, prefix="redundancy_"),
        Part("collection.photo_parameters", names, known, "initial {}", prefix="initial_"),
        Part("collection.photo_sd", names, known, GIVEN_SD, prefix="given_sd_"),
    ]
    behind = Part("point_rays_behind", ("rays_behind",), ("1",), "images with the point behind the camera")
    return {
        "photos": photos,
        "points": [behind, *point_parts("collection", _AXES, ("",) * 3)],
        "images": image_parts("collection", "px"),
    }


def _numbers(kind: str, rows: np.ndarray) -> Column:
    return Column(kind, rows.astype(np.int64), "", f"number of the {kind}, from 0")
