"""A small object whose size comes from a scale bar, its place from GNSS, its tilt from points at one height.

Five photos look at sixteen points from three metres; there is no control. Prints the report's section on the
observations beside images, and how well the points are known.
"""

from __future__ import annotations

import numpy as np

from photogram import Block, Distance, Position, Result, adjust
from photogram.network import Attitude, EqualHeight, Observation, project, rotation_matrix

IMAGE_SD = 0.001
"""Millimetres."""
LEVER_ARM = np.array([0.05, -0.1, 0.2])
"""From the projection centre to the antenna, metres in the axes of the photo."""


def measured(seed: int = 7) -> Block:
    """Return the block with its measurements, errors drawn with the given seed."""
    random = np.random.default_rng(seed)
    corners = np.array([[x, y] for x in (-0.6, -0.2, 0.2, 0.6) for y in (-0.6, -0.2, 0.2, 0.6)])
    points = np.column_stack([corners, 0.1 * np.sin(7 * corners[:, 0] + 3 * corners[:, 1])])
    points[3:5, 2] = points[0, 2]
    stations = np.array([[0, 0, 3.0], [1.2, 0, 3], [-1.2, 0, 3], [0, 1.2, 3], [0, -1.2, 3]])
    attitudes = np.column_stack(
        [-np.arctan2(stations[:, 1], 3), np.arctan2(stations[:, 0], 3), 0.7 * np.arange(5)]
    )
    photos, seen = np.repeat(np.arange(5), 16), np.tile(np.arange(16), 5)
    xy = project(points[seen], stations[photos], attitudes[photos], np.full(80, -50.0))

    photo_ids, point_ids = [f"photo {i}" for i in range(5)], [f"P{i}" for i in range(16)]
    length = float(np.linalg.norm(points[15] - points[0])) + 2e-5 * random.standard_normal()
    observations: list[Observation] = [Distance("P0", "P15", length, sd=2e-5)]
    errors = 1e-4 * random.standard_normal(2)
    observations += [
        EqualHeight("P0", other, sd=1e-4, difference=float(error))
        for other, error in zip(("P3", "P4"), errors, strict=True)
    ]
    to_ground = rotation_matrix(attitudes).transpose(0, 2, 1)
    for photo, station, turned in zip(photo_ids, stations, to_ground, strict=True):
        antenna = station + turned @ LEVER_ARM + 0.02 * random.standard_normal(3)
        observations.append(Position(photo, antenna, sd=0.02, lever_arm=LEVER_ARM))
        error = rotation_matrix(2e-3 * random.standard_normal((1, 3)))[0]
        observations.append(Attitude(photo, turned @ error, sd=2e-3))
    return Block(
        photo_ids=photo_ids,
        photo_positions=stations + 0.03,
        photo_attitudes=attitudes + 0.01,
        principal_distances=np.full(5, -50.0),
        point_ids=point_ids,
        point_positions=np.full((16, 3), np.nan),
        image_photos=photos,
        image_points=seen,
        image_xy=xy + IMAGE_SD * random.standard_normal(xy.shape),
        image_sd=np.full(xy.shape, IMAGE_SD),
        title="a scale bar, GNSS and levelled points",
        observations=observations,
    )


def main() -> Result:
    """Adjust the block and print what has become of the observations."""
    result = adjust(measured())
    print(result.observation_table().to_string(index=False, float_format="%.5f"))
    sd = 1e6 * result.point_sd.mean(axis=0)
    print(f"mean standard deviations of points: {sd[0]:.0f} {sd[1]:.0f} {sd[2]:.0f} um")
    return result


if __name__ == "__main__":
    main()
