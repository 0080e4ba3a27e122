"""The JSON document of an orientation; `docs/absolute-orientation.md` describes it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from photogram import _photocore
from photogram.absolute_orientation.orientation import Orientation
from photogram.absolute_orientation.similarity import Similarity
from photogram.absolute_orientation.tables import left_out, stations
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io import json
from photogram.io.files import read_bytes
from photogram.show.methods import document_of
from photogram.show.quantity import records
from photogram.statistics.limits import GlobalTest


@document_of.register(Orientation)
def to_json(result: Orientation) -> bytes:
    """Return the whole result as JSON (UTF-8); its points are the stations without control."""
    return b"".join([*without_points(result), point_rows(*result.transform_points()), b"\n  ]\n}\n"])


def without_points(result: Orientation) -> Iterator[bytes]:
    """Return the document up to the first of its points, so that any number of them can follow."""
    yield json.to_json(_head(result)).removesuffix(b"\n}\n")
    yield b',\n  "points": ['


def point_rows(ids: Iterable[str], positions: Floats, covariances: Floats) -> bytes:
    """Return points as JSON objects, one a line, with commas between them."""
    rows = zip(ids, positions.tolist(), covariances.tolist(), strict=True)
    objects = (
        orjson.dumps({"id": name, "position": position, "covariance": covariance})
        for name, position, covariance in rows
    )
    return b"\n    " + b",\n    ".join(objects) if len(positions) else b""


def _head(result: Orientation) -> dict[str, Any]:
    similarity = result.similarity
    return {
        "program": f"photogram {_photocore.__version__} absolute-orientation",
        "units": _units(result),
        "conventions": {
            "model": "x = s A X + B, A = K(kappa) Phi(phi) Omega(omega); x model, X control",
            "covariance": "omega, phi, kappa, scale, b1, b2, b3; cofactors times covariance_scale",
            "residual": "u = s X - A^T (x - B): control axes, model units; null where unknown",
            "residual_ground": "u / s: given minus transformed, ground units",
            "residual_model": "v = s A X + B - x with the adjusted X: model axes, model units",
            "standardized": "residual / its standard deviation: a priori if any were given, else by sigma0",
            "studentized": "residual / its standard deviation by sigma0 of all others: Student",
            "deviation_factor": "what standard deviations of points to be transformed are multiplied by",
        },
        "method": result.method,
        "start": result.started,
        "status": result.status,
        "usable": result.usable,
        "messages": result.problems,
        "iterations": len(result.iterations) if result.cycles is None else len(result.cycles),
        "initial": {
            "scale": result.initial.scale,
            "angles_rad": result.initial.angles,
            "translation": result.initial.translation,
        },
        "scale": similarity.scale,
        "scale_held": result.scale_held,
        "rotation": similarity.rotation,
        "angles_rad": similarity.angles,
        "translation": similarity.translation,
        "covariance": similarity.covariance,
        "covariance_scale": result.covariance_scale,
        "deviation_factor": similarity.deviation_factor,
        "rms": result.rms,
        "sigma0": result.sigma0,
        "degrees_of_freedom": result.degrees_of_freedom,
        "known_coordinates": result.known,
        "weighted_sum_of_squares": result.weighted_sum_of_squares,
        "global_test": _global_test(result.test),
        "verdict": result.verdict.document(),
        "test": {
            "of": "standardized" if result.decided_by_w else "studentized",
            "limit": result.limit if np.isfinite(result.limit) else None,
            "outliers": [[result.stations.ids[row], "XYZ"[axis]] for row, axis in result.outliers],
        },
        "condition": result.condition,
        "centres": {"control": similarity.control_centre, "model": similarity.model_centre},
        "control": records(stations(result)),
        "rejected": records(left_out(result)),
    }


def _global_test(test: GlobalTest | None) -> dict[str, Any] | None:
    if test is None:
        return None
    return {
        "variance_of_unit_weight": test.variance,
        "limits": test.limits,
        "probability": test.probability,
        "rejected_high": test.rejected_high,
        "rejected_low": test.rejected_low,
    }


def _units(result: Orientation) -> dict[str, str]:
    ground, model = result.stations.ground_unit, result.stations.model_unit
    return {
        "scale": f"{model} / {ground}",
        "angles_rad": "rad",
        "translation": model,
        "covariance": "products of rad, scale and translation",
        "rms": model,
        "sigma0": "1" if result.weighted else model,
        "residual": model,
        "residual_ground": ground,
        "residual_model": model,
        "adjusted": ground,
        "position": ground,
        "position_covariance": f"{ground}^2",
    }


def read_similarity(path: Path, *, usable: bool = False) -> Similarity:
    """Read the parameters, with their covariance, out of a JSON document.

    Raises InputError: the file cannot be read, is no such document, or holds an orientation that is not to be
    used.

    Parameters
    ----------
    path
        The document.
    usable
        Whether to refuse an orientation that has not converged, or in which something grave was found.
    """
    with json.holding("result of an absolute orientation", path):
        found = orjson.loads(read_bytes(path))
        if usable and not found["usable"]:
            reasons = "; ".join(map(str, found["messages"])) or found["status"]
            raise InputError(f"holds an orientation that is not to be used: {reasons}")
        centres = found["centres"]
        return Similarity.from_parameters(
            found["scale"],
            found["rotation"],
            found["translation"],
            _known(found["covariance"]),
            control_centre=centres["control"],
            model_centre=centres["model"],
            deviation_factor=found["deviation_factor"],
        )


def _known(covariance: list[list[Any]] | None) -> list[list[Any]] | None:
    """Return a covariance; None when it, or an element of it, is unknown."""
    if covariance is None or any(value is None for row in covariance for value in row):
        return None
    return covariance
