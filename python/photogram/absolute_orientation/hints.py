"""What may be wrong with control that does not fit its model, found by trying it.

A hypothesis changes the control: a mirror image, elevations in another unit, coordinates exchanged at one
station. The model is oriented anew with each; one that explains the residuals makes their sum of squares fall
by far more than chance and the number of trials allow (likelihood ratio f ln(Omega_0 / Omega_h)).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.likelihood import judged

FOOT = 0.3048
STATIONS = 60
"""Stations that are tried one by one, at the most."""
WORK = 20_000
"""Of many stations fewer are tried, so that about as many are oriented anew altogether, but always a few."""
FEW = 6
PAIRS = 60
"""Pairs of stations that are exchanged on trial, at the most: of more, those that are nearest each other's
places."""
MOST = 5
"""Hypotheses accepted one upon the other, at the most."""
AS_WELL = 4.0
"""A mirror image fits as well when its sum of squares is at most this multiple."""
SAME_SCALE = 1e-3
"""Relative difference from a foot within which a scale is said to be that of feet and metres."""
SCALE_DEVIATIONS = 3.0
ROUNDING = 1e-5
"""And what coordinates of a few digits leave of it."""

UNITS = {
    FOOT: "in feet where {rest} is in metres",
    1 / FOOT: "in metres where {rest} is in feet",
}


@dataclass(frozen=True)
class Fit:
    """An orientation that was tried: its sum of squares, and a33, the cosine of its tilt."""

    sum_of_squares: float
    upright: float


@dataclass(frozen=True)
class Hint:
    """What explains the residuals: a sentence, and whether it can be taken for sure."""

    text: str
    accepted: bool


Orient = Callable[[Floats], Fit | None]
"""Orients the model with changed control; None where that cannot be done."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A hypothesis and the sum of squares that it leaves."""

    text: str
    control: Floats
    sum_of_squares: float


def find(
    names: list[str],
    control: Floats,
    placed: Floats,
    *,
    sum_of_squares: float,
    rounding: float,
    degrees_of_freedom: int,
    orient: Orient,
) -> list[Hint]:
    """Try what may be wrong, and return what explains the residuals.

    `control` (n, 3) is NaN where it takes no part; `placed` is where the orientation as it is places the
    model, with its sum of squares and degrees of freedom; a sum of squares up to `rounding` is no more than
    that.
    """
    hints: list[Hint] = []
    now = sum_of_squares
    while len(hints) < MOST:
        tried = trials(names, control, placed, rounding, orient)
        verdict = judged(now, [trial.sum_of_squares for trial in tried], degrees_of_freedom)
        if verdict is None:
            break
        best = [tried[place] for place in verdict.best]
        word = "probably" if verdict.accepted else "possibly"
        what = "; or ".join(each.text for each in best)
        text = f"{word} {what}: residuals would be {verdict.fall:.3g} times smaller"
        hints.append(Hint(text, verdict.accepted))
        if not verdict.accepted:
            break
        control, now = best[0].control, best[0].sum_of_squares
    return hints


def trials(names: list[str], control: Floats, placed: Floats, rounding: float, orient: Orient) -> list[Trial]:
    """Orient the model anew with every hypothesis; those of the whole set come first. See :func:`find`."""
    return [
        Trial(text, changed, max(fit.sum_of_squares, rounding))
        for text, changed in _hypotheses(names, control, placed)
        if (fit := orient(changed)) is not None
    ]


