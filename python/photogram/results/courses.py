"""Trajectories of an adjusted block: what they are made of, and how far the adjustment has moved them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.knots import Knot
from photogram.network.trajectories import Basis, Coefficient, Polynomial, Trajectory
from photogram.results.trajectories import corrections
from photogram.results.unknowns import AdjustedUnknown
from photogram.show.quantity import Axis, Quantity, of_each

if TYPE_CHECKING:
    from photogram import Result

POSES = (
    "Of photos on trajectories these are the poses at their own times; of scanners without one, in the middle"
    " of their images."
)

STEPS = 8  # Places in each interval of knots, or for each coefficient of a polynomial
COEFFICIENTS = 24  # Number up to which all coefficients are listed
NOTABLE = 3.0  # Test value from which coefficients of longer lists are listed
LISTED = 20  # Rows of longer lists of coefficients and trajectories


@dataclass(frozen=True, eq=False)
class Course:
    """Positions or rotations of a trajectory after the adjustment."""

    trajectory: str  # Its name; `position` or `rotation`
    what: str
    basis: str  # What its corrections are made of, and of how many coefficients
    count: int
    first: float  # The span of its table, in seconds
    last: float
    # The length of the largest correction in it, in the linear unit or in radians, and its time
    largest: float
    at: float
    tested: float  # The largest of the test values of its coefficients; NaN where none is weighted


def courses(result: Result) -> list[Course]:
    """Return positions and rotations of all trajectories that have corrections, in the order of the block."""
    # By names: those of photos of their own are made anew with their block.
    adjusted = {(each.kind, each.name): each for each in result.unknowns}
    found = []
    for each in result.block.all_trajectories:
        for what, basis, own in zip(
            ("position", "rotation"), (each.position, each.rotation), each.coefficients, strict=True
        ):
            if basis is not None:
                of = [adjusted[one.KIND, one.name] for one in own]
                found.append(_course(each, what, basis, of))
    return found


def _course(trajectory: Trajectory, what: str, basis: Basis, own: Sequence[AdjustedUnknown]) -> Course:
    first, last = trajectory.table.span
    times, values = _times(basis, first, last), np.array([each.position for each in own])
    # The others count for nothing.
    none = [np.zeros((len(each), 3)) for each in trajectory.coefficients]
    part = ("position", "rotation").index(what)
    none[part] = values
    sizes = np.linalg.norm(corrections(trajectory, times, *none)[part], axis=1)
    worst = int(np.argmax(np.nan_to_num(sizes, nan=-1.0)))
    tests = np.abs(np.concatenate([each.standardized for each in own]))
    return Course(
        trajectory=trajectory.name,
        what=what,
        basis=f"{type(basis).__name__.lower()} of degree {basis.degree}",
        count=len(own),
        first=first,
        last=last,
        largest=float(sizes[worst]),
        at=float(times[worst]),
        tested=float(np.nanmax(tests)) if np.isfinite(tests).any() else float("nan"),
    )


def _times(basis: Basis, first: float, last: float) -> Floats:
    """Return times over a span: some in each interval of knots, or for each coefficient of a polynomial."""
    if isinstance(basis, Polynomial):
        return np.linspace(first, last, STEPS * basis.count + 1) if last > first else np.array([first])
    knots, p = np.asarray(basis.knots, dtype=float), basis.degree
    inner = np.clip(np.unique(knots[p : len(knots) - p]), first, last)
    parts = (np.arange(STEPS) / STEPS)[:, np.newaxis]
    return np.unique(np.append(((1 - parts) * inner[:-1] + parts * inner[1:]).ravel(), inner[-1]))


def notable_courses(result: Result) -> tuple[list[Course], str]:
    """Return those that reports list, and what they say of the others: the largest test values come first."""
    every = courses(result)
    if len(every) <= LISTED:
        return every, ""
    order = sorted(range(len(every)), key=lambda row: -np.nan_to_num(every[row].tested))[:LISTED]
    shown = [every[row] for row in sorted(order)]
    return shown, f"{LISTED} of {len(every)}, with the largest test values; the table of unknowns has all"


def courses_table(every: Sequence[Course], linear_unit: str) -> list[Quantity]:
    """Return trajectories, quantity by quantity."""
    axes = (Axis.of("position", linear_unit), Axis.turned("rotation"))
    of = np.array([("position", "rotation").index(each.what) for each in every], dtype=np.int64)

    numbers = (("count", "Coefficients", 0), ("first", "From s", 3), ("last", "To s", 3))
    return [
        of_each(every, "trajectory", kind="name", head="Trajectory"),
        Quantity(np.array([axes[k].name for k in of], dtype=object), axes, "name", head="Of", of=of),
        of_each(every, "basis", kind="name", head="Basis"),
        *(of_each(every, name, head=head, decimals=count) for name, head, count in numbers),
        of_each(every, "largest", axes, "deviation", head="Largest correction", figures=4, of=of),
        of_each(every, "at", head="At s", decimals=3),
        of_each(every, "tested", head="Largest |w|", decimals=2),
    ]


_MANY = (Coefficient, Knot)  # Types with thousands of unknowns


def notable(every: Sequence[AdjustedUnknown]) -> tuple[list[AdjustedUnknown], str]:
    """Return the common unknowns that reports list, and what they say of the others.

    All but coefficients of trajectories and knots of lenses, and these where they are few, or have large test
    values.
    """
    own = [each for each in every if isinstance(each.given, _MANY)]
    if len(own) <= COEFFICIENTS:
        return list(every), ""
    sizes = np.array([np.nan_to_num(np.abs(each.standardized)).max(initial=0.0) for each in own])
    order = np.argsort(-sizes, kind="stable")[:LISTED]
    kept = {id(own[row]) for row in order.tolist() if sizes[row] > NOTABLE}
    shown = [each for each in every if not isinstance(each.given, _MANY) or id(each) in kept]
    both = {isinstance(each.given, Knot): None for each in own}
    kinds = " and ".join("knots of lenses" if knot else "coefficients of trajectories" for knot in both)
    which = f"{len(kept)} of " if kept else ""
    what = f"with |test value| > {NOTABLE:g}, " if kept else ""
    return shown, (
        f"{which}{len(own)} {kinds} {what}{'are listed' if kept else 'are not listed'}:"
        " the table of unknowns has all"
    )
