"""The close-out check: has the plate moved while it was measured? (subroutine CLOSOUT, figure 6)."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.readings import Case
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message

SUSPECT_UM = 2.0  # A mean shift beyond this: a shift of the plate is suspected; close on the second point too
REMEASURE_UM = 4.0  # A mean shift from here on: the case must be measured again
FEW_READINGS = 9  # A case of so few readings that is not closed is not a measurement of the plate
ENOUGH = 3  # Pointings that a close-out needs


@dataclass(frozen=True, eq=False)
class Closeout:
    """Returns to a point: how many pointings each visit has, and their means (visits, 2)."""

    point: int
    counts: tuple[int, ...]
    means_um: Floats

    @property
    def sequential_shifts_um(self) -> Floats:
        """(visits - 1, 2) mean of each return less that of the visit before."""
        return np.diff(self.means_um, axis=0)

    @property
    def total_shift_um(self) -> Floats | None:
        """(2,) mean of the last visit less that of the first; None where there was no return."""
        if len(self.counts) < 2:
            return None
        shift: Floats = self.means_um[-1] - self.means_um[0]
        return shift

    @property
    def verdict(self) -> str:
        """`none` (no return), `good`, `suspect` (more than 2 um) or `remeasure` (4 um or more)."""
        if self.total_shift_um is None:
            return "none"
        largest = float(np.abs(self.sequential_shifts_um).max(initial=np.abs(self.total_shift_um).max()))
        if largest >= REMEASURE_UM:
            return "remeasure"
        return "suspect" if largest > SUSPECT_UM else "good"


def close_out(case: Case) -> tuple[list[Closeout], list[Message]]:
    """Check the returns to the first point of a case and, where it was visited again, to the second.

    Returns
    -------
    closeouts, messages
        That of the first point always; the rules of the report as remarks.
    """
    first, *others = dict.fromkeys(case.points.tolist())
    closeouts = [_visits(case, first)]
    if others and len((second := _visits(case, others[0])).counts) > 1:
        closeouts.append(second)
    if len(closeouts[0].counts) < 2 and len(case.points) <= FEW_READINGS:
        raise case.place.error(
            f"case {case.number}: INSUFFICIENT MEASUREMENTS MADE - STOP"
            f" ({len(case.points)} pointings, and no return to point {first})"
        )
    return closeouts, _remarks(case, closeouts)


def _visits(case: Case, point: int) -> Closeout:
    rows = np.flatnonzero(case.points == point)
    visits = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    means = np.array([case.xy_um[visit].mean(axis=0) for visit in visits])
    return Closeout(point, tuple(len(visit) for visit in visits), means)


def _remarks(case: Case, closeouts: list[Closeout]) -> list[Message]:
    first = closeouts[0]
    head = f"case {case.number}: "
    texts = []
    if first.verdict == "none":
        texts.append(f"NO CLOSEOUT MEASUREMENTS ON INITIAL POINT {first.point} MADE")
    elif first.counts[-1] < ENOUGH:
        texts.append(
            f"the close-out on point {first.point} has {first.counts[-1]} pointings; 3 are asked for"
        )
    for closeout in closeouts:
        size = np.abs(closeout.means_um - closeout.means_um[0]).max()
        if closeout.verdict == "remeasure":
            texts.append(f"point {closeout.point} moved by {size:.1f} um (4 or more): measure the case again")
        elif closeout.verdict == "suspect":
            advice = "" if len(closeouts) > 1 else "; close on the second point too"
            texts.append(
                f"point {closeout.point} moved by {size:.1f} um (more than 2): did the plate shift?{advice}"
            )
    return [case.place.message(head + text) for text in texts]
