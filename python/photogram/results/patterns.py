"""Tests for patterns of residuals over the frame, photos, strips and control.

Outliers are first clipped, and the median of the test values removes a common factor of all standard
deviations. Both would appear as patterns.

Residuals are not independent: ~v = R ~e. Therefore permutations of residuals do not represent the null
hypothesis, and sums of r as variances of sums make tests conservative. Instead, errors e of all images are
drawn and R e computed: the residuals of the network for errors without patterns. A statistic of the residuals
is compared with each draw:

    p = (1 + number of draws with a statistic as large) / (1 + number of draws)

This is exact for any number of draws (Barnard 1963), but cannot be below 1 / (1 + draws).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import argument_error, chosen, finite_rows, whole_number
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.motion import focal_images
from photogram.results.fixed_tests import fall_by_lens
from photogram.results.network import AdjustedNetwork
from photogram.results.network_tables import point_axes
from photogram.statistics import patterns as fits
from photogram.statistics.distributions import LEVEL, bonferroni
from photogram.statistics.evidence import MEDIAN
from photogram.statistics.findings import Systematic
from photogram.statistics.reliability import TESTABLE
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import Result

LEVEL_OF_PATTERNS = 0.001  # Low, because several patterns are tested
NOTABLE = 0.3  # Smallest mean residual that matters, in standard deviations
CLIPPED = 3.0  # Limit of test values
VISIBLE = 0.1  # Smallest redundancy number in the test of normality
TOGETHER = 20  # Number of draws that are projected together
KURTOSIS = (-0.7, 1.0)  # Limits of excess kurtosis without a message


@dataclass(frozen=True, eq=False)
class CameraImages:
    name: str  # Name of the camera
    photos: Bools  # (P,) its photos
    estimated: int  # Number of its estimated parameters


def patterns(
    result: AdjustedNetwork,
    cameras: Sequence[CameraImages],
    axes: Sequence[str] = (),
    fall: Callable[[Bools], float] = lambda _: 0.0,
) -> list[Systematic]:
    """Return the tests of patterns of a network with sufficient data.

    `axes` are the names of the coordinates of stations and points, the height last; empty without meaning on
    the ground. `fall` returns the decrease of the weighted sum of squares with a separate lens model for (m,)
    images of a camera; it is called for large patterns.
    """
    used = chosen(result.used_images & finite_rows(result.redundancy))
    w = np.where(result.redundancy > TESTABLE, result.standardized, math.nan)[used]
    if not np.isfinite(w).any() or not (factor := float(np.nanmedian(np.abs(w))) / MEDIAN) > 0:
        return []
    # ~v = w sqrt(r) of clipped w; 0 if untested.
    redundancy = np.where(np.isfinite(w), result.redundancy[used], 0.0)
    residuals = _clipped(w, redundancy, factor)
    given, (axis, _) = result.given, result._terms.image_axes
    # Tests by photo use measured coordinates: samples and lines for scanners.
    photos, xy, measured = given.image_photos[used], focal_images(given)[used], given.image_xy[used]
    scale = factor * given.image_sd[used].T.copy().mean(axis=1) * axis.factor
    found = list[Systematic | None]()
    for camera in cameras:
        own = chosen(camera.photos[photos])
        pattern = fits.frame_pattern(xy[own], residuals[own], redundancy[own], camera.estimated)
        if pattern is None:
            continue
        dx, dy = (float(each * size) for each, size in zip(pattern.largest, scale.tolist(), strict=True))
        fields = {"camera": camera.name, "rms": float(pattern.rms), "dx": dx, "dy": dy, "unit": axis.small}
        place = {"x": float(pattern.at[0]), "y": float(pattern.at[1])}
        sentence, kind = (
            Phrase("pattern.frame", fields | place),
            Phrase("test.frame", {"camera": camera.name}),
        )
        test = "B", "chi2", (pattern.dof,), pattern.statistic, pattern.probability, LEVEL_OF_PATTERNS
        systematic = Systematic(kind, sentence, *test, large=pattern.rms > NOTABLE)
        if systematic.significant and systematic.large:
            systematic = replace(systematic, fall=fall(camera.photos[given.image_photos]))
        found.append(systematic)
    found.append(_of_photos(photos, given.photo_ids, measured, residuals, redundancy))
    found.append(_distribution(result, used))
    if axes:
        # Weighted observed positions may drift along the order of the photos.
        w = np.where(result.photo_redundancy > TESTABLE, result.photo_standardized, math.nan)
        w = np.where(np.abs(np.nan_to_num(w)).max(axis=0) > fits.SPEAKING, w, math.nan)
        design = np.vander(np.linspace(-1.0, 1.0, len(w)), 3, increasing=True)
        found += [
            _regressed("drift", fits.regression(w[:, k], design), axis=Phrase(f"axis.{name}"))
            for k, name in enumerate(axes)
        ]
        found.append(_of_heights(result))
    return [each for each in found if each is not None]


def _cameras(result: Result) -> list[CameraImages]:
    """Return the cameras of a block; one if it has principal distances."""
    block = result.block
    if block.photo_cameras is None:
        return [CameraImages(str(phrase("test.camera")), np.ones(len(block.photo_ids), dtype=bool), 0)]
    return [
        CameraImages(each.name, block.photo_cameras == row, int(np.count_nonzero(each.information)))
        for row, each in enumerate(result.cameras)
    ]


def block_patterns(result: Result) -> list[Systematic]:
    axes = [axis.name for axis in point_axes(result.block)]
    return patterns(result, _cameras(result), axes, lambda own: fall_by_lens(result, own))


def _clipped(w: Floats, redundancy: Floats, factor: float) -> Floats:
    return np.asarray(np.nan_to_num(np.clip(w / factor, -CLIPPED, CLIPPED)) * np.sqrt(redundancy))


def _of_photos(
    image_photos: Indices, photos: Sequence[str], xy: Floats, residuals: Floats, redundancy: Floats
) -> Systematic | None:
    statistics, probabilities = fits.group_patterns(image_photos, len(photos), xy, residuals, redundancy)
    if np.isnan(probabilities).all():
        return None
    worst, level = int(np.nanargmin(probabilities)), bonferroni(LEVEL, int(np.isfinite(probabilities).sum()))
    name, values = str(photos[worst]), (float(statistics[worst]), float(probabilities[worst]))
    kind, sentence = Phrase("test.photo"), Phrase("pattern.photo", {"photo": name})
    return Systematic(kind, sentence, "c'C^-1c", "chi2", (6.0,), *values, level, subject=name)


def _distribution(result: AdjustedNetwork, used: Bools | slice) -> Systematic | None:
    """Test the normal distribution of residuals; of points on two photos the one with most redundancy."""
    redundancy, w = result.redundancy[used], result.standardized[used]
    single = result.point_rays[result.image_points[used]] <= 2
    seen = redundancy > VISIBLE
    # Numpy is slow along short axes.
    seen &= ~single[:, np.newaxis] | (redundancy >= np.maximum(*redundancy.T)[:, np.newaxis])
    found = fits.normality(w[seen])
    if found is None:
        return None
    two, three = (100 * float(share) for share in found.beyond)
    tails = "heavier" if found.excess > 0 else "lighter"
    fields = {"excess": float(found.excess), "two": two, "three": three}
    sentence = Phrase(f"pattern.{tails}-tails", fields)
    notable = found.excess > KURTOSIS[1] or found.excess < KURTOSIS[0]
    p = found.probability if notable else max(found.probability, LEVEL_OF_PATTERNS)
    test = "A^2", "Anderson-Darling", (), found.statistic, p, LEVEL_OF_PATTERNS
    return Systematic(Phrase("test.normality"), sentence, *test)


def _of_heights(result: AdjustedNetwork) -> Systematic | None:
    """Test the heights of control for bending over the area."""
    w = np.where(result.point_redundancy[:, 2] > TESTABLE, result.point_standardized[:, 2], math.nan)
    tested = np.isfinite(w)
    w, plan = w[tested], result.point_positions[tested, :2]
    if not (len(w) and np.ptp(plan, axis=0).any()):
        return None
    plan = plan - plan.mean(axis=0)
    x, y = (plan / np.abs(plan).max()).T
    design = np.column_stack([np.ones(len(w)), x, y, x * x, x * y, y * y])
    return _regressed("bending", fits.regression(w, design))


def _regressed(code: str, found: fits.Fit | None, **fields: Phrase) -> Systematic | None:
    if found is None:
        return None
    sentence = Phrase(f"pattern.{code}", {**fields, "rms": float(found.rms)})
    test = "F", "F", found.dof, found.statistic, found.probability, LEVEL_OF_PATTERNS
    return Systematic(Phrase(f"test.{code}", fields), sentence, *test)


@dataclass(frozen=True)
class DrawnPattern:
    """A pattern of residuals, with the probability of a stronger random pattern.

    Attributes
    ----------
    name
        The name of the pattern.
    statistic
        `B` of the bins of the frame, Moran's `I`, Durbin and Watson's `d`.
    value
        The statistic of the residuals.
    expected, sd
        Mean and standard deviation over the draws.
    probability
        Share of draws with an equal or stronger pattern; see the module.
    draws
        The number of draws.
    """

    name: str
    statistic: str
    value: float
    expected: float
    sd: float
    probability: float
    draws: int


_Pattern = tuple[str, str, Callable[[Floats], float]]
"""Name, statistic, and function that computes it from (m, 2) residuals ~v."""


def drawn_patterns(result: Result, *, draws: int = 200, seed: int = 1) -> list[DrawnPattern]:
    """Test image residuals for patterns by simulated residuals without patterns.

    For every camera: mean residuals over the frame (B, as in the verdict), and the similarity of residuals
    of adjacent images in the frame on other photos (Moran's I 1950). For the sequence of photos: the
    similarity of the mean residuals of consecutive photos (Durbin and Watson's d 1950). Outliers are clipped
    at three standard deviations, in residuals and draws.

    Parameters
    ----------
    result
        An adjusted block, with redundancy numbers.
    draws, seed
        The number of draws, and the seed of their random numbers. Each draw requires a solution with the
        factor.

    Raises
    ------
    InputError
        If the result is without redundancy numbers or with a robust loss, or an option is invalid.
    OutOfMemoryError, KeyboardInterrupt
        As in :meth:`photogram.Result.covariances`.
    """
    if whole_number("draws", draws) < 1:
        raise argument_error("draws", "positive", value=draws)
    block, used = result.block, result.used_images
    if result.loss is not None or not np.isfinite(result.redundancy[used]).all() or not used.any():
        raise InputError(phrase("models.patterns"))
    redundancy = np.where(used[:, np.newaxis] & (result.redundancy > TESTABLE), result.redundancy, 0.0)
    tests = _patterns(result, redundancy)

    def values(residuals: Floats) -> Floats:
        with np.errstate(invalid="ignore", divide="ignore"):
            w = np.where(redundancy > 0, residuals / np.sqrt(redundancy), math.nan)
        clipped = _clipped(w, redundancy, float(np.nanmedian(np.abs(w))) / MEDIAN)
        return np.array([value(clipped) for *_, value in tests])

    found, drawn = values(result.residuals / block.image_sd), list[Floats]()
    random, core = np.random.default_rng(seed), result._factor()
    while count := min(TOGETHER, draws - len(drawn)):
        errors = np.where(used[:, np.newaxis], random.normal(size=(count, *block.image_xy.shape)), 0.0)
        drawn += [values(each) for each in core.project_images(errors, threads=0, progress=None)]
    tested = []
    for (name, statistic, _), value, by_chance in zip(tests, found.tolist(), np.array(drawn).T, strict=True):
        if math.isfinite(value):
            strong = int((by_chance <= value if statistic == "d" else by_chance >= value).sum())
            sd, p = float(by_chance.std(ddof=1)) if draws > 1 else math.nan, (1 + strong) / (1 + draws)
            tested.append(DrawnPattern(name, statistic, value, float(by_chance.mean()), sd, p, draws))
    return tested


def _patterns(result: Result, redundancy: Floats) -> list[_Pattern]:
    block, photos = result.block, result.block.image_photos
    tested, xy = (redundancy > 0).any(axis=1), focal_images(result.block)

    def bins(own: Indices, v: Floats) -> float:
        pattern = fits.frame_pattern(xy[own], v[own], redundancy[own])
        return math.nan if pattern is None else pattern.statistic

    def alike(own: Indices, v: Floats) -> float:
        return fits.moran(xy[own], photos[own], v[own])

    found: list[_Pattern] = []
    for camera in _cameras(result):
        own = np.flatnonzero(camera.photos[photos] & tested)
        found.append((str(phrase("drawn.frame", camera=camera.name)), "B", partial(bins, own)))
        found.append((str(phrase("drawn.neighbours", camera=camera.name)), "I", partial(alike, own)))
    along = partial(fits.durbin_watson, photos, len(block.photo_ids), redundancy=redundancy)
    return [*found, (str(phrase("drawn.photos")), "d", along)]
