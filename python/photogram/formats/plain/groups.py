"""The tables of groups: shared parameters of pose observations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.formats.plain.common_unknowns import called, word_of
from photogram.formats.plain.schema import AXES, BIAS, OPK, SD_ROTATIONS, deviation_columns
from photogram.formats.plain.subjects import scalar_columns, scalars
from photogram.formats.plain.tables import Tables, angles_of, columns_of
from photogram.io.column_table import ColumnTable
from photogram.io.units import degrees_typed
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
_ANTENNA = {kind: tuple(f"{kind}_{axis}" for axis in AXES) for kind in ("lever", "shift", "drift")}


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
    members = (_antennas if antenna else _inertials)(tables, table, titles)
    groups: dict[str, Group] = {}
    for row, (text, own) in enumerate(zip(names, members, strict=True)):
        if text in groups:
            raise table.error(row, phrase("error.repeated", kind="group", name=text))
        groups[text] = Group(**own, clock=clocks[row])
    return groups


def _antennas(tables: Tables, table: ColumnTable, titles: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield lever arm, shift and drift of each row."""
    values = {kind: tables.vectors(table, names, 0.0) for kind, names in _ANTENNA.items()}
    sd = {
        kind: table.vectors(deviation_columns(names), 0.0 if kind == "lever" else math.inf, infinite=True)
        for kind, names in _ANTENNA.items()
    }
    words = {kind: table.texts(kind) for kind in _ANTENNA}
    epochs = table.numbers("drift_epoch").tolist()
    for row, title in enumerate(titles):

        def one(kind: type[Unknown], what: str, name: str, row: int = row, **more: Any) -> Any:
            if not name:
                return None
            return tables.shared.one(table, row, what, kind, name, values[what][row], sd[what][row], **more)

        arm: Any = tuple(values["lever"][row].tolist())
        if sd["lever"][row].any():
            arm = one(LeverArm, "lever", words["lever"][row] or title)
        shift, drift = (called(words[kind][row], title) for kind in ("shift", "drift"))
        epoch = None if math.isnan(epochs[row]) else epochs[row]
        yield {
            "lever_arm": arm,
            "shift": one(Shift, "shift", shift),
            "drift": one(Drift, "drift", drift, epoch=epoch),
        }


def _inertials(tables: Tables, table: ColumnTable, titles: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield boresight and bias of each row."""
    # Photo and carrier have axes as in the settings.
    matrices = tables.turns(table)
    sd = table.vectors(SD_ROTATIONS, math.inf, infinite=True, read=tables.angle)
    biases = tables.vectors(table, BIAS, 0.0)
    bias_sd = table.vectors(deviation_columns(BIAS), math.inf, infinite=True)
    words = table.texts("boresight", "true"), table.texts("bias", "false")
    one = tables.shared.one
    for row, title in enumerate(titles):
        matrix = None if np.isnan(matrices[row]).any() else matrices[row].T
        boresight, bias = (called(column[row], title) for column in words)
        yield {
            "boresight": one(table, row, "boresight", Boresight, boresight, matrix, sd[row])
            if boresight
            else None,
            "bias": one(table, row, "bias", GyroBias, bias, biases[row], bias_sd[row]) if bias else None,
        }


def antenna_columns(groups: Mapping[str, Group]) -> dict[str, Any]:
    """Return the table of groups of positions and velocities by name."""
    own = list(groups.values())
    arms = [each.lever_arm for each in own]
    levers = [each if isinstance(each, LeverArm) else None for each in arms]
    found: dict[str, Any] = {
        "group": list(groups),
        "lever": ["" if each is None else each.name for each in levers],
        "shift": [word_of(each.shift) for each in own],
        "drift": [word_of(each.drift) for each in own],
    }
    values = [each.position if isinstance(each, LeverArm) else each for each in arms]
    found |= columns_of(_ANTENNA["lever"], np.array(values))
    found |= columns_of(deviation_columns(_ANTENNA["lever"]), _of(levers, "deviations", 0.0))
    for what in ("shift", "drift"):
        unknowns = [getattr(each, what) for each in own]
        found |= columns_of(_ANTENNA[what], _of(unknowns, "position", np.nan))
        found |= columns_of(deviation_columns(_ANTENNA[what]), _of(unknowns, "deviations", np.nan))
    epochs = [None if each.drift is None else each.drift.epoch for each in own]
    if any(each is not None for each in epochs):
        found["drift_epoch"] = np.array([np.nan if each is None else each for each in epochs])
    return found | scalar_columns(Clock, [each.clock for each in own])


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


def inertial_columns(groups: Mapping[str, Group], block: Block) -> dict[str, Any]:
    """Return the table of groups of attitudes and rates by name."""
    own = list(groups.values())
    boresights = [each.boresight for each in own]
    # The boresight is body to photo; tables contain attitudes of the photo in the axes of its carrier.
    matrices = np.array([_matrix(each) for each in boresights]).transpose(0, 2, 1)
    angles = angles_of(matrices, block)
    angles[[each is None or (isinstance(each, Boresight) and each.is_open) for each in boresights]] = np.nan
    sd = np.array([each.deviations if isinstance(each, Boresight) else np.zeros(3) for each in boresights])
    found: dict[str, Any] = {"group": list(groups), **columns_of(OPK, angles)}
    found |= columns_of(SD_ROTATIONS, degrees_typed(sd))
    words = [_boresight_word(name, each) for name, each in zip(groups, boresights, strict=True)]
    if set(words) != {"true"}:
        found["boresight"] = words
    biases = [each.bias for each in own]
    if any(biases):
        found["bias"] = [word_of(each) for each in biases]
        found |= columns_of(BIAS, _of(biases, "position", np.nan))
        found |= columns_of(deviation_columns(BIAS), _of(biases, "deviations", np.nan))
    return found | scalar_columns(Clock, [each.clock for each in own])


def _matrix(boresight: Any) -> Floats:
    if boresight is None:
        return np.eye(3)
    return boresight.attitude if isinstance(boresight, Boresight) else np.asarray(boresight, dtype=float)


def _boresight_word(group: str, boresight: Any) -> str:
    """Return the cell of a boresight: `true` if it has the name of the group."""
    if boresight is None:
        return "false"
    return word_of(boresight) if isinstance(boresight, Boresight) and boresight.name != group else "true"
