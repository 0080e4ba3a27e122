"""Photos on rigs and in motion: tables of rigs, frames and bases, of motions and line times."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.builder import FrameOf, Rig
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.photos import Photos
from photogram.formats.plain.schema import ENDS, RATE, TABLES, VELOCITY, deviation_columns
from photogram.formats.plain.tables import Tables, columns_of, columns_of_records, indices_of, made, named_of
from photogram.formats.plain.trajectories import increasing, rows_of
from photogram.formats.plain.unknowns import read_unknowns, read_values, unknown_columns, value_columns
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.geometry import Cartesian, Spheroid
from photogram.network.motion import about
from photogram.network.moving_photos import Lines, Timed
from photogram.network.observations import Base, Observation
from photogram.network.trajectories import Clock, Trajectory
from photogram.network.unknowns import Sensor
from photogram.words import phrase

FRAME = "frame itself"  # Name of the first sensor of a rig if sensors have explicit names
_BASE = ("rig", *ENDS, "distance", "sd")
_SENSOR = TABLES["rigs"].unknown("sensor")
_REFERENCE = Sensor(FRAME, np.zeros(3), np.eye(3), 0.0)
ZERO = 1e-6  # Largest difference of the first sensor's pose from zero


def read_rigs(tables: Tables) -> Mapping[str, Rig]:
    """Read rigs; the first sensor of each defines the frame."""
    table, records = tables.rows("rigs"), tables.records("rigs")
    values, matrices = (read_values(tables, table, column) for column in _SENSOR.values)
    deviations = np.column_stack([tables.sd(table, name, math.inf) for name in _SENSOR.sd])
    titles = [cells.get("sensor", f"{cells['rig']}/{cells.get('camera', '')}") for cells in records]
    clocks = read_unknowns(tables, table, TABLES["rigs"].unknown("clock"), titles)
    found: dict[str, Rig] = {}
    for row, cells in enumerate(records):
        name = cells.get("sensor", cells.get("camera"))
        if not name:
            raise table.error(row, phrase("plain.no-sensor"))
        unknown = np.isnan(matrices[row]).any()
        matrix = np.eye(3) if unknown else matrices[row]
        value, sd = np.nan_to_num(values[row]), deviations[row]
        if (rig := found.get(cells["rig"])) is None:
            if value.any() or np.abs(matrix - np.eye(3)).max() > ZERO:
                raise table.error(row, phrase("plain.reference-pose", rig=cells["rig"]))
            found[cells["rig"]] = rig = Rig(cells["rig"], name, {}, {})
        elif name == rig.reference or name in rig.sensors:
            raise table.error(row, phrase("plain.sensor-twice", rig=rig.name, name=name))
        else:
            # The initial pose of an unspecified sensor is computed from its photos.
            nothing = unknown and np.isnan(values[row]).all() and np.isinf(sd).all()
            fields = () if nothing else (value, matrix, sd)
            rig.sensors[name] = made(table, row, Sensor, titles[row], *fields)
        if (clock := clocks[row]) is not None:
            rig.clocks[name] = clock
    return found


def read_frames(tables: Tables, rigs: Mapping[str, Rig], photos: Photos) -> list[FrameOf]:
    """Read which photos were taken simultaneously."""
    table = tables.rows("frames")
    rows = indices_of(table, "photo", photos.rows, "photo").tolist()
    found: dict[str, tuple[Rig, dict[str, int]]] = {}
    for row, (photo, cells) in enumerate(zip(rows, tables.records("frames"), strict=True)):
        frame, rig = cells["frame"], rigs[cells["rig"]]
        sensor = sensor_of(table, row, rig, cells.get("sensor", photos.taken[photo]))
        first, members = found.setdefault(frame, (rig, {}))
        if first is not rig or sensor in members:
            raise table.error(row, phrase("plain.frame-twice", frame=frame, sensor=sensor))
        if sensor in rig.clocks:
            raise table.error(row, phrase("plain.frame-offset", rig=rig.name, sensor=sensor))
        members[sensor] = photo
    return [FrameOf(name, rig, members) for name, (rig, members) in found.items()]


def sensor_of(table: ColumnTable, row: int, rig: Rig, sensor: str, column: str = "") -> str:
    """Return a sensor, or the camera of a photo, that is on a rig."""
    if sensor != rig.reference and sensor not in rig.sensors:
        message = phrase("plain.no-sensor-of-rig", rig=rig.name, sensor=sensor)
        raise table.error(row, phrase("error.column", column=column, message=message) if column else message)
    return sensor


def times_of(tables: Tables, name: str) -> dict[str, float]:
    table = tables.rows(name)
    pairs = zip(table.texts("photo"), table.numbers("time").tolist(), strict=True)
    return {photo: time for photo, time in pairs if not math.isnan(time)}


def read_bases(tables: Tables, rigs: Mapping[str, Rig]) -> list[Observation]:
    """Read distances between sensors of rigs."""
    table, found = tables.rows("bases"), list[Observation]()
    sd = tables.deviations(table, "bases", ["sd"])
    table.check_given(sd, ["sd"])
    for row, cells in enumerate(tables.records("bases")):
        rig = rigs[cells["rig"]]
        ends = [sensor_of(table, row, rig, cells[column], column) for column in ENDS]
        # The reference is the frame; a distance between two cameras is undirected.
        first, second = sorted(ends, key=lambda end: end != rig.reference)
        if first == second:
            raise table.error(row, phrase("plain.same-ends", name=first))
        sensors = rig.sensors.get(first), rig.sensors[second]
        found.append(made(table, row, Base, *sensors, cells["distance"], float(sd[row, 0])))
    return found


class Rigs:
    """Rigs of a block; sensors have camera names if these are unique."""

    def __init__(self, block: Block, cameras: Sequence[str], times: Mapping[str, float]) -> None:
        self._times, self._mounts = times, block.mounts
        flown = [each.sensor for each in block.timed if each.sensor is not None]
        # Clocks of sensors, if all of their photos share one
        clocks: dict[str, set[Clock | None]] = {each.sensor.name: {None} for each in block.mounts}
        for timed in block.timed:
            if timed.sensor is not None:
                clocks.setdefault(timed.sensor.name, set()).add(timed.offset)
        self._clocks = {name: own.pop() for name, own in clocks.items() if len(own) == 1}
        of = dict(zip(block.photo_ids, cameras, strict=True))
        pairs = {(each.sensor.name, of[each.frame], of[each.photo]) for each in block.mounts}
        # On trajectories no photo represents a frame, so the rig is unknown.
        views = {(frame, photo) for _, frame, photo in pairs}
        single = len({sensor for sensor, *_ in pairs}) == len(views) == len(pairs)
        self._by_camera = not flown and single and all(frame != photo for frame, photo in views)
        self._references: dict[str, str] = {}
        self._places: dict[str, tuple[str, str]] = {}  # Rig and name of sensors
        for each in block.mounts:
            rig, name = (of[each.frame], of[each.photo]) if self._by_camera else ("rig", each.sensor.name)
            self._references[rig] = of[each.frame] if self._by_camera else FRAME
            self._places.setdefault(each.sensor.name, (rig, name))
        for sensor in flown:
            self._references["rig"] = FRAME
            self._places.setdefault(sensor.name, ("rig", sensor.name))
        self._sensors = {each.name: each for each in [*(each.sensor for each in block.mounts), *flown]}
        bases = [each for each in block.observations if isinstance(each, Base)]
        self._bases = [
            (*row, float(each.length), float(each.sd)) for each in bases if (row := self._row(each))
        ]
        self.lost = len(bases) - len(self._bases)

    def place(self, sensor: Sensor) -> tuple[str, str] | None:
        """Return rig and name of a sensor; None for a sensor without photos."""
        return self._places.get(sensor.name)

    def clock(self, sensor: Sensor | None) -> Clock | None:
        """Return the clock of a sensor, if all of its photos have it."""
        return None if sensor is None else self._clocks.get(sensor.name)

    def title(self, sensor: Sensor) -> str:
        """Return the name of a sensor in the tables."""
        place = self.place(sensor)
        return "/".join(place) if place is not None and self._by_camera else sensor.name

    def _row(self, base: Base) -> tuple[str, str, str] | None:
        """Return rig and two sensors of a base; None if the tables cannot contain it."""
        second = self.place(base.second)
        if second is None:
            return None
        rig, name = second
        first = (rig, self._references[rig]) if base.first is None else self.place(base.first)
        return None if first is None or first[0] != rig else (rig, first[1], name)

    def tables(self, block: Block) -> dict[str, dict[str, Any]]:
        if not self._places:
            return {}
        rows: list[tuple[str, str, Sensor | None]] = []
        for rig, reference in self._references.items():
            rows.append((rig, reference, None))
            rows += [
                (rig, own[1], self._sensors[name]) for name, own in self._places.items() if own[0] == rig
            ]
        frames: dict[tuple[str, str], dict[str, Any]] = {}
        for each in self._mounts:
            rig, name = self._places[each.sensor.name]
            for photo, own in ((each.frame, self._references[rig]), (each.photo, name)):
                cells: dict[str, Any] = {"frame": each.frame, "rig": rig, "photo": photo}
                cells |= {"sensor": "" if self._by_camera else own, "time": self._times.get(photo)}
                frames.setdefault((each.frame, photo), cells)
        order = {frame: row for row, frame in enumerate(dict.fromkeys(frame for frame, _ in frames))}
        clocks = [self.clock(sensor) for *_, sensor in rows]
        return {
            "rigs": {
                "rig": [rig for rig, *_ in rows],
                "camera" if self._by_camera else "sensor": [name for _, name, _ in rows],
                **value_columns(block, _SENSOR, [sensor or _REFERENCE for *_, sensor in rows]),
                **unknown_columns(block, TABLES["rigs"].unknown("clock"), clocks, [""] * len(rows)),
            },
            "frames": columns_of_records(
                frames[key] for key in sorted(frames, key=lambda key: order[key[0]])
            ),
            "bases": columns_of_records(dict(zip(_BASE, base, strict=True)) for base in self._bases),
        }


_MOTION = (*VELOCITY, *RATE)
_SD = deviation_columns(_MOTION)
_FIELDS = ("velocity", "rotation_rate", "sd_velocity", "sd_rate")
"""Fields of these columns in moving photos."""
_OF_UNKNOWNS = (name for each in TABLES["photos"].unknowns for own in each.columns for name in own.names)
_COLUMNS = frozenset(("trajectory", "rig", "sensor", *_MOTION, *_SD, *_OF_UNKNOWNS))


def read_timed(
    tables: Tables,
    photos: Photos,
    cameras: Cameras,
    trajectories: Mapping[str, Trajectory],
    rigs: Mapping[str, Rig],
) -> list[Timed]:
    """Read the motion of photos: on trajectories, or of their own."""
    table, lines = photos.table, _line_times(tables)
    if _COLUMNS.isdisjoint(table.columns) and not (
        lines or any(each.shutter or each.line for each in cameras.rows)
    ):
        return []
    on = named_of(table, "trajectory", trajectories, "trajectory")
    on_rigs, as_sensors = named_of(table, "rig", rigs, "rig"), table.texts("sensor")
    motions = _motions(tables, table)
    clocks, rates = (
        read_unknowns(tables, table, TABLES["photos"].unknown(field), table.texts("photo"))
        for field in ("clock", "rate")
    )
    found: list[Timed] = []
    for row, (name, camera, time) in enumerate(
        zip(photos.names, photos.cameras, table.numbers("time").tolist(), strict=True)
    ):
        rig, sensor, clock = on_rigs[row], None, clocks[row]
        if rig is None and as_sensors[row]:
            if len(rigs) != 1:
                raise table.cell_error(row, "rig", "error.empty")
            (rig,) = rigs.values()
        if rig is not None:
            own = sensor_of(table, row, rig, as_sensors[row] or photos.taken[row])
            sensor, clock = rig.sensors.get(own), clock or rig.clocks.get(own)
        said = {
            "trajectory": on[row],
            "offset": clock,
            "rate": rates[row],
            "sensor": sensor,
            **motions[row],
            "shutter": cameras.rows[camera].shutter,
            "line_sensor": cameras.rows[camera].line,
            "lines": lines.get(name),
        }
        given: dict[str, Any] = {field: value for field, value in said.items() if value is not None}
        if not given:
            continue
        if not math.isnan(time):
            given["time"] = time
        flown, scanned = "trajectory" in given, "lines" in given
        sd = photos.attitude_sd[row]
        contradictions = {
            "plain.motion-columns": flown and "velocity" in given,
            "plain.line-times-of-frame": scanned and "line_sensor" not in given,
            "plain.no-line-times": not scanned and "line_sensor" in given,
            "plain.line-scanner-time": scanned and not flown and "time" not in given,
            "plain.line-rate": "rate" in given and not scanned,
            "plain.moving-attitude": not flown and np.isfinite(sd).any() and sd.any(),
        }
        if codes := [code for code, is_wrong in contradictions.items() if is_wrong]:
            raise table.error(row, phrase(codes[0]))
        found.append(made(table, row, Timed, name, **given))
    return found


def _motions(tables: Tables, table: ColumnTable) -> list[dict[str, Floats]]:
    """Return arguments of :class:`Timed` for velocity and rate of each row."""
    values = table.vectors(_MOTION) * np.concatenate([np.ones(3), np.diag(tables.flip)])
    sd = table.vectors(_SD, infinite=True)
    silent = np.isnan(values).all(axis=1) & np.isnan(sd).all(axis=1)
    values, sd = np.nan_to_num(values), np.where(np.isnan(sd), np.inf, sd)
    rows = np.hstack([values, sd]).reshape(-1, 4, 3)
    return [
        {} if none else dict(zip(_FIELDS, own, strict=True)) for none, own in zip(silent, rows, strict=True)
    ]


def _line_times(tables: Tables) -> dict[str, Lines]:
    table = tables.rows("line_times")
    groups = rows_of(tables, "line_times")
    values = table.given(("line", "time", "seconds_per_line"))
    increasing(table, groups, "line")
    return {name: made(table, int(rows[0]), Lines, values[rows]) for (name,), rows in groups.items()}


def placed(photos: Photos, timed: Sequence[Timed], spheroid: Spheroid | None) -> Photos:
    """Return photos with missing poses completed from their trajectories."""
    centres, matrices = photos.centres.copy(), photos.matrices.copy()
    axes = Cartesian(spheroid)
    for each in timed:
        row = photos.rows[each.photo]
        if each.trajectory is None or np.isfinite([*centres[row], *matrices[row].ravel()]).all():
            continue
        begin = 0.0 if each.lines is None else float(np.asarray(each.lines.table)[0, 1])
        centre, matrix = about(each.trajectory, begin if each.time is None else each.time)
        at = axes.from_cartesian(centre[np.newaxis])
        centres[row], matrices[row] = at[0], axes.to_local(matrix[np.newaxis], at)[0]
    return replace(photos, centres=centres, matrices=matrices)


def moving_columns(block: Block, rigs: Rigs) -> dict[str, Any]:
    """Return the motion columns of photos; empty without moving photos."""
    if not block.timed:
        return {}
    timed = {each.photo: each for each in block.timed}
    rows, clocks, rates = list[dict[str, Any]](), list[Any](), list[Any]()
    for photo in block.photo_ids:
        each = timed.get(photo)
        rows.append({})
        clocks.append(None if each is None or rigs.clock(each.sensor) else each.offset)
        rates.append(None if each is None else each.rate)
        if each is None:
            continue
        rows[-1] |= {"trajectory": "" if each.trajectory is None else each.trajectory.name}
        if each.sensor is not None:
            rows[-1] |= zip(("rig", "sensor"), rigs.place(each.sensor) or ("", ""), strict=True)
        rows[-1] |= {"time": each.time}
        if each.trajectory is None:
            motion = np.concatenate([getattr(each, field) for field in _FIELDS])
            rows[-1] |= columns_of((*_MOTION, *_SD), motion)
    found = columns_of_records(rows)
    for field, unknowns in (("clock", clocks), ("rate", rates)):
        own = unknown_columns(block, TABLES["photos"].unknown(field), unknowns, block.photo_ids)
        found |= {
            name: column for name, column in own.items() if any(each not in (None, "") for each in column)
        }
    return found


def line_times_table(block: Block) -> dict[str, Any]:
    return columns_of_records(
        {"photo": each.photo} | columns_of(("line", "time", "seconds_per_line"), row)
        for each in block.timed
        if each.lines is not None
        for row in np.asarray(each.lines.table)
    )
