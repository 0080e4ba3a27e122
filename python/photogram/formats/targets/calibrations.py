"""Calibrations with targets as projects whose control is the board, and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.format import Wishes
from photogram.formats.plain.boards import ASSUMED
from photogram.formats.project import Project
from photogram.formats.targets import TITLE
from photogram.messages import listed
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.passages import Figure
from photogram.targets.board import Board
from photogram.targets.calibrated import Calibrated
from photogram.targets.calibration import Calibration
from photogram.targets.corners import Corners
from photogram.targets.reading import read
from photogram.targets.start import Start
from photogram.targets.vision import sensor_pose, vision_poses

__all__ = ["MIDDLE", "adjusted_project", "calibration_of", "project_of", "read_project", "shifted"]

MIDDLE = 0.5
"""Of the first pixel, from the upper-left corner: projects count from there."""
NEAR = 1e-6
"""Of the spacing: what control may be off the points of a board."""


def read_project(path: Path, wishes: Wishes) -> Project:
    """Read corners, with first values: what is adjusted is the block of their calibration."""
    sd = wishes.sd.get("images")
    origin = wishes.pixel_origin or "center"
    found = read(path, sd0=None if sd is None else sd[0], pixel_origin=origin)
    return project_of(found, path)


def project_of(calibration: Start, path: Path | None = None) -> Project:
    """Return a calibration as a project, whose pixels count from the upper-left corner of the first."""
    block, lacks = from_corner(calibration.block()), []
    if calibration.sd0 is None:
        lacks.append("no standard deviations of corners: 1 px is assumed (--sd images=...)")
    return Project(
        block=block,
        path=path or Path("corners"),
        title=TITLE,
        sizes=tuple(calibration.corners.sizes),
        pixel_mm=(None,) * len(calibration.cameras),
        starts=np.asarray(block.point_positions),
        lacks=tuple(lacks),
        messages=tuple(calibration.messages),
        boards={"board": calibration.board.replace(shape=calibration.shape)},
        details={ASSUMED: calibration.sd0 is None},
    )


def calibration_of(project: Project) -> Calibration:
    """Return the calibration that a project with a board is.

    Raises
    ------
    InputError
        A project without a board, points that are not those of the board, cameras that are not in pixels,
        photos on trajectories.
    """
    block = project.block
    if not project.boards:
        raise InputError("has no board: a table of boards says what its control is", file=project.path)
    if block.image_unit != "px" or block.photo_cameras is None or block.timed:
        raise InputError("a calibration has images in pixels, and no trajectories", file=project.path)
    if (block.image_sd[:, 0] != block.image_sd[:, 1]).any():
        raise InputError("corners of a calibration are as good in x as in y", file=project.path)
    (board,) = project.boards.values()
    number = _numbers_of(project, board)
    assumed = bool(project.details.get(ASSUMED))
    sd0 = 1.0 if assumed else float(block.image_sd.min())
    references, sensors, stands = _tied(block)
    corners, seen = _corners(project, number, stands, sd0)
    attitudes = Attitudes.of("omega_phi_kappa", block.photo_attitudes[seen])
    rig = len(np.unique(references)) < len(references)
    return Calibration(
        board=_with_places(board, block, number),
        corners=corners,
        cameras=[shifted(each, -MIDDLE) for each in block.cameras],
        poses=vision_poses(block.photo_positions[seen], attitudes),
        sensors=sensors,
        references=references,
        sd0=None if assumed else sd0,
        sync="known" if rig or len(references) == 1 else "none",
        bend=_bend(block),
        messages=project.messages,
    )


def _bend(block: Block) -> tuple[float, float]:
    """Return the deflections that the board begins with."""
    found = [each.bend.position for each in block.passages if isinstance(each, Figure)]
    return (float(found[0][0]), float(found[0][1])) if found else (0.0, 0.0)


def _corners(project: Project, number: Indices, stands: Indices, sd0: float) -> tuple[Corners, Indices]:
    """Return the corners of a project, and (V,) the photo of each view.

    Parameters
    ----------
    project
        The project.
    number
        (n,) the number of the board's point of each point.
    stands
        (P,) the photo whose pose is that of the view of each photo.
    sd0
        The standard deviation of a corner of level 0.
    """
    block = project.block
    assert block.photo_cameras is not None
    pictures = np.unique(block.image_photos)
    place = np.full(len(block.photo_ids), -1)
    place[pictures] = np.arange(len(pictures))
    seen, views = np.unique(stands[pictures], return_inverse=True)
    corners = Corners(
        pictures=[block.photo_ids[row] for row in pictures.tolist()],
        cameras=block.photo_cameras[pictures],
        views=views.reshape(-1),
        camera_names=block.camera_names,
        sizes=project.sizes,
        picture=place[block.image_photos],
        point=number[block.image_points],
        xy=block.image_xy - MIDDLE,
        sd=block.image_sd[:, 0] / sd0,
    )
    return corners, seen


def _tied(block: Block) -> tuple[Indices, Floats, Indices]:
    """Return (K,) the references of cameras, (K, 4, 4) sensors, and (P,) the photo that stands for each."""
    assert block.photo_cameras is not None
    places = {name: row for row, name in enumerate(block.photo_ids)}
    count = len(block.cameras)
    references, sensors = np.arange(count), np.tile(np.eye(4), (count, 1, 1))
    views = np.arange(len(block.photo_ids))
    for each in block.mounts:
        photo, frame = places[each.photo], places[each.frame]
        camera, reference = int(block.photo_cameras[photo]), int(block.photo_cameras[frame])
        views[photo], references[camera] = frame, reference
        sensors[camera] = sensor_pose(each.sensor.position, each.sensor.attitude)
    return references, sensors, views


def _numbers_of(project: Project, board: Board) -> Indices:
    """Return (n,) the number of the board's point of each point of the block."""
    names = project.block.point_ids if board.kind == "points" else board.names
    known = {name: k for k, name in enumerate(names)}
    strange = [name for name in project.block.point_ids if name not in known]
    if strange:
        raise InputError(f"the points {listed(strange)} are none of the board", file=project.path)
    return np.array([known[name] for name in project.block.point_ids], dtype=np.int64)


