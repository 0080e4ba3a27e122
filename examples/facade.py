"""A facade: points on planes, on edges and at one height, distances of an instrument with scale and constant.

Eight photos, no control but the first photo's pose and the geometry of the building. Prints the surfaces and
the instrument.
"""

from __future__ import annotations

import numpy as np

from photogram import Attitudes, Block, Distance, Result, adjust
from photogram.network import (
    Difference,
    Instrument,
    Level,
    Line,
    Observation,
    OnLevel,
    OnLine,
    OnPlane,
    OnPlumbLine,
    Plane,
    PlumbLine,
    project,
)

IMAGE_SD = 0.002
"""Millimetres."""
SD = 0.001
"""Of everything that is measured at the building, metres."""
SCALE, CONSTANT = 1.0004, 0.012
"""Of the instrument."""
WALL, EDGE, GUTTER, PLINTH = range(12), range(12, 16), range(16, 21), range(21, 26)
"""The points on the wall, on its edge, on the gutter above it and on the plinth, which is level."""


def building() -> np.ndarray:
    """Return the points: X along the wall, Y into the building, Z up."""
    wall = [[x, 0.0, z] for x in (-3.0, -1.0, 1.0, 3.0) for z in (0.8, 2.2, 3.6)]
    edge = [[4.0, -0.1, z] for z in (0.4, 1.6, 2.9, 4.0)]
    gutter = [[x, -0.4, 4.5 - 0.01 * x] for x in (-3.5, -1.6, 0.2, 1.9, 3.6)]
    plinth = [[x, -0.3 - 0.1 * (x > 0), 0.3] for x in (-3.3, -1.5, 0.1, 1.7, 3.2)]
    return np.array([*wall, *edge, *gutter, *plinth])


def photographs() -> tuple[np.ndarray, np.ndarray]:
    """Return positions and angles of photos that look at the wall, turned about their axes."""
    positions, matrices = [], []
    for k in range(8):
        centre = np.array([-4.0 + 1.2 * k, -7.0 - (k % 2), 1.0 + 0.9 * (k % 3)])
        back = centre - [0.3 * centre[0], 0.0, 2.2]
        back = back / np.linalg.norm(back)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        turn = 0.5 * np.pi * (k % 2)
        axes = np.column_stack([right, np.cross(back, right), back])
        rolled = axes @ [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
        positions.append(centre)
        matrices.append(rolled)
    return np.array(positions), Attitudes(np.array(matrices)).values("omega_phi_kappa")


def measured(seed: int = 11) -> Block:
    """Return the block with its measurements, errors drawn with the given seed."""
    random = np.random.default_rng(seed)
    points, (positions, angles) = building(), photographs()
    photos, seen = (each.ravel() for each in np.indices((len(positions), len(points))))
    distances = np.full(len(positions), -28.0)
    names = [f"P{k}" for k in range(len(points))]

    def error() -> float:
        return SD * float(random.standard_normal())

    # What is on a surface is off it by its error: so are the points that were photographed.
    off = np.zeros(points.shape)
    off[list(WALL), 1] = [error() for _ in WALL]
    off[list(EDGE), :2] = [[error(), error()] for _ in EDGE]
    across = np.array([[0.01, 0.0, 1.0], [0.0, 1.0, 0.0]]) / np.sqrt([[1.0001], [1.0]])
    off[list(GUTTER)] = [np.array([error(), error()]) @ across for _ in GUTTER]
    off[list(PLINTH), 2] = [error() for _ in PLINTH]
    places = points + off
    xy = project(places[seen], positions[photos], angles[photos], distances[photos])

    wall = Plane("wall", [0.05, -1.0, 0.02], [0.0, 0.05, 2.0])
    edge = PlumbLine("edge", [4.05, -0.15, 0.0])
    gutter = Line("gutter", [1.0, 0.02, 0.0], [0.0, -0.35, 4.45])
    plinth = Level("plinth", 0.0)
    tape = Instrument("rangefinder")
    observations: list[Observation] = [OnPlane(names[k], wall, SD) for k in WALL]
    observations += [OnPlumbLine(names[k], edge, SD) for k in EDGE]
    observations += [OnLine(names[k], gutter, SD) for k in GUTTER]
    observations += [OnLevel(names[k], plinth, SD) for k in PLINTH]
    for a, b in ((0, 11), (2, 9), (12, 15), (16, 20), (21, 25), (0, 1), (1, 2), (3, 6)):
        length = SCALE * float(np.linalg.norm(places[b] - places[a])) + CONSTANT
        observations.append(Distance(names[a], names[b], length + error(), SD, instrument=tape))
    vector = places[25] - places[0] + [error() for _ in range(3)]
    observations.append(Difference(names[0], names[25], vector, sd=SD))
    fixed = np.full((len(positions), 3), np.inf)
    fixed[0] = 0.0
    start = random.normal(0, 0.02, positions.shape), random.normal(0, 0.01, angles.shape)
    start[0][0] = 0.0
    return Block(
        photo_ids=[f"photo {k}" for k in range(len(positions))],
        photo_positions=positions + start[0],
        photo_attitudes=angles + start[1],
        photo_position_sd=fixed,
        principal_distances=distances,
        point_ids=names,
        point_positions=np.full(points.shape, np.nan),
        image_photos=photos,
        image_points=seen,
        image_xy=xy + IMAGE_SD * random.standard_normal(xy.shape),
        image_sd=np.full(xy.shape, IMAGE_SD),
        title="a facade",
        observations=observations,
    )


def main() -> Result:
    """Adjust the block and print the surfaces and the instrument."""
    result = adjust(measured())
    columns = ["kind", "unknown", "component", "unit", "value", "sd"]
    print(result.unknown_table()[columns].to_string(index=False, float_format="%.5f"))
    return result


if __name__ == "__main__":
    main()
