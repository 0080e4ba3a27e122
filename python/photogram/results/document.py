"""The JSON document of an adjusted block; `docs/json.md` describes it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.io import json
from photogram.results.calibration_report import calibration_members
from photogram.results.features_report import features_document
from photogram.results.film_report import fiducial_members, film_members, scanner_members
from photogram.results.network import AdjustedNetwork
from photogram.results.network_tables import control, images, iterations, photos, points, stations, terms_of
from photogram.results.report import problems_of
from photogram.results.result import Result
from photogram.results.tables import camera_parameters, check_points, observations
from photogram.results.weakest import weakest_photos, weakest_points
from photogram.show.methods import document_of
from photogram.show.quantity import Quantities, Quantity, chosen, members, records


@document_of.register(Result)
def to_json(result: Result) -> bytes:
    """Return the whole result as JSON (UTF-8). What is not a number is null."""
    return json.to_json(block_members(result))


def network_members(result: AdjustedNetwork, photo_members: Quantities = ()) -> dict[str, Any]:
    """Return what the documents of all networks have, with more members of photos."""
    summary = result.reliability_summary
    called = int if terms_of(result).identity == "number" else str
    weights = Quantity(result.image_weights[result.used_images], member="weight_factor")
    of_photos = Quantity(result.photo_covariances, member="covariance")
    of_points = Quantity(result.point_covariances[result.used_points], member="covariance")
    return {
        "program": f"photogram {_photocore.__version__}",
        "status": result.status,
        "messages": [str(message) for message in result.messages],
        "loss": {"name": result.loss[0], "scale": result.loss[1]} if result.loss else None,
        "degrees_of_freedom": result.degrees_of_freedom,
        "variance_of_unit_weight": result.variance_of_unit_weight,
        "covariance_scale": result.covariance_scale,
        "verdict": result.verdict.document(),
        "reliability": summary.document() if summary else None,
        "iterations": records(iterations(result))[1:],
        "photos": records([*photos(result), *photo_members, of_photos]),
        "points": records([*points(result), of_points]),
        "observations": records([*images(result), *([weights] if result.loss else [])]),
        "control": records(control(result)),
        "stations": records(stations(result)),
        "weakest": {
            "points": [vars(each) | {"point": called(each.point)} for each in weakest_points(result)],
            "photos": [vars(each) | {"photo": called(each.photo)} for each in weakest_photos(result)],
        },
        "ordering": result.ordering,
        "predictions": dict(result.predictions),
        "operations": dict(result.operations),
        "seconds": dict(result.seconds),
    }


def block_members(result: Result) -> dict[str, Any]:
    """Return the members of the document of an adjusted block."""
    covariances, place, turn = result.photo_covariances, slice(0, 3), slice(3, 6)
    of_photos = (
        Quantity(covariances[:, place, place], member="position_covariance"),
        Quantity(covariances[:, turn, turn], member="attitude_covariance"),
    )
    return {
        **network_members(result, of_photos),
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
        "problems": problems_of(result),
        "initial_weighted_sum_of_squares": result.initial_weighted_sum_of_squares,
        "weighted_sum_of_squares": members(result.sums_of_squares, *_SUMS),
        "redundancy": result.redundancies and members(result.redundancies, *_SUMS),
        "unit_variance": result.unit_variance,
        "global_test": _global_test(result),
        **_of_some(result),
        "observations_beside_images": _beside_images(result),
        "check_points": records(check_points(result)),
        "dropped_points": [{"id": name, "reason": reason} for name, reason in result.dropped.items()],
    }


def _of_some(result: Result) -> dict[str, Any]:
    """Return the members on what only some blocks have."""
    found: dict[str, Any] = {}
    if result.cameras:
        found |= {"cameras": _cameras(result), "calibrations": calibration_members(result)}
    if result.unknowns:
        found["unknowns"] = _unknowns(result)
    if result.films:
        found |= {"films": film_members(result), "fiducials": fiducial_members(result)}
        found["scanners"] = scanner_members(result)
    if result.features is not None:
        found["features"] = features_document(result.features)
    return found


_SUMS = ("camera", "ground", "plates", "observations", "total")


def _units(result: Result) -> dict[str, str]:
    linear, unit = result.block.linear_unit, result.block.image_unit
    geographic, mixed = result.block.geographic, f"longitude deg, latitude deg, height {linear}"
    position = mixed if geographic else linear
    return {
        "position": position,
        "water_level": linear,
        "position_covariance": f"longitude rad, latitude rad, height {linear}; products"
        if geographic
        else f"{linear}^2",
        "attitude": "rad",
        "attitude_covariance": "rad^2",
        "covariance": "products of the units of position_covariance and rad",
        f"residual_{unit}": unit,
        **dict.fromkeys(("position_difference", "position_sd"), position),
        **dict.fromkeys(("attitude_difference_rad", "attitude_sd_rad"), "rad"),
        "difference": position,
        "operations": "multiply-adds, each time the phase is carried out",
        "seconds": "s",
    }


def _cameras(result: Result) -> list[dict[str, Any]]:
    return [
        {
            **members(each, "name", model="camera.model", image_unit="camera.unit"),
            **members(each, "photos", "images"),
            "parameters": records(camera_parameters([each])),
            "covariance": each.covariance,
        }
        for each in result.cameras
    ]


def _unknowns(result: Result) -> list[dict[str, Any]]:
    return [
        members(each, "kind", "name", "position", matrix="attitude")
        | members(each, "observations", "components", "units", sd_given="given.deviations", value="values")
        | members(each, "change", "sd", "redundancy", "standardized", "covariance")
        for each in result.unknowns
    ]


def _beside_images(result: Result) -> list[dict[str, Any]]:
    found = []
    for each in result.kinds.values():
        rows = np.flatnonzero(np.isfinite(each.squares))
        own = [
            Quantity([list(result.block.observations[row].of) for row in each.rows[rows]], member="of"),
            Quantity([each.components] * len(rows), member="components"),
            Quantity([each.units] * len(rows), member="units"),
            *([Quantity(each.weights[rows], member="weight_factor")] if result.loss else []),
        ]
        found += records([*chosen(observations(each), rows), *own])
    return found


def _global_test(result: Result) -> dict[str, Any] | None:
    test = result.global_test
    if test is None:
        return None
    rejected = "high" if test.rejected_high else "low" if test.rejected_low else None
    return members(test, "variance", "limits", "level", "probability") | {"rejected": rejected}
