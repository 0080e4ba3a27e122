"""A camera calibrated while it measures: twelve convergent photos of a small test field, four control points.

Only the principal distance of the lens is known beforehand, to a millimetre. Prints the part of the report on
the camera; a file name as argument gets the picture of its distortion.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from photogram import Attitudes, Block, Camera, Result, adjust
from photogram.network import project

IMAGE_SD = 0.001
"""Millimetres."""
TRUTH = Camera(
    "brown",
    {"c": -24.3, "xp": 0.08, "yp": -0.05, "K1": -1.6e-4, "K2": 2.0e-7, "P1": 1.5e-5, "P2": -1.0e-5},
)
"""The lens that is to be found; c is negative for the positive plane."""
START = Camera(
    "brown",
    {"c": -25.0},
    sd=dict.fromkeys(("c", "xp", "yp", "K1", "K2", "K3", "P1", "P2"), np.inf),
    name="24 mm lens",
)


def poses() -> tuple[np.ndarray, np.ndarray]:
    """Return twelve stations around the field, looking at its middle, and matrices from photo to object.

    Every other photo is turned by 90 degrees about its axis: that tells the principal point from the tilts.
    """
    turns = np.radians(30.0 * np.arange(12))
    heights = np.where(np.arange(12) % 3 == 0, 4.0, 2.5)
    stations = np.column_stack([2.2 * np.cos(turns), 2.2 * np.sin(turns), heights])
    z = stations / np.linalg.norm(stations, axis=1, keepdims=True)
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(z, x)
    turned = (np.arange(12) % 2 == 1)[:, np.newaxis]
    return stations, np.stack([np.where(turned, y, x), np.where(turned, -x, y), z], axis=2)


def measured(seed: int = 11) -> Block:
    """Return the block with its measurements, errors drawn with the given seed."""
    random = np.random.default_rng(seed)
    corners = np.array([[x, y] for x in np.linspace(-1.4, 1.4, 9) for y in np.linspace(-1.0, 1.0, 7)])
    points = np.column_stack([corners, random.uniform(-0.3, 0.3, len(corners))])
    stations, matrices = poses()
    attitudes = Attitudes(matrices).values("omega_phi_kappa")
    photos, seen = (each.ravel() for each in np.indices((len(stations), len(points))))
    # With a principal distance of -1 an image is the direction of its ray.
    ideal = project(points[seen], stations[photos], attitudes[photos], np.full(len(photos), -1.0))
    xy = TRUTH.project(np.column_stack([ideal, np.full(len(ideal), -1.0)]))
    inside = (np.abs(xy) < [18.0, 12.0]).all(axis=1)
    photos, seen, xy = photos[inside], seen[inside], xy[inside]

    control = np.isin(np.arange(len(points)), [0, 6, 56, 62])
    shift = Attitudes.of("rotation_vector", random.normal(0, 0.02, (len(stations), 3))).matrices
    return Block(
        photo_ids=[f"photo {i}" for i in range(1, 13)],
        photo_positions=stations + random.normal(0, 0.05, stations.shape),
        photo_attitudes=Attitudes(matrices @ shift).values("omega_phi_kappa"),
        cameras=[START],
        point_ids=[f"P{i}" for i in range(len(points))],
        point_positions=np.where(
            control[:, np.newaxis], points + random.normal(0, 1e-4, points.shape), np.nan
        ),
        point_sd=np.where(control, 1e-4, np.inf)[:, np.newaxis] * np.ones(3),
        image_photos=photos,
        image_points=seen,
        image_xy=xy + random.normal(0, IMAGE_SD, xy.shape),
        image_sd=np.full(xy.shape, IMAGE_SD),
        title="a test field",
    )


def main(picture: Path | None = None) -> Result:
    """Adjust the block and print what the report says of the camera."""
    result = adjust(measured())
    report = result.report()
    start = report.index("\nCameras\n") + 1
    print(report[start : report.index("\n\nPhotos\n", start)])
    if picture is not None:
        from photogram.results import plot_distortion

        plot_distortion(result, result.cameras[0]).save(picture)
    return result


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
