"""Cameras of a calibration as files of OpenCV, ROS and Kalibr.

Lenses are a pinhole with ordered terms, or a fisheye with four. YAML numbers have all digits. Matrices are
written by row.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.yaml_text import camera_info, figures, matrix_lines
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.network.equivalent_cameras import TERMS, OpencvLens, opencv_lens
from photogram.targets.vision import cross_matrices, inverted
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated


@dataclass(frozen=True, eq=False)
class Rig:
    cameras: tuple[Camera, ...]  # The cameras
    # Image width and height, pixels; None if unknown
    sizes: tuple[tuple[int, int] | None, ...]
    sensors: Floats  # (K, 4, 4) camera 0 -> camera k; NaN for cameras not tied to it
    calibrated: Calibrated | None = None  # The source calibration; None if not available

    @property
    def names(self) -> list[str]:
        return [each.name or f"camera {row}" for row, each in enumerate(self.cameras)]

    @property
    def files(self) -> list[str]:
        return ["".join(c if c.isalnum() or c in "-_." else "-" for c in each) for each in self.names]

    def tied(self, camera: int) -> bool:
        return bool(np.isfinite(self.sensors[camera]).all())

    def size(self, camera: int) -> tuple[int, int]:
        """Return image width and height of a camera; InputError if they are unknown."""
        found = self.sizes[camera]
        if found is None:
            raise InputError(phrase("targets.no-size", camera=self.names[camera]))
        return found

    def lenses(
        self, title: str, models: Sequence[str], fits: Callable[[OpencvLens], bool]
    ) -> list[OpencvLens]:
        """Return the lenses of all cameras; InputError: if a format does not support one."""
        found = []
        for row, camera in enumerate(self.cameras):
            lens = opencv_lens(camera)
            if lens is None or not fits(lens):
                raise self.refusal(row, title, models)
            found.append(lens)
        return found

    def refusal(
        self, camera: int, title: str, models: Sequence[str], code: str = "targets.refused"
    ) -> InputError:
        fields = {"camera": self.names[camera], "model": self.cameras[camera].model, "to": "|".join(models)}
        return InputError(phrase(code, title=title, **fields))


def rig_of(calibrated: Calibrated) -> Rig:
    sensors = calibrated.sensors.copy()
    references = np.asarray(calibrated.calibration.references)
    sensors[(references != 0) & (np.arange(len(sensors)) > 0)] = np.nan
    return Rig(
        cameras=tuple(each.camera for each in calibrated.cameras),
        sizes=tuple(calibrated.calibration.corners.sizes),
        sensors=sensors,
        calibrated=calibrated,
    )


_matrix = partial(matrix_lines, opencv=True)
COUNTS = (4, 5, 8, 12)
MIN_PINHOLE_TERMS = 5
DEVIATIONS = ("fx", "fy", "cx", "cy", *TERMS, "tx", "ty")  # order of `std_deviations_intrinsics`


def opencv_yaml(rig: Rig) -> dict[str, bytes]:
    """Return one file per camera: matrix, distortion, errors; for others of a rig also R, T, E, F."""
    lenses = rig.lenses(
        "YAML of OpenCV",
        ["opencv5", "opencv8", "opencv12", "opencv_fisheye"],
        lambda lens: lens.fewest((4,) if lens.fisheye else COUNTS) is not None,
    )
    files = {}
    for row, name in enumerate(rig.files):
        lens, (width, height), calibrated = lenses[row], rig.size(row), rig.calibrated
        terms = lens.first(4) if lens.fisheye else lens.fewest(COUNTS[COUNTS.index(MIN_PINHOLE_TERMS) :])
        lines = [f"image_width: {width}", f"image_height: {height}"]
        lines += ["fisheye_model: 1"] if lens.fisheye else []
        lines += _matrix("camera_matrix", lens.matrix)
        lines += _matrix("distortion_coefficients", np.reshape(terms or [], (-1, 1)))
        if calibrated is not None:
            corners = calibrated.calibration.corners
            squares = (calibrated.residuals**2).sum(axis=1)
            pictures = corners.picture[corners.use]
            own = np.flatnonzero(corners.cameras == row)
            mean = [squares[pictures == picture].mean() for picture in own if (pictures == picture).any()]
            average = squares[corners.cameras[pictures] == row].mean()
            lines.append(f"avg_reprojection_error: {float(np.sqrt(average))!r}")
            lines += _matrix("per_view_reprojection_errors", np.sqrt(mean).reshape(-1, 1))
            camera = calibrated.cameras[row]
            sd = dict(zip(camera.names, camera.sd.tolist(), strict=True))
            sd |= {"fx": sd["f"], "fy": sd["f"]} if "f" in sd else {}
            sd |= {"k1": sd["k"]} if "k" in sd else {}
            lines += _matrix("std_deviations_intrinsics", [[sd.get(key, 0.0)] for key in DEVIATIONS])
        if row and rig.tied(row):
            # R, T of camera 0 -> this camera, E = [T]x R, and F = K^-T E K0^-1, scaled.
            rotation, shift = rig.sensors[row, :3, :3], rig.sensors[row, :3, 3]
            essential = cross_matrices(shift) @ rotation
            fundamental = np.linalg.inv(lens.matrix).T @ essential @ np.linalg.inv(lenses[0].matrix)
            if fundamental[2, 2]:
                fundamental = fundamental / fundamental[2, 2]
            named = (("R", rotation), ("T", shift.reshape(3, 1)), ("E", essential), ("F", fundamental))
            lines += [line for key, values in named for line in _matrix(key, values)]
        files[f"{name}.yaml"] = "\n".join(["%YAML:1.0", "---", *lines, ""]).encode()
    return files


def ros_camera_info(rig: Rig) -> dict[str, bytes]:
    """Return one file per camera in the format of ROS (`sensor_msgs/CameraInfo`).

    For two tied cameras, the rectification rotates both so that a point has the same row in both. The
    projection of the second contains -fx b with the base b. Other cameras are not rectified.
    """
    models = ["opencv5", "opencv8", "opencv_fisheye"]
    lenses = rig.lenses("camera_info of ROS", models, lambda lens: bool(lens.ros[1]))
    rectified: list[tuple[Floats, Floats] | tuple[()]] = [()] * len(lenses)
    if len(lenses) == 2 and rig.tied(1):
        rectified = [*_rectified(rig.sensors[1], lenses)]
    return {
        f"{rig.files[row]}.yaml": camera_info(rig.names[row], rig.size(row), lens.matrix, lens.ros, *turned)
        for row, (lens, turned) in enumerate(zip(lenses, rectified, strict=True))
    }


def _rectified(sensor: Floats, lenses: list[OpencvLens]) -> list[tuple[Floats, Floats]]:
    """Return rotation and (3, 4) projection of both cameras.

    Each is rotated by half of the rotation between them, then both so that the base is the x axis. Both use
    the shorter focal length, and the mean of their rotated axes as centre.
    """
    half = _photocore.rotation_vectors(sensor[np.newaxis, :3, :3]) / 2
    turns = _photocore.vector_rotations(np.concatenate([half, -half]))
    base = turns[1] @ sensor[:3, 3]
    along = np.array([np.sign(base[0]) or 1.0, 0.0, 0.0])
    across = np.cross(base, along)
    angle = np.arctan2(np.linalg.norm(across), base @ along)
    axis = across / (np.linalg.norm(across) or 1.0)
    common = _photocore.vector_rotations(angle * axis[np.newaxis])[0]
    turned = [common @ each for each in turns]
    focal = min(value for each in lenses for value in each.focal)
    # Rotated position of the image centre: K^-1 c is the original axis.
    axes = [each[:2, 2] / each[2, 2] for each in turned]
    centre = np.mean(
        [np.array(each.centre) - focal * own for each, own in zip(lenses, axes, strict=True)], axis=0
    )
    shifts = (0.0, focal * float((common @ base)[0]))
    return [
        (turn, np.array([[focal, 0, centre[0], shift], [0, focal, centre[1], 0], [0, 0, 1, 0]]))
        for turn, shift in zip(turned, shifts, strict=True)
    ]


KALIBR_TITLE = "camchain.yaml of Kalibr"
KALIBR_TERMS = 4


def kalibr_camchain(rig: Rig) -> dict[str, bytes]:
    """Return the file of Kalibr with all cameras, each with its pose relative to the previous one.

    `radtan` has k1, k2, p1, p2; `equidistant` k1 to k4. `T_cn_cnm1` transforms points from the previous
    camera to this one.
    """
    lines = []
    for row in range(len(rig.cameras)):
        if not (rig.tied(row) and rig.tied(max(row - 1, 0))):
            raise rig.refusal(row, KALIBR_TITLE, [], "targets.refused-tie")
        lens = opencv_lens(rig.cameras[row])
        if lens is None or lens.first(KALIBR_TERMS) is None:
            code = "targets.refused" if lens is None else "targets.refused-terms"
            raise rig.refusal(row, KALIBR_TITLE, ["opencv4", "opencv_fisheye"], code)
        width, height = rig.size(row)
        lines += [
            f"cam{row}:",
            "  camera_model: pinhole",
            f"  intrinsics: {figures([*lens.focal, *lens.centre])}",
            f"  distortion_model: {'equidistant' if lens.fisheye else 'radtan'}",
            f"  distortion_coeffs: {figures(lens.first(KALIBR_TERMS) or [])}",
            f"  resolution: [{width}, {height}]",
            f"  rostopic: /{rig.files[row]}/image_raw",
        ]
        if row:
            from_before = rig.sensors[row] @ inverted(rig.sensors[row - 1])
            lines += ["  T_cn_cnm1:", *(f"  - {figures(each)}" for each in from_before)]
    return {"camchain.yaml": "\n".join([*lines, ""]).encode()}
