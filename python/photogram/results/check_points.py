"""Check points of an adjusted block: known coordinates that took no part in it, and how it agrees."""

from __future__ import annotations

import math
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.observations.points import Control
from photogram.results.network import AdjustedNetwork
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.show.quantity import Axis
    from photogram.statistics.findings import Agreement

MOST = 1000  # Check points of the joint test; of more points every second, third ... is used


@dataclass(frozen=True, eq=False)
class CheckPoints:
    """The k check points of a result."""

    rows: Indices  # (k,) among all points
    names: tuple[str, ...]  # Names of the points
    differences: Floats  # (k, 3) adjusted minus given, in the units of the block; NaN if not given
    sd: Floats  # (k, 3) standard deviations of the adjusted coordinates
    # (k, 3) standard deviations of the given coordinates; assumed values if none were given
    given_sd: Floats
    assumed: Bools  # (k,) whether the given deviations are assumed
    untested: str  # Reason for a missing test; empty with a test
    agreement: Agreement | None = None  # Tests, if any

    @cached_property
    def statistics(self) -> tuple[Floats, Floats]:
        """(k,) test values T (F where the unit weight is estimated) and their probabilities."""
        if self.agreement is None:
            return np.full(len(self.rows), math.nan), np.full(len(self.rows), math.nan)
        tested = self.agreement.points
        return tested.values, np.exp(tested.log_probability())


def check_points(
    network: AdjustedNetwork,
    block: Block,
    differences: Floats,
    kinds: np.ndarray,
    *,
    second: float,
    untested: str = "",
    whole: bool = True,
) -> CheckPoints:
    """Return the check points of an adjusted block with their tests.

    `differences` are (n, 3) adjusted minus given coordinates, `kinds` (n,) those of all points; `second` are
    the degrees of freedom with which the variance of unit weight was estimated, infinite where it is known;
    `untested` says why nothing is tested, `whole` whether the normal equations may be asked for the
    covariances of points with each other.
    """
    rows = np.flatnonzero(network.used_points & (kinds == "check"))
    given, assumed = _given(block, rows, differences[rows])
    found = CheckPoints(
        rows=rows,
        names=tuple(block.point_ids[row] for row in rows.tolist()),
        differences=differences[rows],
        sd=network.point_sd[rows],
        given_sd=given,
        assumed=assumed,
        untested=untested,
    )
    if not len(rows):
        return replace(found, untested="there are none")
    if not np.isfinite(network.point_cofactors[rows]).all():
        return replace(found, untested=untested or "covariances were not computed")
    return found if untested else replace(found, agreement=_agreement(network, block, found, second, whole))


def _agreement(
    network: AdjustedNetwork, block: Block, found: CheckPoints, second: float, whole: bool
) -> Agreement:
    from photogram.results.axes import point_axes  # few blocks have check points
    from photogram.statistics.agreement import agreement

    survey = np.zeros((len(found.rows), 3, 3))
    survey[:, range(3), range(3)] = found.given_sd**2
    asked = partial(agreement, scale=network.covariance_scale, second=second)
    alone = asked(
        found.differences,
        network.point_cofactors[found.rows],
        survey,
        name=partial(_named, found.names),
        apart=partial(_apart, found.differences, point_axes(block)),
    )
    if not whole:
        return alone
    some = together(len(found.rows))
    joint = network.state.joint(found.rows[some].tolist())
    if joint is None:
        try:
            joint = network.covariance(("point", found.names[some])) / network.covariance_scale
        except AdjustmentError:  # not enough memory, or singular by rounding: the single tests stand
            return alone
    return replace(alone, together=asked(found.differences[some], joint, survey[some]).together)


def _named(names: tuple[str, ...], place: tuple[int, ...]) -> str:
    """Return the name of a point; results are pickled with what names their tests."""
    return names[place[0]]


def together(count: int) -> slice:
    """Return which of so many check points are tested together: every so many of too many."""
    return slice(None, None, -(-count // MOST) or None)


def tested_together(block: Block) -> list[int]:
    """Return the points of a block whose cofactors with each other that test needs, where all take part."""
    rows = np.flatnonzero(point_kinds(block) == "check")
    chosen: list[int] = rows[together(len(rows))].tolist()
    return chosen


def point_kinds(block: Block) -> NDArray[np.str_]:
    """Return (n,) `control` with an observed component, `check` with known ones alone, else `pass`."""
    held: Bools = np.asarray(np.isfinite(block.point_sd).any(axis=1))
    held[observed_control(block)] = True
    known = np.isfinite(block.point_positions).any(axis=1)
    return np.where(held, "control", np.where(known, "check", "pass"))


def observed_control(block: Block) -> list[int]:
    """Return the points of control that is observed with a covariance matrix of its own."""
    names = {each.point for each in block.observations if isinstance(each, Control)}
    return [row for row, name in enumerate(block.point_ids) if name in names] if names else []


def _apart(
    differences: Floats, axes: tuple[Axis, ...], place: tuple[int, ...], sd: Floats
) -> dict[str, float | str | Phrase]:
    """Return how far a point is off in the component with the largest test value."""
    own = differences[place[0]]
    with np.errstate(all="ignore"):
        k = int(np.nanargmax(np.abs(own) / np.where(sd > 0, sd, 1e-300)))
    axis = axes[k]
    sizes = {"difference": float(own[k] * axis.factor), "sd": float(sd[k] * axis.factor)}
    return {**sizes, "unit": axis.small, "axis": Phrase(f"axis.{axis.name}")}


def _given(block: Block, rows: Indices, differences: Floats) -> tuple[Floats, Bools]:
    """Return standard deviations of given coordinates, and for which points those of control are assumed."""
    own = np.full((len(rows), 3), math.nan)
    if block.point_check_sd is not None:
        own = block.point_check_sd[rows]
    lacking: Bools = np.asarray((np.isnan(own) & np.isfinite(differences)).any(axis=1))
    # Those of observations are lengths, in geographic blocks too.
    observed = [] if block.geographic else [e for e in block.observations if isinstance(e, Control)]
    every = np.vstack([block.point_sd, *(np.sqrt(np.diag(each.precision)) for each in observed)])
    assumed = [np.median(held) if (held := column[np.isfinite(column)]).size else 0.0 for column in every.T]
    return np.asarray(np.where(np.isnan(own), assumed, own)), lacking
