"""Hypotheses on mistakes in control that does not fit its model, tested by trial.

A hypothesis changes the control: a mirror image, elevations in another unit, coordinates exchanged at one
station. The model is oriented again for each. A hypothesis is accepted if the sum of squares decreases by far
more than chance and the number of trials allow (likelihood ratio f ln(Omega_0 / Omega_h)).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.likelihood import judged
from photogram.words import Phrase, phrase

FOOT = 0.3048
STATIONS = 60  # Maximum number of stations that are tried one by one
WORK = 20_000
"""With many stations fewer are tried, at least FEW, so that the total work is limited."""
FEW = 6
PAIRS = 60
"""Maximum number of tried exchanges; pairs near each other's positions are preferred."""
MOST = 5  # Maximum number of successive hypotheses
AS_WELL = 4.0  # A mirror image fits as well if its sum of squares is at most this multiple
SAME_SCALE = 1e-3  # Relative difference from the ratio of feet and metres
SCALE_DEVIATIONS = 3.0
ROUNDING = 1e-5  # The same for coordinates of a few digits

UNITS = {FOOT: "feet", 1 / FOOT: "metres"}


@dataclass(frozen=True)
class Fit:
    """A trial orientation: its sum of squares, and a33, the cosine of its tilt."""

    sum_of_squares: float
    upright: float


@dataclass(frozen=True)
class Hint:
    """An explanation of the residuals."""

    message: Phrase
    accepted: bool  # Whether it is significant


Orient = Callable[[Floats], Fit | None]
"""Orients the model with changed control; returns None on failure."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A hypothesis and its sum of squares."""

    text: Phrase
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
    """Try possible mistakes and return the ones that explain the residuals.

    `control` (n, 3) is NaN if not used. `placed` are the control coordinates of the model by the given
    orientation, with its sum of squares and degrees of freedom. A sum of squares up to `rounding` is rounding
    only.
    """
    hints: list[Hint] = []
    now = sum_of_squares
    while len(hints) < MOST:
        tried = trials(names, control, placed, rounding, orient)
        verdict = judged(now, [trial.sum_of_squares for trial in tried], degrees_of_freedom)
        if verdict is None:
            break
        best = [tried[place] for place in verdict.best]
        kind = "probable" if verdict.accepted else "possible"
        causes = [trial.text for trial in best]
        text = phrase(f"orientation.{kind}", causes=causes, factor=float(verdict.fall))
        hints.append(Hint(text, verdict.accepted))
        if not verdict.accepted:
            break
        control, now = best[0].control, best[0].sum_of_squares
    return hints


def trials(names: list[str], control: Floats, placed: Floats, rounding: float, orient: Orient) -> list[Trial]:
    """Orient the model by hypotheses, mistakes of the set first; see :func:`find`."""
    return [
        Trial(text, changed, max(fit.sum_of_squares, rounding))
        for text, changed in _hypotheses(names, control, placed)
        if (fit := orient(changed)) is not None
    ]


def _hypotheses(names: list[str], control: Floats, placed: Floats) -> Iterator[tuple[Phrase, Floats]]:
    yield phrase("orientation.mirror"), control * [1.0, 1.0, -1.0]
    for factor, unit in UNITS.items():
        yield phrase(f"orientation.elevations-in-{unit}"), control * [1.0, 1.0, factor]
    yield phrase("orientation.axis-in-feet", axis="X"), control * [FOOT, 1.0, 1.0]
    yield phrase("orientation.axis-in-feet", axis="Y"), control * [1.0, FOOT, 1.0]
    suspects = _suspects(control, control - placed)
    for row in suspects:
        changes: list[tuple[Phrase, Floats]] = []
        if np.isfinite(control[row, :2]).all():
            exchanged = phrase("orientation.axes-exchanged", station=names[row])
            changes.append((exchanged, control[row, [1, 0, 2]]))
        for factor, unit in UNITS.items():
            in_unit = phrase(f"orientation.station-in-{unit}", station=names[row])
            changes.append((in_unit, control[row] * factor))
        for text, changed in changes:
            whole = control.copy()
            whole[row] = changed
            yield text, whole
    for one, other in _pairs(control, placed, suspects):
        whole = control.copy()
        whole[[one, other]] = control[[other, one]]
        yield phrase("orientation.stations-exchanged", first=names[one], second=names[other]), whole


def _pairs(control: Floats, placed: Floats, suspects: list[int]) -> list[tuple[int, int]]:
    """Return station pairs with equal known components, the closest first."""
    known = np.isfinite(control)
    pairs = [(one, other) for one, other in combinations(suspects, 2) if (known[one] == known[other]).all()]

    def apart(pair: tuple[int, int]) -> float:
        own, swapped = control[list(pair)], control[list(pair[::-1])]
        at = placed[list(pair)]
        return float(np.nansum((at - swapped) ** 2) - np.nansum((at - own) ** 2))

    return sorted(pairs, key=apart)[:PAIRS]


def _suspects(control: Floats, residuals: Floats) -> list[int]:
    """Return stations to be tried: all, or large residuals and distant ones.

    A distant station attracts the orientation, and its residual may be small.
    """
    count = len(control)
    tried = min(STATIONS, max(FEW, WORK // count))
    if count <= tried:
        return list(range(count))
    distance = np.nansum(np.abs(control - np.nanmedian(control, axis=0)), axis=1)
    size = np.nansum(np.abs(residuals), axis=1)
    worst = (np.argsort(-values)[: tried // 2].tolist() for values in (distance, size))
    return sorted({row for rows in worst for row in rows})


def unit_of(scale: float, sd: float) -> Phrase | None:
    """Return a message if a scale within its sd is the ratio of feet and metres."""
    for factor, unit in UNITS.items():
        near = abs(math.log(scale / factor))
        if near <= SAME_SCALE and not near > max(SCALE_DEVIATIONS * sd / scale, ROUNDING):
            return phrase(f"orientation.scale-in-{unit}", scale=scale)
    return None


def undecided(control: Floats, fit: Fit, rounding: float, orient: Orient) -> Phrase | None:
    """Return a message if a mirrored model fits as well, with control in a plane.

    `control` (n, 3) is NaN if it is not used; a sum of squares up to `rounding` is rounding only.
    """
    mirrored = orient(control * [1.0, 1.0, -1.0])
    if mirrored is None or mirrored.sum_of_squares > AS_WELL * fit.sum_of_squares + rounding:
        return None
    # In the mirror image, the third axis has the opposite direction.
    is_upside_down = fit.upright < 0 < -mirrored.upright
    return phrase("orientation.plane.upside-down" if is_upside_down else "orientation.plane")