def _with_places(board: Board, block: Block, number: Indices) -> Board:
    """Return a board with the places and standard deviations that the control of a block has."""
    if board.kind == "points":
        return board.replace(points=block.point_positions, point_names=block.point_ids)
    far = np.abs(board.places[number] - block.point_positions)
    if not far.max(initial=0.0) < NEAR * min(board.pitch):
        row = int(np.argmax(far.max(axis=1)))
        raise InputError(f"the point {block.point_ids[row]} lies elsewhere than that of the board")
    if board.shape != "points":
        return board
    sd = np.zeros((len(board.places), 3))
    sd[number] = block.point_sd
    return board.replace(point_sd=sd)


def from_corner(block: Block) -> Block:
    """Return a block whose pixels count from the middle of the first as one that counts from its corner."""
    return block.replace(cameras=[shifted(each) for each in block.cameras], image_xy=block.image_xy + MIDDLE)


def adjusted_project(calibrated: Calibrated) -> Project:
    """Return what was adjusted as a project: free values where the adjustment has ended."""
    own, bend = calibrated.calibration, calibrated.bend
    return project_of(
        own.replace(
            cameras=[each.restarted() for each in calibrated.cameras],
            sensors=calibrated.sensors,
            poses=calibrated.poses,
            bend=own.bend if bend is None else (float(bend.position[0]), float(bend.position[1])),
        )
    )


def shifted(camera: Camera, by: float = MIDDLE) -> Camera:
    """Return a camera whose principal point counts from elsewhere: the corner of the first pixel."""
    if "w" in camera.names or not {"cx", "cy"} <= {*camera.names}:
        return camera  # from the middle of the picture, which is the same place
    centre = {name: camera.parameters[name] + by for name in ("cx", "cy")}
    return camera.replace(parameters={**camera.parameters, **centre})
