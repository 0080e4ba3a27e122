"""Photos on frames: mounts for a block, and photos that stand for frames whose first sensor took none."""

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
    reference: str  # The sensor whose axes are the axes of the frame
    sensors: Mapping[str, Sensor]  # Poses of the other sensors
    # Clocks of sensors on trajectories
    clocks: Mapping[str, Clock] = field(default_factory=dict)


@dataclass(frozen=True)
class FrameOf:
    """Photos that were taken together: their indices by the names of sensors."""

    name: str
    rig: Rig
    photos: Mapping[str, int]


@dataclass(frozen=True)
class Stand:
    """A photo without images that stands for a frame; its camera is called so, or that of another photo."""

    name: str
    camera: str
    like: int
    centre: Floats
    matrix: Floats


def mounted(
    frames: Sequence[FrameOf], photos: Sequence[str], centres: Floats, matrices: Floats
) -> tuple[list[Mount], list[Stand]]:
    """Return mounts, and the photos that are missing for them.

    `centres`, `matrices`: (P, 3) and (P, 3, 3) poses A, photo to object; NaN where unknown.
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
            # Of a sensor that is not known the photo's own pose is near enough to begin with.
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
