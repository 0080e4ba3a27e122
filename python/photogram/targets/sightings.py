"""A board as pictures show it: arrays of pictures by points, and the orders in which these are listed."""

from __future__ import annotations

from typing import Self

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.targets.board import Board
from photogram.targets.corners import Corners
from photogram.targets.homographies import nearest_rotations
from photogram.targets.vision import composed

__all__ = ["LISTED", "Listings", "Sightings"]

LISTED = (
    "as they are numbered",
    "rows from the last to the first",
    "columns from the last to the first",
    "from the last corner to the first",
    "column by column",
    "column by column, each from its last",
    "column by column, from the last column",
    "column by column, from the last corner",
)
"""In which order a file or a detector may list corners."""
FLAT = 0.05
"""Of the extent of a board: what its points may be off a plane to be taken for one."""
UPRIGHT = 1e3
"""Weight of an axis that stays where it is, over those that turn."""
_SAME = 1e-6
"""Of the size of a board: two orders differ by more than this."""


@dataclass(frozen=True, eq=False)
class Listings:
    """Orders in which the corners of a board may be listed, that of their numbers first.

    Attributes
    ----------
    points
        (g, n) of which point of the board the k-th corner of a list is.
    shapes
        Of the orders that differ by more than a symmetry of the board, the first ones: homographies tell
        these apart, and no others.
    turns
        Symmetries that turn the board in its plane, by their orders: (4, 4) places as listed -> places.
    one_sided
        Whether the board is seen from one side alone, as what is printed is.
    """

    points: Indices
    shapes: tuple[int, ...]
    turns: dict[int, Floats]
    one_sided: bool

    @classmethod
    def of(cls, board: Board) -> Self:
        """Return those of a board; targets that say their numbers have one."""
        columns, rows = board.grid
        k = np.arange(len(board.places))
        points = [k]
        if board.kind in ("chessboard", "circles", "asymmetric_circles"):
            points = _listed(k % columns, k // columns, columns, rows)
        if board.kind in ("chessboard", "circles"):
            points += _listed(k // rows, k % rows, columns, rows)
        return cls._compared(board, points)

    @classmethod
    def _compared(cls, board: Board, points: list[Indices]) -> Self:
        """Return orders with what one can tell of them: which are symmetries, which are turns."""
        places = board.places
        size = float(np.ptp(places, axis=0).max())
        shapes: list[int] = []
        turns: dict[int, Floats] = {}
        for own, listed in enumerate(points):
            turn = _turn(places, places[listed])
            if np.abs(places @ turn[:3, :3].T + turn[:3, 3] - places[listed]).max() < _SAME * size:
                turns[own] = turn
            with_one = np.column_stack([places[:, :2], np.ones(len(places))])
            known = [with_one[points[other]] for other in shapes]
            if not any(_is_affine(each, with_one[listed], size) for each in known):
                shapes.append(own)
        return cls(np.array(points), tuple(shapes), turns, one_sided=board.kind != "points")


def _listed(i: Indices, j: Indices, columns: int, rows: int) -> list[Indices]:
    """Return the numbers of points in columns i and rows j, counted from either end."""
    last = [(i, j), (i, rows - 1 - j), (columns - 1 - i, j), (columns - 1 - i, rows - 1 - j)]
    return [row * columns + column for column, row in last]


def _turn(places: Floats, listed: Floats) -> Floats:
    """Return the (4, 4) motion that takes places nearest to others, their z kept upright."""
    middles = places.mean(axis=0), listed.mean(axis=0)
    products = (listed - middles[1]).T @ (places - middles[0])
    products[2, 2] += UPRIGHT * np.abs(products).max()
    rotation = nearest_rotations(products[np.newaxis])[0]
    return composed(rotation, middles[1] - rotation @ middles[0])


def _principal(places: Floats) -> Floats:
    """Return (4, 4) what takes places to the axes of their least-squares plane, from their centroid."""
    middle = places.mean(axis=0)
    axes = np.linalg.svd(places - middle)[2]
    axes[2] *= np.sign(np.linalg.det(axes))
    return composed(axes, -axes @ middle)


def _is_affine(a: Floats, b: Floats, size: float) -> bool:
    return bool(np.abs(a @ np.linalg.lstsq(a, b, rcond=None)[0] - b).max() < _SAME * size)


@dataclass(frozen=True, eq=False)
class Sightings:
    """A board in P pictures.

    Attributes
    ----------
    places
        (n, 3) points of the board, in axes whose x and y lie in its plane where it has one.
    axes
        (4, 4) board -> these axes; other ones only for points that lie anywhere.
    listings
        The orders in which its corners may be listed.
    xy
        (P, n, 2) pixels, NaN where a point was not seen.
    sd
        (P, n) their standard deviations.
    """

    places: Floats
    axes: Floats
    listings: Listings
    xy: Floats
    sd: Floats

    @classmethod
    def of_corners(cls, board: Board, corners: Corners) -> Self:
        """Return the corners that count; InputError of points that the board does not have."""
        places = board.places
        beyond = corners.point >= len(places)
        if beyond.any():
            row = int(np.argmax(beyond))
            raise InputError(f"{corners.title(row)}: the board has {len(places)} points, {board.described}")
        axes = _principal(places) if board.kind == "points" else np.eye(4)
        xy, sd = (np.full((len(corners.pictures), len(places), *more), np.nan) for more in ((2,), ()))
        at = corners.picture[corners.use], corners.point[corners.use]
        xy[at], sd[at] = corners.xy[corners.use], corners.sd[corners.use]
        return cls(places @ axes[:3, :3].T + axes[:3, 3], axes, Listings.of(board), xy, sd)

    @property
    def is_flat(self) -> bool:
        """Whether the board is about a plane."""
        low, _, high = np.sort(np.ptp(self.places, axis=0))
        return bool(low <= FLAT * high)

    @property
    def coordinates(self) -> Floats:
        """(n, 2) places in the plane of the board, or (n, 3) where it has none."""
        return self.places[:, :2] if self.is_flat else self.places

    def in_a_plane(self) -> Bools:
        """Return (P,) whether a picture shows points of one plane alone, of a board that is not flat."""
        seen = np.isfinite(self.xy[..., 0])
        if self.is_flat:
            return np.zeros(len(seen), dtype=bool)
        parts = [self.places[own] - self.places[own].mean(axis=0) for own in seen if own.any()]
        spans = [np.linalg.svd(own, compute_uv=False) for own in parts]
        found = np.ones(len(seen), dtype=bool)
        found[seen.any(axis=1)] = [span[-1] <= FLAT * span[0] for span in spans]
        return found

    def of(self, rows: Indices | Bools) -> Self:
        """Return some pictures alone."""
        return replace(self, xy=self.xy[rows], sd=self.sd[rows])

    def listed(self, orders: Indices) -> Self:
        """Return the pictures with their corners taken for listed in (P,) orders."""
        taken = np.argsort(self.listings.points, axis=1)[orders]
        xy = np.take_along_axis(self.xy, taken[..., np.newaxis], axis=1)
        return replace(self, xy=xy, sd=np.take_along_axis(self.sd, taken, axis=1))
