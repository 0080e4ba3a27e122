"""What is known of cameras over years, quantity by quantity."""

from __future__ import annotations

import numpy as np

from photogram.film.years.comparison import CameraComparison
from photogram.show.quantity import Axis, Quantity

__all__ = ["calibrations"]

ANGLE = (Axis.turned("", "deg"),)


def calibrations(comparison: CameraComparison) -> list[Quantity]:
    """Return the calibrations: days, cameras, models, up to which angle."""
    found = comparison.calibrations
    angles = np.array([np.nan if each.angle is None else each.angle for each in found])
    return [
        Quantity([each.day.isoformat() for each in found], kind="name", member="day", head="Day"),
        Quantity([each.camera.title for each in found], kind="name", member="camera", head="Camera"),
        Quantity([each.camera.model for each in found], kind="name", member="model", head="Model"),
        Quantity(angles, ANGLE, "value", member="angle_rad", head="Up to", decimals=1),
        Quantity([each.source for each in found], kind="name", member="source", head="From"),
    ]
