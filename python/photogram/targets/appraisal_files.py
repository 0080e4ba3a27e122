"""Maps of uncertainty and differences as files, and as members of the JSON document."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from photogram.targets.appraisal_report import Worth
from photogram.targets.calibration_difference import CameraDifference
from photogram.targets.cross_validation import CrossValidation, changes_between
from photogram.targets.maps import UncertaintyMap
from photogram.targets.new_views import Suggestions

__all__ = ["worth_files", "worth_members"]


def worth_files(worth: Worth) -> dict[str, bytes]:
    """Return the maps as tables and arrays, by their names: `map-left-infinity.csv`."""
    files = {}
    for each in worth.maps:
        name = f"map-{each.camera}-{_distance(each.distance)}"
        files[f"{name}.csv"], files[f"{name}.npz"] = each.to_csv(), each.to_npz()
    return files


def worth_members(worth: Worth) -> dict[str, Any]:
    """Return what the JSON document has of it."""
    return {
        "maps": [_map(each) for each in worth.maps],
        "cross_validation": [_cross(each) for each in worth.cross],
        "difference": [_difference(each) for each in worth.differences],
        "suggested_views": [_suggested(each) for each in worth.suggestions],
        "worth": worth.sentences,
    }


def _distance(distance: float) -> str:
    return "infinity" if math.isinf(distance) else f"{distance:g}"


def _map(found: UncertaintyMap) -> dict[str, Any]:
    return {
        "camera": found.camera,
        "distance": found.distance if math.isfinite(found.distance) else None,
        "datum": found.datum,
        "noise_only": found.noise_only,
        "model": found.model,
        "largest_where_seen": found.largest,
        "columns": found.columns.tolist(),
        "rows": found.rows.tolist(),
        "sd": found.sd,
        "covariances": found.covariances,
    }


def _cross(found: CrossValidation) -> dict[str, Any]:
    return {
        "into": found.into,
        "explained": found.explained,
        "factor": found.factor,
        "splits": [
            {
                "views": [list(part) for part in parts],
                "tests": [
                    {"name": each.name, "chi2": each.chi2, "dof": each.dof, "p": each.probability}
                    for each in tests
                ],
                "dk": changes_between(*housings)[0][: found.whole.board.start].tolist(),
            }
            for parts, tests, housings in zip(found.parts, found.tests, found.housings, strict=True)
        ],
    }


def _difference(found: CameraDifference) -> dict[str, Any]:
    test = found.test
    return {
        "cameras": list(found.cameras),
        "distances": [each if math.isfinite(each) else None for each in found.distances],
        "motion": found.fitted.motion,
        "rotation_deg": found.rotation,
        "rms": found.rms,
        "largest": found.largest,
        "shared_corners": found.shared,
        "test": test and {"name": test.name, "chi2": test.chi2, "dof": test.dof, "p": test.probability},
        "columns": found.columns.tolist(),
        "rows": found.rows.tolist(),
        "vectors": found.vectors,
        "covariances": found.covariances,
        "remarks": found.remarks,
    }


def _suggested(found: Suggestions) -> dict[str, Any]:
    return {
        "camera": found.camera,
        "distance": found.distance if math.isfinite(found.distance) else None,
        "largest_before": float(np.max(found.before)),
        "views": [
            {
                "name": each.candidate.name,
                "pose": each.candidate.pose,
                "corners": each.corners.tolist(),
                "largest": each.largest,
                "rms": each.rms,
            }
            for each in found.views
        ],
    }