def _hypotheses(names: list[str], control: Floats, placed: Floats) -> Iterator[tuple[str, Floats]]:
    yield (
        "the control is a mirror image of the model (X and Y exchanged, or an axis reversed, in one of them)",
        control * [1.0, 1.0, -1.0],
    )
    for factor, unit in UNITS.items():
        elevations = unit.format(rest="the plan")
        yield f"the elevations of the control are {elevations}", control * [1.0, 1.0, factor]
    rest = UNITS[FOOT].format(rest="the rest")
    yield f"X of the control is {rest}", control * [FOOT, 1.0, 1.0]
    yield f"Y of the control is {rest}", control * [1.0, FOOT, 1.0]
    suspects = _suspects(control, control - placed)
    for row in suspects:
        changes: list[tuple[str, Floats]] = []
        if np.isfinite(control[row, :2]).all():
            changes.append((f"X and Y of station {names[row]} are exchanged", control[row, [1, 0, 2]]))
        for factor, unit in UNITS.items():
            rest = unit.format(rest="the rest")
            changes.append((f"the coordinates of station {names[row]} are {rest}", control[row] * factor))
        for text, changed in changes:
            whole = control.copy()
            whole[row] = changed
            yield text, whole
    for one, other in _pairs(control, placed, suspects):
        whole = control.copy()
        whole[[one, other]] = control[[other, one]]
        yield f"the coordinates of stations {names[one]} and {names[other]} are exchanged", whole


def _pairs(control: Floats, placed: Floats, suspects: list[int]) -> list[tuple[int, int]]:
    """Return pairs of stations with the same known coordinates, those first that come nearest each other."""
    known = np.isfinite(control)
    pairs = [(one, other) for one, other in combinations(suspects, 2) if (known[one] == known[other]).all()]

    def apart(pair: tuple[int, int]) -> float:
        """Sum of squared distances when they are exchanged, less that as they are."""
        own, swapped = control[list(pair)], control[list(pair[::-1])]
        at = placed[list(pair)]
        return float(np.nansum((at - swapped) ** 2) - np.nansum((at - own) ** 2))

    return sorted(pairs, key=apart)[:PAIRS]


def _suspects(control: Floats, residuals: Floats) -> list[int]:
    """Stations to be tried: all of a few; of many those with the largest residuals and those farthest out.

    A station that is far out draws the orientation to itself, and its residual may be small.
    """
    count = len(control)
    tried = min(STATIONS, max(FEW, WORK // count))
    if count <= tried:
        return list(range(count))
    distance = np.nansum(np.abs(control - np.nanmedian(control, axis=0)), axis=1)
    size = np.nansum(np.abs(residuals), axis=1)
    worst = (np.argsort(-values)[: tried // 2].tolist() for values in (distance, size))
    return sorted({row for rows in worst for row in rows})


def unit_of(scale: float, sd: float) -> str | None:
    """Return a remark where a scale is that of feet and metres: nothing else in the data can tell these.

    Parameters
    ----------
    scale, sd
        Of the similarity x = s A X + B, model units per ground unit, and its standard deviation; NaN where
        it is not known.
    """
    for factor, units in (
        (FOOT, "in feet, the model in metres"),
        (1 / FOOT, "in metres, the model in feet"),
    ):
        near = abs(math.log(scale / factor))
        if near <= SAME_SCALE and not near > max(SCALE_DEVIATIONS * sd / scale, ROUNDING):
            return (
                f"the scale is {scale:.6f}, as of control {units}: where both should be in one unit, one of"
                " them is not"
            )
    return None


def undecided(control: Floats, fit: Fit, rounding: float, orient: Orient) -> str | None:
    """Say so where a mirror image of the model fits as well: control in a plane cannot tell it.

    `control` (n, 3) is NaN where it takes no part; a sum of squares up to `rounding` is no more than that.
    """
    mirrored = orient(control * [1.0, 1.0, -1.0])
    if mirrored is None or mirrored.sum_of_squares > AS_WELL * fit.sum_of_squares + rounding:
        return None
    text = (
        "whether the model is a mirror image of its control cannot be decided: the elevations are those of"
        " points in one plane, as far as the residuals tell"
    )
    # Mirrored, the third axis points the other way.
    if fit.upright < 0 < -mirrored.upright:
        text += "; as it is the model lies upside down, mirrored it would lie upright"
    return text
