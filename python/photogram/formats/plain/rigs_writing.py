"""The tables of rigs, frames and bases."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.schema import AXES, POSE
from photogram.network.attitudes import Attitudes, Representation
from photogram.network.block import Block
from photogram.network.observations import Base
from photogram.network.rigs import Mount
from photogram.network.unknowns import Sensor

__all__ = ["Rigs", "angles_of"]

_ANGLES = ("omega", "phi", "kappa")
FRAME = "frame itself"
"""What the first sensor of a rig is called where sensors have names of their own."""


def angles_of(matrices: Floats, block: Block) -> Floats:
    """Return (n, 3) omega, phi, kappa in degrees of attitudes, axes of a photo as columns."""
    kind: Representation = "omega_phi_kappa_photo_to_ground" if block.photo_to_ground else "omega_phi_kappa"
    found: Floats = np.degrees(Attitudes(matrices).values(kind))
    return found


class Rigs:
    """The rigs of a block, whose sensors are called by the cameras of their photos where these tell them.

    Parameters
    ----------
    block
        The block.
    cameras
        The name of each photo's camera.

    Attributes
    ----------
    lost
        Bases of sensors that took no photo: no frame says what they are on.
    """

    def __init__(self, block: Block, cameras: Sequence[str]) -> None:
        self._cameras = dict(zip(block.photo_ids, cameras, strict=True))
        self._mounts = block.mounts
        self._by_camera = self._told_by_cameras()
        self._sensors: dict[str, dict[str, Sensor]] = {}
        self._references: dict[str, str] = {}
        for each in block.mounts:
            rig = self._rig(each.frame)
            self._references[rig] = self._cameras[each.frame] if self._by_camera else FRAME
            self._sensors.setdefault(rig, {})[self._name(each)] = each.sensor
        bases = [each for each in block.observations if isinstance(each, Base)]
        self._bases = [(each, row) for each in bases if (row := self._row(each)) is not None]
        self.lost = len(bases) - len(self._bases)

    def _told_by_cameras(self) -> bool:
        """Return whether a camera and that of the frame say which sensor took a photo, and a sensor these."""
        of_pair: dict[tuple[str, str], Sensor] = {}
        pairs: dict[int, tuple[str, str]] = {}
        for each in self._mounts:
            pair = self._cameras[each.frame], self._cameras[each.photo]
            same = of_pair.setdefault(pair, each.sensor) is each.sensor
            if not same or pairs.setdefault(id(each.sensor), pair) != pair or pair[0] == pair[1]:
                return False
        return True

    def _rig(self, frame: str) -> str:
        return self._cameras[frame] if self._by_camera else "rig"

    def _name(self, mount: Mount) -> str:
        return self._cameras[mount.photo] if self._by_camera else mount.sensor.name

    def place(self, sensor: Sensor) -> tuple[str, str] | None:
        """Return rig and name of a sensor; None of one that took no photo."""
        return next(
            (
                (rig, name)
                for rig, sensors in self._sensors.items()
                for name, each in sensors.items()
                if each is sensor
            ),
            None,
        )

    def title(self, sensor: Sensor) -> str:
        """Return what reading the tables calls a sensor."""
        place = self.place(sensor)
        return "/".join(place) if place is not None and self._by_camera else sensor.name

    def _row(self, base: Base) -> tuple[str, str, str] | None:
        """Return rig and two sensors of a base."""
        second = self.place(base.second)
        if second is None:
            return None
        rig, name = second
        if base.first is None:
            return rig, self._references[rig], name
        first = self.place(base.first)
        return None if first is None or first[0] != rig else (rig, first[1], name)

    def tables(self, block: Block) -> dict[str, dict[str, Any]]:
        """Return the tables of rigs, frames and bases; none where there are no rigs."""
        if not self._mounts:
            return {}
        rows: list[tuple[str, str, Sensor | None]] = []
        for rig, sensors in self._sensors.items():
            rows += [(rig, self._references[rig], None), *((rig, *each) for each in sensors.items())]
        frames = []
        for frame in dict.fromkeys(each.frame for each in self._mounts):
            rig = self._rig(frame)
            frames.append((frame, rig, frame, self._references[rig]))
            frames += [
                (frame, rig, each.photo, self._name(each)) for each in self._mounts if each.frame == frame
            ]
        what = "camera" if self._by_camera else "sensor"
        columns = ("frame", "rig", "photo") if self._by_camera else ("frame", "rig", "photo", "sensor")
        found = {
            "rigs": {
                "rig": [row[0] for row in rows],
                what: [row[1] for row in rows],
                **_poses([row[2] for row in rows], block),
            },
            "frames": {name: [row[k] for row in frames] for k, name in enumerate(columns)},
        }
        if self._bases:
            names = ("rig", "from", "to")
            found["bases"] = {
                **{name: [row[k] for _, row in self._bases] for k, name in enumerate(names)},
                "distance": np.array([each.length for each, _ in self._bases], dtype=float),
                "sd": np.array([each.sd for each, _ in self._bases], dtype=float),
            }
        return found


def _poses(sensors: Sequence[Sensor | None], block: Block) -> dict[str, Any]:
    """Return poses of sensors: zero of the reference, none of those of which nothing is said."""
    values = np.array([np.zeros(3) if each is None else each.position for each in sensors])
    matrices = np.array([np.eye(3) if each is None else each.attitude for each in sensors])
    angles = angles_of(matrices, block)
    unsaid = [each is not None and each.is_open for each in sensors]
    values[unsaid] = angles[unsaid] = np.nan
    sd = np.array([np.zeros(6) if each is None else each.deviations for each in sensors])
    sd[:, 3:] = np.degrees(sd[:, 3:])
    return {
        **dict(zip(AXES, values.T, strict=True)),
        **dict(zip(_ANGLES, angles.T, strict=True)),
        **dict(zip((f"sd_{name}" for name in POSE), sd.T, strict=True)),
    }
