"""Mounts of photos on frames, and substitutes for missing frame photos."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.rigs import Mount
from photogram.network.trajectories import Clock
from photogram.network.unknowns import Sensor


@dataclass(frozen=True)
class Rig:
    """Sensors on one frame."""

    name: str
    reference: str  # Sensor whose axes are the axes of the frame
    sensors: Mapping[str, Sensor]  # Poses of the other sensors
    # Clocks of sensors on trajectories
    clocks: Mapping[str, Clock] = field(default_factory=dict)


@dataclass(frozen=True)
class FrameOf:
    """Photos taken simultaneously: their indices by sensor name."""

    name: str
    rig: Rig
    photos: Mapping[str, int]


@dataclass(frozen=True)
class Stand:
    """A photo without images that represents a frame."""

    name: str
    camera: str
    like: int
    centre: Floats
    matrix: Floats


def mounted(
    frames: Sequence[FrameOf], photos: Sequence[str], centres: Floats, matrices: Floats
) -> tuple[list[Mount], list[Stand]]:
    """Return mounts, and the missing photos of frames.

    `centres`, `matrices`: (P, 3) and (P, 3, 3) poses A, photo to object; NaN if unknown.
    """
    mounts: list[Mount] = []
    stands: list[Stand] = []
    taken = set(photos)
    for frame in frames:
        first = frame.photos.get(frame.rig.reference)
        if first is not None:
            name = photos[first]
        else:
            camera, row = next(iter(frame.photos.items()))
            sensor = frame.rig.sensors[camera]
            # For an unknown sensor the photo's own pose is a sufficient initial value.
            turn = np.eye(3) if sensor.matrix is None else np.asarray(sensor.matrix)
            matrix = matrices[row] @ turn.T
            name = f"frame {frame.name}"
            while name in taken:
                name += "'"
            taken.add(name)
            centre = centres[row] - matrix @ sensor.position
            stands.append(Stand(name, frame.rig.reference, row, centre, matrix))
        mounts += [
            Mount(photos[row], name, frame.rig.sensors[camera])
            for camera, row in frame.photos.items()
            if camera != frame.rig.reference
        ]
    return mounts, stands
