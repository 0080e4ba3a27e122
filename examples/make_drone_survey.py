"""Write a survey by a drone as tables: 33 photos, RTK positions, five control points, four check points.

python examples/make_drone_survey.py DIRECTORY

The lens is known about, as from the camera's data sheet: its principal distance is off by one percent, its
distortion is left out. What is left to do is docs/tutorials/drone.md. The markers go to markers.csv beside
the directory.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from photogram import Attitudes, Camera
from photogram.io.csv_text import csv_text

SEED = 8
SIZE = (4000, 3000)
"""Pixels."""
TRUTH = Camera(
    "opencv",
    {
        "fx": 3652.4,
        "fy": 3652.4,
        "cx": 2013.1,
        "cy": 1489.2,
        "k1": -0.071,
        "k2": 0.038,
        "p1": 6e-4,
        "p2": -4e-4,
    },
)
DATA_SHEET = 3620.0
IMAGE_SD, GNSS_SD, CONTROL_SD = 0.4, 0.03, 0.01
"""Pixels; metres."""
PROJECT = """\
[project]
format = 1
name = "a gravel pit"
[sd]
images = 0.4
gnss = 0.03
control = 0.01
"""


def flight(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and angles of four strips of seven photos, and of a cross strip that flies higher."""
    along = [
        [14.0 * k - 42.0, 26.0 * strip - 39.0, 92.0, 0.0, 0.0, 180.0 * (strip % 2)]
        for strip in range(4)
        for k in range(7)
    ]
    across = [[0.0, 20.0 * k - 40.0, 118.0, 0.0, 0.0, 90.0] for k in range(5)]
    poses = np.array(along + across)
    poses[:, :3] += random.normal(0.0, 0.8, (len(poses), 3))
    poses[:, 3:] += random.normal(0.0, 1.5, (len(poses), 3))
    return poses[:, :3], poses[:, 3:]


def ground(random: np.random.Generator) -> tuple[list[str], np.ndarray]:
    """Return names and places of points: markers first, then what was matched."""
    markers = [[-55, -50], [55, -50], [55, 50], [-55, 50], [0, 4], [-25, -20], [28, 22], [-20, 35], [26, -30]]
    plan = np.concatenate([np.array(markers, dtype=float), random.uniform([-72, -62], [72, 62], (260, 2))])
    heights = 5.0 * np.sin(plan[:, 0] / 17.0) * np.cos(plan[:, 1] / 23.0) + random.normal(0.0, 0.4, len(plan))
    names = [f"marker-{k + 1}" for k in range(len(markers))] + [f"t{k + 1:03d}" for k in range(260)]
    return names, np.column_stack([plan, heights])


def main(arguments: list[str]) -> None:
    """Write the tables."""
    folder = Path(arguments[0])
    random = np.random.default_rng(SEED)
    positions, angles = flight(random)
    names, points = ground(random)
    photos = [f"DJI_{number:04d}" for number in range(1, len(positions) + 1)]
    rows = []
    for photo, place, matrix in zip(
        photos, positions, Attitudes.of("omega_phi_kappa", np.radians(angles)).matrices, strict=True
    ):
        exact = TRUTH.project((points - place) @ matrix)
        seen = np.flatnonzero(((exact > 15) & (exact < np.array(SIZE) - 15)).all(axis=1))
        measured = np.round(exact[seen] + random.normal(0.0, IMAGE_SD, (len(seen), 2)), 2)
        rows += [(photo, names[k], *xy) for k, xy in zip(seen.tolist(), measured.tolist(), strict=True)]
    antennas = np.round(positions + random.normal(0.0, GNSS_SD, positions.shape), 3)
    given = np.round(points[:9] + random.normal(0.0, CONTROL_SD, (9, 3)), 3)
    started = np.round(angles + random.normal(0.0, 0.5, angles.shape), 2)
    tables = {
        "cameras": {
            "camera": ["drone"],
            "model": ["opencv"],
            "width": [SIZE[0]],
            "height": [SIZE[1]],
            "f": [DATA_SHEET],
            "cx": [SIZE[0] / 2],
            "cy": [SIZE[1] / 2],
        },
        "photos": {
            "photo": photos,
            **dict(zip("xyz", antennas.T, strict=True)),
            **dict(zip(("omega", "phi", "kappa"), started.T, strict=True)),
        },
        "images": {
            name: [row[k] for row in rows] for k, name in enumerate(("photo", "point", "column", "row"))
        },
        "gnss": {"photo": photos, **dict(zip("xyz", antennas.T, strict=True))},
    }
    markers = {
        "point": names[:9],
        **dict(zip("xyz", given.T, strict=True)),
        "use": ["control"] * 5 + ["check"] * 4,
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "project.toml").write_text(PROJECT, encoding="utf-8")
    for name, columns in tables.items():
        (folder / f"{name}.csv").write_bytes(csv_text(columns))
    folder.with_name("markers.csv").write_bytes(csv_text(markers))


if __name__ == "__main__":
    main(sys.argv[1:])
