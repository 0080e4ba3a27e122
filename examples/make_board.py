"""Build the packaged example `board`, which `photogram calibrate --example` takes.

    python examples/make_board.py [DIRECTORY]

Corners of a chessboard in twenty pictures, by the simulator of calibrations: ten with the board in the middle
of the picture, as one holds it when nobody says more (`middle01.jpg` ..), ten towards the edges
(`edge01.jpg` ..). What is made of them is docs/tutorials/calibration.md.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from photogram import Attitudes, Camera
from photogram.io.csv_text import csv_text
from photogram.targets import Board, Calibration, Corners, simulate_corners

SEED = 37
SIZE = (1600, 1200)
"""Pixels."""
TRUTH = Camera(
    "opencv_pinhole",
    {
        "fx": 1312.4,
        "fy": 1311.8,
        "cx": 811.3,
        "cy": 588.6,
        "k1": -0.262,
        "k2": 0.094,
        "p1": 4e-4,
        "p2": -3e-4,
        "k3": -0.021,
    },
    sd=0.0,
)
BOARD = Board(columns=9, rows=6, spacing=0.03)
CORNER_SD = 0.1
"""Pixels."""
EXAMPLE = Path(__file__).resolve().parents[1] / "python" / "photogram" / "examples" / "board"
DESCRIPTION = """\
# A chessboard of 10 x 7 squares of 30 mm: 9 x 6 corners.
kind = "chessboard"
columns = 9
rows = 6
spacing = 0.03
unit = "m"
picture_size = [1600, 1200]
"""
README = """\
# A simulated chessboard

Corners of a chessboard in twenty pictures of 1600 x 1200 pixels, with errors of 0.1 pixel, of a board whose
points are out of place by some hundredths of a millimetre. `examples/make_board.py` in the repository builds
the files and always gives the same ones.

`photogram calibrate --example` calibrates the camera; `photogram new DIR --kind board` writes the files.
"""


def held(random: np.random.Generator, about: float, reach: tuple[float, float], away: tuple[float, float]):
    """Return a pose, board -> camera: its middle in a direction, off the axis (tangent) and away (metres)."""
    off = random.uniform(*reach)
    ray = np.array([off * np.cos(about), 0.75 * off * np.sin(about), 1.0])
    tilt, turn = random.uniform(0, 2 * np.pi), random.uniform(-30, 30)
    size = random.uniform(10, 38)
    vectors = np.radians([[size * np.cos(tilt), size * np.sin(tilt), 0.0], [0.0, 0.0, turn]])
    tilted, turned = Attitudes.of("rotation_vector", vectors).matrices
    pose = np.eye(4)
    pose[:3, :3] = tilted @ turned
    middle = BOARD.places.mean(axis=0)
    pose[:3, 3] = random.uniform(*away) * ray - pose[:3, :3] @ middle
    return pose


def simulated() -> Calibration:
    """Return the calibration with its corners, errors drawn."""
    random = np.random.default_rng(SEED)
    poses = [held(random, 0.63 * k, (0.0, 0.1), (0.6, 0.8)) for k in range(10)]
    poses += [held(random, 0.63 * k, (0.38, 0.5), (0.4, 0.9)) for k in range(10)]
    names = [f"{place}{number:02d}.jpg" for place in ("middle", "edge") for number in range(1, 11)]
    rows = []
    for number, pose in enumerate(poses):
        seen = BOARD.places @ pose[:3, :3].T + pose[:3, 3]
        xy = TRUTH.project(seen * [1.0, -1.0, -1.0])
        inside = ((xy > 5) & (xy < np.array(SIZE) - 6)).all(axis=1)
        rows += [(number, point, *xy[point]) for point in np.flatnonzero(inside).tolist()]
    picture, point, x, y = np.array(rows).T
    corners = Corners(
        pictures=names,
        cameras=[0] * len(names),
        views=np.arange(len(names)),
        camera_names=["camera"],
        sizes=[SIZE],
        picture=picture.astype(int),
        point=point.astype(int),
        xy=np.column_stack([x, y]),
        sd=np.ones(len(rows)),
    )
    exact = Calibration(board=BOARD, corners=corners, cameras=[TRUTH], poses=np.array(poses), sd0=CORNER_SD)
    return simulate_corners(exact, SEED)


def main(arguments: list[str]) -> None:
    """Write corners and board."""
    folder = Path(arguments[0]) if arguments else EXAMPLE
    corners = simulated().corners
    xy = np.round(corners.xy, 2)
    table = {
        "image": [corners.pictures[each] for each in corners.picture.tolist()],
        "point": corners.point,
        "x": xy[:, 0],
        "y": xy[:, 1],
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "corners.csv").write_bytes(csv_text(table))
    (folder / "board.toml").write_text(DESCRIPTION, encoding="utf-8")
    (folder / "README.md").write_text(README, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
