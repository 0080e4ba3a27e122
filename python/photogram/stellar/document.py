"""The JSON document of a calibration, and the exported camera; `docs/stellar-camera.md` describes them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import orjson

from photogram import _photocore
from photogram.angles import ARCSEC
from photogram.stellar.curves import distortion_curves, histogram, refraction_curves
from photogram.stellar.parameters import GROUPS, INDEX, NAMES, UNITS
from photogram.stellar.result import Result
from photogram.stellar.transformation import transformed_angles

__all__ = ["camera_document", "to_json"]

_FORMAT = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE


def to_json(result: Result) -> bytes:
    """Return the whole result as JSON (UTF-8). What is not a number is null."""
    return orjson.dumps(_document(result), option=_FORMAT)


def camera_document(result: Result) -> bytes:
    """Return the calibrated camera with its covariance as JSON: a prior for later adjustments."""
    chosen = [INDEX[name] for name in NAMES[9:22] if name in result.estimated]
    options = result.problem.options
    document = {
        "program": f"photogram {_photocore.__version__}",
        "kind": "stellar camera",
        "form": "distortion, then scale" if options.distortion_first else "scale, then distortion",
        "reference_principal_distance": options.distortion_first or None,
        "common_scale": options.common_scale,
        "parameters": {name: {"value": result.parameters[name], "unit": UNITS[name]} for name in NAMES[9:22]},
        "covariance": {
            "order": [NAMES[i] for i in chosen],
            "matrix": result.covariance[np.ix_(chosen, chosen)],
        },
        "m": result.mean_error,
        "degrees_of_freedom": result.degrees_of_freedom,
    }
    return orjson.dumps(document, option=_FORMAT)


def _document(result: Result) -> dict[str, Any]:
    estimated = [INDEX[name] for name in result.estimated]
    return {
        "program": f"photogram {_photocore.__version__}",
        "labels": result.problem.labels,
        "conventions": {
            "frame": "north, east, zenith (left-handed); azimuth from south, positive west",
            "longitude": "positive west",
            "residual": "computed minus measured; of stars adjusted minus catalogue",
            "standardized": "residual over its mean error",
            "covariance": "cofactors times m squared, in the units of the parameters",
            "iteration": "as published" if result.problem.options.as_published else "strict",
        },
        "m": result.mean_error,
        "m_computed": result.computed_mean_error,
        "m_unit": "m",
        "degrees_of_freedom": result.degrees_of_freedom,
        "counts": asdict(result.counts),
        "sums_of_squares": dict(zip(("plate", "stars", "parameters"), result.solved.sums, strict=True)),
        "iterations": [asdict(level) for level in result.levels],
        "stop": result.solved.stop,
        "converged": result.converged,
        "messages": [str(message) for message in result.messages],
        "parameters": _parameters(result),
        "covariance": {
            "order": result.estimated,
            "matrix": result.covariance[np.ix_(estimated, estimated)],
        },
        "stars": _stars(result),
        "images": _images(result),
        "axis_residual_um": None
        if result.solved.axis_residual is None
        else 1e6 * result.solved.axis_residual,
        "correlated": [{"parameters": [a, b], "correlation": r} for a, b, r in result.correlated()],
        "significance": result.significance(),
        "movement": [asdict(point) for point in result.movement],
        "combined": _combined(result),
        "pre_run": None
        if result.pre_run is None
        else {
            "points": result.pre_run.points,
            "stars": result.pre_run.stars,
            "residual_um": 1e6 * result.pre_run.residuals,
        },
        "transformed": _transformed(result),
        "distortion_curves": asdict(distortion_curves(result)) if result.problem.options.curves else None,
        "refraction_curves": {
            GROUPS[g]: asdict(refraction_curves(result, g))
            for g in range(3)
            if result.problem.options.refraction and result.solved.free[3 * g]
        },
        "histogram": {axis: asdict(histogram(values)) for axis, values in residual_classes(result).items()}
        if result.problem.options.histogram
        else None,
    }


def residual_classes(result: Result) -> dict[str, Any]:
    """Return residuals of known stars in x, y and both, metres."""
    chosen = result.solved.residuals[result.problem.known[result.problem.image_stars]]
    return {"x": chosen[:, 0], "y": chosen[:, 1], "x and y": chosen.ravel()}


def _parameters(result: Result) -> dict[str, dict[str, Any]]:
    errors, options = result.mean_errors, result.problem.options
    names = [name for name in NAMES if options.refraction or name not in NAMES[22:]]
    return {
        name: {
            "value": result.parameters[name],
            "mean_error": errors[name],
            "unit": UNITS[name],
            "given": float(result.problem.initial[INDEX[name]]),
            "estimated": name in result.estimated,
        }
        for name in names
    }


def _stars(result: Result) -> list[dict[str, Any]]:
    problem = result.problem
    columns = zip(
        problem.star_ids,
        problem.known.tolist(),
        result.solved.places.tolist(),
        (result.star_residuals / ARCSEC).tolist(),
        result.ellipses(),
        result.solved.star_redundancy.tolist(),
        result.star_standardized.tolist(),
        strict=True,
    )
    return [
        {
            "id": name,
            "known": known,
            "place_rad": place,
            "residual" if known else "correction": residual if known else [None, None],
            "ellipse": {
                "major_arcsec": ellipse.major / ARCSEC,
                "minor_arcsec": ellipse.minor / ARCSEC,
                "direction_rad": ellipse.direction,
            },
            "redundancy": redundancy,
            "standardized": standardized,
        }
        for name, known, place, residual, ellipse, redundancy, standardized in columns
    ]


def _images(result: Result) -> list[dict[str, Any]]:
    problem = result.problem
    columns = zip(
        problem.image_points,
        problem.image_stars.tolist(),
        problem.image_groups.tolist(),
        (1e6 * result.solved.residuals).tolist(),
        result.solved.redundancy.tolist(),
        result.standardized.tolist(),
        strict=True,
    )
    return [
        {
            "point": point,
            "star": problem.star_ids[star],
            "orientation": GROUPS[group],
            "residual_um": residual,
            "redundancy": redundancy,
            "standardized": standardized,
        }
        for point, star, group, residual, redundancy, standardized in columns
    ]


def _combined(result: Result) -> dict[str, Any] | None:
    combined = result.combined
    if combined is None:
        return None
    errors = combined.mean_error * np.sqrt(np.maximum(np.diag(combined.solved.cofactors), 0))
    return {
        "pairs": combined.pairs,
        "m": combined.mean_error,
        "degrees_of_freedom": result.degrees_of_freedom + combined.constraints,
        "parameters": {
            name: {"value": value, "mean_error": error, "unit": UNITS[name]}
            for name, value, error in zip(
                NAMES, combined.solved.parameters.tolist(), errors.tolist(), strict=True
            )
        },
    }


def _transformed(result: Result) -> dict[str, Any] | None:
    options = result.problem.options
    if options.reference is None:
        return None
    values = result.solved.parameters[:9].reshape(3, 3)
    return {
        GROUPS[g]: transformed_angles(values[g], result.problem.site, options.reference, options.pole)
        for g in range(3)
        if result.solved.free[3 * g]
    }
