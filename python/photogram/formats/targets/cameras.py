"""Cameras of projects, and nothing else of them, as other programs take these."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.project import Project
from photogram.formats.targets.calibrations import MIDDLE, shifted, tied_photos
from photogram.messages import counted, listed
from photogram.network.unknowns import Sensor
from photogram.targets.output.rig import Rig
from photogram.targets.vision import sensor_pose


def rig_of_project(project: Project) -> Rig:
    """Return the cameras of a project whose images are pixels, and where those on frames are to camera 0."""
    block = project.block
    if not block.cameras:
        raise InputError("has principal distances, and no cameras", file=project.path)
    return Rig(
        cameras=tuple(
            shifted(each, -MIDDLE).replace(name=name)
            for each, name in zip(block.cameras, block.camera_names, strict=True)
        ),
        sizes=tuple(project.sizes),
        sensors=_sensors(project),
    )


def _sensors(project: Project) -> Floats:
    """Return (K, 4, 4) camera 0 -> camera k; NaN where they are not one sensor on one frame."""
    block = project.block
    found = np.full((len(block.cameras), 4, 4), np.nan)
    found[0] = np.eye(4)
    own: dict[int, Sensor] = {}
    torn = set[int]()
    cameras = dict(zip(block.photo_ids, np.asarray(block.photo_cameras).tolist(), strict=True))
    for photo, frame, sensor in tied_photos(block):
        camera = cameras[photo]
        if cameras[frame] != 0 or own.setdefault(camera, sensor) is not sensor:
            torn.add(camera)
    for camera in own.keys() - torn - {0}:
        found[camera] = sensor_pose(own[camera].position, own[camera].attitude)
    return found


def lost_beside_cameras(project: Project) -> list[str]:
    """Return what of a project is not in files of its cameras, in sentences."""
    block = project.block
    apart = [
        each.title
        for each, known in zip(block.cameras, np.isfinite(_sensors(project)), strict=True)
        if not known.all()
    ]
    found = [
        counted(len(block.photo_ids), "photo"),
        counted(len(block.point_ids), "point"),
        counted(len(block.image_xy), "image"),
        "standard deviations and errors, which `photogram calibrate --to` writes of a board",
    ]
    if apart:
        found.append(f"where these cameras are to the first, if anything says it: {listed(apart)}")
    return found
