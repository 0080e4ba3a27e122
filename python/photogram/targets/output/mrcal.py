"""`.cameramodel` files of mrcal: a camera, its pose, and its calibration for mrcal tools."""

from __future__ import annotations

import base64
import io
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.network.knots import KNOTTED
from photogram.targets.calibration_result import Calibrated
from photogram.targets.corner_files import KEY
from photogram.targets.maps import UncertaintyMap
from photogram.targets.mrcal_model import INDICES, PREFIX
from photogram.targets.output.rig import TERMS, Rig, terms_of
from photogram.words import phrase

TITLE = "a .cameramodel of mrcal"
CORE = frozenset({"f", "fx", "fy", "cx", "cy"})
OPENCV_TERMS = (0, 4, 5, 8, 12)  # of the models PINHOLE, OPENCV4, OPENCV5 ...
GRID_BOARDS = ("chessboard", "charuco")  # corners with equal spacing in rows and columns
WEIGHT_OF_ABSENT = -1.0


def mrcal_models(rig: Rig, valid: dict[int, Floats] | None = None) -> dict[str, bytes]:
    """Return one file per camera.

    `optimization_inputs` are included if the calibration is available and supported by mrcal. This requires a
    grid board, fixed or with two parabolas, cameras of one model, and no single fixed lens terms. `valid` is
    (n, 2) by camera number: the closed outline of the region with sufficient accuracy.
    """
    lenses = [_lens(rig, row) for row in range(len(rig.cameras))]
    inputs = None if rig.calibrated is None else _inputs(rig, rig.calibrated, lenses)
    found = {}
    for row, name in enumerate(rig.files):
        model, values = lenses[row]
        pose = rig.sensors[row] if rig.tied(row) else np.eye(4)
        members: dict[str, Any] = {
            "lensmodel": PREFIX + model,
            "intrinsics": values.tolist(),
            "extrinsics": _vectors(pose[np.newaxis])[0].tolist(),
            "imagersize": list(rig.size(row)),
        }
        if valid is not None and row in valid:
            members["valid_intrinsics_region"] = np.asarray(valid[row]).tolist()
        if inputs is not None:
            members |= {"icam_intrinsics": row, KEY: inputs}
        lines = [f"    {name!r}: {value!r}," for name, value in members.items()]
        found[f"{name}.cameramodel"] = "\n".join(["{", *lines, "}", ""]).encode()
    return found


def _lens(rig: Rig, row: int) -> tuple[str, Floats]:
    """Return a model name without its prefix, and its parameters in mrcal order."""
    camera = rig.cameras[row]
    if camera.model == KNOTTED and camera.knots is not None:
        order, nx, ny, fov = (camera.parameters[name] for name in ("order", "nx", "ny", "fov_x_deg"))
        name = f"SPLINED_STEREOGRAPHIC_order={order:.0f}_Nx={nx:.0f}_Ny={ny:.0f}_fov_x_deg={fov!r}"
        return name, np.append(camera.values[:4], camera.knots)
    if camera.model == "stereographic" and not camera.values[4:].any():
        return "STEREOGRAPHIC", camera.values[:4]
    if camera.model == "cahvor":
        return "CAHVOR", camera.values
    lens = terms_of(camera)
    if lens is None or lens.fisheye:
        raise rig.refusal(row, TITLE, ["opencv8", "opencv5", "opencv12", "cahvor", KNOTTED])
    free = dict(zip(camera.names, camera.deviations.tolist(), strict=True))
    # Free terms are included even if they are 0.
    count = next(
        each for each in OPENCV_TERMS if not any(lens.terms.get(k) or free.get(k) for k in TERMS[each:])
    )
    values = [*lens.focal, *lens.centre, *(lens.first(count) or ())]
    return f"OPENCV{count}" if count else "PINHOLE", np.array(values)


def _vectors(poses: Floats) -> Floats:
    return np.column_stack([_photocore.rotation_vectors(poses[:, :3, :3]), poses[:, :3, 3]])


