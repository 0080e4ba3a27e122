"""From a project to a COLMAP model, and the covariances of a result beside it."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.colmap.binary import binary_files
from photogram.formats.colmap.content import (
    CAMERA,
    MODELS,
    NO_POINT,
    Camera,
    Frame,
    Images,
    Model,
    Points,
    Pose,
    Rig,
)
from photogram.formats.colmap.text import text_files
from photogram.formats.images import sizes_of, to_corner
from photogram.formats.intersection import complete_positions
from photogram.formats.lenses import lens_of
from photogram.formats.names import names_file, numbered
from photogram.formats.plain.writing import attitude_matrices, known_cameras
from photogram.formats.project import Project, Size
from photogram.io.json import to_json
from photogram.io.places import Place
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera as HouseCamera
from photogram.results.result import Result

__all__ = ["cannot_hold", "covariance_files", "write", "write_as_text"]

_NAMES = dict(MODELS)
_FLIP = np.diag([1.0, -1.0, -1.0])


def cannot_hold(project: Project) -> list[str]:
    """Return what of a project a COLMAP model has no place for."""
    block = project.block
    found = ["standard deviations and correlations", f"the frame ({project.frame}) and its unit"]
    held = int(np.count_nonzero(np.isfinite(block.point_sd).any(axis=1)))
    if held or project.checks:
        found.append(
            f"what control is: {held} held and {len(project.checks)} check points are points as others"
        )
    if block.observations:
        found.append(f"{len(block.observations)} observations beside images")
    unposed = _unposed(project)
    if unposed.any():
        found.append(f"{np.count_nonzero(unposed)} photos without a pose")
    lost = int(np.count_nonzero(~np.isfinite(complete_positions(project)).all(axis=1)))
    if lost:
        found.append(f"{lost} points without a position: their images are features without a point")
    if any(each.deviations.any() for each in known_cameras(block)[0]):
        found.append("which parameters of cameras are unknown")
    return found


def _unposed(project: Project) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    block = project.block
    poses = np.hstack([block.photo_positions, block.photo_attitudes])
    return np.asarray(~np.isfinite(poses).all(axis=1))


def write(project: Project) -> Mapping[str, bytes]:
    """Return the binary files of a project.

    Raises
    ------
    InputError
        Cameras of other models than those of COLMAP, pictures of unknown size, geographic coordinates.
    """
    made = _made(project)
    return {**binary_files(made.model), **names_file(made.points)}


def write_as_text(project: Project) -> Mapping[str, bytes]:
    """Return the text files of a project; see :func:`write`."""
    made = _made(project)
    return {**text_files(made.model), **names_file(made.points)}


@dataclass(frozen=True)
class _Made:
    """A model with the numbers that photos, points and cameras have in it."""

    model: Model
    photos: dict[str, int]
    points: dict[str, int]
    cameras: dict[str, int]


def _made(project: Project) -> _Made:
    block = project.block
    if block.geographic:
        raise InputError("a COLMAP model is cartesian: geographic coordinates have no place there")
    cameras, photo_cameras = known_cameras(block)
    numbers = numbered([each.name for each in cameras])
    sizes = sizes_of(project)
    lines = [_camera(each, size, numbers[each.name]) for each, size in zip(cameras, sizes, strict=True)]
    posed = np.flatnonzero(~_unposed(project))
    photos = numbered([block.photo_ids[row] for row in posed], project.details.get("image numbers"))
    positions = complete_positions(project)
    placed = np.flatnonzero(np.isfinite(positions).all(axis=1))
    points = numbered([block.point_ids[row] for row in placed], project.details.get("point numbers"))
    matrices = attitude_matrices(block)[posed]
    rotations = _FLIP @ matrices.transpose(0, 2, 1)
    translations = -np.einsum("nij,nj->ni", rotations, block.photo_positions[posed])
    quaternions = Attitudes(matrices).values("quaternion_to_vision")
    camera_numbers = np.array([numbers[cameras[photo_cameras[row]].name] for row in posed], dtype=np.int64)
    ids = np.array([photos[block.photo_ids[row]] for row in posed], dtype=np.int64)
    images = _images(project, posed, ids, camera_numbers, quaternions, translations, placed, points)
    colours = project.details.get("colours", {})
    poses = {
        block.photo_ids[row]: Pose(tuple(q), tuple(t))
        for row, q, t in zip(posed.tolist(), quaternions.tolist(), translations.tolist(), strict=True)
    }
    of_photo = {
        block.photo_ids[row]: int(number) for row, number in zip(posed.tolist(), camera_numbers, strict=True)
    }
    rigs, frames = _rigs(project, poses, photos, of_photo, sorted(numbers.values()))
    order = np.argsort([points[block.point_ids[row]] for row in placed], kind="stable")
    placed = placed[order]
    model = Model(
        project.path,
        sorted(lines, key=lambda each: each.number),
        images,
        Points(
            np.array([points[block.point_ids[row]] for row in placed], dtype=np.int64),
            positions[placed],
            np.array(
                [colours.get(block.point_ids[row], (0, 0, 0)) for row in placed], dtype=np.int64
            ).reshape(-1, 3),
            np.zeros(len(placed), dtype=np.int64),
            [],
        ),
        rigs,
        frames,
    )
    return _Made(model, photos, points, numbers)


def _camera(camera: HouseCamera, size: Size, number: int) -> Camera:
    model = camera.model.upper()
    if model in _NAMES and camera.unit == "px":
        return Camera(number, model, *size, tuple(camera.values.tolist()), Place())
    lens = lens_of(camera, size)
    if lens is None:
        raise InputError(
            f"the camera {camera.title} has the model {camera.model}, which COLMAP does not have; none is"
            f" fitted"
        )
    if lens.fx == lens.fy and lens.is_plain("k1", "k2"):
        return Camera(number, "RADIAL", *size, (lens.fx, lens.cx, lens.cy, lens.k1, lens.k2), Place())
    return Camera(number, "FULL_OPENCV", *size, (lens.fx, lens.fy, lens.cx, lens.cy, *lens.terms), Place())


def _images(
    project: Project,
    posed: np.ndarray[tuple[int], np.dtype[np.int64]],
    ids: np.ndarray[tuple[int], np.dtype[np.int64]],
    cameras: np.ndarray[tuple[int], np.dtype[np.int64]],
    quaternions: Floats,
    translations: Floats,
    placed: np.ndarray[tuple[int], np.dtype[np.int64]],
    points: Mapping[str, int],
) -> Images:
    block = project.block
    number = np.full(len(block.point_ids), NO_POINT, dtype=np.int64)
    number[placed] = [points[block.point_ids[row]] for row in placed]
    rank = np.full(len(block.photo_ids), -1, dtype=np.int64)
    by_id = np.argsort(ids, kind="stable")
    rank[posed[by_id]] = np.arange(len(posed))
    rows = np.flatnonzero(rank[block.image_photos] >= 0)
    rows = rows[np.argsort(rank[block.image_photos[rows]], kind="stable")]
    return Images(
        ids[by_id],
        cameras[by_id],
        quaternions[by_id],
        translations[by_id],
        [block.photo_ids[row] for row in posed[by_id]],
        np.bincount(rank[block.image_photos[rows]], minlength=len(posed)),
        to_corner(project)[rows],
        number[block.image_points[rows]],
        [],
    )


def _rigs(
    project: Project,
    poses: Mapping[str, Pose],
    photos: Mapping[str, int],
    cameras: Mapping[str, int],
    numbers: list[int],
) -> tuple[list[Rig], list[Frame]]:
    """Return rigs and frames: those of mounts, and of each other camera and photo one of its own."""
    sensors: dict[int, dict[int, Pose]] = {}
    members: dict[str, list[str]] = {name: [name] for name in poses}
    for mount in project.block.mounts:
        if mount.photo not in poses or mount.frame not in poses:
            continue
        own = sensors.setdefault(cameras[mount.frame], {})
        own.setdefault(cameras[mount.photo], _sensor_pose(mount.sensor.position, mount.sensor.attitude))
        members[mount.frame].append(mount.photo)
        del members[mount.photo]
    rigs = [
        Rig(
            number,
            (CAMERA, number),
            tuple((CAMERA, other, pose) for other, pose in sorted(sensors.get(number, {}).items())),
            Place(),
        )
        for number in numbers
    ]
    frames = [
        Frame(
            photos[name],
            cameras[name],
            poses[name],
            tuple((CAMERA, cameras[each], photos[each]) for each in own),
            Place(),
        )
        for name, own in members.items()
    ]
    return rigs, sorted(frames, key=lambda each: each.number)


def _sensor_pose(position: Floats, axes: Floats) -> Pose:
    """Return sensor from rig: R = F A' F and t = -R (F c)."""
    turn = _FLIP @ axes.T @ _FLIP
    quaternion = Attitudes(turn[np.newaxis]).values("quaternion")[0]
    return Pose(tuple(quaternion.tolist()), tuple((-turn @ _FLIP @ position).tolist()))


