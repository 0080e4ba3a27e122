"""`.cameramodel` files of mrcal: a Python dictionary as text, with an optional calibration.

`optimization_inputs` is a base 85 (RFC 1924) archive of NumPy arrays. They contain corners with weights,
indices of views, cameras and sensors, poses, lenses, and the board deflection. Nothing is unpickled or
evaluated.
"""

from __future__ import annotations

import ast
import base64
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.arrays import argument_error
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.io.files import read_text
from photogram.io.places import Place, at_place
from photogram.network.cameras import Camera
from photogram.network.knots import KNOTTED
from photogram.targets.board import Board
from photogram.targets.calibration import Calibration
from photogram.targets.corner_files import KEY
from photogram.targets.corners import Corners
from photogram.targets.npz_arrays import Arrays, read_arrays
from photogram.targets.vision import inverted, of_vectors
from photogram.words import phrase

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
    """Return a fixed camera from its mrcal name and numbers."""
    said = model.removeprefix(PREFIX)
    if splined := SPLINED.fullmatch(said):
        order, nx, ny, fov = map(float, splined.groups())
        _count(model, values, 4 + 2 * int(nx) * int(ny))
        return Camera(
            KNOTTED,
            dict(
                zip((*CORE, "order", "nx", "ny", "fov_x_deg"), [*values[:4], order, nx, ny, fov], strict=True)
            ),
            name=name,
            knots=np.reshape(values[4:], (int(ny), int(nx), 2)),
        )
    if said not in LENSES:
        raise InputError(phrase("targets.mrcal-lens", model=model, names=[*LENSES, "splined models"]))
    own, count = LENSES[said]
    _count(model, values, count)
    names = Camera(own, dict.fromkeys(CORE, 1.0)).names[:count]
    return Camera(own, dict(zip(names, values, strict=True)), name=name)


def _count(model: str, values: Sequence[float], needed: int) -> None:
    if len(values) != needed:
        raise argument_error(model, "count", count=needed, actual=len(values))


def freed(camera: Camera, model: str, core: bool, lens: bool) -> Camera:
    """Return an mrcal camera with its core, lens terms or knots free as in mrcal."""
    own = CORE if core else ()
    if camera.knots is not None:
        return camera.replace(sd=dict.fromkeys(own, math.inf), knot_sd=math.inf if lens else 0.0)
    terms = camera.names[4 : LENSES[model.removeprefix(PREFIX)][1]]
    return camera.replace(sd=dict.fromkeys((*own, *(terms if lens else ())), math.inf))


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
    sizes = arrays.numbers("imagersizes", len(cameras), 2).astype(int).tolist()
    return Calibration(
        board=board,
        corners=_corners(observed, indices, [(width, height) for width, height in sizes]),
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
    core = arrays.first("do_optimize_intrinsics_core", "do_optimize_intrinsic_core")
    lens = arrays.first("do_optimize_intrinsics_distortions", "do_optimize_intrinsic_distortions")
    model, rows = arrays.text("lensmodel"), arrays.numbers("intrinsics", None, None)
    with at_place(Place(arrays.path)):
        cameras = [lens_of_mrcal(model, row, f"camera {k}") for k, row in enumerate(rows.tolist())]
    return [freed(camera, model, arrays.says(core), arrays.says(lens)) for camera in cameras]


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


def _corners(observed: Floats, indices: Indices, sizes: list[tuple[int, int]]) -> Corners:
    pictures, points = len(observed), observed.shape[1] * observed.shape[2]
    rows = observed.reshape(-1, 3)
    weight = rows[:, 2]
    use = weight > 0
    mounted = len(sizes) > 1
    return Corners(
        pictures=[
            f"view{view:03d}-{camera}" if mounted else f"view{view:03d}"
            for view, camera in indices[:, :2].tolist()
        ],
        cameras=indices[:, 1],
        views=np.unique(indices[:, 0], return_inverse=True)[1].reshape(-1),
        camera_names=[f"camera {number}" for number in range(len(sizes))],
        sizes=sizes,
        picture=np.repeat(np.arange(pictures), points),
        point=np.tile(np.arange(points), pictures),
        xy=rows[:, :2],
        sd=np.where(use, 1 / np.where(use, weight, 1.0), 1.0),
        use=use,
    )
