"""Patterns of image residuals against their exact distribution, by draws of residuals without a pattern.

Residuals are not independent: ~v = R ~e. So a permutation of residuals is no null, and sums of r for the
variances of sums make tests conservative. Here errors e of all images are drawn, and R e computed: what the
network itself makes of errors that have no pattern. A statistic of the residuals is compared with that of
each draw:

    p = (1 + number of draws with a statistic as large) / (1 + number of draws)

which is exact for any number of draws (Barnard 1963), but cannot be below 1 / (1 + draws).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import whole_number
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.motion import focal_images
from photogram.results.group_sums import factored
from photogram.statistics.evidence import MEDIAN
from photogram.statistics.patterns import durbin_watson, frame_pattern, moran
from photogram.statistics.reliability import TESTABLE

if TYPE_CHECKING:
    from photogram import Result

CLIPPED = 3.0  # Larger test values count as this one
TOGETHER = 20  # Draws that are projected at a time


@dataclass(frozen=True)
class DrawnPattern:
    """A pattern of residuals, and how often chance makes as strong a one.

    Attributes
    ----------
    name
        What is looked for.
    statistic
        `B` of the bins of the frame, Moran's `I`, Durbin and Watson's `d`.
    value
        Of the residuals.
    expected, sd
        Mean and standard deviation over the draws.
    probability
        Share of draws with a pattern as strong; see the module.
    draws
        How many there were.
    """

    name: str
    statistic: str
    value: float
    expected: float
    sd: float
    probability: float
    draws: int


@dataclass(frozen=True)
class _Pattern:
    name: str
    statistic: str
    value: Callable[[Floats], float]
    """Of (m, 2) residuals ~v."""
    least: bool = False  # Whether small values are the pattern


def drawn_patterns(result: Result, *, draws: int = 200, seed: int = 1) -> list[DrawnPattern]:
    """Test the residuals of the images of a block for patterns, against draws of residuals without any.

    For every camera: mean residuals over the frame (B, as the verdict tests it), and whether residuals of
    images near each other in the frame, on other photos, are alike (Moran's I 1950). Over the photos in
    their order: whether the mean residuals of one and the next are alike (Durbin and Watson's d 1950).
    Outliers are clipped at three standard deviations, in residuals and draws.

    Parameters
    ----------
    result
        An adjusted block, with redundancy numbers.
    draws, seed
        How many draws, and where their random numbers start. Each takes a solution with the factor.

    Raises
    ------
    InputError
        A result without redundancy numbers or with a robust loss; options that cannot be.
    OutOfMemoryError, KeyboardInterrupt
        As :meth:`photogram.Result.covariances`.
    """
    if whole_number("draws", draws) < 1:
        raise InputError("there must be one draw at least")
    block, used = result.block, result.used_images
    if result.loss is not None or not np.isfinite(result.redundancy[used]).all() or not used.any():
        raise InputError("patterns are tested in results with redundancy numbers and without a loss")
    redundancy = np.where(used[:, np.newaxis] & (result.redundancy > TESTABLE), result.redundancy, 0.0)
    patterns = _patterns(result, redundancy)

    def values(residuals: Floats) -> Floats:
        clipped = _clipped(residuals, redundancy)
        return np.array([pattern.value(clipped) for pattern in patterns])

    found = values(result.residuals / block.image_sd)
    random, core = np.random.default_rng(seed), factored(result)
    drawn: list[Floats] = []
    while len(drawn) < draws:
        count = min(TOGETHER, draws - len(drawn))
        errors = np.where(used[:, np.newaxis], random.normal(size=(count, *block.image_xy.shape)), 0.0)
        drawn += [values(each) for each in core.project_images(errors, threads=0, progress=None)]
    tested = []
    for pattern, value, by_chance in zip(patterns, found.tolist(), np.array(drawn).T, strict=True):
        if math.isfinite(value):
            strong = int((by_chance <= value if pattern.least else by_chance >= value).sum())
            sd = float(by_chance.std(ddof=1)) if draws > 1 else math.nan
            p = (1 + strong) / (1 + draws)
            mean = float(by_chance.mean())
            tested.append(DrawnPattern(pattern.name, pattern.statistic, value, mean, sd, p, draws))
    return tested


def _clipped(residuals: Floats, redundancy: Floats) -> Floats:
    """Return ~v of which outliers are clipped and a common factor is taken out; 0 where nothing is tested."""
    root = np.sqrt(redundancy)
    with np.errstate(invalid="ignore", divide="ignore"):
        w = np.where(root > 0, residuals / root, math.nan)
    factor = float(np.nanmedian(np.abs(w))) / MEDIAN
    return np.nan_to_num(np.clip(w / factor, -CLIPPED, CLIPPED)) * root


def _patterns(result: Result, redundancy: Floats) -> list[_Pattern]:
    block = result.block
    photos: Indices = np.arange(len(block.photo_ids))
    cameras = [("the camera", photos >= 0)]
    if block.photo_cameras is not None:
        cameras = [(each.name, block.photo_cameras == row) for row, each in enumerate(result.cameras)]
    tested = (redundancy > 0).any(axis=1)
    found = []
    for name, own_photos in cameras:
        own = np.flatnonzero(own_photos[block.image_photos] & tested)
        xy, on, r = focal_images(block)[own], block.image_photos[own], redundancy[own]

        def bins(v: Floats, own: Indices = own, xy: Floats = xy, r: Floats = r) -> float:
            pattern = frame_pattern(xy, v[own], r)
            return math.nan if pattern is None else pattern.statistic

        def alike(v: Floats, own: Indices = own, xy: Floats = xy, on: Indices = on) -> float:
            return moran(xy, on, v[own])

        found += [
            _Pattern(f"pattern over the frame of {name}", "B", bins),
            _Pattern(f"neighbours in the frame of {name}", "I", alike),
        ]

    def along(v: Floats) -> float:
        return durbin_watson(block.image_photos, len(photos), v, redundancy)

    return [*found, _Pattern("one photo and the next", "d", along, least=True)]
