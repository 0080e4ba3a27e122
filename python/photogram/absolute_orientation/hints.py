"""What may be wrong with control that does not fit its model, found by trying it.

A hypothesis changes the control: a mirror image, elevations in another unit, coordinates exchanged at one
station. The model is oriented anew with each; one that explains the residuals makes their sum of squares fall
by far more than chance and the number of trials allow (likelihood ratio f ln(Omega_0 / Omega_h)).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from photogram.arguments.types import Floats

__all__ = ["Fit", "Hint", "find", "undecided"]


FOOT = 0.3048
IMPROVEMENT = 25.0
"""The sum of squares must fall by this factor at least: residuals to a fifth."""
CHANCE = 1e-4
"""Probability that any of the hypotheses tried is accepted by chance, about."""
RIVAL = 10.0
"""And all others must be less likely by this difference of f ln Omega."""
TESTED = 4
"""Degrees of freedom from which a hypothesis can be accepted and not only be possible."""
STATIONS = 60
"""Stations that are tried one by one, at the most."""
WORK = 20_000
"""Of many stations fewer are tried, so that about as many are oriented anew altogether, but always a few."""
FEW = 6
MOST = 5
"""Hypotheses accepted one upon the other, at the most."""
AS_WELL = 4.0
"""A mirror image fits as well when its sum of squares is at most this multiple."""

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
class _Trial:
    text: str
    control: Floats
    sum_of_squares: float


def find(
    names: list[str],
    control: Floats,
    residuals: Floats,
    *,
    sum_of_squares: float,
    rounding: float,
    degrees_of_freedom: int,
    orient: Orient,
) -> list[Hint]:
    """Try what may be wrong, and return what explains the residuals.

    Parameters
    ----------
    names, control, residuals
        n identifiers, (n, 3) control coordinates that take part, NaN elsewhere, and their residuals.
    sum_of_squares, degrees_of_freedom
        Of the orientation as it is.
    rounding
        A sum of squares that is no more than rounding.
    orient
        Orients anew.
    """
    hints: list[Hint] = []
    now = sum_of_squares
    while len(hints) < MOST:
        trials = [
            _Trial(text, changed, max(fit.sum_of_squares, rounding))
            for text, changed in _hypotheses(names, control, residuals)
            if (fit := orient(changed)) is not None
        ]
        trials.sort(key=lambda trial: trial.sum_of_squares)
        if not trials or not now > IMPROVEMENT * trials[0].sum_of_squares:
            break
        best = trials[0]

        def likelihood(ratio: float) -> float:
            return degrees_of_freedom * math.log(ratio)

        sure = (
            degrees_of_freedom >= TESTED
            and likelihood(now / best.sum_of_squares) > 2 * math.log(len(trials) / CHANCE)
            and all(likelihood(trial.sum_of_squares / best.sum_of_squares) > RIVAL for trial in trials[1:2])
        )
        fall = math.sqrt(now / best.sum_of_squares)
        word = "probably" if sure else "possibly"
        hints.append(Hint(f"{word} {best.text}: residuals would be {fall:.3g} times smaller", sure))
        if not sure:
            break
        control, now = best.control, best.sum_of_squares
    return hints


def _hypotheses(names: list[str], control: Floats, residuals: Floats) -> Iterator[tuple[str, Floats]]:
    """Return hypotheses with the control changed by each; those of the whole set come first."""
    yield (
        "the control is a mirror image of the model (X and Y exchanged, or an axis reversed, in one of them)",
        control * [1.0, 1.0, -1.0],
    )
    for factor, unit in UNITS.items():
        elevations = unit.format(rest="the plan")
        yield f"the elevations of the control are {elevations}", control * [1.0, 1.0, factor]
    for row in _suspects(control, residuals):
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


def undecided(control: Floats, fit: Fit, rounding: float, orient: Orient) -> str | None:
    """Say so where a mirror image of the model fits as well: control in a plane cannot tell it.

    Parameters
    ----------
    control
        (n, 3) control coordinates that take part, NaN elsewhere.
    fit
        The orientation as it is.
    rounding
        A sum of squares that is no more than rounding.
    orient
        Orients anew.
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
