"""From photographs of a board to a calibrated camera: time to find the board, and to adjust.

python benches/detection.py                 13 pictures of 640 x 480
python benches/detection.py 2400x1800 13    of another size

Pictures of a chessboard, and of circles, are made as a known camera would take them.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from photogram import Camera
from photogram.targets import Board, Calibration, read

sys.path.append(str(Path(__file__).parents[1] / "tests" / "targets"))
import photographed_boards as boards

boards.PARTS = 2

BOARDS = (
    Board(columns=9, rows=6, spacing=0.03),
    Board(kind="circles", columns=8, rows=6, spacing=0.03),
    Board(kind="asymmetric_circles", columns=4, rows=11, spacing=0.02),
)
TILT, SHARES = 40.0, (0.4, 0.7)
"""Degrees about both axes, and the extent of the board over the shorter side of the picture."""


def photographed(folder: Path, board: Board, size: tuple[int, int], count: int) -> None:
    """Write pictures of a board."""
    focus = 0.97 * size[0]
    centre = {"cx": size[0] / 2 + 1.3, "cy": size[1] / 2 - 1.9}
    camera = Camera("opencv", {"fx": focus, "fy": focus, "k1": -0.12, "k2": 0.05, "p1": 0, "p2": 0} | centre)
    pattern = (boards.chessboard if board.kind == "chessboard" else boards.circles)(board)
    random = np.random.default_rng(5)
    for number in range(count):
        ray, tilt = random.uniform(-0.12, 0.12, 2), random.uniform(-TILT, TILT, 2)
        turn, share = random.uniform(-40, 40), random.uniform(*SHARES)
        pose = boards.pose_of(board, camera, ray, tilt, turn, share, size)
        picture = boards.photographed(pattern, camera, size, pose, seed=number)
        cv2.imwrite(str(folder / f"view{number:02}.png"), picture)


def row(board: Board, size: tuple[int, int], count: int) -> str:
    """Return a row of the table."""
    with TemporaryDirectory() as name:
        photographed(Path(name), board, size, count)
        start = time.process_time()
        found: Calibration = read(Path(name), board=board)
        seen = time.process_time()
        adjusted = found.adjust()
        end = time.process_time()
    rms = float(np.sqrt((adjusted.residuals**2).mean()))
    pictures = f"{len(found.corners.pictures)} of {count}"
    return f"{board.kind:18} {pictures:>9} {seen - start:8.2f} s {end - seen:8.2f} s {rms:8.3f} px"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("size", nargs="?", default="640x480")
    parser.add_argument("count", nargs="?", type=int, default=13)
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    print(f"{'processor time':18} {'found':>9} {'read':>10} {'adjusted':>10} {'rms':>11}")
    for board in BOARDS:
        print(row(board, (width, height), given.count), flush=True)


if __name__ == "__main__":
    main()
