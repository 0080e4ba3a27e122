"""The JSON document of a calibration; `docs/stellar-camera.md` describes it."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.io import json
from photogram.show.angles import ARCSEC
from photogram.stellar.comparator_frame import comparator_frame
from photogram.stellar.curves import (
    distortion_curves,
    histogram,
    refraction_curves,
    residual_classes,
    star_means,
)
from photogram.stellar.movement import fictitious_points
from photogram.stellar.parameters import GROUPS, INDEX, NAMES, UNITS
from photogram.stellar.pointing import transformed_angles
from photogram.stellar.result import Ellipse, Result, Stage


def to_json(result: Result) -> bytes:
    """Return the whole result as JSON (UTF-8). What is not a number is null."""
    return json.to_json(_document(result))


def _document(result: Result) -> dict[str, Any]:
    options = result.problem.options
    return {
        "program": f"photogram {_photocore.__version__}",
        "labels": result.problem.labels,
        "conventions": {
            "frame": "north, east, zenith (left-handed); azimuth from south, positive west",
            "longitude": "positive west",
            "residual": "computed minus measured; of stars adjusted minus catalogue",
            "standardized": "residual over its mean error",
            "covariance": "cofactors times m squared, in the units of the parameters",
            "iteration": "as published" if options.as_published else "strict",
        },
        **_solution(result),
        "iterations": [asdict(level) for level in result.levels],
        "stop": result.solved.stop,
        "converged": result.converged,
        "verdict": result.verdict.document(),
        "solutions": [_stage(stage) for stage in result.stages],
        "messages": [str(message) for message in result.messages],
        "correlated": [{"parameters": [a, b], "correlation": r} for a, b, r in result.correlated()],
        "significance": result.significance(),
        "movement": [asdict(point) for point in result.movement],
        "fictitious_points": [asdict(point) for point in fictitious_points(result)]
        if result.movement
        else [],
        "pre_run": _pre_run(result),
        "histogram": {axis: asdict(histogram(values)) for axis, values in residual_classes(result).items()}
        if options.histogram
        else None,
        "combined": None
        if result.combined is None
        else {"pairs": result.combined.pairs, **_solution(result.combined)},
    }


def _solution(result: Result) -> dict[str, Any]:
    """Return what the solution with separate attitudes and the combined one have alike."""
    estimated = [INDEX[name] for name in result.estimated]
    options, axis = result.problem.options, result.solved.axis_residual
    return {
        "m": result.mean_error,
        "m_computed": result.computed_mean_error,
        "m_unit": "m",
        "degrees_of_freedom": result.degrees_of_freedom,
        "counts": asdict(result.counts),
        "sums_of_squares": dict(zip(("plate", "stars", "parameters"), result.solved.sums, strict=True)),
        "parameters": _parameters(result),
        "covariance": {
            "order": result.estimated,
            "matrix": result.covariance[np.ix_(estimated, estimated)],
        },
        "stars": _stars(result),
        "images": _images(result),
        "star_means": _means(result),
        "axis_residual_um": None if axis is None else 1e6 * axis,
        "transformed": _transformed(result),
        "comparator_frame": None
        if options.comparator_angle is None
        else asdict(comparator_frame(result, options.comparator_angle)),
        "distortion_curves": asdict(distortion_curves(result)) if options.curves else None,
        "refraction_curves": {
            GROUPS[g]: asdict(refraction_curves(result, g))
            for g in range(3)
            if options.refraction and result.solved.free[3 * g]
        },
    }


def _stage(stage: Stage) -> dict[str, Any]:
    """Describe one of the solutions; its determinant is in the units of the parameters."""
    return {
        "solution": stage.solution,
        **asdict(stage.counts),
        "degrees_of_freedom": stage.counts.degrees_of_freedom,
        "iterations": len(stage.levels) - 1,
        "stop": stage.stop,
        "converged": stage.converged,
        "log10_determinant": stage.log_determinant / math.log(10),
    }


def _parameters(result: Result) -> dict[str, dict[str, Any]]:
    errors, options = result.mean_errors, result.problem.options
    names = [name for name in NAMES if options.refraction or name not in NAMES[22:]]
    return {
        name: {
            "value": result.parameters[name],
            "mean_error": errors[name],
            "unit": UNITS[name],
            "given": float(result.problem.initial[INDEX[name]]),
            "weight": float(result.problem.parameter_weights[INDEX[name], INDEX[name]]),
            "estimated": name in result.estimated,
        }
        for name in names
    }


def _stars(result: Result) -> list[dict[str, Any]]:
    problem = result.problem
    unknown = {direction.star: direction for direction in result.directions()}
    columns = zip(
        problem.star_ids,
        problem.star_names or problem.star_ids,
        problem.known.tolist(),
        result.solved.places.tolist(),
        (result.star_residuals / ARCSEC).tolist(),
        result.ellipses(),
        result.solved.star_redundancy.tolist(),
        result.star_standardized.tolist(),
        strict=True,
    )
    stars = []
    for star, name, known, place, residual, ellipse, redundancy, standardized in columns:
        document = {
            "id": star,
            "name": name,
            "known": known,
            "place_rad": place,
            "ellipse": _ellipse(ellipse),
        }
        if known:
            document |= {"residual": residual, "redundancy": redundancy, "standardized": standardized}
        else:
            direction = unknown[star]
            document |= {
                "correction": [value / ARCSEC for value in direction.correction],
                "azimuth_rad": direction.azimuth,
                "elevation_rad": direction.elevation,
                "m_i": direction.image_mean_error,
                "orientation_ellipse": _ellipse(direction.orientation),
                "published_ellipse": _ellipse(direction.published),
            }
        stars.append(document)
    return stars


def _ellipse(ellipse: Ellipse) -> dict[str, float]:
    return {
        "major_arcsec": ellipse.major / ARCSEC,
        "minor_arcsec": ellipse.minor / ARCSEC,
        "direction_rad": ellipse.direction,
    }


def _images(result: Result) -> list[dict[str, Any]]:
    problem = result.problem
    columns = zip(
        problem.image_points,
        problem.image_stars.tolist(),
        problem.image_groups.tolist(),
        problem.image_xy.tolist(),
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
            "xy_m": xy,
            "residual_um": residual,
            "redundancy": redundancy,
            "standardized": standardized,
        }
        for point, star, group, xy, residual, redundancy, standardized in columns
    ]


def _means(result: Result) -> list[dict[str, Any]]:
    """Return means over the images of each star with two at least."""
    return [
        {
            "star": star,
            "xy_m": xy,
            "residual_um": 1e6 * v,
            "radial_um": 1e6 * radial,
            "tangential_um": 1e6 * along,
        }
        for star, xy, v, (radial, along) in star_means(result)
    ]


def _pre_run(result: Result) -> dict[str, Any] | None:
    found = result.pre_run
    if found is None:
        return None
    return {"points": found.points, "stars": found.stars, "residual_um": 1e6 * found.residuals}


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
