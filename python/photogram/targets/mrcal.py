"""`.cameramodel` files of mrcal: a Python dictionary as text, with an optional calibration.

`optimization_inputs` is a base 85 (RFC 1924) archive of NumPy arrays. They contain corners with weights,
indices of views, cameras and sensors, poses, lenses, and the board deflection. Nothing is unpickled or
evaluated.
"""

from __future__ import annotations

import ast
import base64
import io
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import argument_error
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.io.files import read_text
from photogram.io.places import Place, at_place
from photogram.network.cameras import Camera
from photogram.network.equivalent_cameras import TERMS, opencv_lens
from photogram.network.passages import KNOTTED
from photogram.targets.board import Board
from photogram.targets.calibration import Calibration
from photogram.targets.corner_files import KEY
from photogram.targets.corners import Corners
from photogram.targets.opencv_corners import Arrays, read_arrays
from photogram.targets.output import Rig
from photogram.targets.uncertainty import UncertaintyMap
from photogram.targets.vision import inverted, of_vectors
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated

PREFIX = "LENSMODEL_"
CORE = ("fx", "fy", "cx", "cy")
# Models by mrcal name, with the number of their parameters
LENSES = {
    "PINHOLE": ("pinhole", 4),
    "STEREOGRAPHIC": ("stereographic", 4),
    **{f"OPENCV{terms}": ("opencv_pinhole", 4 + terms) for terms in (4, 5, 8, 12)},
    "CAHVOR": ("cahvor", 9),
}
SPLINED = re.compile(r"SPLINED_STEREOGRAPHIC_order=(\d+)_Nx=(\d+)_Ny=(\d+)_fov_x_deg=([\d.]+)")


def lens_of_mrcal(model: str, values: Sequence[float], name: str = "") -> Camera:
    said = model.removeprefix(PREFIX)
    splined = SPLINED.fullmatch(said)
    if splined is None and said not in LENSES:
        raise InputError(phrase("targets.mrcal-lens", model=model, names=[*LENSES, "splined models"]))
    order, nx, ny, fov = map(float, splined.groups()) if splined else (0.0, 0.0, 0.0, 0.0)
    own, count = (KNOTTED, 4 + 2 * int(nx) * int(ny)) if splined else LENSES[said]
    if len(values) != count:
        raise argument_error(model, "count", count=count, actual=len(values))
    if splined:
        lattice = {"order": order, "nx": nx, "ny": ny, "fov_x_deg": fov}
        knots = np.reshape(values[4:], (int(ny), int(nx), 2))
        return Camera(own, dict(zip(CORE, values[:4], strict=True)) | lattice, name=name, knots=knots)
    names = Camera(own, dict.fromkeys(CORE, 1.0)).names[:count]
    return Camera(own, dict(zip(names, values, strict=True)), name=name)


INDICES = "indices_frame_camintrinsics_camextrinsics"


