"""How films lie that their marks do not tell: images of known points do, by the pose, and tie points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Literal

import numpy as np

from photogram.arguments.types import Floats
from photogram.film.interior import conformal
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.images import Images
from photogram.formats.plain.photos import Photos
from photogram.lazy_dataclasses import dataclass

__all__ = ["Expected", "Laid", "Lying", "Seen", "way_by_images"]

BETTER = 4.0
"""Times by which images must be farther from their places in every other way to lie."""
NEAR = 0.1
"""How far they may be in the best, in parts of the format: poses and points are start values."""
TIES = 4
"""Points that two photos have in common at least."""


@dataclass(frozen=True)
class Lying:
    """A way to lie: places in the camera's frame of the marks that were read, and the side."""

    places: Floats
    mirrored: bool

    def back(self, true: Floats, images: Floats) -> Floats:
        """Return (m,) complex places in the camera's frame of images, by true places (n, 2) of the marks."""
        t1, t2, theta, m = conformal(self.places, true, mirrored=self.mirrored)
        q = (images @ np.array([1.0, 1j]) - (t1 + 1j * t2)) / ((1.0 + m) * np.exp(1j * theta))
        return np.asarray(-np.conj(q) if self.mirrored else q)


@dataclass(frozen=True)
class Laid:
    """A film of which it is known how it lies, and true places of its marks and images on the scanner."""

    way: Lying
    marks: Floats
    images: Floats

    def places(self) -> Floats:
        """Return (m,) complex places of its images in the camera's frame."""
        return self.way.back(self.marks, self.images)


@dataclass(frozen=True)
class Expected:
    """Where images of a photo should be in the camera's frame.

    Attributes
    ----------
    rows
        (m,) of the images of the photo.
    places
        (m,) complex, mm.
    but
        For what: nothing, a shift and scale, or a rotation with these.
    """

    rows: np.ndarray
    places: Floats
    but: Literal["nothing", "shift", "rotation"] = "nothing"

    def apart(self, q: Floats) -> float:
        """Return the root mean square of what images (m,) are away."""
        left = q - self.places
        if self.but != "nothing":
            own, other = q - q.mean(), self.places - self.places.mean()
            turned = np.vdot(other, own)
            by = turned if self.but == "rotation" else np.linalg.norm(own) * np.linalg.norm(other)
            left = own - by / np.vdot(other, other) * other
        return float(np.sqrt(np.mean(np.abs(left) ** 2)))


@dataclass(frozen=True)
class Seen:
    """Images, and points whose coordinates are known at least nearly.

    Attributes
    ----------
    points
        (n, 3) coordinates; NaN where unknown.
    """

    images: Images
    points: Floats
    photos: Photos
    cameras: Cameras

    def readings(self, photo: str) -> Floats:
        """Return (m, 2) readings of a photo."""
        found: Floats = self.images.xy[self._rows(photo)]
        return found

    def deviations(self, photo: str) -> Floats:
        """Return (m,) the larger standard deviations of these; 1 where nothing is said of them."""
        rows, sd = self._rows(photo), self.images.sd
        found: Floats = np.ones(len(rows)) if sd is None else sd[rows].max(axis=1)
        return found

    def expected(self, photo: str, laid: Callable[[str], Laid | None]) -> Iterator[Expected]:
        """Yield where images of a photo should be: by its pose, and by that of tie points on another photo.

        Parameters
        ----------
        photo
            Its name.
        laid
            Tells of another photo how its film lies, where that is known: asked of few.
        """
        own = self.images.points[self._rows(photo)]
        centre, axes, c = self._pose(photo)
        places = _projected((self.points[own] - centre) @ axes, c)
        known = np.flatnonzero(np.isfinite(places))
        yield Expected(known, places[known])
        found = ((other, lies) for other in self._neighbours(photo, own) if (lies := laid(other)) is not None)
        other, lies = next(found, (None, None))
        if other is None or lies is None:
            return
        theirs = self.images.points[self._rows(other)]
        rows, there = (
            np.array([np.flatnonzero(each == point)[0] for point in np.intersect1d(own, theirs)])
            for each in (own, theirs)
        )
        q = lies.places()[there]
        _, turned, distance = self._pose(other)
        rays = np.column_stack([q.real, q.imag, np.full(len(q), distance)])
        places = _projected(rays @ turned.T @ axes, c)
        if np.isfinite(places).all():
            yield Expected(rows, places, "shift")
        else:
            yield Expected(rows, q, "rotation")

    def _neighbours(self, photo: str, points: np.ndarray) -> list[str]:
        """Return the other photos with enough of some points, that with the most first."""
        images = np.unique(
            np.column_stack([self.images.photos, self.images.points])[np.isin(self.images.points, points)],
            axis=0,
        )
        counts = np.bincount(images[:, 0], minlength=len(self.photos.names))
        order = np.argsort(-counts, kind="stable")
        names = [self.photos.names[row] for row in order.tolist() if counts[row] >= TIES]
        return [name for name in names if name != photo]

    def _rows(self, photo: str) -> np.ndarray:
        return np.flatnonzero(self.images.photos == self.photos.names.index(photo))

    def _pose(self, photo: str) -> tuple[Floats, Floats, float]:
        """Return centre, axes as columns, and principal distance of the positive; NaN where unknown."""
        row = self.photos.names.index(photo)
        c = -abs(self.cameras.cameras[self.photos.cameras[row]].parameters.get("c", np.nan))
        centres, matrices = np.asarray(self.photos.centres), np.asarray(self.photos.matrices)
        return centres[row], matrices[row], c


def _projected(rays: Floats, c: float) -> Floats:
    """Return (m,) complex places of rays (m, 3) in the camera's frame."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(c * (rays[:, 0] + 1j * rays[:, 1]) / rays[:, 2])


def way_by_images(ways: Sequence[Lying], true: Floats, images: Floats, expected: Expected) -> int | None:
    """Return which way to lie brings images where they should be; None where none does, or several do.

    Parameters
    ----------
    ways
        Ways to lie.
    true
        (n, 2) true places on the scanner of the marks.
    images
        (m, 2) true places of all images of the photo.
    expected
        Where some of them should be.
    """
    if len(expected.rows) < 2:
        return None
    apart = [expected.apart(way.back(true, images[expected.rows])) for way in ways]
    order = np.argsort(apart)
    best = apart[order[0]]
    if best > NEAR * float(np.ptp(ways[0].places, axis=0).max()):
        return None
    return int(order[0]) if len(ways) == 1 or apart[order[1]] > BETTER * best else None
