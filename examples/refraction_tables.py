"""Print the tables of docs/refraction.md: how the models of refraction differ.

Run with `python examples/refraction_tables.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from photogram import Refraction
from photogram.network import project, refraction_shift

HEIGHTS_M = (500, 1000, 3000, 6000, 9000, 11000, 15000, 20000, 40000)
CAMERAS_M = (100, 1000, 4500)
DEPTHS_M = (1, 5, 20)
TANGENTS = (0.0, 0.5, 1.0)


def lift(refraction: Refraction, camera: float, across: float, point: float) -> float:
    """Return the lift of a point `across` from the nadir; `camera` and `point` are heights; metres."""
    shift = refraction_shift([[across, 0.0, point]], [[0.0, 0.0, camera]], refraction)
    return float(shift[0, 2])


def air_table() -> Iterator[str]:
    """Lines of the table of K_a at sea level, and of the lift at 45 degrees, by flying height."""
    models: tuple[Literal["giant", "standard"], ...] = ("giant", "standard")
    yield "camera       K giant  K standard  difference    lift at 45 deg: giant  standard"
    yield "     m         urad        urad        urad                        m         m"
    for height in HEIGHTS_M:
        giant, standard = (1e6 * lift(Refraction(air), height, 0, 0) / height for air in models)
        lifts = [lift(Refraction(air), height, height, 0) for air in models]
        yield (
            f"{height:6}  {giant:12.3f}{standard:12.3f}{giant - standard:12.3f}"
            f"{lifts[0]:25.4f}{lifts[1]:10.4f}"
        )


def water_table() -> Iterator[str]:
    """Lines of the table of the lift of points under water, by flying height, depth and angle."""
    models: tuple[Literal["giant", "snell"], ...] = ("giant", "snell")
    yield "camera  depth  tan alpha     lift: giant     snell  difference  shift of the image"
    yield "     m      m                          m         m           m                  um"
    for camera in CAMERAS_M:
        for depth in DEPTHS_M:
            for tangent in TANGENTS:
                across = tangent * (camera + depth)
                giant, snell = (lift(Refraction(water=water), camera, across, -depth) for water in models)
                apart = 1e3 * (image(camera, across, giant - depth) - image(camera, across, snell - depth))
                yield (
                    f"{camera:6}{depth:7}{tangent:11.1f}{giant:16.4f}{snell:10.4f}{giant - snell:12.4f}"
                    f"{apart:20.2f}"
                )


def image(camera: float, across: float, height: float) -> float:
    """Return where a vertical photograph with c = -152.74 mm has a point, in millimetres from its centre."""
    at = project([[across, 0.0, height]], [[0.0, 0.0, camera]], np.zeros((1, 3)), [-152.74])
    return float(at[0, 0])


if __name__ == "__main__":
    print("\n".join(air_table()))
    print()
    print("\n".join(water_table()))
