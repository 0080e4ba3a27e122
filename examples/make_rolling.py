"""Build the packaged example `rolling`, which `photogram new --kind rolling` writes.

    python examples/make_rolling.py [DIRECTORY]

A drone that does not stop for its photos, with a camera that reads its rows one after the other: two strips
in opposite directions, GNSS positions and velocities, rates of a gyroscope, five control points and four
check points. How long the camera reads is not known. docs/formats.md says what the columns are.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from photogram import Attitudes, Camera
from photogram.io.csv_text import csv_text

SEED = 34
SIZE = (4000, 3000)
"""Pixels."""
CAMERA = Camera("simple_radial", {"f": 3650.0, "cx": 2000.0, "cy": 1500.0, "k": -0.02})
READOUT = 0.0276
"""Seconds for all rows, which the tables do not know."""
IMAGE_SD, GNSS_SD, SPEED_SD, RATE_SD, CONTROL_SD = 0.4, 0.02, 0.05, 0.02, 0.01
"""Pixels, metres, metres a second, radians a second, metres."""
EXAMPLE = Path(__file__).resolve().parents[1] / "python" / "photogram" / "examples" / "rolling"
PROJECT = """\
# Ten photos of a drone that flies on while its camera reads row after row. `photogram adjust .` finds how
# long that takes, and where the points are; `photogram info .` says what moves. Replace the tables by your
# own; docs/formats.md has all columns, docs/moving.md says what is adjusted.
[project]
format = 1
name = "a dam in passing"
[time]
# origin = "2026-05-01T09:12:00Z"   # what the seconds of all tables count from: said by info, nothing more
# scale = "utc"                     # none | utc | gps | tai | et
[sd]                                # standard deviations of tables that have no columns for them
images = 0.4                        # pixels
gnss = 0.02
control = 0.01
[adjust]
unit_variance = "unity"             # the standard deviations are taken as given
"""
COMMENTS = {
    "cameras": [
        "readout: seconds from the first row to the last; sd_readout: inf unknown, 0 known. Without these",
        "columns the photos stand still. readout_direction: down, up, right or left.",
    ],
    "photos": [
        "x .. kappa: where a photo is at its time, when its first row is read: initial values, all unknown.",
        "vx ..: velocity by the receiver, metres a second; rate_x ..: by the gyroscope about the axes of the",
        "photo, radians a second; both are observed with their sd. Without sd they are initial values, too.",
    ],
    "gnss": ["Positions of the antenna at these times, in metres; it stands at the projection centre."],
    "control": ["use: control (held by [sd] control) or check (compared only)."],
    "images": ["What was measured: column to the right and row down from the upper-left corner, pixels."],
}


def flight(random: np.random.Generator) -> list[np.ndarray]:
    """Return times, positions, angles, velocities and rates of two strips of five photos."""
    rows = []
    for number in range(10):
        strip, along = divmod(number, 5)
        sense = 1.0 - 2.0 * strip
        place = [sense * (18.0 * along - 36.0), 24.0 * strip - 12.0, 62.0]
        # The top of a picture is ahead: rows lie across the flight.
        rows.append([3.0 * number, *place, 0.0, 0.0, -90.0 * sense, 8.5 * sense, 0.0, 0.0, 0.0, 0.0, 0.0])
    scatter = [0.0, *[0.7] * 3, *[1.5] * 3, *[0.3] * 3, *[0.12] * 3]
    drawn = np.array(rows) + random.normal(0.0, 1.0, (10, 13)) * scatter
    return [np.round(drawn[:, 0], 3), drawn[:, 1:4], np.radians(drawn[:, 4:7]), drawn[:, 7:10], drawn[:, 10:]]


def ground(random: np.random.Generator) -> tuple[list[str], np.ndarray]:
    """Return names and places of points: markers first, then what was matched."""
    markers = [[-44, -28], [44, -28], [44, 28], [-44, 28], [0, 2], [-26, -14], [27, 13], [-24, 17], [22, -19]]
    plan = np.concatenate([np.array(markers, dtype=float), random.uniform([-47, -34], [47, 34], (42, 2))])
    heights = 4.0 * np.sin(plan[:, 0] / 15.0) * np.cos(plan[:, 1] / 19.0) + random.normal(0.0, 0.3, len(plan))
    return [f"marker-{k + 1}" for k in range(9)] + [f"t{k + 1:02d}" for k in range(42)], np.column_stack(
        [plan, heights]
    )


def images(
    points: np.ndarray, place: np.ndarray, turned: np.ndarray, v: np.ndarray, w: np.ndarray
) -> np.ndarray:
    """Return (n, 2) where a photo that moves sees points: each at the time of its own row."""
    rows = np.full(len(points), SIZE[1] / 2)
    for _ in range(30):
        times = rows / SIZE[1] * READOUT
        turns = turned @ Attitudes.of("rotation_vector", times[:, np.newaxis] * w).matrices
        seen = points - place - times[:, np.newaxis] * v
        xy = CAMERA.project(np.einsum("nji,nj->ni", turns, seen))
        rows = xy[:, 1]
    return xy


def main(arguments: list[str]) -> None:
    """Write the tables."""
    folder = Path(arguments[0]) if arguments else EXAMPLE
    random = np.random.default_rng(SEED)
    times, positions, angles, velocities, rates = flight(random)
    names, points = ground(random)
    photos = [f"DJI_{number:04d}" for number in range(1, 11)]
    matrices = Attitudes.of("omega_phi_kappa", angles).matrices
    rows = []
    for photo, *pose in zip(photos, positions, matrices, velocities, rates, strict=True):
        exact = images(points, *pose)
        seen = np.flatnonzero(((exact > 15) & (exact < np.array(SIZE) - 15)).all(axis=1))
        measured = np.round(exact[seen] + random.normal(0.0, IMAGE_SD, (len(seen), 2)), 2)
        rows += [(photo, names[k], *xy) for k, xy in zip(seen.tolist(), measured.tolist(), strict=True)]
    noisy = {
        "place": np.round(positions + random.normal(0.0, GNSS_SD, positions.shape), 3),
        "angles": np.round(np.degrees(angles) + random.normal(0.0, 0.3, angles.shape), 2),
        "velocity": np.round(velocities + random.normal(0.0, SPEED_SD, velocities.shape), 3),
        "rate": np.round(rates + random.normal(0.0, RATE_SD, rates.shape), 4),
        "control": np.round(points[:9] + random.normal(0.0, CONTROL_SD, (9, 3)), 3),
    }
    tables = {
        "cameras": {
            "camera": ["drone"],
            "model": ["simple_radial"],
            "width": [SIZE[0]],
            "height": [SIZE[1]],
            **{name: [CAMERA.parameters[name]] for name in CAMERA.names},
            "readout": [0.02],
            "sd_readout": ["inf"],
            "readout_direction": ["down"],
        },
        "photos": {
            "photo": photos,
            "time": times,
            **dict(zip("xyz", noisy["place"].T, strict=True)),
            **dict(zip(("omega", "phi", "kappa"), noisy["angles"].T, strict=True)),
            **{f"v{axis}": own for axis, own in zip("xyz", noisy["velocity"].T, strict=True)},
            **{f"rate_{axis}": own for axis, own in zip("xyz", noisy["rate"].T, strict=True)},
            **{f"sd_v{axis}": [SPEED_SD] * 10 for axis in "xyz"},
            **{f"sd_rate_{axis}": [RATE_SD] * 10 for axis in "xyz"},
        },
        "gnss": {"photo": photos, **dict(zip("xyz", noisy["place"].T, strict=True))},
        "control": {
            "point": names[:9],
            **dict(zip("xyz", noisy["control"].T, strict=True)),
            "use": ["control"] * 5 + ["check"] * 4,
        },
        "images": {
            name: [row[k] for row in rows] for k, name in enumerate(("photo", "point", "column", "row"))
        },
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "project.toml").write_text(PROJECT, encoding="utf-8")
    for name, columns in tables.items():
        (folder / f"{name}.csv").write_bytes(csv_text(columns, COMMENTS[name]))


if __name__ == "__main__":
    main(sys.argv[1:])