def covariance_files(project: Project, result: Result) -> Mapping[str, bytes]:
    """Return the covariances of a result in the order of the model's files: docs/formats.md."""
    made = _made(project)
    block = result.block
    rows = {name: row for row, name in enumerate(block.photo_ids)}
    photos = sorted(made.photos.items(), key=lambda each: each[1])
    order = [rows[name] for name, _ in photos]
    covariances = _centre_and_rotation(result)[order]
    points = {name: row for row, name in enumerate(block.point_ids)}
    used = result.used_points
    own = sorted(((number, points[name]) for name, number in made.points.items() if used[points[name]]))
    point_rows = [row for _, row in own]
    table = np.empty(len(order), [("id", "<u4"), ("c", "<f8", 21)])
    table["id"], table["c"] = [number for _, number in photos], _lower(covariances)
    point_table = np.empty(len(own), [("id", "<u8"), ("c", "<f8", 6)])
    point_table["id"], point_table["c"] = (
        [number for number, _ in own],
        _lower(result.point_covariances[point_rows]),
    )
    about = {
        "format": 1,
        "what": "covariances: cofactors times the variance of unit weight",
        "variance_of_unit_weight": result.covariance_scale,
        "frame": str(project.frame),
        "unit": block.linear_unit,
        "datum": str(result.datum),
        "photo": ["C_x", "C_y", "C_z", "r_x", "r_y", "r_z"],
        "photo_rotation": "R_true = exp([r]x) R, R world to camera; r in the camera's axes, radians",
        "point": ["X", "Y", "Z"],
        "camera": "the parameters of cameras.bin; held ones have zeros",
        "layout": "u64 n; n x {id, lower triangle by rows as f64}; little endian, no padding",
        "files": ["photo_covariances.bin", "camera_covariances.bin", "point_covariances.bin"],
    }
    return {
        "covariances.json": to_json(about),
        "photo_covariances.bin": struct.pack("<Q", len(table)) + table.tobytes(),
        "camera_covariances.bin": _camera_covariances(made, result),
        "point_covariances.bin": struct.pack("<Q", len(point_table)) + point_table.tobytes(),
    }


