"""OpenCV YAML: camera matrix, distortion, errors; for other cameras of a rig R, T, E and F."""

from __future__ import annotations

from functools import partial

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.yaml_text import matrix_lines
from photogram.targets.calibration_result import Calibrated
from photogram.targets.output.rig import TERMS, Rig, Terms, terms_of
from photogram.targets.vision import cross_matrices

TITLE = "YAML of OpenCV"
_matrix = partial(matrix_lines, opencv=True)
COUNTS = (4, 5, 8, 12)
MIN_PINHOLE_TERMS = 5
DEVIATIONS = ("fx", "fy", "cx", "cy", *TERMS, "tx", "ty")  # order of `std_deviations_intrinsics`


def opencv_yaml(rig: Rig) -> dict[str, bytes]:
    """Return one file per camera."""
    lenses = [_lens(rig, row) for row in range(len(rig.cameras))]
    return {
        f"{name}.yaml": "\n".join(["%YAML:1.0", "---", *_camera(rig, row, lenses), ""]).encode()
        for row, name in enumerate(rig.files)
    }


def _lens(rig: Rig, row: int) -> Terms:
    found = terms_of(rig.cameras[row])
    if found is None or found.fewest((4,) if found.fisheye else COUNTS) is None:
        raise rig.refusal(row, TITLE, ["opencv5", "opencv8", "opencv12", "opencv_fisheye"])
    return found


def _camera(rig: Rig, row: int, lenses: list[Terms]) -> list[str]:
    lens, (width, height) = lenses[row], rig.size(row)
    terms = lens.first(4) if lens.fisheye else lens.fewest(COUNTS[COUNTS.index(MIN_PINHOLE_TERMS) :])
    lines = [f"image_width: {width}", f"image_height: {height}"]
    lines += ["fisheye_model: 1"] if lens.fisheye else []
    lines += _matrix("camera_matrix", lens.matrix)
    lines += _matrix("distortion_coefficients", np.reshape(terms or [], (-1, 1)))
    if rig.calibrated is not None:
        lines += _errors(rig.calibrated, row)
        camera = rig.calibrated.cameras[row]
        sd = dict(zip(camera.names, camera.sd.tolist(), strict=True))
        sd |= {"fx": sd["f"], "fy": sd["f"]} if "f" in sd else {}
        sd |= {"k1": sd["k"]} if "k" in sd else {}
        lines += _matrix("std_deviations_intrinsics", [[sd.get(name, 0.0)] for name in DEVIATIONS])
    if row and rig.tied(row):
        lines += _stereo(rig.sensors[row], lenses[0].matrix, lens.matrix)
    return lines


def _errors(calibrated: Calibrated, row: int) -> list[str]:
    corners = calibrated.calibration.corners
    squares = (calibrated.result.residuals**2).sum(axis=1)
    pictures = corners.picture[corners.use]
    own = np.flatnonzero(corners.cameras == row)
    mean = [squares[pictures == picture].mean() for picture in own if (pictures == picture).any()]
    average = squares[corners.cameras[pictures] == row].mean()
    return [
        f"avg_reprojection_error: {float(np.sqrt(average))!r}",
        *_matrix("per_view_reprojection_errors", np.sqrt(mean).reshape(-1, 1)),
    ]


def _stereo(sensor: Floats, before: Floats, own: Floats) -> list[str]:
    """Return R, T of camera 0 -> this camera, E = [T]x R and F = K^-T E K0^-1, scaled."""
    rotation, shift = sensor[:3, :3], sensor[:3, 3]
    essential = cross_matrices(shift) @ rotation
    fundamental = np.linalg.inv(own).T @ essential @ np.linalg.inv(before)
    if fundamental[2, 2]:
        fundamental = fundamental / fundamental[2, 2]
    named = (("R", rotation), ("T", shift.reshape(3, 1)), ("E", essential), ("F", fundamental))
    return [line for name, values in named for line in _matrix(name, values)]