def read_model(path: Path) -> Calibration:
    """Read the calibration of a `.cameramodel`: corners, board and initial values."""
    packed = _content(path).get(KEY)
    if not isinstance(packed, bytes):
        raise InputError(phrase("targets.mrcal-no-corners", key=KEY), file=path)
    try:
        archive = base64.b85decode(packed)
    except ValueError:
        raise InputError(phrase("targets.mrcal-damaged", key=KEY), file=path) from None
    arrays = read_arrays(path, archive)
    for name in ("observations_point", "observations_point_triangulated"):
        if name in arrays:
            raise arrays.refusal("targets.mrcal-points", name)
    seen = arrays.arrays["observations_board"] if "observations_board" in arrays else None
    if seen is None or seen.ndim != 4:
        raise InputError(phrase("targets.mrcal-no-corners", key="observations_board"), file=path)
    observed = arrays.numbers("observations_board", None, None, None, 3)
    if INDICES not in arrays:
        raise InputError(phrase("error.missing", name=INDICES), file=path)
    # View, camera and sensor of each image; sensor -1 is at the reference
    indices = arrays.numbers(INDICES, len(observed), 3).astype(np.int64)
    if (indices[:, :2] < 0).any() or (indices[:, 2] < -1).any():
        raise arrays.refusal("targets.mrcal-counts", INDICES)
    for name in ("do_optimize_frames", "do_optimize_extrinsics"):
        if name in arrays and not arrays.says(name):
            raise arrays.refusal("targets.mrcal-fixed", name)
    cameras = _cameras(arrays)
    sensors, poses = _poses(arrays, indices, len(cameras))
    warp = arrays.numbers("calobject_warp", 2) if "calobject_warp" in arrays else np.zeros(2)
    board = Board(
        columns=observed.shape[2],
        rows=observed.shape[1],
        spacing=float(arrays.numbers("calibration_object_spacing")),
        shape="bend" if arrays.says("do_optimize_calobject_warp") else "held",
    )
    pictures, points = len(observed), observed.shape[1] * observed.shape[2]
    rows, several = observed.reshape(-1, 3), len(cameras) > 1
    weight = rows[:, 2]
    use = weight > 0
    corners = Corners(
        pictures=[
            f"view{view:03d}-{camera}" if several else f"view{view:03d}"
            for view, camera in indices[:, :2].tolist()
        ],
        cameras=indices[:, 1],
        views=np.unique(indices[:, 0], return_inverse=True)[1].reshape(-1),
        camera_names=[f"camera {number}" for number in range(len(cameras))],
        sizes=arrays.numbers("imagersizes", len(cameras), 2).astype(int).tolist(),
        picture=np.repeat(np.arange(pictures), points),
        point=np.tile(np.arange(points), pictures),
        xy=rows[:, :2],
        sd=np.where(use, 1 / np.where(use, weight, 1.0), 1.0),
        use=use,
    )
    return Calibration(
        board=board,
        corners=corners,
        cameras=cameras,
        poses=poses,
        sensors=sensors,
        bend=(float(warp[0]), float(warp[1])),
        regularise="mrcal" if arrays.says("do_apply_regularization") else None,
    )


def read_lens(path: Path) -> tuple[Camera, tuple[int, int]]:
    """Read the fixed camera of a `.cameramodel`, and its image width and height."""
    content = _content(path)
    try:
        camera = lens_of_mrcal(content["lensmodel"], [*map(float, content["intrinsics"])], path.stem)
        width, height = map(int, content["imagersize"])
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        own = error.phrase if isinstance(error, InputError) else None
        raise InputError(own or phrase("targets.mrcal-no-model"), file=path) from None
    return camera, (width, height)


def _content(path: Path) -> dict[str, Any]:
    text = read_text(path)
    try:
        # Literals only: names, calls and operations are rejected.
        content: Any = ast.literal_eval(text.lstrip())
    except (ValueError, SyntaxError, MemoryError, RecursionError) as error:
        record = error.lineno if isinstance(error, SyntaxError) else None
        raise InputError(phrase("targets.mrcal-dictionary"), file=path, record=record) from None
    if not isinstance(content, dict) or "lensmodel" not in content:
        raise InputError(phrase("targets.mrcal-no-model"), file=path)
    return content


def _cameras(arrays: Arrays) -> list[Camera]:
    """Return the cameras with core, lens terms or knots free as in mrcal."""
    core = arrays.says(arrays.first("do_optimize_intrinsics_core", "do_optimize_intrinsic_core"))
    lens = arrays.says(
        arrays.first("do_optimize_intrinsics_distortions", "do_optimize_intrinsic_distortions")
    )
    model, rows, cameras = arrays.text("lensmodel"), arrays.numbers("intrinsics", None, None), []
    for k, row in enumerate(rows.tolist()):
        with at_place(Place(arrays.path)):
            camera = lens_of_mrcal(model, row, f"camera {k}")
        terms = camera.names[4 : len(row)] if lens and camera.knots is None else ()
        sd = dict.fromkeys((*(CORE if core else ()), *terms), math.inf)
        knot_sd = None if camera.knots is None else math.inf if lens else 0.0
        cameras.append(camera.replace(sd=sd, knot_sd=knot_sd))
    return cameras


