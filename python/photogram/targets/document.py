"""The JSON document of a calibration, and its maps as files.

The document (`docs/json.md`) is that of the block, with the board, the views and what it is worth.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.results.document import block_members
from photogram.show.quantity import Quantity, records
from photogram.targets.calibration_difference import CameraDifference
from photogram.targets.calibration_result import Worth
from photogram.targets.cross_validation import CrossValidation, DifferenceTest, changes_between
from photogram.targets.maps import UncertaintyMap, map_name
from photogram.targets.new_views import Suggestions
from photogram.targets.tables import STRETCHES, board_fit, prior_shift, splines, views

if TYPE_CHECKING:
    from photogram.targets import Calibrated


def calibration_members(calibrated: Calibrated) -> dict[str, Any]:
    """Return the members of the document."""
    sensors = [
        {"camera": calibrated.cameras[row].name, "pose": calibrated.sensors[row].tolist()}
        for row in calibrated.sensors_adjusted()
    ]
    moved = prior_shift(calibrated)
    return {
        **block_members(calibrated.result),
        "board": _board(calibrated),
        "views": records([*views(calibrated), Quantity(calibrated.poses, member="pose")]),
        **({"sensors": sensors} if sensors else {}),
        **({} if calibrated.snooped is None else {"snooping": calibrated.snooped.members()}),
        **({"moved_by_priors": records(moved)} if moved else {}),
        **({"splines": [asdict(each) for each in told]} if (told := splines(calibrated)) else {}),
        **({} if calibrated.worth is None else worth_members(calibrated.worth)),
    }


def _board(calibrated: Calibrated) -> dict[str, Any]:
    calibration, fit = calibrated.calibration, board_fit(calibrated)
    board = calibration.board
    names = np.array(board.names, dtype=object)
    found: dict[str, Any] = {
        "kind": board.kind,
        "columns": board.columns,
        "rows": board.rows,
        "unit": board.unit,
        "shape": calibration.shape,
        "points": records(
            [
                Quantity(names, kind="name", member="id"),
                Quantity(board.places, member="nominal"),
                Quantity(calibrated.points, member="adjusted"),
            ]
        ),
    }
    if (bend := calibrated.bend) is not None:
        found["bend"] = bend.position[:2].tolist()
        found["bend_covariance"] = bend.covariance.tolist()
    if fit is not None:
        found["plane"] = fit.plane.tolist()
        found["rms_out_of_plane"] = fit.rms_out_of_plane
        found["spacing_ppm"] = dict(zip(STRETCHES, fit.stretch.tolist(), strict=True))
        found["sd_spacing_ppm"] = dict(zip(STRETCHES, fit.sd.tolist(), strict=True))
    return found


def worth_files(worth: Worth) -> dict[str, bytes]:
    """Return the maps as tables and arrays, by their names: `map-left-infinity.csv`."""
    files = {}
    for each in worth.maps:
        name = f"map-{map_name(each)}"
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
                "tests": [_test(each) for each in tests],
                "dk": changes_between(*housings)[0][: found.whole.board.start].tolist(),
            }
            for parts, tests, housings in zip(found.parts, found.tests, found.housings, strict=True)
        ],
    }


def _test(test: DifferenceTest) -> dict[str, Any]:
    return {"name": test.name, "chi2": test.chi2, "dof": test.dof, "p": test.probability}


def _difference(found: CameraDifference) -> dict[str, Any]:
    return {
        "cameras": list(found.cameras),
        "distances": [each if math.isfinite(each) else None for each in found.distances],
        "motion": found.fitted.motion,
        "rotation_deg": found.rotation,
        "rms": found.rms,
        "largest": found.largest,
        "shared_corners": found.shared,
        "test": found.test and _test(found.test),
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
