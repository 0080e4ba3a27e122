"""From a COLMAP model to a project."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.colmap.binary import read_binary
from photogram.formats.colmap.content import CAMERA, NO_POINT, Camera, Images, Model, Pose
from photogram.formats.colmap.text import read_text
from photogram.formats.format import Wishes
from photogram.formats.names import NAMES, Colours, renamed
from photogram.formats.project import Project, Size, assembled
from photogram.formats.rigging import FrameOf, Rig, mounted
from photogram.formats.rotations import Y_DOWN
from photogram.io.places import Place, at_place
from photogram.messages import Message, listed
from photogram.network.cameras import Camera as HouseCamera
from photogram.network.unknowns import Sensor
from photogram.words import Phrase

TITLE = "COLMAP model"
LONGEST, SHORT = 1e-2, 1e-6
"""What the length of a quaternion may differ from 1 by, and what is not worth a remark."""


def place_of(path: Path) -> Path | None:
    """Return the folder of a model: a path itself, or `sparse/0` or `sparse` in it."""
    for folder in (path, path / "sparse" / "0", path / "sparse"):
        if any(
            (folder / f"cameras{end}").is_file() and (folder / f"images{end}").is_file()
            for end in (".bin", ".txt")
        ):
            return folder
    return None


def read(path: Path, wishes: Wishes) -> Project:
    """Read a model; binary files where there are both, as the package does."""
    del wishes
    folder = place_of(path)
    if folder is None:
        raise InputError("holds no COLMAP model: cameras and images, .bin or .txt", file=path)
    binary = (folder / "cameras.bin").is_file()
    model = read_binary(folder) if binary else read_text(folder)
    return renamed(_project(model, path), folder / NAMES)


def _project(model: Model, path: Path) -> Project:
    messages: list[Message] = []
    cameras = [_camera(each) for each in model.cameras]
    sizes: list[Size | None] = [(each.width, each.height) for each in model.cameras]
    places = {each.number: row for row, each in enumerate(model.cameras)}
    images = model.images
    _check_images(model, places)
    rotations = _rotations(images.quaternions, images, messages)
    translations = images.translations.copy()
    frames = _composed(model, rotations, translations, messages)
    matrices = (Y_DOWN @ rotations).transpose(0, 2, 1)
    centres = -np.einsum("nji,nj->ni", rotations, translations)
    mounts, stands = mounted(frames, images.names, centres, matrices)
    of_names = {each.name: row for row, each in enumerate(cameras)}
    rows, points = _observed(model, messages)
    point_ids = list(map(str, model.points.numbers.tolist()))
    return assembled(
        path=path,
        title=TITLE,
        cameras=cameras,
        sizes=sizes,
        photo_ids=[*images.names, *(each.name for each in stands)],
        photo_cameras=[
            *(places[number] for number in images.cameras.tolist()),
            *(of_names[each.camera] for each in stands),
        ],
        centres=np.vstack([centres, *(each.centre[np.newaxis] for each in stands)]),
        matrices=np.concatenate([matrices, *(each.matrix[np.newaxis] for each in stands)]),
        point_ids=point_ids,
        starts=model.points.positions,
        image_photos=np.repeat(np.arange(len(images.names)), images.counts)[rows],
        image_points=points,
        image_xy=images.xy[rows],
        mounts=mounts,
        lacks=[Phrase("read.placeless", {"option": Phrase("option.control")})] if len(rows) else [],
        messages=messages,
        details={
            "image numbers": dict(zip(images.names, images.numbers.tolist(), strict=True)),
            "colours": Colours(point_ids, model.points.colours),
        },
    )


def _camera(camera: Camera) -> HouseCamera:
    model = camera.model.lower()
    names = [name for name, _ in dict(_photocore.camera_models())[model][1]]
    values = dict(zip(names, camera.parameters, strict=True))
    with at_place(camera.place):
        return HouseCamera(model, values, name=str(camera.number), unit="px")


def _check_images(model: Model, places: dict[int, int]) -> None:
    images = model.images
    seen: dict[int, int] = {}
    names: dict[str, int] = {}
    for row, (number, camera, name) in enumerate(
        zip(images.numbers.tolist(), images.cameras.tolist(), images.names, strict=True)
    ):
        place = images.places[row]
        if not name.strip() or not name.isprintable():
            raise place.error(f"image {number} has no name that prints: {name[:40]!r}")
        if camera not in places:
            raise place.error(f"image {number} has the camera {camera}, which is not there")
        if seen.setdefault(number, row) != row or names.setdefault(name, row) != row:
            raise place.error(f"the image {number}, {name}, is there twice")
    if not np.isfinite(images.xy).all():
        feature = int(np.flatnonzero(~np.isfinite(images.xy).all(axis=1))[0])
        row = int(np.searchsorted(np.cumsum(images.counts), feature, side="right"))
        raise images.places[row].error(f"image {images.numbers[row]} has a feature that is no finite number")
    points = model.points
    for values, stand, what in (
        (images.translations, images.places, "translation"),
        (points.positions, points.places, "position"),
    ):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            raise stand[int(bad[0])].error(f"the {what} is no finite number")
    order = np.argsort(points.numbers, kind="stable")
    again = np.flatnonzero(np.diff(points.numbers[order]) == 0)
    if again.size:
        row = int(order[again[0] + 1])
        raise points.places[row].error(f"point {points.numbers[row]} is there twice")


def _rotations(quaternions: Floats, images: Images, messages: list[Message]) -> Floats:
    """Return (n, 3, 3) world to camera."""
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.linalg.norm(quaternions, axis=1)
        bad = np.flatnonzero(~(np.abs(lengths - 1) <= LONGEST))
    if len(bad):
        row = int(bad[0])
        raise images.places[row].error(
            f"the quaternion of {images.names[row]} has the length {lengths[row]:.6g}, not 1"
        )
    off = np.flatnonzero(np.abs(lengths - 1) > SHORT)
    if len(off):
        messages.append(
            Message(
                f"{len(off)} quaternions have not the length 1, by up to {np.abs(lengths - 1).max():.2g},"
                f" and were normalised: {listed([images.names[row] for row in off[:20]], 3)}"
            )
        )
    return _matrices(quaternions / lengths[:, np.newaxis])


def _matrices(quaternions: Floats) -> Floats:
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    found: Floats = np.array(rows).transpose(2, 0, 1)
    return found


def _rigid(pose: Pose, place: Place) -> tuple[Floats, Floats]:
    quaternion = np.array([pose.quaternion])
    with np.errstate(over="ignore", invalid="ignore"):
        length = float(np.linalg.norm(quaternion))
    if not abs(length - 1) <= LONGEST:
        raise place.error(f"a quaternion has the length {length:.6g}, not 1")
    translation = np.array(pose.translation)
    if not np.isfinite(translation).all():
        raise place.error("a translation is no finite number")
    return _matrices(quaternion / length)[0], translation


def _composed(
    model: Model, rotations: Floats, translations: Floats, messages: list[Message]
) -> list[FrameOf]:
    """Put the poses of frames and rigs into those of images; return frames whose images hang together."""
    if not model.frames:
        return []
    cameras = {each.number: str(each.number) for each in model.cameras}
    rigs = {each.number for each in model.rigs}
    sensors, house = _mounted_sensors(model, cameras)
    rows = {number: row for row, number in enumerate(model.images.numbers.tolist())}
    found, seen, unknown = [], set(), 0
    for frame in model.frames:
        if frame.rig not in rigs:
            raise frame.place.error(f"frame {frame.number} has the rig {frame.rig}, which is not there")
        turn, shift = _rigid(frame.pose, frame.place)
        photos: dict[str, int] = {}
        for kind, sensor, image in frame.data:
            if kind != CAMERA:
                continue
            if image not in rows:
                raise frame.place.error(f"frame {frame.number} has the image {image}, which is not there")
            row = rows[image]
            if (frame.rig, sensor) not in sensors or model.images.cameras[row] != sensor:
                raise frame.place.error(
                    f"frame {frame.number}: the image {image} is not of the camera {sensor} of its rig"
                )
            if row in seen:
                raise frame.place.error(f"the image {image} is in two frames")
            seen.add(row)
            own_pose = sensors[frame.rig, sensor]
            if own_pose is None:
                rotations[row], translations[row] = np.nan, np.nan
                unknown += 1
                continue
            rotations[row], translations[row] = own_pose[0] @ turn, own_pose[0] @ shift + own_pose[1]
            if cameras[sensor] in photos:
                raise frame.place.error(f"frame {frame.number} has two images of the camera {sensor}")
            photos[cameras[sensor]] = row
        of_frame = house.get(frame.rig)
        if of_frame is not None and any(camera != of_frame.reference for camera in photos):
            found.append(FrameOf(str(frame.number), of_frame, photos))
    if unknown:
        text = f"{unknown} images are of sensors whose pose on the rig is not known: they are oriented first"
        messages.append(Message(text))
    if alone := len(rows) - len(seen):
        text = f"{alone} images are in no frame: their poses are those of the table of images"
        messages.append(Message(text))
    return found


def _mounted_sensors(
    model: Model, cameras: Mapping[int, str]
) -> tuple[dict[tuple[int, int], tuple[Floats, Floats] | None], dict[int, Rig]]:
    """Return the poses of cameras on rigs, None where not known, and the rigs whose frame is a camera."""
    sensors: dict[tuple[int, int], tuple[Floats, Floats] | None] = {}
    house: dict[int, Rig] = {}
    for rig in model.rigs:
        own: dict[str, Sensor] = {}
        for kind, number, pose in rig.sensors:
            if kind != CAMERA:
                continue
            if number not in cameras:
                raise rig.place.error(f"rig {rig.number} has the camera {number}, which is not there")
            found = sensors[rig.number, number] = None if pose is None else _rigid(pose, rig.place)
            if found is not None:
                own[cameras[number]] = Sensor.from_colmap(f"rig {rig.number}, camera {number}", *found)
        if rig.reference is not None and rig.reference[0] == CAMERA:
            sensors[rig.number, rig.reference[1]] = np.eye(3), np.zeros(3)
            house[rig.number] = Rig(str(rig.number), cameras.get(rig.reference[1], ""), own)
    return sensors, house


def _observed(model: Model, messages: list[Message]) -> tuple[Indices, Indices]:
    """Return rows of features that are images of points, and the rows of these."""
    images, points = model.images, model.points
    with_point = np.flatnonzero(images.points != NO_POINT)
    order = np.argsort(points.numbers, kind="stable")
    known = points.numbers[order]
    wanted = images.points[with_point]
    at = np.searchsorted(known, wanted) if len(known) else np.zeros(len(wanted), dtype=np.int64)
    there = np.zeros(len(wanted), dtype=bool)
    inside = at < len(known)
    there[inside] = known[at[inside]] == wanted[inside]
    without = len(images.points) - len(with_point)
    if without:
        messages.append(Message(f"{without} features have no point and are left out"))
    if not there.all():
        lost = np.unique(wanted[~there])
        messages.append(
            Message(
                f"{np.count_nonzero(~there)} features are of {len(lost)} points that points3D does not have,"
                f" and are left out: {listed([str(each) for each in lost[:20].tolist()], 3)}"
            )
        )
    rows = order[at[there]]
    apart = int(np.count_nonzero(np.bincount(rows, minlength=len(points.numbers)) != points.tracks))
    if apart:
        messages.append(Message(f"the tracks of {apart} points are not those of the images, which count"))
    return with_point[there], rows
