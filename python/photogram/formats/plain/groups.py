"""The tables of groups: shared parameters of pose observations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.formats.plain.schema import AXES, OPK, SD_ROTATIONS, deviation_columns
from photogram.formats.plain.subjects import scalar_columns, scalars
from photogram.formats.plain.tables import Tables, angles_of, called, columns_of, word_of
from photogram.io.column_table import ColumnTable
from photogram.io.numbers import degrees_typed
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.observations import Attitude, Position, Rate, Velocity
from photogram.network.trajectories import Clock, GyroBias
from photogram.network.unknowns import Boresight, Drift, LeverArm, Shift, Unknown
from photogram.words import phrase

SHARED: Mapping[type, tuple[str, ...]] = {
    Position: ("lever_arm", "shift", "drift"),
    Velocity: ("lever_arm",),
    Attitude: ("boresight",),
    Rate: ("boresight", "bias"),
}
"""Fields of a group that its observations share, besides the clock."""


@dataclass(frozen=True)
class _Member:
    """A shared parameter of a group."""

    field: str  # Field of groups and observations
    made: type[Unknown]  # Its class
    column: str  # Column of its name
    values: tuple[str, ...]  # Columns of its values
    sd: tuple[str, ...]  # Columns of its standard deviations
    empty: str = ""  # Meaning of an empty name


def _of_axes(name: str, made: type[Unknown], column: str) -> _Member:
    columns = tuple(f"{column}_{axis}" for axis in AXES)
    return _Member(name, made, column, columns, deviation_columns(columns))


_MEMBERS: Mapping[str, tuple[_Member, ...]] = {
    "gnss_groups": (
        _of_axes("lever_arm", LeverArm, "lever"),
        _of_axes("shift", Shift, "shift"),
        _of_axes("drift", Drift, "drift"),
    ),
    "attitude_groups": (
        _Member("boresight", Boresight, "boresight", OPK, SD_ROTATIONS, "true"),
        _of_axes("bias", GyroBias, "bias"),
    ),
}
"""Parameters of the groups of each table."""


@dataclass(frozen=True)
class Group:
    """Parameters of a group; a fixed lever arm or boresight is an array."""

    lever_arm: LeverArm | tuple[float, ...] = (0.0, 0.0, 0.0)
    shift: Shift | None = None
    drift: Drift | None = None
    boresight: Boresight | ArrayLike | None = None
    bias: GyroBias | None = None
    clock: Clock | None = None

    @property
    def key(self) -> tuple[object, ...]:
        """The key of equal groups."""
        known = self.boresight is None or isinstance(self.boresight, Boresight)
        boresight = self.boresight if known else np.asarray(self.boresight).tobytes()
        return self.lever_arm, self.shift, self.drift, boresight, self.bias, self.clock


def group_of(observation: Any) -> Group:
    """Return the group of an observation."""
    members = {name: getattr(observation, name) for name in SHARED[type(observation)]}
    if not isinstance(lever := members.get("lever_arm"), LeverArm | None):
        members["lever_arm"] = tuple(np.broadcast_to(np.asarray(lever, dtype=float), 3).tolist())
    return Group(**members, clock=None if observation.moment is None else observation.clock)


def grouped(tables: Tables, table: ColumnTable, groups: Mapping[str, Group], name: str) -> list[Group]:
    """Return the group of each row, possibly a name only."""
    names = table.texts("group")
    if name in tables.settings.tables or name == "attitude_groups":
        for row, text in enumerate(names):
            if text and text not in groups:
                raise table.unknown_error(row, "group", "group", text, groups)
    alone = Group()
    return [groups.get(text, alone) for text in names]


def read_groups(tables: Tables, name: str) -> dict[str, Group]:
    """Read the table `gnss_groups` or `attitude_groups`, by group name."""
    table = tables.rows(name)
    antenna = name == "gnss_groups"
    names = table.texts("group")
    titles = [text or ("GNSS" if antenna else "IMU") for text in names]
    clocks = scalars(tables, table, Clock, titles)
    members = {each.field: _read_members(tables, table, each, titles) for each in _MEMBERS[name]}
    groups: dict[str, Group] = {}
    for row, text in enumerate(names):
        if text in groups:
            raise table.error(row, phrase("error.repeated", kind="group", name=text))
        groups[text] = Group(**{field: own[row] for field, own in members.items()}, clock=clocks[row])
    return groups


def _read_members(tables: Tables, table: ColumnTable, member: _Member, titles: Sequence[str]) -> list[Any]:
    """Return a parameter of each row: free, weighted or fixed; None without."""
    is_arm, is_turn = member.made is LeverArm, member.made is Boresight
    # Tables contain attitudes of the photo in the axes of its carrier.
    values = tables.turns(table).transpose(0, 2, 1) if is_turn else tables.vectors(table, member.values, 0.0)
    read = tables.angle if is_turn else None
    sd = table.vectors(member.sd, 0.0 if is_arm else math.inf, infinite=True, read=read)
    epochs = table.numbers("drift_epoch").tolist()
    found: list[Any] = []
    for row, (word, title) in enumerate(zip(table.texts(member.column, member.empty), titles, strict=True)):
        value = None if np.isnan(values[row]).any() else values[row]
        name = called(word, title)
        if is_arm:
            name = (word or title) if sd[row].any() else ""
        if not name:
            found.append(tuple(values[row].tolist()) if is_arm else None)
            continue
        more = {"epoch": None if math.isnan(epochs[row]) else epochs[row]} if member.made is Drift else {}
        one = tables.shared.one(table, row, member.column, member.made, name, value, sd[row], **more)
        found.append(one)
    return found


def group_columns(name: str, groups: Mapping[str, Group], block: Block) -> dict[str, Any]:
    """Return the table `gnss_groups` or `attitude_groups` of groups by name."""
    own = list(groups.values())
    found: dict[str, Any] = {"group": list(groups)}
    for member in _MEMBERS[name]:
        parameters = [getattr(each, member.field) for each in own]
        unknowns = [each if isinstance(each, Unknown) else None for each in parameters]
        if member.made is GyroBias and not any(unknowns):
            continue
        if member.made is Boresight:
            words = [_boresight_word(group, each) for group, each in zip(groups, parameters, strict=True)]
            found |= {member.column: words} if set(words) != {"true"} else {}
            found |= columns_of(member.values, _boresight_angles(parameters, block))
            found |= columns_of(member.sd, degrees_typed(_of(unknowns, "deviations", 0.0)))
            continue
        is_arm = member.made is LeverArm
        values = parameters if is_arm else [(math.nan,) * 3 if each is None else each for each in parameters]
        found[member.column] = [
            each.name if is_arm and each else "" if is_arm else word_of(each) for each in unknowns
        ]
        positions = [each.position if isinstance(each, Unknown) else each for each in values]
        found |= columns_of(member.values, np.array(positions))
        found |= columns_of(member.sd, _of(unknowns, "deviations", 0.0 if is_arm else math.nan))
    epochs = [None if each.drift is None else each.drift.epoch for each in own]
    if any(each is not None for each in epochs):
        found["drift_epoch"] = np.array([np.nan if each is None else each for each in epochs])
    return found | scalar_columns(Clock, [each.clock for each in own])


def _boresight_angles(boresights: Sequence[Any], block: Block) -> Floats:
    """Return (n, 3) angles of the photo in the axes of its carrier; NaN if unknown."""
    matrices = [
        np.eye(3) if each is None else each.attitude if isinstance(each, Boresight) else each
        for each in boresights
    ]
    angles = angles_of(np.array(matrices, dtype=float).transpose(0, 2, 1), block)
    angles[[each is None or (isinstance(each, Boresight) and each.is_open) for each in boresights]] = np.nan
    return angles


def _of(unknowns: Sequence[Unknown | None], what: str, missing: float) -> Floats:
    """Return (n, 3) numbers of unknowns."""
    return np.array([(missing,) * 3 if each is None else getattr(each, what) for each in unknowns])


def named_groups(observations: Sequence[Any], *, numbered: bool) -> tuple[list[str], dict[str, Group]]:
    """Return the group name of each observation, and groups by name.

    Groups of antennas are `numbered`; others have the names of their boresights.
    """
    names: dict[tuple[object, ...], str] = {}
    groups: dict[str, Group] = {}
    for observation in observations:
        group = group_of(observation)
        if group.key not in names:
            names[group.key] = name = str(len(groups) + 1) if numbered else _inertial_name(group, groups)
            if name:
                groups[name] = group
    if numbered and list(names) == [Group().key]:
        return [], {}
    return [names[group_of(observation).key] for observation in observations], groups


def _inertial_name(group: Group, groups: Mapping[str, Group]) -> str:
    """Return the name of a group: of its boresight, if it is unique."""
    if group.key == Group().key:
        return ""
    number = len(groups) + 1
    if isinstance(group.boresight, Boresight):
        name = group.boresight.name
    else:
        name = f"IMU {number}" if group.boresight is None else f"known {number}"
    return f"{name} {number}" if name in groups else name


def _boresight_word(group: str, boresight: Any) -> str:
    """Return the cell of a boresight: `true` if it has the name of the group."""
    if boresight is None:
        return "false"
    return word_of(boresight) if isinstance(boresight, Boresight) and boresight.name != group else "true"
