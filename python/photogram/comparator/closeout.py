"""The close-out check: has the plate moved while it was measured? (subroutine CLOSOUT, figure 6)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.readings import Case
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.words import Phrase, phrase

SUSPECT_UM, REMEASURE_UM = 2.0, 4.0  # mean shifts: close on the second point too, measure the case again
FEW_READINGS = 9  # a case with so few readings must be closed
ENOUGH = 3  # pointings of a close-out


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
    """Check the returns to the first point of a case and, if it was visited again, to the second.

    The close-out of the first point is always returned; the remarks are the rules of the report.
    """
    first, *others = dict.fromkeys(case.points.tolist())
    closeouts = [_visits(case, first)]
    if others and len((second := _visits(case, others[0])).counts) > 1:
        closeouts.append(second)
    if len(closeouts[0].counts) < 2 and len(case.points) <= FEW_READINGS:
        fields = {"case": case.number, "count": len(case.points), "point": first}
        raise case.place.error(phrase("comparators.not-closed", **fields))
    return closeouts, [case.place.message(remark) for remark in _remarks(case.number, closeouts)]


def _visits(case: Case, point: int) -> Closeout:
    rows = np.flatnonzero(case.points == point)
    visits = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    means = np.array([case.xy_um[visit].mean(axis=0) for visit in visits])
    return Closeout(point, tuple(len(visit) for visit in visits), means)


def _remarks(case: int, closeouts: list[Closeout]) -> Iterator[Phrase]:
    first = closeouts[0]
    if first.verdict == "none":
        yield phrase("comparators.no-closeout", case=case, point=first.point)
    elif (count := first.counts[-1]) < ENOUGH:
        fields = {"case": case, "point": first.point, "count": count}
        yield phrase("comparators.short-closeout", least=ENOUGH, **fields)
    suspect = "comparators.shifted" if len(closeouts) > 1 else "comparators.shifted-first"
    codes = {"remeasure": "comparators.moved", "suspect": suspect}
    for closeout in closeouts:
        if closeout.verdict in codes:
            shift = float(np.abs(closeout.means_um - closeout.means_um[0]).max())
            yield phrase(codes[closeout.verdict], case=case, point=closeout.point, shift=shift)
