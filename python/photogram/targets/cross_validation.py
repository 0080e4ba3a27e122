"""Cross-validation: agreement of subsets of the views within their cofactors.

Subsets a and b are adjusted separately from the values of the whole. With the weights P of common
information, priors and the nominal points of the board,

    cov(k_b - k_a) = Q_a + Q_b - Q_a P Q_b - Q_b P Q_a

for all common unknowns. Unmodelled lens distortion, deformed boards and moving views increase the
differences, while the residuals of each subset may be unchanged.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Self

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import whole_number
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.distributions import log_chi_square, log_fisher
from photogram.summaries import Brief, Rows
from photogram.targets.housing import Housing
from photogram.targets.projection import common_partials, datum_rows
from photogram.targets.vision import unknown_of, values_of
from photogram.words import phrase

MIN_PROBABILITY = 0.01  # calibrations with a larger p agree


@dataclass(frozen=True)
class DifferenceTest:
    """Test of a difference of two calibrations."""

    name: str  # name of the difference
    chi2: float  # dk' cov(dk)^-1 dk over the variance of unit weight
    dof: int
    probability: float  # probability of an equal or larger difference

    @classmethod
    def of(cls, name: str, chi2: float, dof: int, freedom: float = math.inf) -> Self:
        """Return the test; `freedom` is the redundancy of unit weight, infinite if known."""
        known = math.isinf(freedom)
        logarithm = log_chi_square(chi2, dof) if known else log_fisher(chi2 / dof, dof, freedom)
        return cls(name, chi2, dof, float(np.exp(logarithm)))

    @property
    def explained(self) -> bool:
        """Whether the cofactors explain the difference."""
        return self.probability > MIN_PROBABILITY

    @property
    def factor(self) -> float:
        """Mean ratio of the differences to their standard deviations."""
        return math.sqrt(self.chi2 / self.dof)


RANK_TOLERANCE = 1e-6  # smaller relative cofactors of a change are due to the common priors


@dataclass(frozen=True, eq=False)
class CrossMap:
    """Differences of the projections of a camera between two subsets."""

    differences: Floats  # (n, 2) projections by part b minus part a, pixels, in the datum of the whole
    covariances: Floats  # (n, 2, 2) expected covariances of the differences

    @property
    def chi2(self) -> Floats:
        """(n,) d' cov(d)^-1 d with two degrees of freedom."""
        return squares_of(self.differences, self.covariances)


def squares_of(vectors: Floats, covariances: Floats) -> Floats:
    """Return (n,) d' Q^-1 d of (n, 2) vectors."""
    solved = np.linalg.solve(covariances, vectors[:, :, np.newaxis])[:, :, 0]
    return np.asarray((vectors * solved).sum(axis=1))


