"""Document of an adjusted collection for reports, HTML pages and JSON (`docs/collection.md`)."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.collection.parameters import POSE
from photogram.plots.accessor import drawings
from photogram.results.network_document import network_document, network_members, size_section, used_fact
from photogram.results.network_sections import control_section, stations_section
from photogram.results.network_tables import image_axes
from photogram.results.parts import Terms
from photogram.show.page import Document, Fact, Section, conventions
from photogram.show.quantity import Axis, Quantity

if TYPE_CHECKING:
    from photogram.collection import AdjustedCollection


@np.errstate(over="ignore", invalid="ignore")
def collection_document(result: AdjustedCollection) -> Document:
    given, variance = result.collection, result.variance_of_unit_weight
    size = [
        used_fact("Photos", result.photo_images > 0),
        used_fact("Points", result.used_points),
        used_fact("Image points", result.used_images),
        Fact("Camera", given.camera, note=f"unknowns of a photo: {', '.join(given.parameters)}"),
    ]
    if result.datum:
        held = [f"{name} of photo {photo}" for photo, name in result.datum]
        size.append(Fact("Datum", "held parameters", note=", ".join(held)))
    if behind := int(np.count_nonzero(result.point_rays_behind)):
        size.append(Fact.of("Points behind a camera", behind, tone="look"))
    first = 0.5 * result.initial_weighted_sum_of_squares
    good = [
        Fact.of("Cost at first, half the sum of squares", first, figures=7),
        Fact.of("Cost", result.cost, figures=7),
        Fact.of("Variance of unit weight", variance, decimals=6),
    ]
    pictures = drawings(result)
    cameras = Section("cameras", "Cameras", [pictures[name] for name in ("distortion", "correlations")])
    return network_document(
        result,
        "Adjustment of a collection of photos",
        size_section(result, size, good),
        [control_section(result), stations_section(result), cameras],
        photos=int(np.count_nonzero(result.photo_images)),
        members=partial(_members, result),
    )


def _members(result: AdjustedCollection) -> dict[str, Any]:
    named = zip(result.collection.parameters[len(POSE) :], result.collection.units[len(POSE) :], strict=True)
    lengths, plain = list[str](), list[str]()
    for name, unit in named:
        (lengths if unit else plain).append(name)
    return {
        **network_members(result),
        "units": {
            "w1, w2, w3": "rad",
            "t1, t2, t3, position": "unit of the object space",
            ", ".join([*lengths, "residual_px"]): "pixel",
            **({", ".join(plain): "1"} if plain else {}),
            "covariance": "products of these",
            "operations": "multiply-adds, each time the phase is carried out",
            "seconds": "s",
        },
        "conventions": {
            "camera": f"P = R(w) X + t, {result.collection.formula}",
            **conventions("collection"),
        },
        "initial_cost": 0.5 * result.initial_weighted_sum_of_squares,
        "cost": result.cost,
        "weighted_sum_of_squares": result.weighted_sum_of_squares,
        "datum": [{"photo": photo, "parameter": parameter} for photo, parameter in result.datum],
        "camera": result.collection.camera,
        "parameters": result.collection.parameters,
    }


def collection_terms(result: AdjustedCollection) -> Terms:
    """Return names and components of photos, points and images of a collection."""
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
