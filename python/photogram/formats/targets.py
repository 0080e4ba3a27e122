"""Conversion of target calibrations to projects, and back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.format import FORMATS
from photogram.formats.plain.boards import ASSUMED, REGULARISED, TIMES
from photogram.formats.project import Project, Unused
from photogram.formats.read_options import ReadOptions
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.observations import Prior
from photogram.network.passages import Figure, Knot
from photogram.network.unknowns import Sensor
from photogram.targets.board import Board
from photogram.targets.calibration import Calibration
from photogram.targets.calibration_result import Calibrated
from photogram.targets.corners import Corners
from photogram.targets.motion import motion_of
from photogram.targets.output import Rig
from photogram.targets.reading import read
from photogram.targets.vision import sensor_pose, vision_poses
from photogram.words import Phrase, option_sd, phrase

MIDDLE = 0.5  # Centre of the first pixel, from the upper-left corner: projects count from there
NEAR = 1e-6  # Largest distance of control from board points, relative to the spacing


def read_project(path: Path, options: ReadOptions) -> Project:
    """Read corners, with initial values, as the block of their calibration."""
    sd = options.sd.get("images")
    origin = options.pixel_origin or "center"
    found = read(path, sd0=None if sd is None else sd[0], pixel_origin=origin)
    return project_of(found, path)


def project_of(calibration: Calibration, path: Path | None = None) -> Project:
    """Convert a calibration to a project; pixels count from the corner."""
    middle = calibration.block()
    cameras = [shifted(each) for each in middle.cameras]
    block, lacks = middle.replace(cameras=cameras, image_xy=middle.image_xy + MIDDLE), []
    corners, times = calibration.corners, dict[str, float]()
    if corners.times is not None and calibration.sync != "offset":
        times = dict(zip(corners.pictures, corners.times.tolist(), strict=True))
    left, names = np.flatnonzero(~corners.use).tolist(), calibration.board.names
    left_sd = corners.sd[left] * (calibration.sd0 or calibration.assumed)
    if calibration.sd0 is None:
        lacks.append(Phrase("read.corners", {"number": 1.0, "option": option_sd("images")}))
    return Project(
        block=block,
        path=path or Path("corners"),
        title=FORMATS["targets"].title,
        sizes=tuple(corners.sizes),
        lacks=tuple(lacks),
        messages=tuple(calibration.messages),
        boards={"board": calibration.board.replace(shape=calibration.shape)},
        unused=Unused(
            photos=tuple(corners.pictures[row] for row in corners.picture[left].tolist()),
            points=tuple(names[row] for row in corners.point[left].tolist()),
            xy=corners.xy[left] + MIDDLE,
            sd=np.column_stack([left_sd, left_sd]),
        ),
        details={ASSUMED: calibration.sd0 is None, REGULARISED: calibration.regularise, TIMES: times},
    )


def calibration_of(project: Project) -> Calibration:
    """Convert a project with a board and cameras in pixels to a calibration."""
    block = project.block
    if not project.boards:
        raise InputError(phrase("board-project.none"), file=project.path)
    if block.image_unit != "px" or block.photo_cameras is None:
        raise InputError(phrase("format.pixels", unit=block.image_unit), file=project.path)
    if (block.image_sd[:, 0] != block.image_sd[:, 1]).any():
        raise InputError(phrase("board-project.sd"), file=project.path)
    # Priors of knots belong to their cameras.
    others = [
        each.name
        for each in block.observations
        if not (isinstance(each, Prior) and isinstance(each.unknown, Knot))
    ]
    if others:
        raise InputError(phrase("board-project.observations", names=others), file=project.path)
    (board,) = project.boards.values()
    number = _numbers_of(project, board)
    assumed = bool(project.details.get(ASSUMED))
    sd0 = 1.0 if assumed else float(block.image_sd.min())
    references, sensors, sd_sensors, stands = _tied(block)
    corners, seen = _corners(project, number, stands, sd0)
    attitudes = Attitudes.of("omega_phi_kappa", block.photo_attitudes[seen])
    bend, sd_bend = (0.0, 0.0), np.full(2, np.inf)
    if figures := [each.bend for each in block.passages if isinstance(each, Figure)]:
        bend, sd_bend = tuple(figures[0].position[:2].tolist()), figures[0].deviations[:2]
    rig = len(np.unique(references)) < len(references)
    clocks = _in_motion(project, seen) if block.timed else None
    if clocks is not None:
        corners = corners.replace(times=clocks.pop("times")[np.unique(block.image_photos)])
    elif all(name in (times := project.details.get(TIMES, {})) for name in corners.pictures):
        corners = corners.replace(times=[times[name] for name in corners.pictures])
    return Calibration(
        board=_with_places(board, project, number),
        corners=corners,
        cameras=[shifted(each, -MIDDLE) for each in block.cameras],
        poses=vision_poses(block.photo_positions[seen], attitudes),
        sensors=sensors,
        references=references,
        sd0=None if assumed else sd0,
        sync="offset" if block.timed else "known" if rig or len(references) == 1 else "none",
        bend=bend,
        sd_sensors=sd_sensors,
        sd_bend=sd_bend,
        regularise=project.details.get(REGULARISED),
        messages=project.messages,
        **(clocks or {}),
    )


def _in_motion(project: Project, seen: Indices) -> dict[str, Any]:
    """Return (P,) clock times, and the fields of calibrations on motion of the board."""
    block = project.block
    assert block.photo_cameras is not None
    places = {name: row for row, name in enumerate(block.photo_ids)}
    times = np.full(len(places), np.nan)
    offsets, sd = np.zeros(len(block.cameras)), np.full(len(block.cameras), np.inf)
    motions: dict[int, Floats | None] = {}
    for each in block.timed:
        row = places[each.photo]
        motions[row] = None if each.trajectory is None or each.readout else motion_of(each.trajectory)
        times[row] = np.nan if each.time is None else each.time
        if each.offset is not None:
            camera = int(block.photo_cameras[row])
            offsets[camera], sd[camera] = each.offset.value, each.offset.deviations[0]
    motion = [motions.get(row) for row in seen.tolist()]
    if np.isnan(times).any() or any(each is None for each in motion):
        raise InputError(phrase("board-project.motion"), file=project.path)
    return {"times": times, "offsets": offsets, "sd_offsets": sd, "motion": np.array(motion)}


def _corners(project: Project, number: Indices, stands: Indices, sd0: float) -> tuple[Corners, Indices]:
    """Return the corners of a project, and (V,) the photo of each view.

    `number` is (n,) the board point of each point. `stands` is (P,) the photo with the pose of the view of
    each photo. `sd0` is the standard deviation of a corner of level 0.
    """
    block = project.block
    assert block.photo_cameras is not None
    pictures = np.unique(block.image_photos)
    place = np.full(len(block.photo_ids), -1)
    place[pictures] = np.arange(len(pictures))
    seen, views = np.unique(stands[pictures], return_inverse=True)
    names = [block.photo_ids[row] for row in pictures.tolist()]
    left, places = project.unused, {name: row for row, name in enumerate(names)}
    points = dict(zip(block.point_ids, number.tolist(), strict=True))
    if strange := [name for name in left.points if name not in points]:
        raise InputError(phrase("board-project.points", names=strange), file=project.path)
    kept = [row for row, name in enumerate(left.photos) if name in places]
    picture = np.array([places[left.photos[row]] for row in kept], dtype=np.int64)
    point = np.array([points[left.points[row]] for row in kept], dtype=np.int64)
    used = np.arange(len(block.image_xy) + len(kept)) < len(block.image_xy)
    corners = Corners(
        pictures=names,
        cameras=block.photo_cameras[pictures],
        views=views.reshape(-1),
        camera_names=block.camera_names,
        sizes=project.sizes,
        picture=np.append(place[block.image_photos], picture),
        point=np.append(number[block.image_points], point),
        xy=np.vstack([block.image_xy, left.xy[kept]]) - MIDDLE,
        sd=np.append(block.image_sd[:, 0], left.sd[kept, 0]) / sd0,
        use=used,
    )
    return corners, seen


def _tied(block: Block) -> tuple[Indices, Floats, Floats, Indices]:
    """Return (K,) references, (K, 4, 4) sensors, sd, and (P,) view photos."""
    assert block.photo_cameras is not None
    places = {name: row for row, name in enumerate(block.photo_ids)}
    count = len(block.cameras)
    references, sensors = np.arange(count), np.tile(np.eye(4), (count, 1, 1))
    sd = np.full((count, 6), np.inf)
    views = np.arange(len(block.photo_ids))
    for name, stands, sensor in tied_photos(block):
        photo, frame = places[name], places[stands]
        camera, reference = int(block.photo_cameras[photo]), int(block.photo_cameras[frame])
        views[photo], references[camera] = frame, reference
        sensors[camera], sd[camera] = sensor_pose(sensor.position, sensor.attitude), sensor.deviations
    return references, sensors, sd, views


def tied_photos(block: Block) -> list[tuple[str, str, Sensor]]:
    """Return photos on sensors, with the photo of their frame or itself."""
    flown = {id(each.trajectory): each.photo for each in block.timed if each.sensor is None}
    return [(each.photo, each.frame, each.sensor) for each in block.mounts] + [
        (each.photo, flown.get(id(each.trajectory), each.photo), each.sensor)
        for each in block.timed
        if each.sensor is not None
    ]


def _numbers_of(project: Project, board: Board) -> Indices:
    """Return (n,) the board point of each point of the block."""
    ids = project.block.point_ids
    known = {name: k for k, name in enumerate(ids if board.kind == "points" else board.names)}
    if strange := [name for name in ids if name not in known]:
        raise InputError(phrase("board-project.points", names=strange), file=project.path)
    return np.array([known[name] for name in ids], dtype=np.int64)


def _with_places(board: Board, project: Project, number: Indices) -> Board:
    """Return a board with positions and standard deviations of control."""
    block = project.block
    if board.kind == "points":
        return board.replace(points=block.point_positions, point_names=block.point_ids)
    far = np.abs(board.places[number] - block.point_positions)
    if not far.max(initial=0.0) < NEAR * min(board.pitch):
        fields = {"point": block.point_ids[int(np.argmax(far.max(axis=1)))], "difference": float(far.max())}
        raise InputError(phrase("board-project.position", **fields), file=project.path)
    if board.shape != "points":
        return board
    sd = np.zeros((len(board.places), 3))
    sd[number] = block.point_sd
    return board.replace(point_sd=sd)


def adjusted_project(calibrated: Calibrated) -> Project:
    return project_of(calibrated.restarted_calibration())


def shifted(camera: Camera, by: float = MIDDLE) -> Camera:
    """Return a camera whose principal point counts from the first corner."""
    if "w" in camera.names or not {"cx", "cy"} <= {*camera.names}:
        return camera  # From the image centre, which does not change
    centre = {name: camera.parameters[name] + by for name in ("cx", "cy")}
    return camera.replace(parameters={**camera.parameters, **centre})


def rig_of_project(project: Project) -> Rig:
    """Return pixel cameras of a project, and their poses relative to camera 0."""
    block = project.block
    if not block.cameras:
        raise InputError(phrase("board-project.cameras"), file=project.path)
    pairs = zip(block.cameras, block.camera_names, strict=True)
    cameras = tuple(shifted(camera, -MIDDLE).replace(name=name) for camera, name in pairs)
    return Rig(cameras=cameras, sizes=tuple(project.sizes), sensors=_sensors(project))


def _sensors(project: Project) -> Floats:
    """Return (K, 4, 4) camera 0 -> camera k; NaN if not on one frame."""
    block = project.block
    found = np.full((len(block.cameras), 4, 4), np.nan)
    cameras = dict(zip(block.photo_ids, np.asarray(block.photo_cameras).tolist(), strict=True))
    mounts: dict[int, set[tuple[int, int]]] = {}
    for photo, frame, sensor in tied_photos(block):
        mounts.setdefault(cameras[photo], set()).add((cameras[frame], id(sensor)))
        found[cameras[photo]] = sensor_pose(sensor.position, sensor.attitude)
    # A camera on several sensors, or on the frame of another camera, has no pose.
    torn = [camera for camera, own in mounts.items() if len(own) > 1 or next(iter(own))[0] != 0]
    found[torn] = np.nan
    found[0] = np.eye(4)
    return found


def lost_beside_cameras(project: Project) -> list[Phrase]:
    block, known = project.block, [np.isfinite(sensor).all() for sensor in _sensors(project)]
    lost = {"photos": len(block.photo_ids), "points": len(block.point_ids), "images": len(block.image_xy)}
    found = [phrase(f"lost.all-{name}", n=count) for name, count in lost.items()]
    found.append(phrase("lost.calibration"))
    cameras = [camera.title for camera, fixed in zip(block.cameras, known, strict=True) if not fixed]
    return found + ([phrase("lost.sensors", names=cameras)] if cameras else [])


def camera_file(name: str, project: Project) -> Mapping[str, bytes]:
    from photogram.targets.camera_formats import CAMERA_FORMATS

    return CAMERA_FORMATS[name](rig_of_project(project))
