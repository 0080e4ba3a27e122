"""Data structuring of the 1987 program: bandwidth of normal equations (GIANT guide, Appendix A).

Unknowns form sets of three: two per station, one per point. Frames and their points are processed in order.
The first image of a point adds the missing sets of all stations that observe it, in the order of the frames.
The set of the point follows. A station is open from its entry until its last point. Points share one set of
storage.
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.arrays import by_occurrence
from photogram.arguments.types import Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block

FEWEST_TIES = 3  # Minimum number of points for the orientation of a photo


@dataclass(frozen=True)
class Overflow:
    """First station whose entry exceeds a limit of the bandwidth.

    `photos` are the stations in storage at that time, in the order of entry. The first image of `point`
    requires the entry.
    """

    photo: int
    photos: list[int]
    point: int


@dataclass(frozen=True, eq=False)
class Structure:
    """Order of the parameter sets, and the resulting bandwidth.

    `photos` are the P' photos with images, in the order of entry. `entry` and `exit` are indices into
    `points`, of the point at which a photo enters and of its last point. `points` are in the order of their
    first image.
    """

    photos: Indices
    entry: Indices
    exit: Indices
    points: Indices

    @property
    def open_photos(self) -> Indices:
        """(n',) number of open stations at each point."""
        changes = np.bincount(self.entry, minlength=len(self.points) + 1)
        changes -= np.bincount(self.exit + 1, minlength=len(self.points) + 1)
        return np.cumsum(changes)[:-1]

    @property
    def effective_bandwidth(self) -> int:
        """Maximum number of sets of three in storage: two per open station, one for the point."""
        return 2 * int(self.open_photos.max(initial=0)) + 1 if len(self.points) else 0

    @property
    def naive_bandwidth(self) -> int:
        """Maximum span in sets of three from a station to its last correlated set."""
        if not len(self.points):
            return 0
        # The sets of previous points and of stations entered so far precede the set of a point.
        entered = np.cumsum(np.bincount(self.entry, minlength=len(self.points)))
        first = self.entry + 2 * np.arange(len(self.photos))
        last = self.exit + 2 * entered[self.exit]
        return int((last - first).max()) + 1

    def sets(self) -> list[tuple[str, int]]:
        """Return the parameter sets in order: `position` and `attitude` of a photo, `point` of a point."""
        ordered: list[tuple[str, int]] = []
        starts = np.searchsorted(self.entry, np.arange(len(self.points) + 1)).tolist()
        photos = self.photos.tolist()
        for point, first, last in zip(self.points.tolist(), starts, starts[1:], strict=False):
            for photo in photos[first:last]:
                ordered += [("position", photo), ("attitude", photo)]
            ordered.append(("point", point))
        return ordered

    def overflow(self, limit: int) -> Overflow | None:
        """Return the first station and point that exceed a limit of the effective bandwidth."""
        over = 2 * self.open_photos + 1 > limit
        if not over.any():
            return None
        at = int(over.argmax())
        before = np.flatnonzero((self.entry < at) & (self.exit >= at))
        entering = np.flatnonzero(self.entry == at)
        # This number of stations fits; the next one exceeds the limit.
        room = (limit - 1) // 2 - len(before)
        stored = self.photos[np.concatenate([before, entering[:room]])]
        return Overflow(int(self.photos[entering[room]]), stored.tolist(), int(self.points[at]))


def structure(image_photos: Indices, image_points: Indices, order: Indices | None = None) -> Structure:
    """Structure the normal equations of a block as the 1987 program did.

    The points of a photo are in the order of its (m,) images. Photos are processed in the order (P,), by
    default of their indices.
    """
    if not len(image_photos):
        nothing = np.empty(0, dtype=np.int64)
        return Structure(nothing, nothing, nothing, nothing)
    walked = image_photos
    if order is not None:
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        walked = place[image_photos]
    rows = np.argsort(walked, kind="stable")
    walked, seen = walked[rows], image_points[rows]
    points = by_occurrence(seen)
    rank = np.empty(seen.max() + 1, dtype=np.int64)
    rank[points] = np.arange(len(points))
    starts = np.flatnonzero(np.diff(walked, prepend=-1))
    entry = np.minimum.reduceat(rank[seen], starts)
    exit_ = np.maximum.reduceat(rank[seen], starts)
    photos = image_photos[rows][starts]
    entered = np.argsort(entry, kind="stable")
    return Structure(photos[entered], entry[entered], exit_[entered], points)


def ties(block: Block) -> Indices:
    """Return (P,) how many points of each photo are tied by another photo or by control."""
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    useful = (rays >= 2) | np.isfinite(block.point_sd).any(axis=1)
    return np.bincount(block.image_photos[useful[block.image_points]], minlength=len(block.photo_ids))
