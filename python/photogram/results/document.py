"""The JSON document of an adjusted block; `docs/json.md` describes it."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.io import json
from photogram.results.calibration_report import calibration_members
from photogram.results.features_report import features_document
from photogram.results.report import problems_of
from photogram.results.result import Result, SumsByKind
from photogram.results.weakest import weakest_photos, weakest_points
from photogram.show.ways import document_of

if TYPE_CHECKING:
    from photogram.arguments.types import Floats

__all__ = ["to_json"]


@document_of.register(Result)
def to_json(result: Result) -> bytes:
    """Return the whole result as JSON (UTF-8). What is not a number is null."""
    return json.to_json(_document(result))


def _document(result: Result) -> dict[str, Any]:
    sums = result.sums_of_squares
    return {
        "program": f"photogram {_photocore.__version__}",
        "title": result.block.title,
        "units": _units(result),
        "conventions": {
            "object_space": "geographic" if result.block.geographic else "rectangular",
            "rotation": "photo-to-ground" if result.block.photo_to_ground else "ground-to-photo",
            "attitude": "omega, phi, kappa; M = M_kappa M_phi M_omega",
            "residual": "observed minus computed",
            "standardized": "residual / (sd x root of redundancy number), a priori unit weight",
            "covariance": "cofactors times covariance_scale",
            "difference": "adjusted minus given",
            "control, stations": "standardized: sign of the difference; sd 0: fixed, null: free or not held",
        },
        "datum": result.datum.document(),
        "refraction": asdict(result.block.refraction) if result.block.refraction else None,
        "status": result.status,
        "problems": problems_of(result),
        "messages": [str(message) for message in result.messages],
        "loss": {"name": result.loss[0], "scale": result.loss[1]} if result.loss else None,
        "initial_weighted_sum_of_squares": result.initial_weighted_sum_of_squares,
        "iterations": [
            {
                "number": iteration.number,
                "weighted_sum_of_squares": iteration.weighted_sum_of_squares,
                "largest_change_sd": iteration.largest_change,
                "damping": iteration.damping,
            }
            for iteration in result.iterations
        ],
        "weighted_sum_of_squares": _by_kind(sums),
        "redundancy": None if result.redundancies is None else _by_kind(result.redundancies),
        "degrees_of_freedom": result.degrees_of_freedom,
        "unit_variance": result.unit_variance,
        "variance_of_unit_weight": result.variance_of_unit_weight,
        "global_test": _global_test(result),
        "verdict": result.verdict.document(),
        "reliability": summary.document() if (summary := result.reliability_summary) else None,
        "covariance_scale": result.covariance_scale,
        "photos": _photos(result),
        **(
            {"cameras": _cameras(result), "calibrations": calibration_members(result)}
            if result.cameras
            else {}
        ),
        **({"unknowns": _unknowns(result)} if result.unknowns else {}),
        **({} if result.features is None else {"features": features_document(result.features)}),
        "points": _points(result),
        "observations": _observations(result),
        "observations_beside_images": _beside_images(result),
        "control": _control(result),
        "stations": _stations(result),
        "check_points": _check_points(result),
        "weakest": {
            "points": [vars(each) for each in weakest_points(result)],
            "photos": [vars(each) for each in weakest_photos(result)],
        },
        "dropped_points": [{"id": name, "reason": reason} for name, reason in result.dropped.items()],
        "ordering": result.ordering,
        "predictions": dict(result.predictions),
        "operations": dict(result.operations),
        "seconds": dict(result.seconds),
    }


def _by_kind(sums: SumsByKind) -> dict[str, float]:
    return {
        "camera": sums.camera,
        "ground": sums.ground,
        "plates": sums.plates,
        "observations": sums.observations,
        "total": sums.total,
    }


def _units(result: Result) -> dict[str, str]:
    linear = result.block.linear_unit
    geographic, unit = result.block.geographic, result.block.image_unit
    return {
        "position": f"longitude deg, latitude deg, height {linear}" if geographic else linear,
        "water_level": linear,
        "position_covariance": f"longitude rad, latitude rad, height {linear}; products"
        if geographic
        else f"{linear}^2",
        "attitude": "rad",
        "attitude_covariance": "rad^2",
        "covariance": "products of the units of position_covariance and rad",
        f"residual_{unit}": unit,
        "position_difference": f"longitude deg, latitude deg, height {linear}" if geographic else linear,
        "position_sd": f"longitude deg, latitude deg, height {linear}" if geographic else linear,
        "attitude_difference_rad": "rad",
        "attitude_sd_rad": "rad",
        "difference": f"longitude deg, latitude deg, height {linear}" if geographic else linear,
        "operations": "multiply-adds, each time the phase is carried out",
        "seconds": "s",
    }


def _outward(result: Result, positions: Floats) -> Floats:
    """Longitude and latitude in degrees, as the document has them."""
    if not result.block.geographic:
        return positions
    outward = positions.copy()
    outward[:, :2] = np.degrees(outward[:, :2])
    return outward


def _photos(result: Result) -> list[dict[str, Any]]:
    columns = zip(
        result.block.photo_ids,
        _outward(result, result.photo_positions).tolist(),
        result.photo_attitudes.tolist(),
        result.photo_covariances,
        strict=True,
    )
    return [
        {
            "id": name,
            "position": position,
            "attitude_rad": attitude,
            "position_covariance": covariance[:3, :3].tolist(),
            "attitude_covariance": covariance[3:, 3:].tolist(),
            "covariance": covariance.tolist(),
        }
        for name, position, attitude, covariance in columns
    ]


def _cameras(result: Result) -> list[dict[str, Any]]:
    return [
        {
            "name": each.name,
            "model": each.camera.model,
            "image_unit": each.camera.unit,
            "photos": each.photos,
            "images": each.images,
            "parameters": [
                {"name": name, "unit": each.camera.unit_of(name), "value": value, "sd": sd, "given": given}
                | {"sd_given": sd_given, "redundancy": redundancy}
                for name, value, sd, given, sd_given, redundancy in zip(
                    each.names,
                    each.values.tolist(),
                    each.sd.tolist(),
                    each.given.values.tolist(),
                    each.given.deviations.tolist(),
                    each.redundancy.tolist(),
                    strict=True,
                )
            ],
            "covariance": each.covariance.tolist(),
        }
        for each in result.cameras
    ]


def _unknowns(result: Result) -> list[dict[str, Any]]:
    return [
        {
            "kind": each.kind,
            "name": each.name,
            "position": each.position.tolist(),
            "matrix": each.attitude.tolist(),
            "observations": each.observations,
            "components": list(each.components),
            "units": list(each.units),
            "sd_given": each.given.deviations.tolist(),
            "value": each.values.tolist(),
            "change": each.change.tolist(),
            "sd": each.sd.tolist(),
            "redundancy": each.redundancy.tolist(),
            "standardized": each.standardized.tolist(),
            "covariance": each.covariance.tolist(),
        }
        for each in result.unknowns
    ]


def _points(result: Result) -> list[dict[str, Any]]:
    columns = zip(
        result.block.point_ids,
        _outward(result, result.point_positions).tolist(),
        result.point_covariances.tolist(),
        result.point_rays.tolist(),
        result.point_kinds.tolist(),
        strict=True,
    )
    return [
        {"id": name, "position": position, "covariance": covariance, "rays": rays, "kind": kind}
        for name, position, covariance, rays, kind in columns
        if rays
    ]


def _observations(result: Result) -> list[dict[str, Any]]:
    block, used = result.block, result.used_images
    columns = zip(
        block.image_photos[used].tolist(),
        block.image_points[used].tolist(),
        result.residuals[used].tolist(),
        result.redundancy[used].tolist(),
        result.standardized[used].tolist(),
        result.image_weights[used].tolist(),
        strict=True,
    )
    return [
        {
            "photo": block.photo_ids[photo],
            "point": block.point_ids[point],
            f"residual_{block.image_unit}": residual,
            "redundancy": redundancy,
            "standardized": standardized,
            **({"weight_factor": weight} if result.loss else {}),
        }
        for photo, point, residual, redundancy, standardized, weight in columns
    ]


def _beside_images(result: Result) -> list[dict[str, Any]]:
    return [
        {
            "kind": each.kind,
            "of": list(result.block.observations[row].of),
            "components": list(each.components),
            "units": list(each.units),
            "sd": each.sd[k].tolist(),
            "residual": each.residuals[k].tolist(),
            "redundancy": each.redundancy[k].tolist(),
            "standardized": each.standardized[k].tolist(),
            **({"weight_factor": each.weights[k].item()} if result.loss else {}),
        }
        for each in result.kinds.values()
        for k, row in enumerate(each.rows.tolist())
        if np.isfinite(each.squares[k])
    ]


def _global_test(result: Result) -> dict[str, Any] | None:
    test = result.global_test
    if test is None:
        return None
    return {
        "variance": test.variance,
        "limits": test.limits,
        "level": test.level,
        "probability": test.probability,
        "rejected": "high" if test.rejected_high else "low" if test.rejected_low else None,
    }


def _control(result: Result) -> list[dict[str, Any]]:
    given = result.control
    columns = zip(
        given.rows.tolist(),
        _outward(result, given.differences).tolist(),
        _outward(result, given.sd).tolist(),
        given.redundancy.tolist(),
        given.tests.tolist(),
        strict=True,
    )
    return [
        {
            "id": result.block.point_ids[row],
            "position_difference": residual,
            "position_sd": sd,
            "redundancy": redundancy,
            "standardized": standardized,
        }
        for row, residual, sd, redundancy, standardized in columns
    ]


def _stations(result: Result) -> list[dict[str, Any]]:
    given = result.stations
    columns = zip(
        given.rows.tolist(),
        _outward(result, given.differences[:, :3]).tolist(),
        _outward(result, given.sd[:, :3]).tolist(),
        given.differences[:, 3:].tolist(),
        given.sd[:, 3:].tolist(),
        given.redundancy.tolist(),
        given.tests.tolist(),
        strict=True,
    )
    return [
        {
            "id": result.block.photo_ids[row],
            "position_difference": position,
            "position_sd": position_sd,
            "attitude_difference_rad": attitude,
            "attitude_sd_rad": attitude_sd,
            "redundancy": redundancy,
            "standardized": standardized,
        }
        for row, position, position_sd, attitude, attitude_sd, redundancy, standardized in columns
    ]


def _check_points(result: Result) -> list[dict[str, Any]]:
    checks = result.check_points
    arrays = (checks.differences, checks.sd, checks.given_sd)
    columns = [_outward(result, each).tolist() for each in arrays]
    names = ("id", "difference", "sd", "given_sd", "assumed", "statistic", "p")
    rows = zip(checks.names, *columns, checks.assumed.tolist(), *checks.statistics, strict=True)
    return [dict(zip(names, row, strict=True)) for row in rows]
