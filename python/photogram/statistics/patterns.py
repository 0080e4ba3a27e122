"""Tests for patterns of residuals: tails, frame pattern, trend, bend.

All use standardized residuals ~v = (observed - computed) / sd and their redundancy numbers r. The residuals
of an adjustment are correlated, ~v = R ~e. A sum over a group has the variance sum R_ij, of which sum r_i is
the diagonal part. The other part is mostly negative, because the unknowns absorb a common shift of a group.
So tests with the variance sum r_i are conservative.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass

MOST = 20_000  # Largest number of values in the test of normality

BINS = 5  # Bins of the frame in each direction

FULL = 10.0  # Smallest redundancy of a bin

SINGULAR = 1e-6  # Smallest determinant of a regular matrix, as a part of the product of its diagonal

SPEAKING = 1e-3  # Smallest maximum of standardized residuals that are tested

CELLS = 10  # Cells of the frame in each direction; observations in one cell are neighbours


@dataclass(frozen=True)
class Normality:
    values: int  # Number of values
    excess: float  # Excess kurtosis; 0 of the normal distribution
    # Shares of values beyond 2 and 3 standard deviations; 0.0455 and 0.0027 if normal
    beyond: tuple[float, float]
    # Anderson and Darling's A^2 with mean and variance estimated, corrected for the number (Stephens
    # 1974)
    statistic: float
    probability: float  # p-value of the statistic for normal values


def normality(values: Floats) -> Normality | None:
    """Test values for any normal distribution (Anderson and Darling 1954).

    Residuals combine the errors of many observations and look more normal than these. So acceptance proves
    little if redundancy is low. None of less than 20 values, or equal ones.
    """
    z = values[np.isfinite(values)]
    # An odd step, so that x and y are both in the sample.
    z = np.sort(z[:: -(-z.size // MOST) | 1])
    n = z.size
    if n < 20 or not z.std(ddof=1) > 0:
        return None
    z = (z - z.mean()) / z.std(ddof=1)
    below = np.clip(_photocore.normal(z), 1e-300, 1.0)
    above = np.clip(_photocore.normal(-z), 1e-300, 1.0)
    ranks = 2 * np.arange(1, n + 1) - 1
    squared = -n - float(np.mean(ranks * (np.log(below) + np.log(above[::-1]))))
    corrected = squared * (1 + 0.75 / n + 2.25 / n**2)
    size = np.abs(z)
    return Normality(
        values=n,
        excess=float((z**4).mean() / (z**2).mean() ** 2 - 3),
        beyond=(float((size > 2).mean()), float((size > 3).mean())),
        statistic=corrected,
        probability=_of_anderson_darling(corrected),
    )


def _of_anderson_darling(a: float) -> float:
    """Return the p-value of corrected A^2 (D'Agostino and Stephens 1986, table 4.9)."""
    if a >= 0.6:
        return math.exp(min(1.2937 - 5.709 * a + 0.0186 * a * a, 0.0)) if a < 13 else 0.0
    if a > 0.34:
        return math.exp(0.9177 - 4.279 * a - 1.38 * a * a)
    if a > 0.2:
        return 1 - math.exp(-8.318 + 42.796 * a - 59.938 * a * a)
    return 1 - math.exp(-13.436 + 101.14 * a - 223.73 * a * a)


@dataclass(frozen=True)
class FramePattern:
    """Mean residuals over the frame of a camera."""

    # Sum over bins and axes of (sum of ~v)^2 / (sum of r), and its degrees of freedom (chi-square)
    statistic: float
    dof: float
    probability: float  # Of a statistic as large without a pattern
    rms: float  # Root mean square of the mean vectors of the bins, in standard deviations, x and y together
    largest: tuple[float, float]  # The largest mean vector of a bin, in standard deviations
    at: tuple[float, float]  # Mean image coordinates in that bin


def frame_pattern(
    xy: Floats, residuals: Floats, redundancy: Floats, parameters: int = 0
) -> FramePattern | None:
    """Test whether the mean residuals (m, 2) in the bins of a frame are zero.

    The number of estimated camera `parameters` reduces the degrees of freedom. None unless four of 5 x 5 bins
    have a redundancy of 10 in both axes.
    """
    if not len(xy):
        return None
    bins = _cells(xy, BINS)
    sums, checked, places = (_summed(bins, each) for each in (residuals, redundancy, xy))
    counts = np.bincount(bins, minlength=BINS**2)
    full = (checked >= FULL).all(axis=1)
    dof = 2.0 * int(np.count_nonzero(full)) - parameters
    if np.count_nonzero(full) < 4 or dof < 1:
        return None
    statistic = float((sums[full] ** 2 / checked[full]).sum())
    means = sums[full] / counts[full, np.newaxis]
    worst = int((means**2).sum(axis=1).argmax())
    at = (places[full] / counts[full, np.newaxis])[worst]
    return FramePattern(
        statistic=statistic,
        dof=dof,
        probability=_photocore.chi_square(statistic, dof),
        rms=math.sqrt(float((means**2).sum(axis=1).mean())),
        largest=(float(means[worst, 0]), float(means[worst, 1])),
        at=(float(at[0]), float(at[1])),
    )


def _cells(xy: Floats, count: int) -> Indices:
    """Return (m,) cells of observations, `count` per direction over their extent."""
    cells = np.zeros(len(xy), dtype=np.int64)
    for values in xy.T:  # Numpy is slow along short axes.
        low, high = values.min(), values.max()
        width = high - low if high > low else 1.0
        cells = cells * count + np.minimum((count * (values - low) / width).astype(np.int64), count - 1)
    return cells


def _summed(groups: Indices, values: Floats) -> Floats:
    return np.stack([np.bincount(groups, weights=column, minlength=BINS**2) for column in values.T], axis=1)


_UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # Upper triangle of a symmetric matrix


def group_patterns(
    groups: Indices, count: int, xy: Floats, residuals: Floats, redundancy: Floats
) -> tuple[Floats, Floats]:
    """Test groups of residuals for a shift and a linear form of coordinates.

    For a photo, this indicates film or scanner errors, or a wrong axis. With b = (1, x, y) centred and
    scaled, it is the score test c' C^-1 c, c = sum b ~v, C = sum r b b', in both axes. It is chi-square with
    six degrees of freedom.
    """
    sums = _summing(groups, count)
    numbers = np.maximum(np.bincount(groups, minlength=count), 1)
    x, y = (each - (sums(each) / numbers)[groups] for each in xy.T)
    spread = math.sqrt((x * x + y * y).mean() / 2) if len(xy) else 1.0
    x, y = x / (spread or 1.0), y / (spread or 1.0)
    statistics, enough = np.zeros(count), np.ones(count, dtype=bool)
    for v, r in zip(residuals.T.copy(), redundancy.T.copy(), strict=True):
        score: Floats = np.stack([sums(each) for each in (v, x * v, y * v)], axis=1)
        matrices = np.empty((count, 3, 3))
        of_x, of_y = x * r, y * r
        for (i, j), weights in zip(_UPPER, (r, of_x, of_y, x * of_x, y * of_x, y * of_y), strict=True):
            matrices[:, i, j] = matrices[:, j, i] = sums(weights)
        enough &= matrices[:, 0, 0] >= FULL
        matrices[~enough] = np.eye(3)
        statistics += _quadratic(matrices, score)
    statistics[~enough] = math.nan
    return statistics, np.array([_photocore.chi_square(each, 6.0) for each in statistics.tolist()])


def _summing(groups: Indices, count: int) -> Callable[[Floats], Floats]:
    """Return a function that sums values by group; consecutive values of sorted groups are added faster."""
    if not len(groups) or (groups[1:] < groups[:-1]).any():
        return lambda values: np.asarray(np.bincount(groups, values, count), dtype=np.float64)
    starts = np.flatnonzero(np.diff(groups, prepend=-1))

    def sums(values: Floats) -> Floats:
        found = np.zeros(count)
        found[groups[starts]] = np.add.reduceat(values, starts)
        return found

    return sums


def _quadratic(matrices: Floats, vectors: Floats) -> Floats:
    """Return c' C^+ c of (n, k, k) and (n, k), by pseudo-inverses if singular."""
    scale = np.sqrt(np.einsum("gii->gi", matrices))
    sound = np.linalg.det(matrices) > SINGULAR * scale.prod(axis=1) ** 2
    found = np.empty(len(vectors))
    c = vectors[sound]
    found[sound] = np.einsum("gi,gi->g", c, np.linalg.solve(matrices[sound], c[..., np.newaxis])[..., 0])
    c = vectors[~sound]
    found[~sound] = np.einsum("gi,gij,gj->g", c, np.linalg.pinv(matrices[~sound], hermitian=True), c)
    return found


@dataclass(frozen=True)
class Fit:
    """A regression of test values on other quantities."""

    statistic: float  # F, and its degrees of freedom
    dof: tuple[float, float]
    probability: float  # Of a statistic as large without a dependence
    rms: float  # Root mean square of the fitted values, in standard deviations


def regression(values: Floats, design: Floats) -> Fit | None:
    """Test the dependence of values on k columns by F with k and n - k.

    None with fewer than k + 5 values.
    """
    kept = np.isfinite(values)
    y, x = values[kept], design[kept]
    if len(y) < x.shape[1] + 5:
        return None
    basis, triangle = np.linalg.qr(x)
    first = int(np.count_nonzero(np.abs(np.diag(triangle)) > 1e-9 * np.abs(triangle).max()))
    if first < x.shape[1]:
        return None
    along = basis.T @ y
    explained, second = float(along @ along), float(len(y) - first)
    left = float(y @ y) - explained
    if not left > 0:
        return None
    statistic = (explained / first) / (left / second)
    probability = _photocore.fisher(statistic, float(first), second)
    return Fit(statistic, (float(first), second), probability, math.sqrt(explained / len(y)))


def moran(xy: Floats, photos: Indices, residuals: Floats) -> float:
    """Return Moran's I, the spatial correlation of residuals over the frame.

        I = (n / S0) sum w_ij z_i z_j / sum z_i^2,     S0 = sum w_ij

    The sums include x and y. Neighbours are observations in one of 10 x 10 cells of the frame but on
    different photos, because errors in object space correlate observations of one photo. w_ij is 1 / (number
    of neighbours of i). About 0 without a pattern; NaN without neighbours.
    """
    if not len(xy):
        return math.nan
    cells = _cells(xy, CELLS)
    _, shared = np.unique(cells * (int(photos.max()) + 1) + photos, return_inverse=True)
    neighbours = np.bincount(cells)[cells] - np.bincount(shared)[shared]
    seen = neighbours > 0
    squares = float((residuals**2).sum())
    if not (seen.any() and squares > 0):
        return math.nan
    lagged = np.zeros_like(residuals)
    for z, own in zip(residuals.T, lagged.T, strict=True):
        others = np.bincount(cells, weights=z)[cells] - np.bincount(shared, weights=z)[shared]
        own[seen] = others[seen] / neighbours[seen]
    return moran_index(residuals, lagged, float(seen.sum()))


def moran_index(values: Floats, lagged: Floats, total: float) -> float:
    """Return Moran's I from neighbour sums `lagged`; `total` is the weight sum.

    I = (n / total) sum z_i lagged_i / sum z_i^2 of (n, ...) values that are about zero on average.
    """
    return len(values) / total * float((values * lagged).sum()) / float((values**2).sum())


def durbin_watson(photos: Indices, count: int, residuals: Floats, redundancy: Floats) -> float:
    """Return d of mean residuals of photos in order (Durbin and Watson 1950).

        d = sum (m_(p+1) - m_p)^2 / sum m_p^2,     m_p = sum ~v / root of sum r

    The sums include x and y. d is about 2 if the residuals of consecutive photos are independent, and towards
    0 with a drift. NaN of fewer than three photos.
    """
    steps = squares = 0.0
    for v, r in zip(residuals.T, redundancy.T, strict=True):
        sums, checked = (np.bincount(photos, weights=each, minlength=count) for each in (v, r))
        means = sums[checked > 0] / np.sqrt(checked[checked > 0])
        if means.size < 3:
            return math.nan
        steps += float((np.diff(means) ** 2).sum())
        squares += float((means**2).sum())
    return steps / squares if squares > 0 else math.nan
