"""The JSON document of a run; `docs/perspective-center.md` describes it."""

from __future__ import annotations

import math
from typing import Any

from photogram import _photocore
from photogram.io import json
from photogram.perspective_center.batch import Run
from photogram.perspective_center.solution import INTERIOR, PerspectiveCenter
from photogram.perspective_center.tables import points
from photogram.show.quantity import records

__all__ = ["to_json"]


def to_json(run: Run) -> bytes:
    """Return a run as JSON (UTF-8). What is not a number is null."""
    document = {
        "program": f"photogram {_photocore.__version__}",
        "units": {
            "perspective_center": "unit of the model",
            "attitude_minutes": "omega, phi, kappa in minutes of arc, 3437.7468 to the radian",
            "standard_errors": "unit of the model; minutes of arc",
            "sigma0_plate": "mm",
            "sigma0_model": "unit of the model",
            "covariance": "omega, phi, kappa in rad, X, Y, Z in the unit of the model, mm; products",
            "interior": "principal distance c, principal point xp, yp, mm; errors of the unknown ones",
            "mean": "unit of the model",
            "residual": "measured minus projected, unit of the model",
            "radial_distortion": "mm on the plate, positive outward",
            "standardized": "residual / its own standard deviation, from sigma0_plate",
            "studentized": "residual / its own standard deviation, from that of all others: Student",
        },
        "messages": [str(message) for message in run.messages],
        "error": None if run.stop is None else str(run.stop.error),
        "sets": [_set(result) for result in run.results],
    }
    return json.to_json(document)


def _set(result: PerspectiveCenter) -> dict[str, Any]:
    names = ("X", "Y", "Z", "omega_minutes", "phi_minutes", "kappa_minutes")
    errors = [None] * 6 if result.standard_errors is None else result.standard_errors.tolist()
    return {
        "title": result.grid.title,
        "data_set": result.grid.number,
        "perspective_center": result.position.tolist(),
        "attitude_minutes": result.attitude_minutes.tolist(),
        "standard_errors": dict(zip(names, errors, strict=True)),
        "interior": dict(zip(INTERIOR, result.interior.tolist(), strict=True)),
        "interior_standard_errors": {}
        if result.interior_errors is None
        else dict(zip(result.unknown, result.interior_errors.tolist(), strict=True)),
        "sigma0_plate": result.sigma0_plate,
        "sigma0_model": result.sigma0_model,
        "covariance": None if result.covariance is None else result.covariance.tolist(),
        "test": {
            "of": "studentized",
            "limit": result.limit if math.isfinite(result.limit) else None,
            "outliers": [[result.grid.ids[row], "XY"[axis]] for row, axis in result.outliers],
        },
        "verdict": result.verdict.document(),
        "converged": result.converged,
        "iterations": len(result.cycles),
        "points": records(points(result)),
    }
