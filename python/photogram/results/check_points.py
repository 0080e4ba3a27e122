"""Check points of an adjusted block: known coordinates that were not used."""

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
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import Result
    from photogram.show.quantity import Axis
    from photogram.statistics.findings import Agreement

MOST = 1000  # Largest number of check points in the joint test; of more points a regular subset is used


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
        """(k,) test values T (F if the unit weight is estimated) and their probabilities."""
        if self.agreement is None:
            return np.full(len(self.rows), math.nan), np.full(len(self.rows), math.nan)
        tested = self.agreement.points
        return tested.values, np.exp(tested.log_probability())


def check_points(result: Result) -> CheckPoints:
    """Return the check points of a result with single and joint tests.

    Blocks that were adjusted in parts lack covariances between points, and therefore a joint test.
    """
    block = result.block
    rows = np.flatnonzero(result.used_points & (result.point_kinds == "check"))
    differences = result.point_differences[rows]
    obstacles = {
        "there are none": not len(rows),
        "the datum of the network is chosen, and theirs is another": result.datum.is_chosen,
        "all photos are fixed, and no standard deviation has their errors": not result.photo_given_sd.any(),
        "the adjustment has not converged": not result.converged,
        "covariances were not computed": not np.isfinite(result.point_cofactors[rows]).all(),
    }
    untested = next((reason for reason, holds in obstacles.items() if holds), "")
    names, sd = tuple(block.point_ids[row] for row in rows.tolist()), result.point_sd[rows]
    found = CheckPoints(rows, names, differences, sd, *_given(block, rows, differences), untested)
    return found if untested else replace(found, agreement=_agreement(result, found))


def _agreement(result: Result, found: CheckPoints) -> Agreement:
    from photogram.results.network_tables import point_axes  # few blocks have check points
    from photogram.statistics.agreement import agreement

    survey = np.zeros((len(found.rows), 3, 3))
    survey[:, range(3), range(3)] = found.given_sd**2
    asked = partial(agreement, scale=result.covariance_scale, second=result.freedom_of_scale)
    alone = asked(
        found.differences,
        result.point_cofactors[found.rows],
        survey,
        name=partial(_named, found.names),
        apart=partial(_apart, found.differences, point_axes(result.block)),
    )
    if not result.WHOLE:
        return alone
    some = together(len(found.rows))
    joint = result.state.joint(found.rows[some].tolist())
    if joint is None:
        try:
            joint = result.covariance(("point", found.names[some])) / result.covariance_scale
        except AdjustmentError:  # not enough memory, or singular by rounding: single tests remain
            return alone
    return replace(alone, together=asked(found.differences[some], joint, survey[some]).together)


def _named(names: tuple[str, ...], place: tuple[int, ...]) -> str:
    """Return the name of a point; module-level, so that results can be pickled."""
    return names[place[0]]


def together(count: int) -> slice:
    """Return the slice of check points that are tested jointly."""
    return slice(None, None, -(-count // MOST) or None)


def tested_together(block: Block) -> list[int]:
    """Return the points whose joint cofactors this test requires, if all take part."""
    rows = np.flatnonzero(point_kinds(block) == "check")
    chosen: list[int] = rows[together(len(rows))].tolist()
    return chosen


def point_kinds(block: Block) -> NDArray[np.str_]:
    """Return (n,) types: `control` if observed, `check` if known only, else `pass`."""
    held: Bools = np.asarray(np.isfinite(block.point_sd).any(axis=1))
    held[observed_control(block)] = True
    known = np.isfinite(block.point_positions).any(axis=1)
    return np.where(held, "control", np.where(known, "check", "pass"))


def observed_control(block: Block) -> list[int]:
    """Return the control points with an observed covariance matrix."""
    names = {each.point for each in block.observations.of_type(Control)}
    return [row for row, name in enumerate(block.point_ids) if name in names] if names else []


def _apart(
    differences: Floats, axes: tuple[Axis, ...], place: tuple[int, ...], sd: Floats
) -> dict[str, float | str | Phrase]:
    """Return the distance of a point in the component with the largest test value."""
    own = differences[place[0]]
    with np.errstate(all="ignore"):
        k = int(np.nanargmax(np.abs(own) / np.where(sd > 0, sd, 1e-300)))
    axis = axes[k]
    sizes = {"difference": float(own[k] * axis.factor), "sd": float(sd[k] * axis.factor)}
    return {**sizes, "unit": axis.small, "axis": Phrase(f"axis.{axis.name}")}


def _given(block: Block, rows: Indices, differences: Floats) -> tuple[Floats, Bools]:
    """Return standard deviations of given coordinates, and points with assumed ones."""
    own = np.full((len(rows), 3), math.nan)
    if block.point_check_sd is not None:
        own = block.point_check_sd[rows]
    lacking: Bools = np.asarray((np.isnan(own) & np.isfinite(differences)).any(axis=1))
    # Standard deviations of observations are lengths, also in geographic blocks.
    observed = [] if block.geographic else block.observations.of_type(Control)
    every = np.vstack([block.point_sd, *(np.sqrt(np.diag(each.precision)) for each in observed)])
    assumed = [np.median(held) if (held := column[np.isfinite(column)]).size else 0.0 for column in every.T]
    return np.asarray(np.where(np.isnan(own), assumed, own)), lacking
