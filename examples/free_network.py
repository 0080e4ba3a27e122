"""A network without control in three datums: a photo held, inner constraints over all points, over four.

Seven photos look at twenty-five points on a table; nothing says where it is or how large. Prints the standard
deviations of the points in each datum, and what is the same in all of them.
"""

from __future__ import annotations

import numpy as np

from photogram import Block, InnerConstraints, Result, adjust
from photogram.network import project

IMAGE_SD = 0.001
"""Millimetres."""
CORNERS = ("P0", "P4", "P20", "P24")


def measured(seed: int = 5) -> Block:
    """Return the block with its measurements, errors drawn with the given seed."""
    random = np.random.default_rng(seed)
    ticks = np.linspace(-0.8, 0.8, 5)
    plan = np.array([[x, y] for y in ticks for x in ticks])
    points = np.column_stack([plan, 0.15 * np.cos(5 * plan[:, 0] - 4 * plan[:, 1])])
    stations = np.array(
        [
            [-0.5, 0, 3],
            [0.2, 0.1, 3.1],
            [0.9, 0, 3],
            [1.6, 0.2, 2.8],
            [0, 1.5, 2.9],
            [0.9, -1.4, 2.9],
            [-1.4, 0, 2.8],
        ]
    )
    attitudes = np.column_stack(
        [-np.arctan2(stations[:, 1], 3), np.arctan2(stations[:, 0], 3), 0.8 * np.arange(7)]
    )
    photos, seen = np.repeat(np.arange(7), 25), np.tile(np.arange(25), 7)
    xy = project(points[seen], stations[photos], attitudes[photos], np.full(175, -50.0))
    return Block(
        photo_ids=[str(k + 1) for k in range(7)],
        photo_positions=stations + 0.02 * random.standard_normal(stations.shape),
        photo_attitudes=attitudes + 0.01 * random.standard_normal(attitudes.shape),
        principal_distances=np.full(7, -50.0),
        point_ids=[f"P{k}" for k in range(25)],
        point_positions=points,
        image_photos=photos,
        image_points=seen,
        image_xy=xy + IMAGE_SD * random.standard_normal(xy.shape),
        image_sd=np.full(xy.shape, IMAGE_SD),
        title="a network without control",
    )


def in_three_datums() -> list[Result]:
    """Adjust the block once, and take it to two other datums without adjusting again."""
    minimum = adjust(measured())
    return [minimum, minimum.in_datum(InnerConstraints()), minimum.in_datum(InnerConstraints(points=CORNERS))]


def main() -> list[Result]:
    """Print the standard deviations of points in three datums."""
    results = in_three_datums()
    for result in results:
        print(result.datum)
        sd = 1e6 * result.point_sd
        root = np.sqrt((sd**2).mean(axis=0))
        print(f"  points, root mean square   {root[0]:8.1f} {root[1]:8.1f} {root[2]:8.1f} um")
        corners = [result.block.point_ids.index(name) for name in CORNERS]
        root = np.sqrt((sd[corners] ** 2).mean(axis=0))
        print(f"  of these the corners       {root[0]:8.1f} {root[1]:8.1f} {root[2]:8.1f} um")
        print(f"  sum of redundancy numbers  {result.redundancy.sum():.6f}")
    relative = results[0].relative_to(photo="2")
    sd = 1e6 * relative.photo_sd[:, :3]
    print(f"stations relative to photo 2, greatest sd: {sd.max():.1f} um")
    return results


if __name__ == "__main__":
    main()