def splits(views: int, into: str | int) -> list[tuple[list[int], list[int]]]:
    """Return pairs of view subsets for `odd`, `halves` or K subsets."""
    numbers = list(range(views))
    if into == "odd":
        return [(numbers[::2], numbers[1::2])]
    if into == "halves":
        return [(numbers[: views // 2], numbers[views // 2 :])]
    count = whole_number("into", into)
    folds = [numbers[k::count] for k in range(count)]
    return [(sorted(set(numbers) - set(fold)), fold) for fold in folds]


def changes_between(a: Housing, b: Housing) -> tuple[Floats, Floats]:
    """Return (c,) changes from a to b without the board, and their (c, c) cofactors."""
    found = np.zeros(a.common)
    for number, (first, second) in enumerate(zip(a.cameras, b.cameras, strict=True)):
        found[a.parameters(number)] = (values_of(second) - values_of(first))[unknown_of(first)]
        if number:
            turn = b.sensors[number, :3, :3] @ a.sensors[number, :3, :3].T
            moved = b.sensors[number, :3, 3] - a.sensors[number, :3, 3]
            found[a.sensor(number)] = np.concatenate(
                [moved, _photocore.rotation_vectors(turn[np.newaxis])[0]]
            )
    common = slice(0, a.common)
    own, other = a.cofactors[common, common], b.cofactors[common, common]
    shared = own @ a.weights @ other
    return found, own + other - shared - shared.T


def parts_agree(
    a: Housing, b: Housing, names: Sequence[str], unit: tuple[float, float] = (1.0, math.inf)
) -> list[DifferenceTest]:
    """Test the differences of each of K cameras, and of all cameras and sensors."""
    change, cofactors = changes_between(a, b)
    variance, freedom = unit
    groups = {name: a.parameters(number) for number, name in enumerate(names)}
    if len(names) > 1:
        groups["all"] = slice(0, a.board.start)
    found = []
    for name, own in groups.items():
        splined = any(each.knots is not None for each in a.cameras)
        changed, known = change[own], cofactors[own, own]
        if splined:
            # (r,) changes that corners determine, and their (r, r) cofactors
            scale = 1 / np.sqrt(np.diag(a.cofactors + b.cofactors)[own])
            values, vectors = np.linalg.eigh(known * scale[:, np.newaxis] * scale)
            kept = values > RANK_TOLERANCE
            changed, known = vectors[:, kept].T @ (scale * changed), np.diag(values[kept])
        chi2 = float(changed @ np.linalg.solve(known, changed)) / variance
        found.append(DifferenceTest.of(name, chi2, len(changed), freedom))
    return found


def cross_map(
    whole: Housing, a: Housing, b: Housing, camera: int, pixels: Floats, distance: float
) -> CrossMap:
    """Return linearised projection differences of subsets in the datum `corners`."""
    rows = datum_rows(whole, camera, "corners")
    partials = common_partials(whole, camera, pixels, distance, rows)
    change, cofactors = changes_between(a, b)
    return CrossMap(partials @ change, whole.variance * partials @ cofactors @ partials.transpose(0, 2, 1))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CrossValidation(Brief):
    """Separately adjusted subsets of the views, and tests of their agreement.

    Attributes
    ----------
    into
        Type of split.
    cameras
        Names of the cameras of the housing.
    parts
        Views of both subsets of each split.
    tests
        For each split the tests of the cameras, and of all with their sensors if there are several.
    whole, housings
        The housing from all views, and from both subsets of each split.
    """

    into: str
    cameras: tuple[str, ...]
    parts: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]
    tests: tuple[tuple[DifferenceTest, ...], ...]
    whole: Housing
    housings: tuple[tuple[Housing, Housing], ...]

    @property
    def explained(self) -> bool:
        """Whether covariances explain the differences (all p >= 0.01 / number of splits)."""
        return min(each[-1].probability for each in self.tests) > MIN_PROBABILITY / len(self.tests)

    @property
    def factor(self) -> float:
        """Mean ratio of the differences to their standard deviations over the splits."""
        return float(np.sqrt(np.mean([each[-1].factor ** 2 for each in self.tests])))

    @property
    def verdict(self) -> str:
        """Verdict of the cross-validation on every uncertainty map."""
        probability = min(each[-1].probability for each in self.tests)
        code = f"cross.{'explained' if self.explained else 'too-small'}"
        return str(phrase(code, factor=self.factor, p=probability))

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of splits and tests."""
        rows = []
        for (a, b), tests in zip(self.parts, self.tests, strict=True):
            said = [
                phrase("cross.test", name=each.name, chi2=each.chi2, dof=each.dof, p=each.probability)
                for each in tests
            ]
            views = str(phrase("cross.views", first=len(a), second=len(b)))
            rows.append((views, str(phrase("cross.tests", tests=said))))
        return "Cross-validation", [*rows, ("verdict", self.verdict)]

    def map(self, camera: int, pixels: Floats, distance: float, split: int = 0) -> CrossMap:
        """Return the projection differences between two subsets of a split.

        Parameters
        ----------
        camera
            Camera number in the housing.
        pixels, distance
            (n, 2) pixels, and distance from the camera centre; infinite: directions.
        split
            Split number.
        """
        return cross_map(self.whole, *self.housings[split], camera, pixels, distance)
