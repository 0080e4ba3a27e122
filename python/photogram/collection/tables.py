"""What the photos, points and images of an adjusted collection are called, and how well poses are known."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.collection.collection import POSE
from photogram.collection.result import AdjustedCollection
from photogram.results.axes import Determined, Terms, image_axes
from photogram.show.quantity import Axis, Quantity


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


@np.errstate(invalid="ignore")
def determined(result: AdjustedCollection) -> Determined:
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