def _poses(arrays: Arrays, indices: Indices, count: int) -> tuple[Floats, Floats]:
    """Return (K, 4, 4) sensors, camera 0 -> camera k, and (V, 4, 4) view poses."""
    views = of_vectors(arrays.numbers(arrays.first("frames_rt_toref", "rt_ref_frame"), None, 6))
    mounted = [each for each in ("extrinsics_rt_fromref", "rt_cam_ref") if each in arrays]
    to_camera = of_vectors(arrays.numbers(mounted[0], None, 6)) if mounted else np.zeros((0, 4, 4))
    if indices[:, 0].max() >= len(views) or indices[:, 2].max() >= len(to_camera):
        raise arrays.refusal("targets.mrcal-index", INDICES)
    if set(indices[:, 1].tolist()) != set(range(count)):
        raise arrays.refusal("targets.mrcal-cameras", INDICES, count=count)
    from_reference = np.empty((count, 4, 4))
    for camera in range(count):
        of = np.unique(indices[indices[:, 1] == camera, 2])
        if len(of) > 1:
            raise arrays.refusal("targets.mrcal-moving", INDICES, camera=camera)
        from_reference[camera] = np.eye(4) if of[0] < 0 else to_camera[of[0]]
    first = from_reference[0]
    seen = np.unique(indices[:, 0])
    return from_reference @ inverted(first), first @ views[seen]


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
    lens = opencv_lens(camera)
    if lens is None or lens.fisheye:
        raise rig.refusal(
            row, "a .cameramodel of mrcal", ["opencv8", "opencv5", "opencv12", "cahvor", KNOTTED]
        )
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
            splined or len(names - {"f", *CORE}) in (0, len(values) - 4)
            for splined, names, (_, values) in zip(knots, free, lenses, strict=True)
        )
        and calibration.sync != "offset"
        and (count == 1 or all(rig.tied(row) for row in range(1, count)))
    )
    if not fits:
        return None
    bend = calibrated.bend
    variance = calibrated.variance_of_unit_weight or 1.0
    corners = calibration.corners
    observed = np.zeros((len(corners.pictures), board.rows * board.columns, 3))
    observed[..., 2] = WEIGHT_OF_ABSENT
    observed[corners.picture, corners.point, :2] = corners.xy
    # Unused corners have a weight below 0.
    observed[corners.picture, corners.point, 2] = np.where(corners.use, 1.0, -1.0) / corners.sd
    order = np.lexsort([corners.cameras, corners.views])
    indices = np.column_stack([corners.views, corners.cameras, corners.cameras - 1]).astype(np.int32)
    estimated = set().union(*free)
    terms = bool(estimated - {"f", *CORE}) or any(each.given.knot_unknowns for each in calibrated.cameras)
    arrays: dict[str, Any] = {
        "intrinsics": np.array([values for _, values in lenses]),
        "extrinsics_rt_fromref": _vectors(rig.sensors[1:]) if count > 1 else np.zeros((0, 6)),
        "frames_rt_toref": _vectors(calibrated.poses),
        "points": "",
        "observations_board": observed.reshape(-1, board.rows, board.columns, 3)[order],
        INDICES: indices[order],
        "observations_point": "",
        "indices_point_camintrinsics_camextrinsics": "",
        "lensmodel": PREFIX + lenses[0][0],
        "imagersizes": np.array([rig.size(row) for row in range(count)], dtype=np.int32),
        "calobject_warp": np.array(calibration.bend if bend is None else bend.position[:2]),
        "do_optimize_intrinsics_core": bool(estimated & {"f", *CORE}),
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
    # Bilinear interpolation of the map
    fractions = [
        np.interp(places[..., axis], nodes, np.arange(len(nodes)))
        for axis, nodes in enumerate((found.columns, found.rows))
    ]
    i, j = (np.clip(each.astype(int), 0, n - 2) for each, n in zip(fractions, sd.shape[::-1], strict=True))
    x, y = fractions[0] - i, fractions[1] - j
    with np.errstate(invalid="ignore"):
        upper = sd[j, i] * (1 - x) + sd[j, i + 1] * x
        lower = sd[j + 1, i] * (1 - x) + sd[j + 1, i + 1] * x
        good = inside & (upper * (1 - y) + lower * y <= largest)
    steps = np.where(good.all(axis=1), OUTLINE_STEPS, np.argmin(good, axis=1)) - 1
    return np.asarray(places[np.arange(len(angles)), steps])
