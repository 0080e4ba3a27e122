"""Files of the result of a block (`docs/results.md`)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.io.column_table import NameColumn
from photogram.io.parquet import Column
from photogram.io.writing import Content
from photogram.messages import Message, Undetermined
from photogram.network import cameras, core_arrays, films, geometry, lens, moving_photos, refraction
from photogram.network import trajectories as motion
from photogram.network.motion import scanners
from photogram.network.observations import Observation
from photogram.network.passages import Passage
from photogram.network.unknowns import Unknown
from photogram.results import datum, features, parts
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
from photogram.results.tables import TABLE_FILES, TABLES
from photogram.statistics.findings import Removed
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import Result

KIND = "block"
_ANGLES = ("omega", "phi", "kappa")


def block_files(result: Result) -> dict[str, Content]:
    block = result.block
    photos, points = (np.arange(len(names)) for names in (block.photo_ids, block.point_ids))
    kinds = ("control", "check", "pass")
    of_points = np.argmax(result.point_kinds[np.newaxis] == np.array(kinds)[:, np.newaxis], axis=0)
    leading = {
        "photos": [_named("photo", block.photo_ids, photos)],
        "points": [
            _named("point", block.point_ids, points),
            Column("kind", NameColumn(list(kinds), of_points), "", "control (held), check (known) or pass"),
        ],
        "images": [
            _named("photo", block.photo_ids, block.image_photos),
            _named("point", block.point_ids, block.image_points),
        ],
    }
    if block.photo_cameras is not None:
        leading["photos"].append(_named("camera", block.camera_names, block.photo_cameras))
    tables = {name: sheet(TABLES[kind](result)) for name, kind in TABLE_FILES.items()}
    summary = {
        "title": block.title,
        "linear_unit": block.linear_unit,
        "image_unit": block.image_unit,
        "object_space": "geographic" if block.geographic else "rectangular",
        "rotation": "photo-to-ground" if block.photo_to_ground else "ground-to-photo",
        "status": result.status,
        "datum": str(result.datum),
        "degrees_of_freedom": result.degrees_of_freedom,
    }
    declared = parts_of_block(
        geographic=block.geographic, unit=block.linear_unit, image_unit=block.image_unit
    )
    scanned, images = scanners(block)[block.image_photos], declared["images"]
    if scanned.any():
        # Image coordinates of spherical cameras are angles; residuals and deviations are in the focal plane.
        units = ("1", "1") if scanned.all() else (f"{block.image_unit}; 1 of scanners",) * 2
        description = "measured {}; of scanners sample (x) and line (y)"
        images[0] = replace(images[0], units=units, description=description)
    return written(result, KIND, "block", declared, leading, tables, block.frame, summary)


def parts_of_block(*, geographic: bool, unit: str, image_unit: str) -> dict[str, list[Part]]:
    """Return the stored arrays of a block; the columns of those that are None do not exist."""
    places = ("longitude", "latitude", "height") if geographic else ("x", "y", "z")
    lengths = ("rad", "rad", unit) if geographic else (unit,) * 3
    turns = ("rad",) * 3
    both, units = (*places, *_ANGLES), (*lengths, *turns)
    check_sd = "standard deviation of the given {} of a check point; NaN if unknown"
    photos = [
        Part("photo_positions", places, lengths, "adjusted {}"),
        Part("photo_attitudes", _ANGLES, turns, "adjusted {}, M = M_kappa M_phi M_omega"),
        Part("photo_sd", both, units, "standard deviation of {}", "derived", "sd_"),
        Part("photo_cofactors", both, units, TRIANGLE, "matrix", "covariance"),
        Part("photo_redundancy", both, ("1",) * 6, REDUNDANCY, prefix="redundancy_"),
        Part("block.photo_positions", places, lengths, "initial {}", prefix="initial_"),
        Part("block.photo_attitudes", _ANGLES, turns, "initial {}", prefix="initial_"),
        Part("block.photo_position_sd", places, lengths, GIVEN_SD, prefix="given_sd_"),
        Part("block.photo_attitude_sd", _ANGLES, turns, GIVEN_SD, prefix="given_sd_"),
        Part("block.photo_positions_observed", places, lengths, "observed {}", prefix="observed_"),
        Part("block.photo_attitudes_observed", _ANGLES, turns, "observed {}", prefix="observed_"),
        Part("block.principal_distances", ("principal_distance",), (image_unit,), "signed as it was given"),
        Part("photo_order", ("elimination",), ("1",), "row of the photo that is eliminated in this place"),
        Part("photo_corrections", both, units, "corrections, iteration by iteration", "list", "corrections"),
    ]
    return {
        "photos": photos,
        "points": [
            *point_parts("block", places, lengths),
            Part("point_last_corrections", places, lengths, "last correction of {}", prefix="last_change_"),
            Part("block.point_check_sd", places, lengths, check_sd, prefix="check_sd_"),
        ],
        "images": image_parts("block", image_unit),
    }


def _named(kind: str, names: list[str], rows: np.ndarray) -> Column:
    return Column(kind, NameColumn(names, rows), "", f"name of the {kind}")


MODULES = (
    *(cameras, core_arrays, films, geometry, lens, motion, moving_photos),
    *(refraction, datum, features, parts),
)
CLASSES = (Message, Phrase, Removed, Undetermined)


def saved_classes() -> list[type]:
    """Return the classes that the document of a block may contain: those of modules, and subclasses."""
    found, bases = [*CLASSES], [Observation, Unknown, Passage]
    for module in MODULES:
        found += [
            each
            for each in vars(module).values()
            if isinstance(each, type) and each.__module__ == module.__name__
        ]
    while bases:
        own: list[Any] = bases.pop().__subclasses__()
        found, bases = [*found, *own], [*bases, *own]
    return found
