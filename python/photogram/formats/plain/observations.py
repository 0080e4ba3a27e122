"""Tables of additional observations, read and written by the declarations of their columns."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from photogram.formats.builder import Rig
from photogram.formats.plain.rigs import read_bases
from photogram.formats.plain.schema import (
    ANGULAR,
    REQUIRED,
    SETTINGS,
    TABLES,
    Column,
    Parameter,
    deviation_columns,
)
from photogram.formats.plain.tables import (
    DEGREE,
    Tables,
    Transform,
    columns_of,
    correlations,
    covariances_of,
    indices_of,
    made,
    made_of_rows,
)
from photogram.formats.plain.trajectories import read_smoothness
from photogram.formats.plain.unknowns import (
    read_observed,
    read_unknowns,
    unknown_class,
    unknown_columns,
    written_values,
)
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import dataclass
from photogram.network import observations
from photogram.network.block import Block
from photogram.network.observations import Observation, Observations, Position
from photogram.network.trajectories import Trajectory
from photogram.network.unknowns import Unknown
from photogram.words import phrase

_POSES = ("gnss", "velocities", "attitudes", "rates")
_OTHERS = tuple(name for name, each in TABLES.items() if each.class_name and name not in _POSES)
_GROUPS = ("gnss_groups", "attitude_groups")
_GROUP_TITLES = dict(zip(_GROUPS, ("GNSS", "IMU"), strict=True))  # Names of unknowns of a group without name
_NO_ARM = np.zeros(3).tobytes()  # The default lever arm
_Columns = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Known:
    points: Mapping[str, int]  # Rows by name
    photos: Mapping[str, int]
    times: Sequence[float]  # Times of photos in seconds; NaN without
    trajectories: Mapping[str, Trajectory]


def read_observations(
    tables: Tables, transform: Transform, known: Known, rigs: Mapping[str, Rig]
) -> list[Observation | Observations[Any]]:
    """Read all tables of additional observations: parts of the observations of a block."""
    shared = {name: dict[str, Any]() for name in _GROUPS}
    for name in _GROUPS:
        table = tables.rows(name)
        names = table.texts("group")
        titles = [group or _GROUP_TITLES[name] for group in names]
        parts = TABLES[name].unknowns
        fields = {part.field: read_unknowns(tables, table, part, titles) for part in parts}
        for row, group in enumerate(names):
            if group in shared[name]:
                raise table.error(row, phrase("error.repeated", kind="group", name=group))
            shared[name][group] = {field: own[row] for field, own in fields.items()}
    found = [one for name in _POSES for one in _read(tables, transform, known, name, shared)]
    found += read_smoothness(tables, known.trajectories)
    for column in (part for name in _OTHERS for part in TABLES[name].all_columns if part.kind == "shared"):
        name = f"{column.components[0]}s"
        if name not in shared:
            table = tables.rows(name)
            (unknown,) = TABLES[name].unknowns
            names = table.names_once(unknown.name)
            own = read_unknowns(tables, table, unknown, names, transform)
            shared[name] = dict(zip(names, own, strict=True))
    found += [one for name in _OTHERS for one in _read(tables, transform, known, name, shared)]
    return [*found, *read_bases(tables, rigs)]


def _read(
    tables: Tables, transform: Transform, known: Known, name: str, shared: Mapping[str, dict[str, Any]]
) -> Iterator[Observation | Observations[Any]]:
    """Yield the observations of a table; `shared` contains unknowns and groups by table and name."""
    table = tables.read(name)
    if table is None:
        return
    make = getattr(observations, TABLES[name].class_name)
    wanted = {"clock", *(field for field, _ in make.UNKNOWNS)}
    of: Sequence[dict[str, Any] | None] = [{}] * table.count
    members: Sequence[Mapping[str, Any]] = of  # type: ignore[assignment]
    fields: dict[str, Any] = {}
    missing: Any = False
    place = ""
    for part in TABLES[name].parts:
        if isinstance(part, Parameter):
            own = read_unknowns(tables, table, part, [name] * table.count)
            members = [{} if each is None else {part.field: each} for each in own]
        elif part.kind == "subject":
            of = _subjects(tables, table, known)
        elif part.kind in ("point", "photo"):
            places = known.points if part.kind == "point" else known.photos
            names = list(places)
            rows = indices_of(table, part.names[0], places, part.kind)
            fields[part.field] = [names[row] for row in rows.tolist()]
        elif part.kind == "shared":
            fields[part.field] = _named(table, part, shared[f"{part.names[0]}s"])
        elif part.kind == "group":
            groups = {
                group: {field: own for field, own in each.items() if own is not None and field in wanted}
                for group, each in shared[part.field].items()
            }
            members = _members(tables, table, part.field, groups)
        elif part.kind.endswith("matrix"):
            fields |= _precision(tables, table, part, missing)
        elif part.field:
            fields[part.field] = values = read_observed(tables, table, part, whole=not make.MISSING)
            missing = np.isnan(values) if make.MISSING else False
            place = part.field if part.kind == "place" else place
    if place:
        positions, covariances = transform.positions(name, fields[place], fields["covariance"], table)
        fields |= {place: positions, "covariance": covariances}
    times = table.numbers("time").tolist() if make is Position else []
    arguments = dict[int, dict[str, Any]]()
    for row, (subject, group, *values) in enumerate(zip(of, members, *fields.values(), strict=True)):
        if subject is None:
            continue
        given = {**subject, **dict(zip(fields, values, strict=True)), **group}
        if "clock" in group and "trajectory" not in subject:
            raise table.error(row, phrase("plain.clock-of-photo"))
        if make is Position and given["photo"] is not None:
            time = times[row]
            if math.isnan(time):
                time = known.times[known.photos[given["photo"]]]
            if math.isnan(time) and given.get("drift") is not None:
                raise table.error(row, phrase("plain.drift-without-time"))
            given["time"] = 0.0 if math.isnan(time) else time
        arguments[row] = given
    yield from made_of_rows(table, make, arguments)


def _subjects(tables: Tables, table: ColumnTable, known: Known) -> list[dict[str, Any] | None]:
    """Return the subject of each row as arguments; None for skipped rows.

    Rows at times outside their trajectory are skipped; a remark contains their number.
    """
    if "trajectory" not in table:
        names, rows = list(known.photos), indices_of(table, "photo", known.photos, "photo").tolist()
        return [{"photo": names[row]} for row in rows]
    times = table.numbers("time").tolist()
    found: list[dict[str, Any] | None] = []
    words = table.texts("photo"), table.texts("trajectory")
    for row, (photo, name, time) in enumerate(zip(*words, times, strict=True)):
        if bool(photo) == bool(name):
            raise table.error(row, phrase("error.exclusive", first="photo", second="trajectory"))
        for word, what, there in ((photo, "photo", known.photos), (name, "trajectory", known.trajectories)):
            if word and word not in there:
                raise table.unknown_error(row, what, what, word, there)
        if photo:
            found.append({"photo": photo})
            continue
        if math.isnan(time):
            raise table.cell_error(row, "time", "error.empty")
        first, last = known.trajectories[name].reach
        own = {"photo": None, "trajectory": known.trajectories[name], "time": time}
        found.append(own if first <= time <= last else None)
    if out := found.count(None):
        tables.remark("plain.outside-trajectory", table.path, n=out)
    return found


def _members(
    tables: Tables, table: ColumnTable, name: str, groups: Mapping[str, Mapping[str, Any]]
) -> list[Mapping[str, Any]]:
    """Return the unknowns of the group of each row; a group of positions may be a name only."""
    names = table.texts("group")
    if name in tables.settings.tables or name == "attitude_groups":
        for row, group in enumerate(names):
            if group and group not in groups:
                raise table.unknown_error(row, "group", "group", group, groups)
    return [groups.get(group, {}) for group in names]


def _named(table: ColumnTable, column: Column, known: dict[str, Any]) -> list[Unknown | None]:
    """Return the unknown of each row; names without a row in their table are added."""
    (name,), found = column.names, list[Unknown | None]()
    if column.default == REQUIRED:
        table.names(name)
    (unknown,) = TABLES[f"{name}s"].unknowns
    for row, title in enumerate(table.texts(name)):
        if title and title not in known:
            known[title] = made(table, row, unknown_class(unknown.class_name), title)
        found.append(known[title] if title else None)
    return found


def _precision(tables: Tables, table: ColumnTable, column: Column, missing: Any) -> dict[str, Any]:
    """Return standard deviations or covariance matrices of all rows as an argument."""
    components = column.components
    names = deviation_columns(components) or ("sd",)
    sd = np.where(missing, 1.0, tables.deviations(table, column.table, names))
    table.check_given(sd, names, column.table if column.default == SETTINGS else "")
    if not components:
        return {"sd": sd[:, 0].tolist()}
    units = [tables.radians if name in ANGULAR else 1.0 for name in components]
    covariances = covariances_of(sd, table, components, units)
    if column.kind == "body matrix":
        signs = np.resize(np.diag(tables.flip), len(components))
        covariances = covariances * signs * signs[:, np.newaxis]
    return {"covariance": covariances}


def observation_tables(block: Block) -> _Columns:
    """Return the tables of additional observations, of their unknowns and of their groups."""
    found: _Columns = {}
    tables = {getattr(observations, TABLES[name].class_name): name for name in (*_POSES, *_OTHERS)}
    observed: dict[str, list[Any]] = {name: [] for name in tables.values()}
    for each in block.observations:
        if type(each) in tables:
            observed[tables[type(each)]].append(each)
    observed = {name: own for name, own in observed.items() if own}
    names: dict[int, str] = {}
    for name in _GROUPS:
        kinds = [kind for kind in _POSES if any(each.field == name for each in TABLES[kind].all_columns)]
        members = [each for kind in kinds for each in observed.get(kind, ())]
        if groups := _named_groups(members, names):
            titles = [group or _GROUP_TITLES[name] for group in groups]
            found[name] = {"group": list(groups)}
            for part in TABLES[name].unknowns:
                values = [group.get(part.field) for group in groups.values()]
                found[name] |= unknown_columns(block, part, values, titles)
    shared: dict[str, list[Unknown | None]] = {}
    for name, own in observed.items():
        found[name] = _written(block, name, own, names)
        for column in TABLES[name].all_columns:
            if column.kind == "shared":
                unknowns = [getattr(each, column.field) for each in own]
                shared.setdefault(f"{column.names[0]}s", []).extend(unknowns)
    for name, unknowns in shared.items():
        if distinct := [*dict.fromkeys(each for each in unknowns if each is not None)]:
            (part,) = TABLES[name].unknowns
            found[name] = unknown_columns(block, part, distinct, [each.name for each in distinct])
    return found


def _named_groups(own: Sequence[Any], groups: dict[int, str]) -> dict[str, dict[str, Any]]:
    """Return the unknowns of groups by group name, and add the group of each observation by its identity.

    Groups of antennas are numbered; others have the names of their boresights.
    """
    found: dict[str, dict[str, Any]] = {}
    names: dict[frozenset[Any], str] = {}
    keys = []
    for each in own:
        group = {field: value for field, _ in each.UNKNOWNS if (value := getattr(each, field)) is not None}
        if each.trajectory is not None and each.clock is not None:
            group["clock"] = each.clock
        for field, value in group.items():
            if not isinstance(value, Unknown):  # Fixed
                group[field] = np.broadcast_to(value, (3, 3) if field == "boresight" else (3,)).astype(float)
        cells = {
            field: value if isinstance(value, Unknown) else value.tobytes() for field, value in group.items()
        }
        keys.append(key := frozenset((field, value) for field, value in cells.items() if value != _NO_ARM))
        if key not in names:
            number, boresight = len(found) + 1, group.get("boresight")
            name = f"IMU {number}" if boresight is None else getattr(boresight, "name", f"known {number}")
            name = f"{name} {number}" if name in found else name
            names[key] = str(number) if "lever_arm" in group else name if key else ""
            if names[key]:
                found[names[key]] = group
    if "lever_arm" in next(iter(found.values()), {}) and not any(keys):
        return {}
    groups |= {id(each): names[key] for each, key in zip(own, keys, strict=True)} if found else {}
    return found


def _written(block: Block, name: str, own: Sequence[Any], groups: Mapping[int, str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for part in TABLES[name].parts:
        if isinstance(part, Parameter):
            clocks = [None if each.trajectory is None else each.clock for each in own]
            found |= unknown_columns(block, part, clocks, [name] * len(own))
        elif part.kind == "subject":
            found |= _subject_columns(own, block)
        elif part.kind == "group":
            found |= {"group": [groups[id(each)] for each in own]} if id(own[0]) in groups else {}
        elif part.kind.endswith("matrix"):
            found |= _deviations(own, part)
        elif part.field:
            values = [getattr(each, part.field) for each in own]
            if part.kind in ("point", "photo"):
                found[part.names[0]] = values
            elif part.kind == "shared":
                named = ["" if each is None else each.name for each in values]
                found |= {part.names[0]: named} if any(named) else {}
            elif part.kind != "body" or part.default != "0" or np.any(values):
                found |= written_values(block, part, np.array(values, dtype=float))
    return found


def _subject_columns(own: Sequence[Any], block: Block) -> dict[str, Any]:
    trajectories, photos = [each.trajectory for each in own], [each.photo for each in own]
    if not any(trajectories):
        # If photos have times, the times of drifts are written in addition.
        dated = block.timed and isinstance(own[0], Position)
        return {"photo": photos} | ({"time": [each.time for each in own]} if dated else {})
    return {
        **({"photo": photos} if any(photos) else {}),
        "trajectory": [None if each is None else each.name for each in trajectories],
        "time": [each.time for each in own],
    }


def _deviations(own: Sequence[Any], column: Column) -> dict[str, Any]:
    if not column.components:
        return {"sd": np.array([each.sd for each in own], dtype=float)}
    covariances = np.array([each.precision for each in own])
    if own[0].MISSING:
        seen = ~np.isnan([each.observed for each in own])
        # Matrix elements of unobserved components are ignored.
        covariances = np.where(seen[:, :, np.newaxis] & seen[:, np.newaxis, :], covariances, np.nan)
    units = [DEGREE if name in ANGULAR else 1.0 for name in column.components]
    sd = np.sqrt(np.einsum("nii->ni", covariances)) * units
    names = deviation_columns(column.components)
    return columns_of(names, sd) | correlations(covariances, column.components, units)
