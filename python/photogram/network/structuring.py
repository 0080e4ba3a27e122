"""Data structuring of the 1987 program: the bandwidth of the normal equations (GIANT guide, Appendix A).

Unknowns come in sets of three: two for a station, one for a point. The frames are walked in their order, and
the points of a frame in theirs; the first image of a point enters the sets of all stations that observe it
(those that are not there yet, in the order of the frames), then the set of the point. A station is open from
its entry until the last point that it observes; points share one set of storage.
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block

__all__ = ["FEWEST_TIES", "Overflow", "Structure", "structure", "ties"]

FEWEST_TIES = 3  # Points that the orientation of a photo needs at least


@dataclass(frozen=True)
class Overflow:
    """Where the bandwidth first exceeds a limit: the station whose entry is too much.

    `photos` are the stations in storage then, in the order of their entry, `point` that whose first image
    called for it.
    """

    photo: int
    photos: list[int]
    point: int


@dataclass(frozen=True, eq=False)
class Structure:
    """The order of the parameter sets and what it costs.

    Of P' photos with images, in the order of their entry, `entry` and `exit` are the places, in `points`, of
    the points at which they enter, and of the last they observe; n' points are in the order of their first
    image.
    """

    photos: Indices
    entry: Indices
    exit: Indices
    points: Indices

    @property
    def open_photos(self) -> Indices:
        """(n',) stations that are open while each point is in its turn."""
        changes = np.bincount(self.entry, minlength=len(self.points) + 1)
        changes -= np.bincount(self.exit + 1, minlength=len(self.points) + 1)
        return np.cumsum(changes)[:-1]

    @property
    def effective_bandwidth(self) -> int:
        """Sets of three in storage at the most: two for each open station and one for the point."""
        return 2 * int(self.open_photos.max(initial=0)) + 1 if len(self.points) else 0

    @property
    def naive_bandwidth(self) -> int:
        """Sets of three from the first of a station to the last set that it is correlated with."""
        if not len(self.points):
            return 0
        # Before the set of a point stand those of the points before it and of the stations entered by then.
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
        """Return where the effective bandwidth first exceeds a limit, if it does."""
        over = 2 * self.open_photos + 1 > limit
        if not over.any():
            return None
        at = int(over.argmax())
        before = np.flatnonzero((self.entry < at) & (self.exit >= at))
        entering = np.flatnonzero(self.entry == at)
        # So many stations fit; the next one to enter is too much.
        room = (limit - 1) // 2 - len(before)
        stored = self.photos[np.concatenate([before, entering[:room]])]
        return Overflow(int(self.photos[entering[room]]), stored.tolist(), int(self.points[at]))


def structure(image_photos: Indices, image_points: Indices, order: Indices | None = None) -> Structure:
    """Structure the normal equations of a block as the 1987 program did.

    The points of a photo are in the order of its (m,) images; the photos are walked in the order (P,), by
    default that of their indices.
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
    walked = walked[rows]
    points, first, which = np.unique(image_points[rows], return_index=True, return_inverse=True)
    turn = np.argsort(first)
    rank = np.empty_like(turn)
    rank[turn] = np.arange(len(turn))
    starts = np.flatnonzero(np.diff(walked, prepend=-1))
    entry = np.minimum.reduceat(rank[which], starts)
    exit_ = np.maximum.reduceat(rank[which], starts)
    photos = image_photos[rows][starts]
    entered = np.argsort(entry, kind="stable")
    return Structure(photos[entered], entry[entered], exit_[entered], points[turn])


def ties(block: Block) -> Indices:
    """(P,) points of each photo that another photo or control ties."""
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    useful = (rays >= 2) | np.isfinite(block.point_sd).any(axis=1)
    return np.bincount(block.image_photos[useful[block.image_points]], minlength=len(block.photo_ids))
