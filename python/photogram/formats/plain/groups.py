"""The tables of groups: what positions and velocities, or attitudes and rates, have in common."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

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

_Group = TypeVar("_Group", "Antenna", "Inertial")


@dataclass(frozen=True)
class Antenna:
    """What the positions and velocities of a group have in common; known lever arms are three numbers."""

    lever: LeverArm | tuple[float, ...] = (0.0, 0.0, 0.0)
    shift: Shift | None = None
    drift: Drift | None = None
    clock: Clock | None = None


@dataclass(frozen=True)
class Inertial:
    """What the attitudes and rates of a group have in common."""

    boresight: Boresight | ArrayLike | None = None
    clock: Clock | None = None
    bias: GyroBias | None = None


def grouped(
    tables: Tables, table: ColumnTable, groups: Mapping[str, _Group], what: str
) -> list[_Group | None]:
    """Return the group of each row; None of rows of no group."""
    names = table.texts("group")
    if what in tables.settings.tables or what == "attitude_groups":
        for row, name in enumerate(names):
            if name and name not in groups:
                raise table.unknown_error(row, "group", "group", name, groups)
    return [groups.get(name) for name in names]


def antennas(tables: Tables) -> dict[str, Antenna]:
    """Read the table `gnss_groups`, by the names of groups."""
    table = tables.rows("gnss_groups")
    values = {"lever": tables.vectors(table, [f"lever_{axis}" for axis in AXES], 0.0)}
    values |= {kind: table.vectors([f"{kind}_{axis}" for axis in AXES], 0.0) for kind in ("shift", "drift")}
    sd = {
        kind: table.vectors([f"sd_{kind}_{axis}" for axis in AXES], default, infinite=True)
        for kind, default in (("lever", 0.0), ("shift", math.inf), ("drift", math.inf))
    }
    epochs = [None if math.isnan(each) else float(each) for each in table.numbers("drift_epoch")]
    names = table.texts("group")
    titles = [name or "GNSS" for name in names]
    own = scalars(tables, table, Clock, titles)
    words = [table.texts(column) for column in ("lever", "shift", "drift")]
    found: dict[str, Antenna] = {}
    for row, (name, title, lever, shift, drift) in enumerate(zip(names, titles, *words, strict=True)):
        if name in found:
            raise table.error(row, phrase("error.repeated", kind="group", name=name))

        def one(kind: type[Any], what: str, name: str, row: int = row, **more: Any) -> Any:
            return tables.shared.one(table, row, what, kind, name, values[what][row], sd[what][row], **more)

        arm = one(LeverArm, "lever", lever or title) if sd["lever"][row].any() else None
        moved, drifts = called(shift, title), called(drift, title)
        found[name] = Antenna(
            tuple(values["lever"][row].tolist()) if arm is None else arm,
            one(Shift, "shift", moved) if moved else None,
            one(Drift, "drift", drifts, epoch=epochs[row]) if drifts else None,
            own[row],
        )
    return found


def inertials(tables: Tables) -> dict[str, Inertial]:
    """Read the table `attitude_groups`, by the names of groups."""
    table = tables.rows("attitude_groups")
    # Both the photo and what carries it have axes as the settings say.
    matrices = tables.turns(table)
    sd = table.vectors(SD_ROTATIONS, math.inf, infinite=True, read=tables.angle)
    biases = tables.vectors(table, BIAS, 0.0)
    bias_sd = table.vectors(deviation_columns(BIAS), math.inf, infinite=True)
    names = table.texts("group")
    titles = [name or "IMU" for name in names]
    own = scalars(tables, table, Clock, titles)
    words = table.texts("boresight", "true"), table.texts("bias", "false")
    found: dict[str, Inertial] = {}
    for row, (name, title, turned, bias) in enumerate(zip(names, titles, *words, strict=True)):
        if name in found:
            raise table.error(row, phrase("error.repeated", kind="group", name=name))
        matrix = None if np.isnan(matrices[row]).any() else matrices[row].T
        one = tables.shared.one
        boresight, gyro = called(turned, title), called(bias, title)
        found[name] = Inertial(
            one(table, row, "boresight", Boresight, boresight, matrix, sd[row]) if boresight else None,
            own[row],
            one(table, row, "bias", GyroBias, gyro, biases[row], bias_sd[row]) if gyro else None,
        )
    return found


def antenna_of(each: Position | Velocity) -> Antenna:
    """Return what an observation has in common with others."""
    lever = each.lever_arm
    if not isinstance(lever, LeverArm):
        lever = tuple(np.broadcast_to(np.asarray(lever, dtype=float), 3).tolist())
    clock = None if each.moment is None else each.clock
    if isinstance(each, Velocity):
        return Antenna(lever, clock=clock)
    return Antenna(lever, each.shift, each.drift, clock)


def antenna_columns(groups: Mapping[Antenna, str]) -> dict[str, Any]:
    """Return the table of groups of positions and velocities, which have these names."""
    levers = [each.lever if isinstance(each.lever, LeverArm) else None for each in groups]
    found: dict[str, Any] = {
        "group": list(groups.values()),
        "lever": ["" if each is None else each.name for each in levers],
        "shift": [word_of(each.shift) for each in groups],
        "drift": [word_of(each.drift) for each in groups],
    }
    given = [each.lever.position if isinstance(each.lever, LeverArm) else each.lever for each in groups]
    found |= columns_of([f"lever_{axis}" for axis in AXES], np.array(given))
    found |= columns_of([f"sd_lever_{axis}" for axis in AXES], _of(levers, "deviations", 0.0))
    for what in ("shift", "drift"):
        unknowns = [getattr(each, what) for each in groups]
        found |= columns_of([f"{what}_{axis}" for axis in AXES], _of(unknowns, "position", np.nan))
        found |= zip(
            [f"sd_{what}_{axis}" for axis in AXES], _of(unknowns, "deviations", np.nan).T, strict=True
        )
    epochs = [None if each.drift is None else each.drift.epoch for each in groups]
    if any(each is not None for each in epochs):
        found["drift_epoch"] = np.array([np.nan if each is None else each for each in epochs])
    return found | scalar_columns(Clock, [each.clock for each in groups])


def _of(unknowns: Sequence[Unknown | None], what: str, missing: float) -> Floats:
    """Return (n, 3) numbers of unknowns."""
    return np.array([(missing,) * 3 if each is None else getattr(each, what) for each in unknowns])


def inertial_groups(observations: Sequence[Attitude | Rate]) -> tuple[list[str], dict[str, Inertial]]:
    """Return the name of the group of each observation, empty where it has none, and all groups by name."""
    names: dict[tuple[object, ...], str] = {}
    groups: dict[str, Inertial] = {}
    found = []
    for each in observations:
        clock = None if each.moment is None else each.clock
        own = Inertial(each.boresight, clock, each.bias if isinstance(each, Rate) else None)
        known = own.boresight is None or isinstance(own.boresight, Boresight)
        key = (own.boresight if known else np.asarray(own.boresight).tobytes(), own.clock, own.bias)
        if key not in names:
            names[key] = name = _group_name(own, groups)
            if name:
                groups[name] = own
        found.append(names[key])
    return found, groups


def _group_name(own: Inertial, groups: Mapping[str, Inertial]) -> str:
    """Return what a group is called: as its boresight, where no other group is."""
    if own.boresight is None and own.clock is None and own.bias is None:
        return ""
    number = len(groups) + 1
    if isinstance(own.boresight, Boresight):
        name = own.boresight.name
    else:
        name = f"IMU {number}" if own.boresight is None else f"known {number}"
    return f"{name} {number}" if name in groups else name


def inertial_columns(groups: Mapping[str, Inertial], block: Block) -> dict[str, Any]:
    """Return the table of groups of attitudes and rates, by their names."""
    own = list(groups.values())
    boresights = [each.boresight for each in own]
    # The boresight is body to photo; the tables have attitudes of the photo in the axes of what carries it.
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
    """Return what the cell of a boresight says: `true` where it is called as the group."""
    if boresight is None:
        return "false"
    return word_of(boresight) if isinstance(boresight, Boresight) and boresight.name != group else "true"
