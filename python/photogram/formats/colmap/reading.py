"""Reader of COLMAP models."""

from __future__ import annotations

import math
from collections.abc import Container, Hashable, Mapping, Sequence
from pathlib import Path

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder, FrameOf, Rig
from photogram.formats.colmap.content import CAMERA, NO_POINT, Camera, Model
from photogram.formats.colmap.files import read_model
from photogram.formats.images import Y_DOWN
from photogram.formats.names import NAMES, NamedValues, renamed
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.io.places import Place, at_place
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera as HouseCamera
from photogram.network.unknowns import Sensor
from photogram.words import Phrase, phrase

TITLE = "COLMAP model"
MAX_DIFFERENCE, NORMALISED = 1e-2, 1e-6
"""Differences of the length of a quaternion from 1: the largest, and the largest without a remark."""


def place_of(path: Path) -> Path | None:
    """Return the folder of a model: a path itself, or `sparse/0` or `sparse` in it."""
    for folder in (path, path / "sparse" / "0", path / "sparse"):
        if any(
            (folder / f"cameras{end}").is_file() and (folder / f"images{end}").is_file()
            for end in (".bin", ".txt")
        ):
            return folder
    return None


def read(path: Path, options: ReadOptions) -> Project:
    """Read a model."""
    del options
    folder = place_of(path)
    if folder is None:
        raise InputError(phrase("colmap.files"), file=path)
    return renamed(_project(read_model(folder), path), folder / NAMES)


def _project(model: Model, path: Path) -> Project:
    block, images = BlockBuilder(path, TITLE), model.images
    names, numbers, xy = [each.name for each in images], model.numbers, model.features["xy"]
    for each in model.cameras:
        block.camera(_camera(each), (each.width, each.height), key=each.number, place=each.place)
    _check_model(model, block.camera_rows)
    table = np.array([each.pose for each in images]).reshape(-1, 7)
    translations = table[:, 4:]
    rotations, off = _rotations(table[:, :4], [each.place for each in images])
    if len(off):
        remark = Message.of("colmap.normalised", n=len(off), names=[names[row] for row in off])
        block.messages.append(remark)
    frames = _composed(model, rotations, translations, block.messages)
    cameras = [block.camera_rows[each.camera] for each in images]
    centres = -np.einsum("nji,nj->ni", rotations, translations)
    block.photos(names, cameras, centres, (Y_DOWN @ rotations).transpose(0, 2, 1))
    block.rigs(frames)
    rows, points = _observed(model, block.messages)
    block.points(list(map(str, model.points["number"].tolist())), model.points["xyz"].copy())
    photos = np.repeat(np.arange(len(images)), model.counts)[rows]
    block.images(photos, points, xy[rows])
    if len(rows):
        block.lacks.append(Phrase("read.placeless", {"option": Phrase("option.control")}))
    return block.project(
        details={
            "image numbers": dict(zip(names, numbers.tolist(), strict=True)),
            "colours": NamedValues(block.point_ids, model.points["rgb"]),
        }
    )


def _camera(camera: Camera) -> HouseCamera:
    model = camera.model.lower()
    names = [name for name, _ in dict(_photocore.camera_models())[model][1]]
    values = dict(zip(names, camera.parameters, strict=True))
    with at_place(camera.place):
        return HouseCamera(model, values, name=str(camera.number), unit="px")


def _check_model(model: Model, cameras: Container[Hashable]) -> None:
    """Reject invalid names, cameras and numbers."""
    known: set[str | int] = set()
    for image in model.images:
        place = image.place
        if not image.name.strip() or not image.name.isprintable():
            raise place.error(phrase("format.name", what="image", name=image.name))
        if image.camera not in cameras:
            raise place.error(phrase("format.undefined", what="camera", name=str(image.camera)))
        for key in (image.name, image.number):
            if key in known:
                raise place.error(phrase("format.repeated", what="image", name=str(key)))
            known.add(key)
        if not all(map(math.isfinite, image.pose[4:])):
            raise place.error(phrase("format.finite", name="the translation"))
    finite = np.isfinite(model.features["xy"]).all(axis=1)
    if not finite.all():
        row = int(np.searchsorted(np.cumsum(model.counts), np.argmin(finite), side="right"))
        raise model.images[row].place.error(phrase("format.finite", name="a feature"))
    finite, numbers = np.isfinite(model.points["xyz"]).all(axis=1), model.points["number"]
    if not finite.all():
        raise model.point_places[int(np.argmin(finite))].error(phrase("format.finite", name="the position"))
    _, first = np.unique(numbers, return_index=True)
    if len(first) < len(numbers):
        row = int(np.setdiff1d(np.arange(len(numbers)), first)[0])
        raise model.point_places[row].error(phrase("format.repeated", what="point", name=str(numbers[row])))


