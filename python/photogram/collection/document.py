"""The JSON document of an adjusted collection; `docs/collection.md` describes it."""

from __future__ import annotations

from typing import Any

from photogram.collection.result import AdjustedCollection
from photogram.io import json
from photogram.results.document import network_members
from photogram.show.methods import document_of

__all__ = ["to_json"]


@document_of.register(AdjustedCollection)
def to_json(result: AdjustedCollection) -> bytes:
    """Return the whole result as JSON (UTF-8). What is not a number is null."""
    return json.to_json(_document(result))


def _document(result: AdjustedCollection) -> dict[str, Any]:
    return {
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