def _inputs(rig: Rig, calibrated: Calibrated, lenses: list[tuple[str, Floats]]) -> bytes | None:
    """Return the calibration archive as text; None if mrcal does not support it."""
    calibration, count = calibrated.calibration, len(rig.cameras)
    board = calibration.board
    free = [{each.names[k] for k in each.estimated} for each in calibrated.cameras]
    knots = [each.given.knots is not None for each in calibrated.cameras]
    fits = (
        board.kind in GRID_BOARDS
        and calibration.shape in ("held", "bend")
        and board.pitch[0] == board.pitch[1]
        and len({name for name, _ in lenses}) == 1
        and all(
            splined or len(names - CORE) in (0, len(values) - 4)
            for splined, names, (_, values) in zip(knots, free, lenses, strict=True)
        )
        and calibration.sync != "offset"
        and (count == 1 or all(rig.tied(row) for row in range(1, count)))
    )
    if not fits:
        return None
    bend = calibrated.bend
    variance = calibrated.result.variance_of_unit_weight or 1.0
    observed, indices = _observations(calibrated)
    estimated = set().union(*free)
    terms = bool(estimated - CORE) or any(each.given.knot_unknowns for each in calibrated.cameras)
    arrays: dict[str, Any] = {
        "intrinsics": np.array([values for _, values in lenses]),
        "extrinsics_rt_fromref": _vectors(rig.sensors[1:]) if count > 1 else np.zeros((0, 6)),
        "frames_rt_toref": _vectors(calibrated.poses),
        "points": "",
        "observations_board": observed,
        INDICES: indices,
        "observations_point": "",
        "indices_point_camintrinsics_camextrinsics": "",
        "lensmodel": PREFIX + lenses[0][0],
        "imagersizes": np.array([rig.size(row) for row in range(count)], dtype=np.int32),
        "calobject_warp": np.array(calibration.bend if bend is None else bend.position[:2]),
        "do_optimize_intrinsics_core": bool(estimated & CORE),
        "do_optimize_intrinsics_distortions": terms,
        "do_optimize_extrinsics": True,
        "do_optimize_frames": True,
        "do_optimize_calobject_warp": calibration.shape == "bend",
        "calibration_object_spacing": float(board.pitch[0]),
        "do_apply_outlier_rejection": False,
        "observed_pixel_uncertainty": float(np.sqrt(variance)) * (calibration.sd0 or 1.0),
        "do_apply_regularization": calibration.regularise == "mrcal",
        "verbose": False,
    }
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return base64.b85encode(file.getvalue())


def _observations(calibrated: Calibrated) -> tuple[Floats, Any]:
    corners, board = calibrated.calibration.corners, calibrated.calibration.board
    found = np.zeros((len(corners.pictures), board.rows * board.columns, 3))
    found[..., 2] = WEIGHT_OF_ABSENT
    found[corners.picture, corners.point, :2] = corners.xy
    # Unused corners have a weight below 0.
    found[corners.picture, corners.point, 2] = np.where(corners.use, 1.0, -1.0) / corners.sd
    order = np.lexsort([corners.cameras, corners.views])
    indices = np.column_stack([corners.views, corners.cameras, corners.cameras - 1]).astype(np.int32)
    return found.reshape(-1, board.rows, board.columns, 3)[order], indices[order]


OUTLINE_DIRECTIONS, OUTLINE_STEPS = 90, 400  # about the most accurate pixel


def valid_region(found: UncertaintyMap, largest: float) -> Floats:
    """Return (n, 2) the closed outline of pixels whose worst sd is below a limit.

    It is searched from the most accurate pixel in 90 directions, with linear interpolation of the map.
    """
    sd = np.where(np.isfinite(found.sd), found.sd, np.inf)
    row, column = np.unravel_index(np.argmin(sd), sd.shape)
    if not sd[row, column] <= largest:
        fields = {"camera": found.camera, "need": largest, "best": float(sd[row, column])}
        raise InputError(phrase("targets.no-region", **fields))
    middle = np.array([found.columns[column], found.rows[row]])
    angles = np.linspace(0, 2 * np.pi, OUTLINE_DIRECTIONS + 1)
    # Down to the farthest corner, and clipped to the image.
    lengths = np.linspace(0, float(np.hypot(*found.size)), OUTLINE_STEPS)
    places = (
        middle + lengths[:, np.newaxis] * np.stack([np.cos(angles), np.sin(angles)], axis=1)[:, np.newaxis]
    )
    last = np.array(found.size) - 1.0
    inside = ((places >= 0) & (places <= last)).all(axis=2)
    good = inside & (_between(found, sd, np.clip(places, 0, last)) <= largest)
    steps = np.where(good.all(axis=1), OUTLINE_STEPS, np.argmin(good, axis=1)) - 1
    return np.asarray(places[np.arange(len(angles)), steps])


def _between(found: UncertaintyMap, sd: Floats, places: Floats) -> Floats:
    """Return values of a map at positions (..., 2) by bilinear interpolation."""
    parts = []
    for axis, nodes in enumerate((found.columns, found.rows)):
        own = np.clip(np.searchsorted(nodes, places[..., axis], side="right") - 1, 0, len(nodes) - 2)
        parts.append((own, (places[..., axis] - nodes[own]) / (nodes[own + 1] - nodes[own])))
    (i, x), (j, y) = parts
    with np.errstate(invalid="ignore"):
        upper = sd[j, i] * (1 - x) + sd[j, i + 1] * x
        lower = sd[j + 1, i] * (1 - x) + sd[j + 1, i + 1] * x
        whole: Floats = upper * (1 - y) + lower * y
    return np.where(np.isnan(whole), np.inf, whole)
