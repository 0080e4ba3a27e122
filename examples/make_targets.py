"""Build the packaged example `flange`, which `photogram new --kind metrology` writes.

    python examples/make_targets.py [DIRECTORY]

A close-range survey as tables: targets on a flange, two scale bars, no control, an unknown lens. Sixteen
photos from 1.6 m, convergent, every other one turned by 90 degrees. What is left to do is
docs/tutorials/metrology.md.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from photogram import Camera
from photogram.io.csv_text import csv_text

SEED = 22
SIZE = (6000, 4000)
"""Pixels, of 0.006 mm."""
TRUTH = Camera(
    "opencv",
    {
        "fx": 4712.6,
        "fy": 4712.6,
        "cx": 3014.8,
        "cy": 1989.1,
        "k1": -0.112,
        "k2": 0.094,
        "p1": 3e-4,
        "p2": -5e-4,
    },
)
IMAGE_SD, BAR_SD = 0.06, 5e-6
"""Pixels; metres, of the calibrated lengths of the bars."""
DIAMETER = 0.40006
"""Of the circle of holes, metres."""
EXAMPLE = Path(__file__).resolve().parents[1] / "python" / "photogram" / "examples" / "flange"
PROJECT = """\
# Targets on a part, photographed from all around; scale bars, no control. Replace the tables by your own:
# `photogram adjust .` adjusts it; docs/tutorials/metrology.md goes on to a decision, docs/formats.md has all.
# cameras.csv: sd_NAME = inf makes a parameter of the lens unknown. photos.csv: nothing need be known of them.
# images.csv: centres of targets in pixels. distances.csv: the certified lengths of the bars.
[project]
format = 1
name = "a flange"
[sd]
images = 0.06                       # pixels: centres of ellipses
distances = 0.000005                # metres: the bars' certificates
[adjust]
datum = "inner"                     # no control: the network is as free as can be
[features]                          # through points: distance, line, plane, circle, sphere or cylinder
bore = { circle = ["hole-*"] }
"""


def stations() -> tuple[np.ndarray, np.ndarray]:
    """Return positions of photos that look at the middle of the flange, and matrices from photo to object."""
    turns = np.radians(22.5 * np.arange(16))
    heights = np.where(np.arange(16) % 2 == 0, 1.35, 0.85)
    reach = np.sqrt(1.6**2 - heights**2)
    positions = np.column_stack([reach * np.cos(turns), reach * np.sin(turns), heights])
    z = positions / np.linalg.norm(positions, axis=1, keepdims=True)
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(z, x)
    turned = (np.arange(16) % 4 > 1)[:, np.newaxis]
    return positions, np.stack([np.where(turned, y, x), np.where(turned, -x, y), z], axis=2)


def targets() -> tuple[list[str], np.ndarray]:
    """Return names and places: eight holes, a field around them, the ends of two bars, metres."""
    turns = np.radians(45.0 * np.arange(8))
    holes = np.column_stack([DIAMETER / 2 * np.cos(turns), DIAMETER / 2 * np.sin(turns), np.full(8, 0.03)])
    ticks = np.linspace(-0.42, 0.42, 7)
    field = np.array([[x, y, 0.04 * np.sin(11 * x) * np.cos(9 * y) - 0.02] for x in ticks for y in ticks])
    bars = np.array([[-0.40, -0.46, 0.0], [0.40, -0.46, 0.02], [-0.47, -0.35, 0.01], [-0.47, 0.35, 0.0]])
    names = [f"hole-{k + 1}" for k in range(8)] + [f"c{k + 1:02d}" for k in range(49)]
    return [*names, "bar-1-a", "bar-1-b", "bar-2-a", "bar-2-b"], np.concatenate([holes, field, bars])


def main(arguments: list[str]) -> None:
    """Write the tables."""
    folder = Path(arguments[0]) if arguments else EXAMPLE
    random = np.random.default_rng(SEED)
    names, points = targets()
    positions, matrices = stations()
    photos = [f"IMG_{number:04d}" for number in range(1, len(positions) + 1)]
    rows = []
    for photo, place, matrix in zip(photos, positions, matrices, strict=True):
        exact = TRUTH.project((points - place) @ matrix)
        seen = np.flatnonzero(((exact > 30) & (exact < np.array(SIZE) - 30)).all(axis=1))
        measured = np.round(exact[seen] + random.normal(0.0, IMAGE_SD, (len(seen), 2)), 3)
        rows += [(photo, names[k], *xy) for k, xy in zip(seen.tolist(), measured.tolist(), strict=True)]
    ends = points[-4:].reshape(2, 2, 3)
    bars = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) + random.normal(0.0, BAR_SD, 2)
    free = {f"sd_{name}": ["inf"] for name in ("f", "cx", "cy", "k1", "k2", "p1", "p2")}
    tables = {
        "cameras": {
            "camera": ["28 mm"],
            "model": ["opencv"],
            "width": [SIZE[0]],
            "height": [SIZE[1]],
            "f": [4700.0],
            "cx": [SIZE[0] / 2],
            "cy": [SIZE[1] / 2],
            **free,
        },
        "photos": {"photo": photos},
        "images": {
            name: [row[k] for row in rows] for k, name in enumerate(("photo", "point", "column", "row"))
        },
        "distances": {
            "from": ["bar-1-a", "bar-2-a"],
            "to": ["bar-1-b", "bar-2-b"],
            "distance": np.round(bars, 6),
        },
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "project.toml").write_text(PROJECT, encoding="utf-8")
    for name, columns in tables.items():
        (folder / f"{name}.csv").write_bytes(csv_text(columns))


if __name__ == "__main__":
    main(sys.argv[1:])
