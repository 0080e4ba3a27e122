"""Moving photos: on trajectories, with their own motion, or line scanners."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.builder import Rig
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.photos import Photos
from photogram.formats.plain.rigs import Rigs, sensor_of
from photogram.formats.plain.schema import RATE, TABLES, VELOCITY, deviation_columns
from photogram.formats.plain.tables import (
    Tables,
    columns_of,
    columns_of_records,
    made,
    named_of,
)
from photogram.formats.plain.trajectories import increasing, rows_of
from photogram.formats.plain.unknowns import read_unknowns, unknown_columns
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.geometry import Cartesian, Spheroid
from photogram.network.motion import about
from photogram.network.moving_photos import Lines, Timed
from photogram.network.trajectories import Trajectory
from photogram.words import phrase

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
    if _COLUMNS.isdisjoint(table.columns) and not any((lines, *cameras.shutters, *cameras.lines)):
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
        zip(photos.names, photos.cameras, photos.times.tolist(), strict=True)
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
            "shutter": cameras.shutters[camera],
            "line_sensor": cameras.lines[camera],
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
        for code in (code for code, wrong in contradictions.items() if wrong):
            raise table.error(row, phrase(code))
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
    """Return the line times by photo name."""
    table = tables.rows("line_times")
    groups = rows_of(tables, "line_times")
    values = table.given(("line", "time", "seconds_per_line"))
    increasing(table, groups, "line")
    return {name: made(table, int(rows[0]), Lines, values[rows]) for (name,), rows in groups.items()}


def placed(photos: Photos, timed: Sequence[Timed], spheroid: Spheroid | None) -> Photos:
    """Return photos with missing poses completed from their trajectories."""
    centres, matrices = photos.centres.copy(), photos.matrices.copy()
    axes = Cartesian(spheroid)
    places = {name: row for row, name in enumerate(photos.names)}
    for each in timed:
        row = places[each.photo]
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
    """Return the table of line times."""
    own = [each for each in block.timed if each.lines is not None]
    if not own:
        return {}
    tables = [np.asarray(each.lines.table) for each in own if each.lines is not None]
    rows = np.vstack(tables)
    names = [each.photo for each, table in zip(own, tables, strict=True) for _ in table]
    return {"photo": names, **columns_of(("line", "time", "seconds_per_line"), rows)}
