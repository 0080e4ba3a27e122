"""Observed image coordinates compared with predictions from given data.

(x, y) observed = R2 (x, y) predicted + t,     R2 = k V,  V orthogonal,  k = sqrt|det R2|
m = rms(observed - predicted) / rms(observed - mean),     e = rms(residual of this) / rms(observed - mean)
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.rays import Rays

LEAST = 6  # Known or intersected points that a photo needs
MOST = 12  # Maximum number of examined photos,
SCANNED = 200  # and of scanned photos of a larger block
UNKNOWN = 1e6  # Misfit of a photo without predictions


@dataclass(frozen=True, eq=False)
class Regression:
    """Regression of observed on predicted image coordinates of k photos."""

    misfit: Floats  # (k,) m
    scale: Floats  # (k,) k
    turn: Floats  # (k, 2, 2) V
    shift: Floats  # (k, 2) t, millimetres
    rest: Floats  # (k,) e


def view(block: Block, photos: Indices) -> Block:
    """Return the unweighted part of a block for comparing some photos.

    It has all observations of these points, except observations of given points on other photos.
    """
    chosen = np.isin(block.image_photos, photos)
    seen = np.zeros(len(block.point_ids), dtype=bool)
    seen[block.image_points[chosen]] = True
    seen &= ~given_points(block)
    images = chosen | seen[block.image_points]
    return block.replace(
        image_photos=block.image_photos[images],
        image_points=block.image_points[images],
        image_xy=block.image_xy[images],
        image_sd=block.image_sd[images],
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        photo_positions_observed=None,
        photo_attitudes_observed=None,
        point_sd=np.inf,
        observations=(),
        refraction=None,
    )


def given_points(block: Block) -> Bools:
    """(n,) whether the position of a point is given, as control or not."""
    return np.asarray(np.isfinite(block.point_positions).all(axis=1))


def predictions(block: Block) -> Floats:
    """(m, 2) predicted image coordinates, millimetres; NaN if a point has no position.

    Points without given positions are intersected.
    """
    rays = Rays.of(block)
    positions = rays.axes.positions(block.point_positions)
    unknown = ~given_points(block)
    if unknown.any():
        positions = np.where(unknown[:, np.newaxis], rays.intersect().positions, positions)
    residuals, _ = rays.residuals(positions[block.image_points])
    predicted: Floats = block.image_xy - residuals
    return predicted


def misfits(block: Block, photos: Indices) -> Floats:
    """(k,) m of some photos; very large with too few predicted points."""
    predicted = predictions(block)
    return np.array([_misfit(block, predicted, photo) for photo in photos])


def control_misfit(block: Block) -> float:
    """Return m of all observations of given points together; very large with too few."""
    rows = _control_rows(block)
    if len(rows) < LEAST:
        return UNKNOWN
    found = relative(block.image_xy[rows] - predictions(block)[rows], block.image_xy[rows])
    return found if np.isfinite(found) else UNKNOWN


def control_residuals(block: Block) -> Floats:
    """(k,) relative residuals of given points; infinite without prediction."""
    rows = _control_rows(block)
    xy = block.image_xy[rows]
    spread = float(np.sqrt(((xy - xy.mean(axis=0)) ** 2).sum(axis=1).mean()))
    found = np.linalg.norm(xy - predictions(block)[rows], axis=1) / spread
    return np.where(np.isfinite(found), found, np.inf)


def _control_rows(block: Block) -> Indices:
    found: Indices = np.flatnonzero(given_points(block)[block.image_points])
    return found


def _misfit(block: Block, predicted: Floats, photo: int) -> float:
    rows = _rows(block, predicted, photo)
    if len(rows) < LEAST:
        return UNKNOWN
    found = relative(block.image_xy[rows] - predicted[rows], block.image_xy[rows])
    return found if np.isfinite(found) else UNKNOWN


def _rows(block: Block, predicted: Floats, photo: int) -> Indices:
    found: Indices = np.flatnonzero((block.image_photos == photo) & np.isfinite(predicted).all(axis=1))
    return found


def relative(residuals: Floats, observed: Floats) -> float:
    """Return the rms of residuals relative to the observations about their mean."""
    return float(np.sqrt((residuals**2).sum() / ((observed - observed.mean(axis=0)) ** 2).sum()))


def regressions(block: Block, photos: Indices) -> Regression:
    """Compute the regression for some photos with enough points."""
    predicted = predictions(block)
    rows = [_rows(block, predicted, photo) for photo in photos]
    each = [_regressed(block.image_xy[own], predicted[own]) for own in rows]
    scale, turn, shift, rest = zip(*each, strict=True)
    return Regression(
        misfit=np.array([_misfit(block, predicted, photo) for photo in photos]),
        scale=np.array(scale),
        turn=np.array(turn),
        shift=np.array(shift),
        rest=np.array(rest),
    )


def _regressed(observed: Floats, predicted: Floats) -> tuple[float, Floats, Floats, float]:
    if len(observed) < LEAST:
        return np.nan, np.full((2, 2), np.nan), np.full(2, np.nan), UNKNOWN
    design = np.column_stack([predicted, np.ones(len(predicted))])
    solved = np.linalg.lstsq(design, observed, rcond=None)[0]
    linear = solved[:2].T
    left, _, right = np.linalg.svd(linear)
    rest = relative(observed - design @ solved, observed)
    return float(np.sqrt(abs(np.linalg.det(linear)))), left @ right, solved[2], rest


def spread(photos: Indices, most: int) -> Indices:
    """Return an evenly spaced selection of at most `most` photos."""
    return photos[np.unique(np.linspace(0, len(photos) - 1, min(most, len(photos))).round().astype(np.int64))]


def eligible(block: Block) -> Indices:
    """Return a selection of photos with enough points that are given or on two photos."""
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    usable = (given_points(block) | (rays > 1))[block.image_points]
    counts = np.bincount(block.image_photos[usable], minlength=len(block.photo_ids))
    return spread(np.flatnonzero(counts >= LEAST), SCANNED)
