"""An aerial block with GNSS and an inertial unit: lever arm, shifts and drifts of strips, boresight.

Three strips of five photos and a cross strip, four control points. What the instruments are off by is unknown
and adjusted with the block. Prints what was found of it.
"""

from __future__ import annotations

import numpy as np

from photogram import Attitudes, Block, LeverArm, Position, Result, adjust
from photogram.network import (
    Attitude,
    Boresight,
    Control,
    Drift,
    Observation,
    Shift,
    project,
    rotation_matrix,
)

PRINCIPAL_DISTANCE = -100.0
IMAGE_SD = 0.005
"""Millimetres."""
HEIGHT = 1000.0
"""Metres, as all that follows."""
GNSS_SD = 0.05
CONTROL_SD = 0.03
LEVER_ARM_SD = 0.02
"""It was measured in the aircraft."""
IMU_SD = 2e-4
"""Radians."""
TRUTH = {
    "lever arm": np.array([0.12, -0.35, 1.2]),
    "boresight": np.array([0.004, -0.006, 0.011]),
}
"""Metres in the axes of the photo; a rotation vector in radians."""
SHIFTS = np.array([[0.3, -0.2, 0.5], [-0.4, 0.1, 0.3], [0.2, 0.3, -0.2], [0.1, -0.3, 0.4]])
DRIFTS = 0.005 * np.array([[1.0, -1, 0.5], [0.3, 1, -1], [-1, 0.5, 1], [0.5, 0.5, -0.5]])
"""Of each strip, metres and metres a second."""


def flight() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return strips, positions and angles of the photos; strips are flown to and fro, the last across."""
    strips, positions, kappas = [], [], []
    for strip, heading in enumerate((0.0, np.pi, 0.0, np.pi / 2)):
        for k in range(5):
            along, across = 400.0 * k, 700.0 * strip
            place = [800.0, 350.0 * k, HEIGHT] if strip == 3 else [along, across, HEIGHT]
            strips.append(strip)
            positions.append(place)
            kappas.append(heading)
    tilts = 0.04 * np.sin(np.arange(40.0).reshape(20, 2) ** 2)
    return np.array(strips), np.array(positions), np.column_stack([tilts, kappas])


def _lever_arm(random: np.random.Generator) -> LeverArm:
    """Return the lever arm as it was measured."""
    return LeverArm("antenna", TRUTH["lever arm"] + LEVER_ARM_SD * random.standard_normal(3), LEVER_ARM_SD)


def measured(seed: int = 3) -> Block:
    """Return the block with its measurements, errors drawn with the given seed."""
    random = np.random.default_rng(seed)
    strips, positions, angles = flight()
    grid = np.stack(np.meshgrid(np.arange(-300, 2000, 220.0), np.arange(-300, 1800, 220.0)), axis=-1)
    plan = grid.reshape(-1, 2)
    points = np.column_stack([plan, 40 * np.sin(plan[:, 0] / 300) * np.cos(plan[:, 1] / 400)])
    photos, seen = (each.ravel() for each in np.indices((len(positions), len(points))))
    distances = np.full(len(positions), PRINCIPAL_DISTANCE)
    xy = project(points[seen], positions[photos], angles[photos], distances[photos])
    inside = np.abs(xy).max(axis=1) < 60
    photos, seen, xy = photos[inside], seen[inside], xy[inside]

    photo_ids = [f"{strip + 1}{k + 1}" for strip in range(4) for k in range(5)]
    point_ids = [f"P{k}" for k in range(len(points))]
    lever_arm, boresight = _lever_arm(random), Boresight("unit")
    shifts, drifts = ([kind(f"strip {k + 1}") for k in range(4)] for kind in (Shift, Drift))
    turned = rotation_matrix(angles).transpose(0, 2, 1)
    matrix = Attitudes.of("rotation_vector", TRUTH["boresight"][np.newaxis]).matrices[0]
    observations: list[Observation] = []
    for k, strip in enumerate(strips):
        time = 8.0 * (k % 5)
        antenna = (
            positions[k] + turned[k] @ TRUTH["lever arm"] + SHIFTS[strip] + (time - 16.0) * DRIFTS[strip]
        )
        observations.append(
            Position(
                photo_ids[k],
                antenna + GNSS_SD * random.standard_normal(3),
                sd=GNSS_SD,
                lever_arm=lever_arm,
                shift=shifts[strip],
                drift=drifts[strip],
                time=time,
            )
        )
        error = Attitudes.of("rotation_vector", IMU_SD * random.standard_normal((1, 3))).matrices[0]
        attitude = turned[k] @ matrix @ error
        observations.append(Attitude(photo_ids[k], attitude, sd=IMU_SD, boresight=boresight))
    for corner in ((0, 0), (1600, 0), (0, 1400), (1600, 1400)):
        nearest = int(np.hypot(*(plan - corner).T).argmin())
        place = points[nearest] + CONTROL_SD * random.standard_normal(3)
        observations.append(Control(point_ids[nearest], place, sd=CONTROL_SD))
    return Block(
        photo_ids=photo_ids,
        photo_positions=positions + random.normal(0, 5, positions.shape),
        photo_attitudes=angles + random.normal(0, 0.01, angles.shape),
        principal_distances=distances,
        point_ids=point_ids,
        point_positions=np.full(points.shape, np.nan),
        image_photos=photos,
        image_points=seen,
        image_xy=xy + IMAGE_SD * random.standard_normal(xy.shape),
        image_sd=np.full(xy.shape, IMAGE_SD),
        title="GNSS and an inertial unit",
        observations=observations,
    )


def main() -> Result:
    """Adjust the block and print what was found of the instruments."""
    result = adjust(measured())
    columns = ["kind", "unknown", "component", "unit", "value", "sd"]
    print(result.unknown_table()[columns].to_string(index=False, float_format="%.5f"))
    return result


if __name__ == "__main__":
    main()
