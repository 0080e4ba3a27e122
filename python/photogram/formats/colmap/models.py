"""COLMAP models as projects, and the covariances of a result."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder, FrameOf, Rig
from photogram.formats.colmap import files
from photogram.formats.format import FORMATS
from photogram.formats.images import Y_DOWN, lens_of, sizes_of, to_corner
from photogram.formats.models import attitude_matrices, complete_positions, known_cameras
from photogram.formats.names import NAMES, NamedValues, names_file, numbered, with_names
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.formats.recognition import colmap
from photogram.io.json import to_json
from photogram.io.parquet import packed
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.block_checks import known_poses
from photogram.network.cameras import Camera
from photogram.network.moving_photos import Mount
from photogram.network.unknowns import Sensor
from photogram.results.result import Result
from photogram.words import Phrase, phrase

MAX_DIFFERENCE, NORMALISED = 1e-2, 1e-6
"""Differences of the length of a quaternion from 1: the largest, and the largest without a remark."""


def read(path: Path, options: ReadOptions) -> Project:
    folder = colmap(path)
    if folder is None:
        raise InputError(phrase("colmap.files"), file=path)
    project = _project(files.read_model(folder), path)
    return with_names(project, folder / NAMES) if (folder / NAMES).is_file() else project


def _project(model: files.Model, path: Path) -> Project:
    block, images = BlockBuilder(path, FORMATS["colmap"].title), model.images
    for each in model.cameras:
        values = dict(zip(files.MODELS[each.model], each.parameters, strict=True))
        with at_place(each.place):
            camera = Camera(each.model.lower(), values, name=str(each.number), unit="px")
        block.camera(camera, (each.width, each.height), key=each.number, place=each.place)
    for image in images:
        block.photo(image.number, image.camera, image.place, name=image.name)
    finite = np.isfinite(model.features["xy"]).all(axis=1)
    if not finite.all():
        row = int(np.searchsorted(np.cumsum(model.counts), np.argmin(finite), side="right"))
        raise images[row].place.error(phrase("format.finite", name="a feature"))
    _check_finite(model.points["xyz"], model.point_place, "the position")
    _, first = np.unique(numbers := model.points["number"], return_index=True)
    if len(first) < len(numbers):
        row = int(np.setdiff1d(np.arange(len(numbers)), first)[0])
        raise model.point_place(row).error(phrase("format.repeated", what="point", name=str(numbers[row])))
    names = list(block.photo_ids)
    rotations, translations, off = _rigid([each.pose for each in images], [each.place for each in images])
    if len(off):
        remark = Message.of("colmap.normalised", n=len(off), names=[names[row] for row in off])
        block.messages.append(remark)
    frames = _composed(model, rotations, translations, block.messages)
    centres = -np.einsum("nji,nj->ni", rotations, translations)
    block.photos(names, block.photo_cameras, centres, (Y_DOWN @ rotations).transpose(0, 2, 1))
    block.rigs(frames)
    rows, points = _observed(model, block.messages)
    block.points(list(map(str, model.points["number"].tolist())), model.points["xyz"].copy())
    photos = np.repeat(np.arange(len(images)), model.counts)[rows]
    block.images(photos, points, model.features["xy"][rows])
    if len(rows):
        block.lacks.append(Phrase("read.placeless", {"option": Phrase("option.control")}))
    image_numbers = dict(zip(names, model.numbers.tolist(), strict=True))
    colours = NamedValues[list[int]](block.point_ids, model.points["rgb"])
    return block.project(details={"image numbers": image_numbers, "colours": colours})


def _check_finite(values: Floats, place: Callable[[int], Place], name: str) -> None:
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        raise place(int(np.argmin(finite))).error(phrase("format.finite", name=name))


def _rigid(poses: Sequence[Sequence[float]], places: Sequence[Place]) -> tuple[Floats, Floats, Indices]:
    """Return (n, 3, 3) rotations, (n, 3) translations, and rows of quaternions without unit length."""
    table = np.array(poses, dtype=float).reshape(-1, 7)
    _check_finite(table[:, 4:], places.__getitem__, "the translation")
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.linalg.norm(table[:, :4], axis=1)
        differences = np.abs(lengths - 1)
    bad = ~(differences <= MAX_DIFFERENCE)
    if bad.any():
        row = int(np.argmax(bad))
        raise places[row].error(phrase("format.length", length=float(lengths[row])))
    matrices = Attitudes.of("quaternion", table[:, :4]).matrices.copy()
    return matrices, table[:, 4:], np.flatnonzero(differences > NORMALISED)


def _composed(
    model: files.Model, rotations: Floats, translations: Floats, messages: list[Message]
) -> list[FrameOf]:
    if not model.frames:
        return []
    cameras = {camera.number: str(camera.number) for camera in model.cameras}
    numbers = {rig.number for rig in model.rigs}
    sensors, rigs = _mounted_sensors(model, cameras)
    rows = {each.number: row for row, each in enumerate(model.images)}
    frames, seen, unknown = [], set(), 0
    turns, shifts, _ = _rigid([each.pose for each in model.frames], [each.place for each in model.frames])
    for frame, turn, shift in zip(model.frames, turns, shifts, strict=True):
        place = frame.place
        if frame.rig not in numbers:
            raise place.error(phrase("format.undefined", what="rig", name=str(frame.rig)))
        photos: dict[str, int] = {}
        for sensor, image in ((own.number, own.image) for own in frame.data if own.kind == files.CAMERA):
            if image not in rows:
                raise place.error(phrase("format.undefined", what="image", name=str(image)))
            row = rows[image]
            if (frame.rig, sensor) not in sensors or model.images[row].camera != sensor:
                raise place.error(phrase("colmap.sensor", frame=frame.number, image=image, camera=sensor))
            if row in seen or cameras[sensor] in photos:
                raise place.error(phrase("colmap.frame", frame=frame.number, image=image, camera=sensor))
            seen.add(row)
            pose = sensors[frame.rig, sensor]
            if pose is None:
                rotations[row], translations[row] = np.nan, np.nan
                unknown += 1
                continue
            rotations[row], translations[row] = pose[0] @ turn, pose[0] @ shift + pose[1]
            photos[cameras[sensor]] = row
        rig = rigs.get(frame.rig)
        if rig is not None and any(camera != rig.reference for camera in photos):
            frames.append(FrameOf(str(frame.number), rig, photos))
    for code, n in (("colmap.unposed", unknown), ("colmap.frameless", len(rows) - len(seen))):
        messages += [Message.of(code, n=n)] if n else []
    return frames


def _mounted_sensors(
    model: files.Model, cameras: Mapping[int, str]
) -> tuple[dict[tuple[int, int], tuple[Floats, Floats] | None], dict[int, Rig]]:
    """Return poses of cameras on rigs (None: unknown), and rigs by frame camera."""
    poses: dict[tuple[int, int], tuple[Floats, Floats] | None] = {}
    rigs: dict[int, Rig] = {}
    for rig in model.rigs:
        sensors: dict[str, Sensor] = {}
        for number, pose in ((own.number, own.pose) for own in rig.sensors if own.kind == files.CAMERA):
            if number not in cameras:
                raise rig.place.error(phrase("format.undefined", what="camera", name=str(number)))
            poses[rig.number, number] = None
            if pose:
                turns, shifts, _ = _rigid([pose], [rig.place])
                poses[rig.number, number] = rigid = turns[0], shifts[0]
                name = f"rig {rig.number}, camera {number}"
                sensors[cameras[number]] = Sensor.from_colmap(name, *rigid)
        for reference in (own.number for own in rig.reference if own.kind == files.CAMERA):
            poses[rig.number, reference] = np.eye(3), np.zeros(3)
            rigs[rig.number] = Rig(str(rig.number), cameras.get(reference, ""), sensors)
    return poses, rigs


def _observed(model: files.Model, messages: list[Message]) -> tuple[Indices, Indices]:
    """Return rows of features that are images of points, and the rows of the points."""
    named, own = model.features["point"].copy(), model.points["number"].astype(np.int64)
    features = np.flatnonzero(named != files.NO_POINT)
    order = np.argsort(own, kind="stable")
    numbers, wanted = own[order], named[features]
    at = np.searchsorted(numbers, wanted)
    known = np.append(numbers, files.NO_POINT)[at] == wanted
    rows = order[at[known]]
    missing = np.unique(wanted[~known]).tolist()
    counts = np.bincount(rows, minlength=len(own))
    for code, n in (
        ("colmap.pointless", len(named) - len(features)),
        ("colmap.unknown-points", np.count_nonzero(~known)),
        ("colmap.tracks", np.count_nonzero(counts != model.points["track"].astype(np.int64))),
    ):
        messages += [Message.of(code, n=int(n), names=missing)] if n else []
    return features[known], rows


def cannot_hold(project: Project) -> list[Phrase]:
    """Return points without a position, and rigs that cameras cannot define."""
    unplaced = np.count_nonzero(~np.isfinite(complete_positions(project)).all(axis=1))
    found = [phrase("lost.unplaced", n=int(unplaced))] if unplaced else []
    which = known_cameras(project.block)[1]
    if not _told_by_cameras(project.block.mounts, dict(zip(project.block.photo_ids, which, strict=True))):
        found.append(phrase("lost.rigs"))
    return found


def _told_by_cameras(mounts: Sequence[Mount], cameras: Mapping[str, int]) -> bool:
    """Return whether each camera belongs to one sensor or rig, as required."""
    sensors: dict[int, tuple[int, int]] = {}
    for mount in mounts:
        own = cameras[mount.frame], id(mount.sensor)
        if sensors.setdefault(cameras[mount.photo], own) != own:
            return False
    mounted = {mount.photo for mount in mounts}
    alone = {camera for photo, camera in cameras.items() if photo not in mounted}
    return not alone & set(sensors)


def write(kind: str, project: Project) -> Mapping[str, bytes]:
    """Return the text or binary files of a project."""
    written = _written(project)
    own = (files.text_files if kind == "text" else files.binary_files)(written.model)
    return {**own, **names_file(written.points)}


@dataclass(frozen=True)
class _Written:
    model: files.Model
    photos: dict[str, int]
    points: dict[str, int]
    cameras: dict[str, int]
    rows: Indices


def _written(project: Project) -> _Written:
    """Return the model of all photos with a pose, and of all points with a position."""
    block, details = project.block, project.details
    cameras, photo_cameras = known_cameras(block)
    numbers = numbered([camera.name for camera in cameras])
    own = (numbers[camera.name] for camera in cameras)
    records = sorted(map(_record, cameras, sizes_of(project), own), key=lambda camera: camera.number)
    rows = np.flatnonzero(known_poses(block))
    if not len(rows):
        raise InputError(phrase("format.poses"))
    photos = numbered([block.photo_ids[row] for row in rows], details.get("image numbers"))
    positions = complete_positions(project)
    point_rows = np.flatnonzero(np.isfinite(positions).all(axis=1))
    points = numbered([block.point_ids[row] for row in point_rows], details.get("point numbers"))
    attitudes = Attitudes(attitude_matrices(block)[rows])
    quaternions = attitudes.values("quaternion_to_vision")
    translations = attitudes.translations(block.photo_positions[rows])
    poses = dict(zip(photos, map(tuple, np.hstack([quaternions, translations]).tolist()), strict=True))
    of_rows = (numbers[cameras[photo_cameras[row]].name] for row in rows)
    of_photo = dict(zip(photos, of_rows, strict=True))
    rigs, frames = _rigs(project, poses, photos, of_photo, numbers)

    image_rows = np.flatnonzero(np.isin(block.image_photos, rows))
    numbers_of_photos = np.zeros(len(block.photo_ids), dtype=np.int64)
    numbers_of_photos[rows] = list(photos.values())
    owners = numbers_of_photos[block.image_photos[image_rows]]
    image_rows = image_rows[np.argsort(owners, kind="stable")]
    point_numbers = np.full(len(block.point_ids), files.NO_POINT, dtype=np.int64)
    point_numbers[point_rows] = list(points.values())
    features = np.empty(len(image_rows), files.FEATURE)
    features["xy"] = to_corner(project)[image_rows]
    features["point"] = point_numbers[block.image_points[image_rows]]
    names = sorted(photos, key=photos.__getitem__)
    parts = np.split(features, np.searchsorted(np.sort(owners), [photos[name] for name in names])[1:])
    pairs = zip(names, parts, strict=True)
    images = [files.Image(photos[name], poses[name], of_photo[name], name, own) for name, own in pairs]
    point_rows = point_rows[np.argsort(point_numbers[point_rows], kind="stable")]
    colours = details.get("colours", {})
    table = np.zeros(len(point_rows), files.POINT)
    table["number"], table["xyz"], table["error"] = point_numbers[point_rows], positions[point_rows], -1.0
    rgb = [colours.get(block.point_ids[row], (0, 0, 0)) for row in point_rows.tolist()]
    table["rgb"] = np.array(rgb, dtype=np.int64).reshape(-1, 3)
    model = files.Model(project.path, records, images, table, rigs, frames)
    return _Written(model, photos, points, numbers, image_rows)


def _record(camera: Camera, size: Size, number: int) -> files.Camera:
    model = camera.model.upper()
    if model in files.MODELS and camera.unit == "px":
        return files.Camera(number, model, *size, tuple(camera.values.tolist()))
    lens = lens_of(camera, size)
    if lens is None or (terms := lens.first(8)) is None:
        raise InputError(phrase("format.model", camera=camera.title, model=camera.model, title="COLMAP"))
    if lens.focal[0] == lens.focal[1] and not any(terms[2:]):
        return files.Camera(number, "RADIAL", *size, (lens.focal[0], *lens.centre, *terms[:2]))
    return files.Camera(number, "FULL_OPENCV", *size, (*lens.focal, *lens.centre, *terms))


def _rigs(
    project: Project,
    poses: Mapping[str, tuple[float, ...]],
    photos: Mapping[str, int],
    cameras: Mapping[str, int],
    numbers: Mapping[str, int],
) -> tuple[list[files.Rig], list[files.Frame]]:
    """Return rigs and frames: of mounts, and one for each other camera and photo."""
    sensors: dict[int, dict[int, tuple[float, ...]]] = {}
    members: dict[str, list[str]] = {name: [name] for name in poses}
    mounts = [each for each in project.block.mounts if each.photo in poses and each.frame in poses]
    for mount in mounts if _told_by_cameras(mounts, cameras) else []:
        own = sensors.setdefault(cameras[mount.frame], {})
        # Sensor from rig: R = F A' F and t = -R (F c)
        turn = Y_DOWN @ mount.sensor.attitude.T @ Y_DOWN
        quaternion = Attitudes(turn[np.newaxis]).values("quaternion")[0].tolist()
        shift = (-turn @ Y_DOWN @ mount.sensor.position).tolist()
        own.setdefault(cameras[mount.photo], (*quaternion, *shift))
        members[mount.frame].append(mount.photo)
        del members[mount.photo]
    mounted = {number for own in sensors.values() for number in own}
    rigs = []
    for number in sorted(set(numbers.values()) - mounted):
        mounts_of = sorted(sensors.get(number, {}).items())
        others = tuple(files.MountedSensor(files.CAMERA, other, True, pose) for other, pose in mounts_of)
        rigs.append(files.Rig(number, 1 + len(others), (files.Sensor(files.CAMERA, number),), others))
    frames = []
    for name, names in members.items():
        data = tuple(files.SensorImage(files.CAMERA, cameras[each], photos[each]) for each in names)
        frames.append(files.Frame(photos[name], cameras[name], poses[name], len(data), data))
    return rigs, sorted(frames, key=lambda each: each.number)


def covariance_files(project: Project, result: Result) -> Mapping[str, bytes]:
    """Return the covariances of a result: docs/formats/colmap.md."""
    model = _written(project)
    block = result.block
    photos, points = (
        {numbers[name]: row for row, name in enumerate(names) if name in numbers}
        for names, numbers in ((block.photo_ids, model.photos), (block.point_ids, model.points))
    )
    points = {number: row for number, row in points.items() if result.used_points[row]}
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
        "quality": "u64 n; n x {u32 image_id, u32 point2D_idx, f32 x 6}: residual, redundancy number and test"
        " value of column and row; NaN where there is none",
        "files": [
            "photo_covariances.bin",
            "camera_covariances.bin",
            "point_covariances.bin",
            "observation_quality.bin",
        ],
    }
    quality = np.empty(len(model.rows), [("image", "<u4"), ("feature", "<u4"), ("values", "<f4", 6)])
    quality["image"] = np.repeat(model.model.numbers, model.model.counts)
    quality["feature"] = np.concatenate([np.arange(count) for count in model.model.counts])
    parts = (result.residuals, result.redundancy, result.standardized)
    quality["values"] = np.hstack([part[model.rows] for part in parts])
    # A Exp(rho) is F A' before: r = -F rho.
    own, jacobian = result.photo_rotation_covariances, np.eye(6)
    jacobian[3:, 3:] = -Y_DOWN
    return {
        "covariances.json": to_json(about),
        "photo_covariances.bin": _triangles(photos, jacobian @ own @ jacobian.T, "<u4"),
        "camera_covariances.bin": _camera_covariances(model, result),
        "point_covariances.bin": _triangles(points, result.point_covariances, "<u8"),
        "observation_quality.bin": struct.pack("<Q", len(quality)) + quality.tobytes(),
    }


def _triangles(rows: Mapping[int, int], covariances: Floats, number: str) -> bytes:
    """Return covariances, stored by row, in the order of their numbers."""
    own = sorted(rows.items())
    lower = packed(covariances[[row for _, row in own]])
    table = np.empty(len(own), [("id", number), ("c", "<f8", lower.shape[1])])
    table["id"], table["c"] = [each for each, _ in own], lower
    return struct.pack("<Q", len(table)) + table.tobytes()


def _camera_covariances(model: _Written, result: Result) -> bytes:
    matrices = {model.cameras.get(each.name): each.covariance for each in result.cameras}
    found = []
    for camera in model.model.cameras:
        count, matrix = len(camera.parameters), matrices.get(camera.number)
        if matrix is None or matrix.shape != (count, count):
            matrix = np.zeros((count, count))
        triangle = packed(matrix[np.newaxis])[0].astype("<f8")
        found.append(struct.pack("<II", camera.number, count) + triangle.tobytes())
    return struct.pack("<Q", len(found)) + b"".join(found)
