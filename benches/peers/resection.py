"""The same random photos resected by photogram and by OpenCV's solvePnP; prints one Markdown table.

    python benches/peers/resection.py --count 2000 --seed 1

The photos are those of `benches/resect_random.py`. OpenCV's camera looks along +z with y downward: its axes
are those of the photo turned by half a turn about x. Poses are compared in the standard deviations that
photogram gives them.
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np
from scipy.stats import chi2

import photogram
from photogram.network.geometry import rotation_angles

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from resect_random import THREE_SIGMA, Case, cases

TURN = np.diag([1.0, -1.0, -1.0])
"""From photo axes to those of OpenCV's camera."""
METHODS = {
    "solvePnP, iterative": cv2.SOLVEPNP_ITERATIVE,
    "solvePnP, SQPnP": cv2.SOLVEPNP_SQPNP,
}
SAME = 1e-2
"""Poses nearer than this, in standard deviations, are the same minimum."""


@dataclass
class Side:
    """One way to resect: seconds of each repetition, and the pose of every photo (None where it failed)."""

    name: str
    computed: str
    solve: Callable[[Case], np.ndarray | None]
    seconds: list[float] = field(default_factory=list)
    poses: list[np.ndarray | None] = field(default_factory=list)

    def run(self, made: list[Case]) -> None:
        """Resect all photos."""
        start = time.perf_counter()
        self.poses = [self.solve(case) for case in made]
        self.seconds.append(time.perf_counter() - start)


def ours(case: Case) -> np.ndarray | None:
    """Pose by photogram; its covariance and all test values are computed with it."""
    try:
        photo = case.resect()
    except photogram.AdjustmentError:
        return None
    return np.concatenate([photo.position, photo.attitude])


def theirs(method: int) -> Callable[[Case], np.ndarray | None]:
    """Return the pose by OpenCV."""

    def solve(case: Case) -> np.ndarray | None:
        f = abs(case.principal_distance)
        # On the positive plane x, y have the directions of the object; OpenCV's y points down.
        image = case.xy * -np.sign(case.principal_distance) * [1.0, -1.0]
        camera = np.diag([f, f, 1.0])
        # Near the origin, as photogram does inside: OpenCV would lose digits in large coordinates.
        origin = case.points.mean(axis=0)
        try:
            found, turn, shift = cv2.solvePnP(case.points - origin, image, camera, None, flags=method)
        except cv2.error:
            return None
        if not found:
            return None
        rotation = cv2.Rodrigues(turn)[0]
        position = origin - (rotation.T @ shift)[:, 0]
        return np.concatenate([position, rotation_angles((TURN @ rotation)[np.newaxis])[0]])

    return solve


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="photogram and OpenCV on the same photos")
    parser.add_argument("--count", type=int, default=2000, help="photos (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the photos (default %(default)s)")
    parser.add_argument("--repetitions", type=int, default=5, help="of every side (default %(default)s)")
    arguments = parser.parse_args()
    made = list(cases(arguments.count, arguments.seed))
    sides = [Side("photogram.resect", "pose, 6x6 covariance, redundancy, tests", ours)]
    sides += [Side(name, "pose only", theirs(method)) for name, method in METHODS.items()]
    for _ in range(arguments.repetitions):
        # In turn, so that all meet the same machine.
        for side in sides:
            side.run(made)
    print(
        f"{len(made):,} photos with 4 to 39 points (seed {arguments.seed}),"
        f" {arguments.repetitions} repetitions in turn\n"
    )
    print(_table(sides, made))
    print(f"Python {platform.python_version()}, photogram {version('photogram')}, OpenCV {cv2.__version__}")


def _table(sides: list[Side], made: list[Case]) -> str:
    photos = [case.resect() for case in made]
    limit = chi2.ppf(THREE_SIGMA, 6)
    rows = [["", *(side.name for side in sides)], ["---", *("---:" for _ in sides)]]
    rows.append(["computed", *(side.computed for side in sides)])
    rows.append(["microseconds a photo, best", *(f"{1e6 * min(s.seconds) / len(made):.0f}" for s in sides)])
    counts = []
    for side in sides:
        distances = []
        for case, photo, pose in zip(made, photos, side.poses, strict=True):
            if pose is None:
                continue
            weight = np.linalg.inv(photo.cofactors)
            error, apart = case.error(pose), case.error(pose) - case.error(_joined(photo))
            distances.append((error @ weight @ error > limit, np.sqrt(max(0.0, apart @ weight @ apart))))
        beyond, apart_sd = np.array(distances).T
        counts.append(
            [
                str(sum(pose is None for pose in side.poses)),
                str(int(beyond.sum())),
                str(int((apart_sd > SAME).sum())),
                f"{np.median(apart_sd):.0e}" if side is not sides[0] else "",
            ]
        )
    names = [
        "no pose",
        f"farther from the truth than three sigma ({(1 - THREE_SIGMA) * len(made):.0f} expected)",
        f"farther from photogram's pose than {SAME} sd",
        "median distance from photogram's pose, sd",
    ]
    rows += [[name, *values] for name, values in zip(names, zip(*counts, strict=True), strict=True)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"


def _joined(photo: photogram.Resection) -> np.ndarray:
    return np.concatenate([photo.position, photo.attitude])


if __name__ == "__main__":
    main()
