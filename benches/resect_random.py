"""Resection of random photos: how many poses lie within three of their own standard deviations.

    python benches/resect_random.py --count 10000 --seed 1

Each photo has 4 to 39 control points, spread over a plane (two in five) or through space, any attitude
(uniform over all rotations), any angle of view from 17 to 74 degrees, either sign of the principal distance,
and image errors of 0.002 to 0.020 mm whose standard deviation is known. With e the error of position and
attitude and Q their cofactor matrix, a pose counts as within three sigma when e^T Q^-1 e is not above the
99.73 % point of chi-square with six degrees of freedom: of exact covariances and a linear model 0.27 % would
lie beyond.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from photogram import AdjustmentError, Resection, resect
from photogram.adjustment.resection import Observed, solve
from photogram.network.geometry import project, rotation_angles, rotation_matrix

THREE_SIGMA = 0.9973
STEEP = np.radians(80.0)
"""Beyond this phi, omega and kappa are nearly the same rotation, and their errors far from linear."""
FEW = 5
"""Points with which there is hardly any redundancy."""


@dataclass(frozen=True, eq=False)
class Case:
    """A photo: what is measured, and the truth (position, then attitude)."""

    points: np.ndarray
    xy: np.ndarray
    sd: float
    principal_distance: float
    truth: np.ndarray

    def resect(self) -> Resection:
        """Resect it as a user would."""
        return resect(self.points, self.xy, self.principal_distance, image_sd=self.sd)

    def error(self, pose: np.ndarray) -> np.ndarray:
        """Difference from the truth, angles within half a turn."""
        error = pose - self.truth
        error[3:] -= 2 * np.pi * np.round(error[3:] / (2 * np.pi))
        return error

    def from_truth(self) -> np.ndarray:
        """Adjust from the true pose: the minimum that belongs to it."""
        observed = Observed(self.points, 0.0, self.xy, self.sd, self.principal_distance, None)
        return solve(observed, start=self.truth, limit=1e-5, max_iterations=200).pose


def cases(count: int, seed: int) -> Iterator[Case]:
    """Make random photos."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        yield _case(random)


def _case(random: np.random.Generator) -> Case:
    count = int(random.integers(4, 40))
    c = float(random.choice([-1, 1]) * random.choice([50.0, 90.0, 150.0, 300.0]))
    half = random.uniform(0.15, 0.75) * abs(c)
    sd = random.uniform(0.002, 0.02)
    # Through the angles, so that the truth is the attitude to the last bit.
    attitude = rotation_angles(Rotation.random(random_state=random).as_matrix()[np.newaxis])[0]
    distance = 10.0 ** random.uniform(0.0, 4.0)
    position = 10.0 * distance * random.uniform(-1.0, 1.0, 3)
    xy = random.uniform(-half, half, (count, 2))
    if random.random() < 0.4:
        slope = random.uniform(-0.5, 0.5, 2)
        depth = distance / (1.0 + xy @ slope / abs(c))
    else:
        relief = random.uniform(0.02, 0.5)
        depth = distance * (1.0 + relief * random.uniform(-1.0, 1.0, count))
    in_photo = np.column_stack([-xy / c, np.full(count, -1.0)]) * depth[:, np.newaxis]
    points = position + in_photo @ rotation_matrix(attitude[np.newaxis])[0]
    exact = project(points, np.tile(position, (count, 1)), np.tile(attitude, (count, 1)), np.full(count, c))
    noisy = exact + random.normal(0.0, sd, (count, 2))
    return Case(points, noisy, sd, c, np.concatenate([position, attitude]))


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of a photo: the test value, and where it is beyond three sigma the reason."""

    value: float
    reason: str | None = None


def outcome(case: Case) -> Outcome:
    """Resect a photo and compare it with the truth."""
    try:
        photo = case.resect()
    except AdjustmentError as error:
        return Outcome(np.inf, f"raised {type(error).__name__}: {error}")
    error = case.error(np.concatenate([photo.position, photo.attitude]))
    value = float(error @ np.linalg.solve(photo.cofactors, error))
    if value <= chi2.ppf(THREE_SIGMA, 6):
        return Outcome(value)
    if not photo.converged:
        return Outcome(value, photo.status)
    apart = case.error(case.from_truth()) - error
    if float(apart @ np.linalg.solve(photo.cofactors, apart)) > 1e-3:
        return Outcome(value, "another minimum than that next to the truth")
    if abs(case.truth[4]) > STEEP:
        return Outcome(value, "right minimum, phi beyond 80 degrees")
    if len(case.xy) <= FEW:
        return Outcome(value, f"right minimum, {FEW} points or fewer")
    return Outcome(value, "right minimum, chance")


def main() -> None:
    """Print how many poses lie beyond three sigma, and why."""
    parser = argparse.ArgumentParser(description="resection of random photos")
    parser.add_argument("--count", type=int, default=10_000, help="photos (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the photos (default %(default)s)")
    arguments = parser.parse_args()
    made = list(cases(arguments.count, arguments.seed))
    start = time.perf_counter()
    for case in made:
        case.resect()
    seconds = time.perf_counter() - start
    found = [outcome(case) for case in made]
    values = np.array([each.value for each in found])
    limit = chi2.ppf(THREE_SIGMA, 6)
    count = len(found)
    print(f"{count} photos, seed {arguments.seed}; {1e6 * seconds / count:.0f} microseconds each")
    print(f"e^T Q^-1 e above {limit:.2f}: {(values > limit).sum()}; expected {(1 - THREE_SIGMA) * count:.0f}")
    for percent in (50, 90, 99):
        found_at, expected = np.percentile(values, percent), chi2.ppf(percent / 100, 6)
        print(f"{percent:>3} % point: {found_at:6.2f}; expected {expected:6.2f}")
    for reason, number in Counter(each.reason for each in found if each.reason).most_common():
        print(f"{number:>5}  {reason}")


if __name__ == "__main__":
    main()
