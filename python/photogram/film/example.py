"""Simulated certificates of one camera over fifteen years with a step of the principal distance."""

from __future__ import annotations

from datetime import date

import numpy as np

from photogram.film.certificate import Certificate
from photogram.film.lens_table import RadialTable

DAYS = ("1974-03-12", "1977-05-03", "1980-02-27", "1983-05-11", "1986-04-08", "1989-06-20")
ANGLES = (7.5, 15.0, 22.7, 30.0, 35.0, 40.0)
FOCAL_LENGTH, STEP = 152.375, 0.015  # Millimetres; a repair before the fourth certificate causes the step
CURVE = (-3.1e-4, 3.8e-8, -1.0e-12)
POINT = (0.004, -0.012)
SD_READING, SD_FOCAL_LENGTH, SD_POINT = 1.5e-3, 0.003, 0.003


def simulated_certificates() -> list[Certificate]:
    """Simulate six calibrations of a camera; readings are printed to a micrometre."""
    rng = np.random.default_rng(1974)
    angle = np.radians(ANGLES)
    found = []
    for k, day in enumerate(DAYS):
        true = FOCAL_LENGTH + (STEP if k >= 3 else 0.0)
        # The focal length has its own error; the table refers to the printed value.
        printed = round(rng.normal(true, SD_FOCAL_LENGTH), 3)
        curve = (printed * np.tan(angle))[:, np.newaxis] ** [1, 3, 5] @ np.array(CURVE)
        distortion = rng.normal(curve, SD_READING)
        x, y = np.round(rng.normal(POINT, SD_POINT), 3).tolist()
        found.append(
            Certificate(
                name="rc10-2345",
                camera_type="Wild RC10",
                day=date.fromisoformat(day),
                c=printed,
                autocollimation=(x, y),
                places={"ml": (-110.0, 0.0), "mr": (110.0, 0.0)},
                radial=RadialTable(angle, np.round(distortion, 3), SD_READING),
            )
        )
    return found
