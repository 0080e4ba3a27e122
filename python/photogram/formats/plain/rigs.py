"""The tables of rigs and frames."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from photogram.formats.plain.rows import made
from photogram.formats.plain.schema import AXES, ROTATIONS
from photogram.formats.plain.tables import Tables, indices_of
from photogram.formats.rigging import FrameOf, Rig
from photogram.messages import quoted
from photogram.network.unknowns import Sensor

__all__ = ["read_frames", "read_rigs"]

ZERO = 1e-6
"""What the pose of the first sensor of a rig may differ from zero by."""


def read_rigs(tables: Tables, cameras: Sequence[str]) -> Mapping[str, Rig]:
    """Read rigs: the first sensor of each is the frame; sensors are called by their cameras, or otherwise.

    Raises
    ------
    InputError
        Cameras that are not there, sensors that are there twice, a first sensor with a pose.
    """
    table = tables.read("rigs")
    if table is None:
        return {}
    values, matrices = tables.vectors(table, AXES), tables.turns(table)
    lengths = np.stack([table.numbers(f"sd_{axis}", math.inf, infinite=True) for axis in AXES], axis=1)
    angles = np.stack(
        [table.numbers(f"sd_{name}", math.inf, infinite=True, read=tables.angle) for name in ROTATIONS],
        axis=1,
    )
    found: dict[str, tuple[str, dict[str, Sensor]]] = {}
    for row, (rig, camera, own) in enumerate(
        zip(*(table.texts(column) for column in ("rig", "camera", "sensor")), strict=True)
    ):
        if camera and camera not in cameras:
            raise table.error(row, f"column camera: there is no camera {quoted(camera)}")
        name = own or camera
        if not name:
            raise table.error(row, "there is neither a camera nor a sensor")
        matrix = np.eye(3) if np.isnan(matrices[row]).any() else matrices[row]
        value, sd = np.nan_to_num(values[row]), np.concatenate([lengths[row], angles[row]])
        if rig not in found:
            if value.any() or np.abs(matrix - np.eye(3)).max() > ZERO:
                raise table.error(
                    row, f"the first camera of the rig {rig} is its reference: its pose is zero"
                )
            found[rig] = name, {}
            continue
        reference, sensors = found[rig]
        if name == reference or name in sensors:
            raise table.error(row, f"the rig {rig} has the {'sensor' if own else 'camera'} {name} twice")
        title = own or f"{rig}/{camera}"
        # A sensor of which nothing is said starts where the poses of its photos have it.
        nothing = np.isnan(matrices[row]).any() and np.isnan(values[row]).all() and np.isinf(sd).all()
        sensors[name] = made(
            table, row, partial(Sensor, title) if nothing else partial(Sensor, title, value, matrix, sd)
        )
    return {name: Rig(name, reference, sensors) for name, (reference, sensors) in found.items()}


def read_frames(
    tables: Tables, rigs: Mapping[str, Rig], photos: Sequence[str], cameras: Sequence[str]
) -> list[FrameOf]:
    """Read which photos were taken together.

    Parameters
    ----------
    tables, rigs
        The tables, and the rigs by name.
    photos, cameras
        Names of photos, and of the camera of each.

    Raises
    ------
    InputError
        Rigs, photos and sensors that are not there, two photos of a sensor on one frame.
    """
    table = tables.read("frames")
    if table is None:
        return []
    rows = indices_of(table, "photo", {name: row for row, name in enumerate(photos)}, "photo").tolist()
    found: dict[str, tuple[Rig, dict[str, int]]] = {}
    for row, (photo, frame, name, own) in enumerate(
        zip(rows, *(table.texts(column) for column in ("frame", "rig", "sensor")), strict=True)
    ):
        if name not in rigs:
            raise table.error(row, f"column rig: there is no rig {quoted(name)}")
        rig, sensor = rigs[name], own or cameras[photo]
        if sensor != rig.reference and sensor not in rig.sensors:
            what = "sensor" if own else "camera"
            raise table.error(row, f"the rig {rig.name} has no {what} {sensor}, which took the photo")
        _, members = found.setdefault(frame, (rig, {}))
        if found[frame][0] is not rig or sensor in members:
            what = "sensor" if own else "camera"
            raise table.error(row, f"the frame {frame} has two rigs, or two photos of the {what} {sensor}")
        members[sensor] = photo
    return [FrameOf(name, rig, members) for name, (rig, members) in found.items()]
