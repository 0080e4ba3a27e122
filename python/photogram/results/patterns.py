"""Whether the residuals of a network show a pattern: over the frame, by photo, along the strip, over control.

Outliers are clipped and a common factor of all standard deviations is taken out first, by the median of the
test values: what is left of them would be taken for a pattern.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from photogram.arguments.arrays import chosen, finite_rows
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.motion import focal_images
from photogram.results.network import AdjustedNetwork
from photogram.statistics.distributions import LEVEL, bonferroni
from photogram.statistics.evidence import MEDIAN
from photogram.statistics.findings import Systematic
from photogram.statistics.patterns import SPEAKING, Fit, frame_pattern, group_patterns, normality, regression
from photogram.statistics.reliability import TESTABLE
from photogram.words import Phrase

LEVEL_OF_PATTERNS = 0.001  # Low, because several patterns are tested
NOTABLE = 0.3  # Smallest mean residual that matters, in standard deviations
CLIPPED = 3.0  # Limit of test values
VISIBLE = 0.1  # Smallest redundancy number in the test of normality
KURTOSIS = (-0.7, 1.0)  # Limits of excess kurtosis without a message


@dataclass(frozen=True, eq=False)
class CameraImages:
    name: str  # Of the camera
    photos: Bools  # (P,) which photos have it
    estimated: int  # How many of its parameters are estimated


def patterns(
    result: AdjustedNetwork,
    cameras: Sequence[CameraImages],
    axes: Sequence[str] = (),
    fall: Callable[[Bools], float] = lambda _: 0.0,
) -> list[Systematic]:
    """Return the tests of patterns of a network, where there is enough to test.

    `axes` are what the coordinates of stations and points are called, the height last; none where they mean
    nothing on the ground. `fall` gives by how much the weighted sum of squares would fall with a lens for
    (m,) images of a camera; it is asked for where the pattern is large.
    """
    used = chosen(result.used_images & finite_rows(result.redundancy))
    w = np.where(result.redundancy > TESTABLE, result.standardized, math.nan)[used]
    if not np.isfinite(w).any():
        return []
    factor = float(np.nanmedian(np.abs(w))) / MEDIAN
    if not factor > 0:
        return []
    # ~v = w sqrt(r), of w that are clipped; 0 if nothing is tested.
    redundancy = np.where(np.isfinite(w), result.redundancy[used], 0.0)
    residuals = np.nan_to_num(np.clip(w / factor, -CLIPPED, CLIPPED)) * np.sqrt(redundancy)
    given, (axis, _) = result.given, result._terms().image_axes
    # By photo the coordinates are those that were measured: of a scanner, samples and lines.
    image_photos, xy, measured = given.image_photos, focal_images(given), given.image_xy
    scale = factor * given.image_sd[used].mean(axis=0) * axis.factor
    found: list[Systematic | None] = [
        _of_camera(each, image_photos[used], xy[used], residuals, redundancy, scale, axis.small)
        for each in cameras
    ]
    for row, (each, camera) in enumerate(zip(found, cameras, strict=True)):
        if each is not None and each.significant and each.large:
            found[row] = replace(each, fall=fall(camera.photos[image_photos]))
    found.append(_of_photos(image_photos[used], given.photo_ids, measured[used], residuals, redundancy))
    found.append(_distribution(result, used))
    if axes:
        # Observed positions that have a weight may drift along the order of the photos.
        w = np.where(result.photo_redundancy > TESTABLE, result.photo_standardized, math.nan)
        w = np.where(np.abs(np.nan_to_num(w)).max(axis=0) > SPEAKING, w, math.nan)
        design = np.vander(np.linspace(-1.0, 1.0, len(w)), 3, increasing=True)
        found += [
            _regressed("drift", regression(w[:, k], design), axis=Phrase(f"axis.{name}"))
            for k, name in enumerate(axes)
        ]
        found.append(_of_heights(result))
    return [each for each in found if each is not None]


def _of_camera(
    camera: CameraImages,
    image_photos: Indices,
    xy: Floats,
    residuals: Floats,
    redundancy: Floats,
    scale: Floats,
    unit: str,
) -> Systematic | None:
    own = chosen(camera.photos[image_photos])
    found = frame_pattern(xy[own], residuals[own], redundancy[own], camera.estimated)
    if found is None:
        return None
    x, y = (each * size for each, size in zip(found.largest, scale.tolist(), strict=True))
    place = {"x": float(found.at[0]), "y": float(found.at[1])}
    fields = {"camera": camera.name, "rms": float(found.rms), "dx": float(x), "dy": float(y), "unit": unit}
    return Systematic(
        kind=Phrase("test.frame", {"camera": camera.name}),
        sentence=Phrase("pattern.frame", {**fields, **place}),
        statistic="B",
        distribution="chi2",
        dof=(found.dof,),
        value=found.statistic,
        probability=found.probability,
        level=LEVEL_OF_PATTERNS,
        large=found.rms > NOTABLE,
    )


def _of_photos(
    image_photos: Indices, photos: Sequence[str], xy: Floats, residuals: Floats, redundancy: Floats
) -> Systematic | None:
    statistics, probabilities = group_patterns(image_photos, len(photos), xy, residuals, redundancy)
    if np.isnan(probabilities).all():
        return None
    worst, tested = int(np.nanargmin(probabilities)), int(np.isfinite(probabilities).sum())
    return Systematic(
        kind=Phrase("test.photo"),
        subject=str(photos[worst]),
        sentence=Phrase("pattern.photo", {"photo": str(photos[worst])}),
        statistic="c'C^-1c",
        distribution="chi2",
        dof=(6.0,),
        value=float(statistics[worst]),
        probability=float(probabilities[worst]),
        level=bonferroni(LEVEL, tested),
    )


def _distribution(result: AdjustedNetwork, used: Bools | slice) -> Systematic | None:
    """Test whether residuals are normal, one value of each visible direction.

    The coordinates of a point on two photos repeat each other: the one with most redundancy is taken.
    """
    redundancy, w = result.redundancy[used], result.standardized[used]
    single = result.point_rays[result.image_points[used]] <= 2
    seen = redundancy > VISIBLE
    seen[single] &= redundancy[single] >= redundancy[single].max(axis=1, keepdims=True)
    found = normality(w[seen])
    if found is None:
        return None
    two, three = (100 * float(share) for share in found.beyond)
    tails = "heavier" if found.excess > 0 else "lighter"
    fields = {"excess": float(found.excess), "two": two, "three": three}
    return Systematic(
        kind=Phrase("test.normality"),
        sentence=Phrase(f"pattern.{tails}-tails", fields),
        statistic="A^2",
        distribution="Anderson-Darling",
        dof=(),
        value=found.statistic,
        probability=found.probability
        if found.excess > KURTOSIS[1] or found.excess < KURTOSIS[0]
        else max(found.probability, LEVEL_OF_PATTERNS),
        level=LEVEL_OF_PATTERNS,
    )


def _of_heights(result: AdjustedNetwork) -> Systematic | None:
    """Test whether the heights of control bend over the area."""
    w = np.where(result.point_redundancy > TESTABLE, result.point_standardized, math.nan)[:, 2]
    tested = np.isfinite(w)
    if not tested.any():
        return None
    plan = result.point_positions[:, :2] - result.point_positions[tested, :2].mean(axis=0)
    extent = float(np.abs(plan[tested]).max())
    if not extent > 0:
        return None
    plan = plan / extent
    x, y = plan.T
    design = np.column_stack([np.ones(len(w)), x, y, x * x, x * y, y * y])
    return _regressed("bending", regression(w, design, tested))


def _regressed(code: str, found: Fit | None, **fields: Phrase) -> Systematic | None:
    if found is None:
        return None
    return Systematic(
        kind=Phrase(f"test.{code}", fields),
        sentence=Phrase(f"pattern.{code}", {**fields, "rms": float(found.rms)}),
        statistic="F",
        distribution="F",
        dof=found.dof,
        value=found.statistic,
        probability=found.probability,
        level=LEVEL_OF_PATTERNS,
    )
