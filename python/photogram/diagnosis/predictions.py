"""Observed image coordinates compared with predictions from given data.

(x, y) observed = R2 (x, y) predicted + t,     R2 = k V,  V orthogonal,  k = sqrt|det R2|
m = rms(observed - predicted) / rms(observed - mean),     e = rms(residual of this) / rms(observed - mean)

Proposals are evaluated by the misfit m of a changed block relative to that of the given data. Rough initial
poses suffice; an adjustment would not converge, or would reject what is right.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.diagnosis.mistakes import Proposal
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.motion import kept_images
from photogram.network.rays import Rays
from photogram.words import Phrase, phrase

LEAST = 6  # Known or intersected points that a photo needs
MOST = 12  # Maximum number of examined photos,
SCANNED = 200  # and of scanned photos of a larger block
UNKNOWN = 1e6  # Misfit of a photo without predictions


def view(block: Block, photos: Indices) -> Block:
    """Return the unweighted part of a block for comparing some photos.

    It has all observations of these points, except observations of given points on other photos.
    """
    chosen = np.isin(block.image_photos, photos)
    seen = np.zeros(len(block.point_ids), dtype=bool)
    seen[block.image_points[chosen]] = True
    seen &= ~given_points(block)
    return kept_images(block, chosen | seen[block.image_points]).replace(
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
    rows = [_rows(block, predicted, photo) for photo in photos]
    return np.array([relative(block.image_xy[own], predicted[own]) for own in rows])


def control_misfit(block: Block) -> tuple[float, float]:
    """Return m of all observations of given points, very large with too few, and their median residual."""
    rows = np.flatnonzero(given_points(block)[block.image_points])
    if not len(rows):
        return 0.0, 0.0
    xy, predicted = block.image_xy[rows], predictions(block)[rows]
    sizes = np.linalg.norm(xy - predicted, axis=1)
    return relative(xy, predicted), float(np.median(np.where(np.isfinite(sizes), sizes, np.inf)))


def _rows(block: Block, predicted: Floats, photo: int) -> Indices:
    found: Indices = np.flatnonzero((block.image_photos == photo) & np.isfinite(predicted).all(axis=1))
    return found


def relative(observed: Floats, predicted: Floats) -> float:
    """Return the rms of residuals relative to the observations about their mean; large with too few."""
    if len(observed) < LEAST:
        return UNKNOWN
    squares = ((observed - predicted) ** 2).sum() / ((observed - observed.mean(axis=0)) ** 2).sum()
    return float(np.sqrt(squares)) if np.isfinite(squares) else UNKNOWN


def regressions(block: Block, photos: Indices) -> list[Floats]:
    """Return k (k,), V (k, 2, 2), t (k, 2) in millimetres and e (k,) of k photos with enough points."""
    predicted = predictions(block)
    rows = [_rows(block, predicted, photo) for photo in photos]
    columns = zip(*(_regressed(block.image_xy[own], predicted[own]) for own in rows), strict=True)
    return [*map(np.array, columns)]


def _regressed(observed: Floats, predicted: Floats) -> tuple[float, Floats, Floats, float]:
    if len(observed) < LEAST:
        return np.nan, np.full((2, 2), np.nan), np.full(2, np.nan), UNKNOWN
    design = np.column_stack([predicted, np.ones(len(predicted))])
    solved = np.linalg.lstsq(design, observed, rcond=None)[0]
    linear = solved[:2].T
    left, _, right = np.linalg.svd(linear)
    scale = float(np.sqrt(abs(np.linalg.det(linear))))
    return scale, left @ right, solved[2], relative(observed, design @ solved)


def spread(photos: Indices, most: int) -> Indices:
    """Return an evenly spaced selection of at most `most` photos."""
    return photos[np.unique(np.linspace(0, len(photos) - 1, min(most, len(photos))).round().astype(np.int64))]


def eligible(block: Block, least: int = LEAST, most: int = SCANNED) -> Indices:
    """Return a selection of photos with enough points that are given or on two photos."""
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    usable = (given_points(block) | (rays > 1))[block.image_points]
    counts = np.bincount(block.image_photos[usable], minlength=len(block.photo_ids))
    return spread(np.flatnonzero(counts >= least), most)


SUSPICION = 0.35  # Misfit m above which photos are examined
PASSES, PASSES_ROUGH, ROUGH = 0.2, 0.3, 0.1
"""Largest ratio of the median misfit if the result is below ROUGH; otherwise initial poses are rough."""
EACH = 0.5
"""Largest ratio for each photo that did not fit, and for the median residual of control."""
AS_GOOD = 1.5  # Another proposal is as good if its misfit is below this multiple of the least


@dataclass(frozen=True, eq=False)
class Predicted:
    """Proposals with which predictions fit, best first; several if the data do not decide."""

    best: list[Proposal]
    before: float  # Median misfit of the given and of the corrected data
    after: float
    photos: Sequence[str] = ()  # With the mistake; empty for all photos
    what: str = "images"
    distance: float | None = None  # Principal distance of these photos, if they are all photos with it

    @property
    def names(self) -> list[str]:
        """Names of the mistakes."""
        return [each.name for each in self.best]

    @property
    def message(self) -> Phrase:
        """The message on the mistakes."""
        photos = list(self.photos)
        return phrase(
            f"convention.{'likely' if len(self.best) == 1 else 'one-of'}",
            causes=[each.message for each in self.best],
            photos=phrase("convention.photos", n=len(photos), photos=photos) if photos else "",
            misfit=phrase(f"convention.misfit.{self.what}", misfit=self.after),
            before=phrase("convention.before", misfit=self.before) if self.before < UNKNOWN else "",
        )


def predict(
    proposals: Iterable[Proposal], block: Block, misfits_of: Callable[[Block], Floats], **of: Any
) -> Predicted | None:
    """Return the proposals with which the photos of a block fit, if they do not fit without.

    `misfits_of` returns the (k,) misfits of a changed block. `of` are members of :class:`Predicted`.
    """
    given = misfits_of(block)
    before = float(np.median(given)) if len(given) else 0.0
    if not before > SUSPICION:
        return None
    found: dict[str, tuple[float, Proposal]] = {}
    for proposal in proposals:
        left = misfits_of(proposal.change(block))
        ratio, median = left / given, float(np.median(left))
        limit = PASSES_ROUGH if median > ROUGH else PASSES
        each = (ratio < EACH) | (np.maximum(left, given) < SUSPICION)
        if np.median(ratio) < limit and each.all() and median < SUSPICION:
            # The same mistake may occur in several forms.
            key = str(proposal.message) if proposal.exact else proposal.name
            found[key] = min(found.get(key, (np.inf, proposal)), (median, proposal), key=lambda own: own[0])
    if not found:
        return None
    after = min(misfit for misfit, _ in found.values())
    best = sorted(found.values(), key=lambda own: own[0])
    return Predicted([own for misfit, own in best if misfit <= AS_GOOD * after], before, after, **of)
