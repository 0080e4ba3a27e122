"""Cross-validation: whether parts of the views agree as well as their cofactors say.

Parts a and b are adjusted by themselves from the values of the whole. With the weights P of what both share,
priors and the nominal points of the board,

    cov(k_b - k_a) = Q_a + Q_b - Q_a P Q_b - Q_b P Q_a

in all common unknowns. A lens that bends as the model cannot, boards that were not flat, views that were not
still: all make the parts differ by more, while the residuals of each part look as before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.targets.agreement import Agreement
from photogram.targets.datums import datum_rows
from photogram.targets.housing import Housing
from photogram.targets.imaging import unknown_of, values_of
from photogram.targets.projection import common_partials

__all__ = ["CrossMap", "changes_between", "cross_map", "parts_agree", "splits"]


@dataclass(frozen=True, eq=False)
class CrossMap:
    """Where a camera of the two parts images the same points.

    Attributes
    ----------
    differences
        (n, 2) images by part b less those by part a, pixels, in the datum of the whole.
    covariances
        (n, 2, 2) what they should have.
    """

    differences: Floats
    covariances: Floats

    @property
    def chi2(self) -> Floats:
        """(n,) d' cov(d)^-1 d, of two degrees of freedom."""
        solved = np.linalg.solve(self.covariances, self.differences[:, :, np.newaxis])[:, :, 0]
        return np.asarray((self.differences * solved).sum(axis=1))


def splits(views: int, into: str | int) -> list[tuple[list[int], list[int]]]:
    """Return parts of the views in pairs: `odd`: even, odd numbers; `halves`; K: each part and the rest."""
    numbers = list(range(views))
    if into == "odd":
        return [(numbers[::2], numbers[1::2])]
    if into == "halves":
        return [(numbers[: views // 2], numbers[views // 2 :])]
    folds = [numbers[k :: int(into)] for k in range(int(into))]
    return [(sorted(set(numbers) - set(fold)), fold) for fold in folds]


def changes_between(a: Housing, b: Housing) -> tuple[Floats, Floats]:
    """Return (c,) values of b less those of a, and their (c, c) cofactors; of the board none are compared."""
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
) -> list[Agreement]:
    """Test the differences of two parts, of each camera, and of all cameras and sensors together.

    Parameters
    ----------
    a, b
        The parts.
    names
        Of the K cameras.
    unit
        Variance of unit weight with its degrees of freedom; infinite where it was known before.
    """
    change, cofactors = changes_between(a, b)
    variance, freedom = unit
    groups = {name: a.parameters(number) for number, name in enumerate(names)}
    if len(names) > 1:
        groups["all"] = slice(0, a.board.start)
    found = []
    for name, own in groups.items():
        chi2 = float(change[own] @ np.linalg.solve(cofactors[own, own], change[own])) / variance
        found.append(Agreement.of(name, chi2, len(change[own]), freedom))
    return found


def cross_map(
    whole: Housing, a: Housing, b: Housing, camera: int, pixels: Floats, distance: float
) -> CrossMap:
    """Return where the parts image the same points, by the linear map of the whole in its datum `corners`."""
    rows = datum_rows(whole, camera, "corners")
    partials = common_partials(whole, camera, pixels, distance, rows)
    change, cofactors = changes_between(a, b)
    return CrossMap(partials @ change, whole.variance * partials @ cofactors @ partials.transpose(0, 2, 1))