def _rotations(quaternions: Floats, places: Sequence[Place]) -> tuple[Floats, Indices]:
    """Return (n, 3, 3) matrices of quaternions, and rows without unit length."""
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.linalg.norm(quaternions, axis=1)
        differences = np.abs(lengths - 1)
    bad = ~(differences <= MAX_DIFFERENCE)
    if bad.any():
        row = int(np.argmax(bad))
        raise places[row].error(phrase("format.length", length=float(lengths[row])))
    matrices = Attitudes.of("quaternion", quaternions).matrices.copy()
    return matrices, np.flatnonzero(differences > NORMALISED)


def _rigid(poses: Sequence[Sequence[float]], places: Sequence[Place]) -> list[tuple[Floats, Floats]]:
    """Return rotations and translations of poses."""
    table = np.array(poses, dtype=float).reshape(-1, 7)
    finite = np.isfinite(table[:, 4:]).all(axis=1)
    if not finite.all():
        raise places[int(np.argmin(finite))].error(phrase("format.finite", name="the translation"))
    return list(zip(_rotations(table[:, :4], places)[0], table[:, 4:], strict=True))


def _composed(
    model: Model, rotations: Floats, translations: Floats, messages: list[Message]
) -> list[FrameOf]:
    """Compose poses of frames and rigs to poses of images."""
    if not model.frames:
        return []
    cameras = {camera.number: str(camera.number) for camera in model.cameras}
    numbers = {rig.number for rig in model.rigs}
    sensors, rigs = _mounted_sensors(model, cameras)
    rows = {each.number: row for row, each in enumerate(model.images)}
    frames, seen, unknown = [], set(), 0
    poses = _rigid([each.pose for each in model.frames], [each.place for each in model.frames])
    for frame, (turn, shift) in zip(model.frames, poses, strict=True):
        place = frame.place
        if frame.rig not in numbers:
            raise place.error(phrase("format.undefined", what="rig", name=str(frame.rig)))
        photos: dict[str, int] = {}
        for sensor, image in ((own.number, own.image) for own in frame.data if own.kind == CAMERA):
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
    model: Model, cameras: Mapping[int, str]
) -> tuple[dict[tuple[int, int], tuple[Floats, Floats] | None], dict[int, Rig]]:
    """Return poses of cameras on rigs (None: unknown), and rigs by frame camera."""
    poses: dict[tuple[int, int], tuple[Floats, Floats] | None] = {}
    rigs: dict[int, Rig] = {}
    for rig in model.rigs:
        sensors: dict[str, Sensor] = {}
        for number, pose in ((own.number, own.pose) for own in rig.sensors if own.kind == CAMERA):
            if number not in cameras:
                raise rig.place.error(phrase("format.undefined", what="camera", name=str(number)))
            rigid = poses[rig.number, number] = _rigid([pose], [rig.place])[0] if pose else None
            if rigid is not None:
                name = f"rig {rig.number}, camera {number}"
                sensors[cameras[number]] = Sensor.from_colmap(name, *rigid)
        for reference in (own.number for own in rig.reference if own.kind == CAMERA):
            poses[rig.number, reference] = np.eye(3), np.zeros(3)
            rigs[rig.number] = Rig(str(rig.number), cameras.get(reference, ""), sensors)
    return poses, rigs


def _observed(model: Model, messages: list[Message]) -> tuple[Indices, Indices]:
    """Return rows of features that are images of points, and the rows of the points."""
    named, own = model.features["point"].copy(), model.points["number"].astype(np.int64)
    features = np.flatnonzero(named != NO_POINT)
    order = np.argsort(own, kind="stable")
    numbers, wanted = own[order], named[features]
    at = np.searchsorted(numbers, wanted)
    known = np.append(numbers, NO_POINT)[at] == wanted
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
