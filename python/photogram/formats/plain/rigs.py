"""The tables of rigs, frames and bases."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.builder import FrameOf, Rig
from photogram.formats.plain.schema import TABLES
from photogram.formats.plain.tables import Tables, columns_of_records, indices_of, made
from photogram.formats.plain.unknowns import read_unknowns, read_values, unknown_columns, value_columns
from photogram.io.column_table import ColumnTable
from photogram.network.block import Block
from photogram.network.observations import Base, Observation
from photogram.network.rigs import Mount
from photogram.network.trajectories import Clock
from photogram.network.unknowns import Sensor
from photogram.words import phrase

FRAME = "frame itself"  # Name of the first sensor of a rig if sensors have explicit names
_BASE = ("rig", "from", "to", "distance", "sd")
_SENSOR = TABLES["rigs"].unknown("sensor")
_REFERENCE = Sensor(FRAME, np.zeros(3), np.eye(3), 0.0)
ZERO = 1e-6  # Largest difference of the first sensor's pose from zero


def read_rigs(tables: Tables, cameras: Sequence[str]) -> Mapping[str, Rig]:
    """Read rigs; the first sensor of each defines the frame."""
    table = tables.rows("rigs")
    values, matrices = (read_values(tables, table, column) for column in _SENSOR.values)
    deviations = np.column_stack([tables.sd(table, name, math.inf) for name in _SENSOR.sd])
    found: dict[str, tuple[str, dict[str, Sensor]]] = {}
    clocked: dict[str, dict[str, Clock]] = {}
    rows = list(zip(*(table.texts(column) for column in ("rig", "camera", "sensor")), strict=True))
    titles = [own or f"{rig}/{camera}" for rig, camera, own in rows]
    dated = read_unknowns(tables, table, TABLES["rigs"].unknown("clock"), titles)
    for row, (rig, camera, own) in enumerate(rows):
        if camera and camera not in cameras:
            raise table.unknown_error(row, "camera", "camera", camera, cameras)
        name = own or camera
        if not name:
            raise table.error(row, phrase("plain.no-sensor"))
        if (clock := dated[row]) is not None:
            clocked.setdefault(rig, {})[name] = clock
        matrix = np.eye(3) if np.isnan(matrices[row]).any() else matrices[row]
        value, sd = np.nan_to_num(values[row]), deviations[row]
        if rig not in found:
            if value.any() or np.abs(matrix - np.eye(3)).max() > ZERO:
                raise table.error(row, phrase("plain.reference-pose", rig=rig))
            found[rig] = name, {}
            continue
        reference, sensors = found[rig]
        if name == reference or name in sensors:
            raise table.error(row, phrase("plain.sensor-twice", rig=rig, name=name))
        # The initial pose of an unspecified sensor is computed from its photos.
        nothing = np.isnan(matrices[row]).any() and np.isnan(values[row]).all() and np.isinf(sd).all()
        values_of_sensor = () if nothing else (value, matrix, sd)
        sensors[name] = made(table, row, Sensor, titles[row], *values_of_sensor)
    return {
        name: Rig(name, reference, sensors, clocked.get(name, {}))
        for name, (reference, sensors) in found.items()
    }


def read_frames(
    tables: Tables, rigs: Mapping[str, Rig], photos: Sequence[str], cameras: Sequence[str]
) -> list[FrameOf]:
    """Read which photos were taken simultaneously."""
    table = tables.rows("frames")
    rows = indices_of(table, "photo", {name: row for row, name in enumerate(photos)}, "photo").tolist()
    found: dict[str, tuple[Rig, dict[str, int]]] = {}
    for row, (photo, frame, name, own) in enumerate(
        zip(rows, *(table.texts(column) for column in ("frame", "rig", "sensor")), strict=True)
    ):
        if name not in rigs:
            raise table.unknown_error(row, "rig", "rig", name, rigs)
        rig = rigs[name]
        sensor = sensor_of(table, row, rig, own, cameras[photo])
        _, members = found.setdefault(frame, (rig, {}))
        if found[frame][0] is not rig or sensor in members:
            raise table.error(row, phrase("plain.frame-twice", frame=frame, sensor=sensor))
        if sensor in rig.clocks:
            raise table.error(row, phrase("plain.frame-offset", rig=rig.name, sensor=sensor))
        members[sensor] = photo
    return [FrameOf(name, rig, members) for name, (rig, members) in found.items()]


def sensor_of(table: ColumnTable, row: int, rig: Rig, own: str, camera: str) -> str:
    """Return the sensor of a photo in a rig: explicit, else its camera."""
    sensor = own or camera
    if sensor != rig.reference and sensor not in rig.sensors:
        raise table.error(row, phrase("plain.no-sensor-of-rig", rig=rig.name, sensor=sensor))
    return sensor


def times_of_frames(tables: Tables) -> dict[str, float]:
    """Return the given times of photos on frames."""
    table = tables.rows("frames")
    return times_said(table.texts("photo"), table.numbers("time"))


def times_said(photos: Sequence[str], times: Floats) -> dict[str, float]:
    """Return the given times of photos."""
    pairs = zip(photos, times.tolist(), strict=True)
    return {photo: time for photo, time in pairs if not math.isnan(time)}


def read_bases(tables: Tables, rigs: Mapping[str, Rig]) -> list[Observation]:
    """Read distances between sensors of rigs."""
    table = tables.rows("bases")
    lengths = table.numbers("distance")
    sd = tables.deviations(table, "bases", ["sd"])[:, 0]
    table.check_given(np.column_stack([lengths, sd]), ("distance", "sd"))
    found: list[Observation] = []
    for row, (name, *ends) in enumerate(
        zip(*(table.texts(column) for column in ("rig", "from", "to")), strict=True)
    ):
        if name not in rigs:
            raise table.unknown_error(row, "rig", "rig", name, rigs)
        rig = rigs[name]
        for column, end in zip(("from", "to"), ends, strict=True):
            if end != rig.reference and end not in rig.sensors:
                raise table.cell_error(row, column, "plain.no-sensor-of-rig", rig=name, sensor=end)
        # The reference is the frame; a distance between two cameras is undirected.
        first, second = sorted(ends, key=lambda end: end != rig.reference)
        if first == second:
            raise table.error(row, phrase("plain.same-ends", name=first))
        sensors = rig.sensors.get(first), rig.sensors[second]
        found.append(made(table, row, Base, *sensors, float(lengths[row]), float(sd[row])))
    return found


class Rigs:
    """Rigs of a block; sensors have camera names if these are unique."""

    def __init__(self, block: Block, cameras: Sequence[str], times: Mapping[str, float]) -> None:
        self._times = times
        self._cameras = dict(zip(block.photo_ids, cameras, strict=True))
        self._mounts = block.mounts
        self._flown = [each.sensor for each in block.timed if each.sensor is not None]
        self._clocks = _clocks(block)
        self._by_camera = self._told_by_cameras()
        self._sensors: dict[str, dict[str, Sensor]] = {}
        self._references: dict[str, str] = {}
        for each in block.mounts:
            rig = self._rig(each.frame)
            self._references[rig] = self._cameras[each.frame] if self._by_camera else FRAME
            self._sensors.setdefault(rig, {})[self._name(each)] = each.sensor
        for sensor in self._flown:
            self._references["rig"] = FRAME
            self._sensors.setdefault("rig", {})[sensor.name] = sensor
        bases = [each for each in block.observations if isinstance(each, Base)]
        self._bases = [(each, row) for each in bases if (row := self._row(each)) is not None]
        self.lost = len(bases) - len(self._bases)

    def _told_by_cameras(self) -> bool:
        """Return whether cameras of frame and photo identify a sensor.

        On trajectories no photo represents a frame, so the rig is unknown.
        """
        if self._flown:
            return False
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
        """Return rig and name of a sensor; None for a sensor without photos."""
        return next(
            (
                (rig, name)
                for rig, sensors in self._sensors.items()
                for name, each in sensors.items()
                if each is sensor
            ),
            None,
        )

    def clock(self, sensor: Sensor | None) -> Clock | None:
        """Return the clock of a sensor, if all of its photos have it."""
        return self._clocks.get(id(sensor))

    def title(self, sensor: Sensor) -> str:
        """Return the name of a sensor in the tables."""
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
        """Return the tables of rigs, frames and bases."""
        if not self._sensors:
            return {}
        rows: list[tuple[str, str, Sensor | None]] = []
        for rig, sensors in self._sensors.items():
            rows += [(rig, self._references[rig], None), *((rig, *each) for each in sensors.items())]
        frames: dict[str, list[dict[str, Any]]] = {}
        for each in self._mounts:
            rig = self._rig(each.frame)
            for photo, name in ((each.frame, self._references[rig]), (each.photo, self._name(each))):
                if photo == each.frame and photo in frames:
                    continue
                cells: dict[str, Any] = {"frame": each.frame, "rig": rig, "photo": photo}
                cells |= {"sensor": "" if self._by_camera else name, "time": self._times.get(photo)}
                frames.setdefault(each.frame, []).append(cells)
        clocks = [self.clock(sensor) for *_, sensor in rows]
        bases = [(*row, float(each.length), float(each.sd)) for each, row in self._bases]
        return {
            "rigs": {
                "rig": [rig for rig, *_ in rows],
                "camera" if self._by_camera else "sensor": [name for _, name, _ in rows],
                **value_columns(block, _SENSOR, [sensor or _REFERENCE for *_, sensor in rows]),
                **unknown_columns(block, TABLES["rigs"].unknown("clock"), clocks, [""] * len(rows)),
            },
            "frames": columns_of_records(cells for own in frames.values() for cells in own),
            "bases": columns_of_records(dict(zip(_BASE, base, strict=True)) for base in bases),
        }


def _clocks(block: Block) -> dict[int, Clock]:
    """Return clocks of sensors, if all of their photos share one."""
    found: dict[int, Clock | None] = {id(each.sensor): None for each in block.mounts}
    for each in block.timed:
        if each.sensor is not None and found.setdefault(id(each.sensor), each.offset) is not each.offset:
            found[id(each.sensor)] = None
    return {key: clock for key, clock in found.items() if clock is not None}
