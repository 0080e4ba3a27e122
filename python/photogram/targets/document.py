"""The JSON document of a calibration: that of its block, with the board and its views; `docs/json.md`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from photogram.io import json
from photogram.results.document import block_members
from photogram.show.methods import document_of
from photogram.show.quantity import Quantity, records
from photogram.targets.appraisal_files import worth_members
from photogram.targets.board_fit import STRETCHES, board_fit
from photogram.targets.calibration_result import Calibrated
from photogram.targets.prior_shift import prior_shift
from photogram.targets.splined import splines
from photogram.targets.tables import views

__all__ = ["calibration_document", "to_json"]


@document_of.register(Calibrated)
def to_json(calibrated: Calibrated) -> bytes:
    """Return the whole calibration as JSON (UTF-8)."""
    return json.to_json(calibration_document(calibrated))


def calibration_document(calibrated: Calibrated) -> dict[str, Any]:
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
        **({} if calibrated.snooped is None else {"snooping": calibrated.snooped.document()}),
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
