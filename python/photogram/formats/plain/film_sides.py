"""How films lie that their marks do not tell: where a photo has a pose, images of known points do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogram.arguments.types import Floats
from photogram.film.interior import conformal
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.images import Images
from photogram.formats.plain.photos import Photos

__all__ = ["Lying", "Seen", "way_by_images"]

BETTER = 4.0
"""Times by which images must be farther from their places in every other way to lie."""
NEAR = 0.1
"""How far they may be in the best, in parts of the format: poses and points are start values."""


@dataclass(frozen=True)
class Lying:
    """A way to lie: places in the camera's frame of the marks that were read, and the side."""

    places: Floats
    mirrored: bool


@dataclass(frozen=True)
class Seen:
    """Images of points whose coordinates are known at least nearly.

    Attributes
    ----------
    points
        (n, 3) coordinates; NaN where unknown.
    """

    images: Images
    points: Floats
    photos: Photos
    cameras: Cameras

    def of(self, photo: str) -> tuple[Floats, Floats]:
        """Return (m, 2) readings of a photo, and (m, 2) where its pose has them in the camera's frame."""
        row = self.photos.names.index(photo)
        own = self.images.photos == row
        c = -abs(self.cameras.cameras[self.photos.cameras[row]].parameters.get("c", np.nan))
        rays = (self.points[self.images.points[own]] - self.photos.centres[row]) @ self.photos.matrices[row]
        with np.errstate(divide="ignore", invalid="ignore"):
            places = c * rays[:, :2] / rays[:, 2:]
        known = np.isfinite(places).all(axis=1)
        return self.images.xy[own][known], places[known]


def way_by_images(ways: Sequence[Lying], true: Floats, images: Floats, seen: Floats) -> int | None:
    """Return which way to lie brings images where a pose has them; None where none does, or several do.

    Parameters
    ----------
    ways
        Ways to lie.
    true
        (n, 2) true places on the scanner of the marks.
    images, seen
        (m, 2) true places of images, and where they are in the camera's frame by the pose.
    """
    if len(images) < 2:
        return None
    apart = []
    for way in ways:
        t1, t2, theta, m = conformal(way.places, true, mirrored=way.mirrored)
        q = (images @ np.array([1.0, 1j]) - (t1 + 1j * t2)) / ((1.0 + m) * np.exp(1j * theta))
        q = -np.conj(q) if way.mirrored else q
        apart.append(float(np.sqrt(np.mean(np.abs(q - seen @ np.array([1.0, 1j])) ** 2))))
    order = np.argsort(apart)
    best = apart[order[0]]
    if best > NEAR * float(np.ptp(ways[0].places, axis=0).max()):
        return None
    return int(order[0]) if len(ways) == 1 or apart[order[1]] > BETTER * best else None
