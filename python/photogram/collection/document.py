"""The JSON document of an adjusted collection; `docs/collection.md` describes it."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram import _photocore
from photogram.collection.collection import PARAMETERS
from photogram.collection.solution import CollectionSolution
from photogram.io import json

__all__ = ["to_json"]


def to_json(result: CollectionSolution) -> bytes:
    """Return the whole result as JSON (UTF-8). What is not a number is null."""
    return json.to_json(_document(result))


def _document(result: CollectionSolution) -> dict[str, Any]:
    return {
        "program": f"photogram {_photocore.__version__}",
        "units": {
            "w1, w2, w3": "rad",
            "t1, t2, t3, position": "unit of the object space",
            "f, residual_px": "pixel",
            "k1, k2": "1",
            "covariance": "products of these",
            "operations": "multiply-adds, each time the phase is carried out",
            "seconds": "s",
        },
        "conventions": {
            "camera": "P = R(w) X + t, p = -(P1, P2) / P3, image = f (1 + k1 p^2 + k2 p^4) p",
            "residual": "observed minus computed",
            "standardized": "residual / (sd x root of redundancy number), a priori unit weight",
            "covariance": "cofactors times covariance_scale",
            "cost": "half the sum that is minimised",
        },
        "status": result.status,
        "messages": [str(message) for message in result.messages],
        "loss": None if result.loss is None else {"name": result.loss[0], "scale": result.loss[1]},
        "initial_cost": 0.5 * result.initial_weighted_sum_of_squares,
        "cost": result.cost,
        "iterations": [
            {
                "number": iteration.number,
                "cost": 0.5 * iteration.weighted_sum_of_squares,
                "damping": iteration.damping,
            }
            for iteration in result.iterations
        ],
        "weighted_sum_of_squares": result.weighted_sum_of_squares,
        "degrees_of_freedom": result.degrees_of_freedom,
        "variance_of_unit_weight": result.variance_of_unit_weight,
        "covariance_scale": result.covariance_scale,
        "datum": [{"photo": photo, "parameter": parameter} for photo, parameter in result.datum],
        "parameters": PARAMETERS,
        "photos": _photos(result),
        "points": _points(result),
        "observations": _observations(result),
        "ordering": result.ordering,
        "predictions": dict(result.predictions),
        "operations": dict(result.operations),
        "seconds": dict(result.seconds),
    }


def _photos(result: CollectionSolution) -> list[dict[str, Any]]:
    columns = zip(
        result.photo_parameters, result.photo_covariances, result.photo_images.tolist(), strict=True
    )
    return [
        {"parameters": parameters, "covariance": np.ascontiguousarray(covariance), "images": images}
        for parameters, covariance, images in columns
    ]


def _points(result: CollectionSolution) -> list[dict[str, Any]]:
    used = np.flatnonzero(result.used_points)
    columns = zip(
        used.tolist(),
        result.point_positions[used],
        result.point_covariances[used],
        result.point_rays[used].tolist(),
        strict=True,
    )
    return [
        {"number": number, "position": position, "covariance": covariance, "rays": rays}
        for number, position, covariance, rays in columns
    ]


def _observations(result: CollectionSolution) -> list[dict[str, Any]]:
    collection, used = result.collection, result.used_images
    columns = zip(
        collection.image_photos[used].tolist(),
        collection.image_points[used].tolist(),
        result.residuals[used],
        result.redundancy[used],
        result.standardized[used],
        result.image_weights[used].tolist(),
        strict=True,
    )
    return [
        {
            "photo": photo,
            "point": point,
            "residual_px": residual,
            "redundancy": redundancy,
            "standardized": standardized,
            "weight_factor": weight,
        }
        for photo, point, residual, redundancy, standardized, weight in columns
    ]
