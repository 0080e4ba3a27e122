"""A block in apex-solver: the same unknowns, observations and weights as in photogram.

The solver is a library in Rust: the program in the directory `apex` reads a block as numbers, solves it and
writes numbers. Poses and camera are those of `gtsam_block`, x = -c p1 / p3, y = c p2 / p3, but the pose leads
from object to camera space, and every image point has a camera of its own, which counts in standard
deviations of the image coordinates.

All numbers are 64-bit floats. To the program: how many photographs, points and image points there are; pose
of every photograph (translation, quaternion with the real part first); coordinates of every point;
photograph, point, two focal lengths and two coordinates of every image point; point, three coordinates and
three roots of weights of every control point. From it: whether it has converged, iterations, cost at the
start and at the end, seconds of the optimization, highest resident memory; poses and points as above.
"""

from __future__ import annotations

import subprocess
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from solution import HALF_TURN, Floats, Solution, check, in_standard_deviations, to_object_space

from photogram import Attitudes, Block
from photogram.network.geometry import rotation_angles

_DIRECTORY = Path(__file__).parent / "apex"
_PROGRAM = _DIRECTORY / "target" / "release" / "apex-side"

SETTINGS = ("gn-cholesky", "gn-schur", "gn-chunked", "gn-implicit", "lm-cholesky", "lm-schur")
FASTEST = "gn-cholesky"


@dataclass(frozen=True)
class Found:
    """What the program wrote."""

    solution: Solution
    seconds: float
    peak: float


def build() -> bool:
    """Build the program, unless it is there already; return whether it can be built."""
    command = ["cargo", "build", "--release", "--quiet", "--target-dir", str(_DIRECTORY / "target")]
    try:
        return not subprocess.run(command, cwd=_DIRECTORY, check=False).returncode
    except FileNotFoundError:
        return False


def version() -> str:
    """Return the version of apex-solver that the program is built with."""
    needed = tomllib.loads((_DIRECTORY / "Cargo.toml").read_text())["dependencies"]
    return str(needed["apex-solver"]["version"]).removeprefix("=")


def numbers(block: Block, points: Floats) -> Floats:
    """Translate a block whose points start from `points`, (n, 3), for the program.

    Held components of control are priors of their standard deviations; a component that is not held has the
    weight 0. Raises ValueError for what the translation does not cover: geographic space, weighted or fixed
    photographs, fixed control.
    """
    check(block)
    attitudes = Attitudes.of("matrix_to_vision", to_object_space(block).transpose(0, 2, 1))
    which = np.stack([block.image_photos, block.image_points], axis=1)
    held = np.isfinite(block.point_sd)
    control = np.flatnonzero(held.any(axis=1))
    # Weight 0 times a value that is not known must be 0, not NaN.
    known = np.where(held, block.point_positions, points)[control]
    parts = [
        np.array([len(block.photo_ids), len(block.point_ids), len(which)]),
        np.hstack([attitudes.translations(block.photo_positions), attitudes.values("quaternion_to_vision")]),
        points,
        np.hstack([which, in_standard_deviations(block)]),
        np.hstack([control[:, np.newaxis], known, 1.0 / block.point_sd[control]]),
    ]
    return np.concatenate([part.ravel() for part in parts]).astype("<f8")


def solve(block: Block, problem: Floats, setting: str) -> Found:
    """Let the program optimize."""
    with tempfile.TemporaryDirectory() as directory:
        given, found = Path(directory) / "block", Path(directory) / "solution"
        problem.tofile(given)
        subprocess.run([_PROGRAM, given, found, setting], check=True)
        values = np.fromfile(found, "<f8")
    (converged, iterations, initial, final, seconds, peak), unknowns = values[:6], values[6:]
    photos, points = np.split(unknowns, [7 * len(block.photo_ids)])
    translations, quaternions = np.split(photos.reshape(-1, 7), [3], axis=1)
    attitudes = Attitudes.of("quaternion_to_vision", quaternions)
    matrices = HALF_TURN @ attitudes.values("matrix_to_vision")
    if block.photo_to_ground:
        matrices = matrices.transpose(0, 2, 1)
    solution = Solution(
        converged=bool(converged),
        iterations=int(iterations),
        initial_weighted_sum_of_squares=2.0 * initial,
        weighted_sum_of_squares=2.0 * final,
        photo_positions=attitudes.positions(translations),
        photo_attitudes=rotation_angles(matrices),
        point_positions=points.reshape(-1, 3),
    )
    return Found(solution, seconds, peak)
