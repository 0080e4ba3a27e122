"""YAML of ROS (`sensor_msgs/CameraInfo`) and Kalibr (`camchain.yaml`).

ROS has one file per camera, and a pair is rectified to equal rows. A Kalibr file lists all cameras, each with
its pose relative to the previous one.
"""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.io.yaml_text import camera_info, figures
from photogram.targets.output.rig import Rig, Terms, terms_of
from photogram.targets.vision import inverted

TITLE = "camera_info of ROS"
PLUMB_BOB_TERMS, RATIONAL_TERMS, EQUIDISTANT_TERMS = 5, 8, 4


def ros_camera_info(rig: Rig) -> dict[str, bytes]:
    """Return one file per camera.

    For two tied cameras, the rectification rotates both so that a point has the same row in both. The
    projection of the second contains -fx b with the base b. Other cameras are not rectified.
    """
    lenses = [_lens(rig, row) for row in range(len(rig.cameras))]
    rectified: list[tuple[Floats, Floats] | tuple[()]] = [()] * len(lenses)
    if len(lenses) == 2 and rig.tied(1):
        rectified = [*_rectified(rig.sensors[1], lenses)]
    return {
        f"{rig.files[row]}.yaml": camera_info(
            rig.names[row], rig.size(row), lens.matrix, _distortion(lens), *turned
        )
        for row, (lens, turned) in enumerate(zip(lenses, rectified, strict=True))
    }


def _lens(rig: Rig, row: int) -> Terms:
    found = terms_of(rig.cameras[row])
    if found is None or not _distortion(found)[1]:
        raise rig.refusal(row, TITLE, ["opencv5", "opencv8", "opencv_fisheye"])
    return found


def _distortion(lens: Terms) -> tuple[str, list[float]]:
    if lens.fisheye:
        return "equidistant", lens.first(EQUIDISTANT_TERMS) or []
    if (terms := lens.first(PLUMB_BOB_TERMS)) is not None:
        return "plumb_bob", terms
    return "rational_polynomial", lens.first(RATIONAL_TERMS) or []


def _rectified(sensor: Floats, lenses: list[Terms]) -> list[tuple[Floats, Floats]]:
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
    """Return the file.

    `radtan` has k1, k2, p1, p2; `equidistant` k1 to k4. `T_cn_cnm1` transforms points from the previous
    camera to this one.
    """
    lines = []
    for row in range(len(rig.cameras)):
        lens = _kalibr_lens(rig, row)
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


def _kalibr_lens(rig: Rig, row: int) -> Terms:
    if not (rig.tied(row) and rig.tied(max(row - 1, 0))):
        raise rig.refusal(row, KALIBR_TITLE, [], "targets.refused-tie")
    found = terms_of(rig.cameras[row])
    if found is None or found.first(KALIBR_TERMS) is None:
        code = "targets.refused" if found is None else "targets.refused-terms"
        raise rig.refusal(row, KALIBR_TITLE, ["opencv4", "opencv_fisheye"], code)
    return found
