"""Numbers along an axis: steps of 1, 2 or 5, as many as there is room for."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.show.sketch.letters import widest

MAX_STEPS = 8
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True, eq=False)
class Ticks:
    """Values along an axis and how they are written; `power`, if any, goes with the name of the axis."""

    values: Floats
    texts: list[str]
    power: str = ""

    def signed(self, decimal: str) -> Ticks:
        """Return the same with the decimal sign of a language."""
        return Ticks(self.values, [text.replace(".", decimal) for text in self.texts], self.power)


def ticks(limits: Floats, length: float, size: float, *, across: bool, log: bool = False) -> Ticks:
    """Return the ticks of an axis with (2,) limits; `length` of the axis and `size` of letters are points.

    Numbers `across` are side by side. Logarithmic axes have 1, 2, 5 times powers of ten.
    """
    low, high = sorted(limits.tolist())
    if log and (ratios := _ratios(low, high, length, size, across=across)):
        return ratios
    extent = high - low
    if not extent > 0:
        return _written(np.array([low]), extent)
    least = extent / MAX_STEPS if across else max(extent / MAX_STEPS, 2.6 * size / max(length, 1e-9) * extent)
    power = 10.0 ** math.floor(math.log10(least))
    for step in (power * factor for factor in (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)):
        values = step * np.arange(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
        if len(values) < 2:
            # An axis that is too short for two of these has its ends, or one of them.
            ends = _written(np.array([low, high]), step / 10.0)
            fit = not across or widest(ends.texts, size) + size < length
            return ends if fit else _written(ends.values[:1], step / 10.0)
        found = _written(values, step)
        fits = not across or widest(found.texts, size) + 1.6 * size < step / extent * length
        if step >= least * (1 - 1e-9) and fits:
            break
    return found


def _ratios(low: float, high: float, length: float, size: float, *, across: bool) -> Ticks | None:
    """Return ticks of a logarithmic axis, as many as there is room for; None where that is fewer than two."""
    powers = 10.0 ** np.arange(math.floor(math.log10(low)), math.floor(math.log10(high)) + 1)
    for steps in ((1.0, 2.0, 5.0), (1.0, 5.0), (1.0,)):
        every = np.outer(powers, steps).ravel()
        values = every[(every >= low * (1 - 1e-9)) & (every <= high * (1 + 1e-9))]
        found = Ticks(values, [f"{value:g}" for value in values.tolist()])
        places = np.log(values) / math.log(high / low) * length
        room = widest(found.texts, size) + 0.8 * size if across else 1.6 * size
        if len(values) > 1 and (np.diff(places) > room).all():
            return found
    return None


def _written(values: Floats, step: float) -> Ticks:
    largest = float(np.abs(values).max())
    power = 0
    if largest > 0 and not 1e-3 <= largest < 1e8:
        power = math.floor(math.log10(largest))
    decimals = max(0, power - math.floor(math.log10(step) + 1e-9)) if step > 0 else 0
    texts = [f"{value / 10.0**power:.{min(decimals, 15)}f}" for value in values.tolist()]
    texts = [text.lstrip("-") if not text.strip("-0.") else text.replace("-", "−") for text in texts]
    return Ticks(values, texts, f"10{str(power).translate(SUPERSCRIPT)}" if power else "")