def _camera_covariances(made: _Made, result: Result) -> bytes:
    found = []
    own = {each.name: each.covariance for each in result.cameras}
    for camera in made.model.cameras:
        name = next(name for name, number in made.cameras.items() if number == camera.number)
        count = len(camera.parameters)
        matrix = own.get(name)
        if matrix is None or matrix.shape != (count, count):
            matrix = np.zeros((count, count))
        found.append(
            struct.pack("<II", camera.number, count) + _lower(matrix[np.newaxis])[0].astype("<f8").tobytes()
        )
    return struct.pack("<Q", len(found)) + b"".join(found)


def _lower(matrices: Floats) -> Floats:
    rows, columns = np.tril_indices(matrices.shape[1])
    found: Floats = matrices[:, rows, columns]
    return found


def _centre_and_rotation(result: Result) -> Floats:
    """Return (P, 6, 6) covariances of centres and of rotations in the axes of the cameras.

    A Exp(rho) is F A' before: r = -F rho.
    """
    kind = "omega_phi_kappa_photo_to_ground" if result.block.photo_to_ground else "omega_phi_kappa"
    rates = _photocore.attitudes_from_numbers(kind, result.photo_attitudes, _photocore.nadir_boresight(0))[1]
    jacobian = np.zeros((len(rates), 6, 6))
    jacobian[:, :3, :3] = np.eye(3)
    jacobian[:, 3:, 3:] = -_FLIP @ rates
    found: Floats = jacobian @ result.photo_covariances @ jacobian.transpose(0, 2, 1)
    return found
