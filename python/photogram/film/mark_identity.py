"""Which mark a reading is of, where nobody has said: quarter turns of the film, and its side."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import frozen, number
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.film.interior import pairs
from photogram.lazy_dataclasses import dataclass

__all__ = ["DECIDED", "FilmWay", "WhichMark", "which_mark"]

CHANCE = 1e-4
"""Of a wrong choice among the eight."""
DECIDED = 2.0 * float(np.log(8.0 / CHANCE))
"""By how much the weighted sum of squares of the runner-up must exceed that of the best."""
NEAR = 0.1
"""A reading as far from every mark, in parts of the format, is of none of them."""


@dataclass(frozen=True, eq=False)
class FilmWay:
    """A way in which a film may lie.

    Attributes
    ----------
    marks
        (n,) the number of the mark of each reading.
    quarter_turns, mirrored
        As of :class:`WhichMark`.
    """

    marks: Indices
    quarter_turns: int
    mirrored: bool

    def __str__(self) -> str:
        return f"turned by {90 * self.quarter_turns} degrees{', mirrored' if self.mirrored else ''}"


@dataclass(frozen=True, eq=False)
class WhichMark:
    """What was found of readings without names.

    Attributes
    ----------
    marks
        (n,) the number of the mark of each reading, for the best of the eight ways to lie.
    quarter_turns
        How many quarters the film lies turned counter-clockwise against the camera's frame, for the best.
    mirrored
        Whether it was seen from the other side, for the best.
    omega
        (8,) weighted sums of squares after an affine fit: four quarter turns, then four mirrored; infinite
        where readings are of no marks.
    decided
        Whether the runner-up is so much worse that the best is sure.
    ways
        (8,) all, in the same order; None where readings are of no marks.
    alike
        The best, and those that cannot be told from it.
    """

    marks: Indices
    quarter_turns: int
    mirrored: bool
    omega: Floats
    decided: bool
    ways: tuple[FilmWay | None, ...]
    alike: tuple[FilmWay, ...]

    def __str__(self) -> str:
        return str(self.alike[0]) if self.decided else "cannot be told from the marks: quarter turn or side"


def which_mark(places: ArrayLike, true: ArrayLike, *, sd: float = 0.004) -> WhichMark:
    """Find of which marks readings are: the film lies in one of four quarter turns, on one of two sides.

    Marks of modern cameras are symmetric to some 0.01 mm: then it cannot be told from them, and the flight
    or tie points must.

    Parameters
    ----------
    places
        (m, 2) places of the marks in the camera's frame, mm.
    true
        (n, 2) true places on the scanner of readings without names, mm, y up; three at least.
    sd
        Standard deviation of these against the certificate, mm.

    Raises
    ------
    InputError
        Fewer than three readings, or readings that are of no marks in all eight ways.
    """
    q, p = pairs("places", places), pairs("true", true)
    if len(p) < 3 or len(q) < len(p):
        raise InputError(
            f"{len(p)} readings without names, and {len(q)} marks: three of these at least are needed"
        )
    if number("sd", sd) <= 0:
        raise InputError(f"sd is no standard deviation: {sd}")
    ways = [_tried(q, p, turns, mirrored=mirrored) for mirrored in (False, True) for turns in range(4)]
    omega = np.array([each[1] for each in ways]) / sd**2
    best = int(np.argmin(omega))
    if not np.isfinite(omega[best]):
        raise InputError("the readings without names are of no marks of the camera, however the film lies")
    every = [FilmWay(frozen(marks), k % 4, k >= 4) for k, (marks, _) in enumerate(ways)]
    alike = sorted(np.flatnonzero(omega - omega[best] <= DECIDED).tolist(), key=lambda k: k != best)
    return WhichMark(
        marks=every[best].marks,
        quarter_turns=best % 4,
        mirrored=best >= 4,
        omega=frozen(omega),
        decided=len(alike) == 1,
        ways=tuple(each if np.isfinite(one) else None for each, one in zip(every, omega, strict=True)),
        alike=tuple(every[k] for k in alike),
    )


def _tried(q: Floats, p: Floats, turns: int, *, mirrored: bool) -> tuple[Indices, float]:
    """Return the mark of each reading for a way to lie, and the sum of squares after an affine fit."""
    lain = q * [-1.0, 1.0] if mirrored else q
    turn = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), turns)
    lain = lain @ turn.T
    marks = _nearest(lain, p)
    if marks is None:
        return np.zeros(len(p), dtype=np.int64), np.inf
    design = np.column_stack([np.ones(len(p)), q[marks]])
    left = p - design @ np.linalg.lstsq(design, p, rcond=None)[0]
    return marks, float((left**2).sum())


def _nearest(lain: Floats, p: Floats) -> Indices | None:
    """Return the mark of each reading, each once, for the shift that brings readings nearest; None without.

    Every mark is tried for the first reading: marks may have been lost.
    """
    limit = NEAR * np.ptp(lain, axis=0).max()
    best, found = np.inf, None
    for place in lain:
        apart = np.linalg.norm((p - p[0] + place)[:, np.newaxis] - lain, axis=2)
        marks = apart.argmin(axis=1)
        worst = apart[np.arange(len(p)), marks].max()
        if worst < min(limit, best) and len(set(marks.tolist())) == len(p):
            best, found = worst, marks
    return found
