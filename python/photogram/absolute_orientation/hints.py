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


Fit = tuple[float, float]
"""Of a trial orientation: its sum of squares, and a33, the cosine of its tilt."""
Orient = Callable[[Floats], Fit | None]
"""Orients the model with changed control; returns None on failure."""
Trial = tuple[Phrase, Floats, float]
"""A hypothesis, its control, and its sum of squares."""


def find(
    names: list[str],
    control: Floats,
    placed: Floats,
    *,
    sum_of_squares: float,
    rounding: float,
    degrees_of_freedom: int,
    orient: Orient,
) -> list[tuple[Phrase, bool]]:
    """Try possible mistakes and return the ones that explain the residuals, and whether significantly.

    `control` (n, 3) is NaN if not used. `placed` are the control coordinates of the model by the given
    orientation, with its sum of squares and degrees of freedom. A sum of squares up to `rounding` is rounding
    only.
    """
    hints: list[tuple[Phrase, bool]] = []
    now = sum_of_squares
    while len(hints) < MOST:
        tried = trials(names, control, placed, rounding, orient)
        verdict = judged(now, [squares for *_, squares in tried], degrees_of_freedom)
        if verdict is None:
            break
        best = [tried[place] for place in verdict.best]
        kind = "probable" if verdict.accepted else "possible"
        causes = [text for text, *_ in best]
        text = phrase(f"orientation.{kind}", causes=causes, factor=float(verdict.fall))
        hints.append((text, verdict.accepted))
        if not verdict.accepted:
            break
        _, control, now = best[0]
    return hints


def trials(names: list[str], control: Floats, placed: Floats, rounding: float, orient: Orient) -> list[Trial]:
    """Orient the model by hypotheses, mistakes of the set first; see :func:`find`."""
    return [
        (text, changed, max(fit[0], rounding))
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
        changes = {"axes-exchanged": control[row, [1, 0, 2]]} if np.isfinite(control[row, :2]).all() else {}
        changes |= {f"station-in-{unit}": control[row] * factor for factor, unit in UNITS.items()}
        for code, changed in changes.items():
            whole = control.copy()
            whole[row] = changed
            yield phrase(f"orientation.{code}", station=names[row]), whole
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
    if mirrored is None or mirrored[0] > AS_WELL * fit[0] + rounding:
        return None
    # In the mirror image, the third axis has the opposite direction.
    is_upside_down = fit[1] < 0 < -mirrored[1]
    return phrase("orientation.plane.upside-down" if is_upside_down else "orientation.plane")
