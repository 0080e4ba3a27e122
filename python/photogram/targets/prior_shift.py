"""What weak priors of cameras have moved: the bias that they bring, over standard deviations."""

from __future__ import annotations

import numpy as np

from photogram.show.quantity import Axis, Quantity
from photogram.targets.calibration_result import Calibrated

__all__ = ["moved_lines", "prior_shift"]

NOTABLE = 0.2
"""Of a standard deviation: what moves less is no matter."""


def prior_shift(calibrated: Calibrated) -> list[Quantity]:
    """Return how far priors moved each unknown parameter, and that over its sd; nothing without priors.

    The adjustment without the priors is where the one with them began.
    """
    before = calibrated.unregularised
    if before is None:
        return []
    names, changes, axes = list[str](), list[float](), list[Axis]()
    of_sd = list[float]()
    for own, free in zip(calibrated.cameras, before.cameras, strict=True):
        for k in own.estimated:
            names.append(f"{own.name} {own.names[k]}")
            axes.append(Axis.of(own.names[k], own.camera.unit_of(own.names[k])))
            changes.append(float(own.values[k] - free.values[k]))
            of_sd.append(changes[-1] / float(own.sd[k]))
    return [
        Quantity(np.array(names, dtype=object), (), "name", "parameter", "parameter", head="Parameter"),
        Quantity(
            np.array(changes), tuple(axes), "value", None, "change", head="Moved", of=np.arange(len(names))
        ),
        Quantity(np.array(of_sd), (), "number", None, "over_sd", head="Over its sd"),
    ]


def moved_lines(calibrated: Calibrated) -> list[str]:
    """Return the largest of it in a line for each parameter that moved by more than a fifth of its sd."""
    table = prior_shift(calibrated)
    if not table:
        return []
    names, changes, of_sd = (each.values for each in table)
    largest = int(np.argmax(np.abs(of_sd)))
    lines = [f"largest: {names[largest]} by {of_sd[largest]:+.2f} of its standard deviation"]
    return lines + [
        f"{name} moved by {change:+.3g}, {over:+.2f} of its standard deviation"
        for name, change, over in zip(names, changes, of_sd, strict=True)
        if abs(over) > NOTABLE
    ]
