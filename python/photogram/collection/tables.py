"""The tables of an adjusted collection and its JSON document, which `docs/collection.md` describes."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram import _photocore
from photogram.collection.collection import POSE
from photogram.collection.result import AdjustedCollection
from photogram.io import json
from photogram.results.axes import image_axes
from photogram.results.document import network_members
from photogram.results.network_tables import TABLES, Terms, terms_of
from photogram.results.weakest import Determined, determined
from photogram.show.methods import columns_of, document_of
from photogram.show.quantity import Axis, Quantity, frame


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


@determined.register
@np.errstate(invalid="ignore")
def _(result: AdjustedCollection) -> Determined:
    """Turn w and t of P = R(w) X + t into the station and a turn about the axes of the photo.

    In w and t a photo far from the origin would look badly determined, whatever sees it.
    """
    pose = len(POSE)
    translations, cofactors = result.photo_parameters[:, 3:pose], result.photo_cofactors[:, :pose, :pose]
    vectors = np.ascontiguousarray(result.photo_parameters[:, :3])
    matrices, turns = _photocore.attitudes_from_numbers("rotation_vector_to_photo", vectors, np.eye(3))
    # The station is -A t, and A becomes A (I + [rho]).
    partials = np.zeros((len(vectors), pose, pose))
    partials[:, :3, :3] = matrices @ np.cross(translations[:, np.newaxis, :], turns, axisb=1, axisc=1)
    partials[:, :3, 3:] = -matrices
    partials[:, 3:, :3] = turns
    return Determined(
        stations=-np.einsum("pij,pj->pi", matrices, translations),
        points=result.point_positions,
        poses=partials @ cofactors @ partials.transpose(0, 2, 1),
        ranks=(np.diagonal(cofactors, axis1=1, axis2=2) > 0).sum(axis=1),
        point_cofactors=result.point_cofactors,
    )


@document_of.register(AdjustedCollection)
def to_json(result: AdjustedCollection) -> bytes:
    """Return the whole result as JSON (UTF-8). What is not a number is null."""
    document = {
        **network_members(result),
        "units": {
            **_units(result),
            "covariance": "products of these",
            "operations": "multiply-adds, each time the phase is carried out",
            "seconds": "s",
        },
        "conventions": {
            "camera": f"P = R(w) X + t, {result.collection.formula}",
            "residual": "observed minus computed",
            "difference": "adjusted minus given; standardized has its sign",
            "standardized": "residual / (sd x root of redundancy number), a priori unit weight",
            "covariance": "cofactors times covariance_scale",
            "cost": "half the sum that is minimised",
            "control, stations": "residual: given minus adjusted; sd 0: fixed, null: free",
        },
        "initial_cost": 0.5 * result.initial_weighted_sum_of_squares,
        "cost": result.cost,
        "weighted_sum_of_squares": result.weighted_sum_of_squares,
        "datum": [{"photo": photo, "parameter": parameter} for photo, parameter in result.datum],
        "camera": result.collection.camera,
        "parameters": result.collection.parameters,
    }
    return json.to_json(document)


def _units(result: AdjustedCollection) -> dict[str, str]:
    """Return the units of parameters, of positions and of residuals, what shares a unit together."""
    names, units = result.collection.parameters[6:], result.collection.units[6:]
    lengths = [name for name, unit in zip(names, units, strict=True) if unit]
    plain = [name for name, unit in zip(names, units, strict=True) if not unit]
    return {
        "w1, w2, w3": "rad",
        "t1, t2, t3, position": "unit of the object space",
        ", ".join([*lengths, "residual_px"]): "pixel",
        **({", ".join(plain): "1"} if plain else {}),
    }
