"""Control and check points as they were given, in the system in which a client reads coordinates."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.observations import Control
from photogram.results.axes import point_axes
from photogram.results.statement.comparison import Compared, in_order

if TYPE_CHECKING:
    from photogram import Result


@dataclass(frozen=True)
class System:
    """A system of coordinates for people."""

    crs: str  # Name; empty for the system of the block
    axes: tuple[tuple[str, str], tuple[str, str], tuple[str, str]]  # Names and units of its three coordinates
    carried: Callable[[Floats], Floats]  # Transforms (n, 3) positions of the block; angles in degrees


@dataclass(frozen=True, eq=False)
class Survey:
    """Points that were given."""

    # n names; `control` or `check`
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    # (n, 3) in the system; standard deviations along the axes of the block
    positions: Floats
    sd: Floats
    checks: Floats  # (k, 3) positions of the check points of the statement in the system
    system: System | None  # None without points


NOTHING = Survey((), (), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)), None)


def surveyed(result: Result, found: Compared, system: System | None) -> Survey:
    """Return control and check points of a block, in a system or in the block's own axes."""
    block = result.block
    own = own_system(result) if system is None else system
    observed = {each.point: each for each in block.observations if isinstance(each, Control)}
    kinds = result.point_kinds.copy()
    positions, sd = block.point_positions.copy(), block.point_sd.copy()
    for name, each in observed.items():
        row = block.point_ids.index(name)
        kinds[row], positions[row] = "control", np.asarray(each.position, dtype=float)
        sd[row] = np.sqrt(np.diag(each.precision))
    survey = dict(zip(found.names, found.survey_sd, strict=True))
    rows = in_order(block, np.flatnonzero(kinds != "pass"))
    for row in rows.tolist():
        if block.point_ids[row] in survey:
            sd[row] = survey[block.point_ids[row]]
    return Survey(
        names=tuple(block.point_ids[row] for row in rows.tolist()),
        kinds=tuple(str(kinds[row]) for row in rows.tolist()),
        positions=_carried(own, positions[rows]),
        sd=np.where(np.isfinite(sd[rows]), sd[rows], np.nan),
        checks=_carried(own, found.given),
        system=own,
    )


def own_system(result: Result) -> System:
    """Return the axes of a block themselves: longitudes and latitudes in degrees."""
    axes = point_axes(result.block)
    factors = np.array([np.degrees(1.0) if axis.angle else 1.0 for axis in axes])
    named = tuple((axis.name, "deg" if axis.angle else axis.unit) for axis in axes)
    return System("", (named[0], named[1], named[2]), lambda positions: positions * factors)


def _carried(system: System, positions: Floats) -> Floats:
    """Return positions in a system; with a coordinate lacking only in the block's own axes."""
    if not system.crs:
        return system.carried(positions)
    found = np.full(positions.shape, np.nan)
    whole = np.isfinite(positions).all(axis=1)
    if whole.any():
        found[whole] = system.carried(positions[whole])
    return found
