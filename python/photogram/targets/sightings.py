"""Board observations in images: arrays, corner orders, homographies, focal lengths and poses.

Arrays are images by board points: (P, n, 2) pixels or (P, n, 3) rays, NaN for unobserved points. Point
coordinates have m = 2 components in the plane of a flat board, or m = 3. Axes are vision axes: x right, y
down, z forward. Homographies of pixels and rays give focal lengths and poses.
"""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.targets.board import Board
from photogram.targets.corners import Corners, check_points
from photogram.targets.vision import composed

_MIN_COLUMN_RATIO = 1e-9  # of a homography of non-collinear corners


def homographies(places: Floats, xy: Floats) -> Floats:
    """Return (P, 3, m + 1) board homographies by direct linear transformation.

    Both sides are centred and scaled to a mean distance of sqrt 2, in space of sqrt 3. There, each has norm 1
    and an arbitrary sign. Board points are (n, m), pixels (P, n, 2), NaN if unobserved. Each image needs four
    points of a plane, no three of them collinear, or six points not in a plane.
    """
    seen = np.isfinite(xy[..., 0])
    board, of_board = _scaled(np.broadcast_to(places, (len(xy), *places.shape)), seen)
    image, of_image = _scaled(xy, seen)
    found = _smallest(_equations(board, _with_one(image))[:, :, :2], seen)
    return np.asarray(np.linalg.inv(of_image) @ found @ of_board)


def ray_homographies(places: Floats, rays: Floats) -> Floats:
    """Return (P, 3, m + 1) ray homographies: ray x H (x, y, 1) = 0, or (x, y, z, 1).

    Board points are (n, m), rays (P, n, 3) of length 1, NaN if unobserved. The sign puts most points on the
    side of their rays.
    """
    seen = np.isfinite(rays[..., 0])
    board, of_board = _scaled(np.broadcast_to(places, (len(rays), *places.shape)), seen)
    found: Floats = _smallest(_equations(board, rays), seen) @ of_board
    towards = np.einsum("pni,pij,nj->pn", np.nan_to_num(rays), found, _with_one(places))
    found *= np.where(towards.sum(axis=1) < 0, -1.0, 1.0)[:, np.newaxis, np.newaxis]
    return found


def angles_apart(places: Floats, rays: Floats, found: Floats) -> Floats:
    """Return (P, n) angles (rad) of rays and transformed points; NaN if unobserved."""
    there = np.einsum("pij,nj->pni", found, _with_one(places))
    across = np.linalg.norm(np.cross(rays, there), axis=-1)
    return np.asarray(np.arctan2(across, np.einsum("pni,pni->pn", rays, there)))


def focal_lengths(found: Floats, middle: Floats) -> tuple[float, float, float]:
    """Return fx, fy, and a single f, of a perspective camera; NaN if undetermined.

    Let g = T(-middle) H with the first columns a, b, whose directions in space are orthogonal and of equal
    length. Each image gives two equations in X = 1/fx^2, Y = 1/fy^2,

        a1 b1 X + a2 b2 Y = -a3 b3,    (a1^2 - b1^2) X + (a2^2 - b2^2) Y = -(a3^2 - b3^2).

    Homographies are (P, 3, m + 1) to pixels. For points that are not coplanar each is a camera matrix with
    its own principal point, otherwise the principal point is `middle` (2,).
    """
    own = found.copy()
    own[:, :2] -= middle[:, np.newaxis] * found[:, 2:]
    if own.shape[2] == 4:
        # Medians by the rows a, b, c of K R: a'a/c'c = fx^2 + cx^2
        matrices = own[:, :, :3]
        norms = np.sum(matrices[:, 2] ** 2, axis=1)[:, np.newaxis]
        squares = np.sum(matrices[:, :2] ** 2, axis=2) / norms
        centre = matrices[:, :2] @ matrices[:, 2, :, np.newaxis]
        fx, fy = np.sqrt(np.median(squares - (centre[..., 0] / norms) ** 2, axis=0)).tolist()
        return fx, fy, (fx + fy) / 2
    lengths = np.linalg.norm(own[:, :, :2], axis=1)
    # Collinear corners determine only one of both columns.
    own = own[lengths.min(axis=1) > _MIN_COLUMN_RATIO * lengths.max(axis=1)]
    a, b = own[:, :, 0], own[:, :, 1]
    weight = 1 / (np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1))[:, np.newaxis]
    rows = np.concatenate([a * b * weight, (a * a - b * b) * weight])
    both = np.linalg.lstsq(rows[:, :2], -rows[:, 2], rcond=None)[0]
    one = np.linalg.lstsq(rows[:, :2].sum(axis=1, keepdims=True), -rows[:, 2], rcond=None)[0]
    fx, fy, f = (1 / math.sqrt(each) if each > 0 else math.nan for each in [*both.tolist(), float(one[0])])
    return fx, fy, f


def poses(found: Floats) -> Floats:
    """Return (P, 4, 4) poses board -> camera of signed ray homographies (P, 3, m + 1).

    The scale is the mean length of the columns before the last. The third axis of a plane is their cross
    product, the attitude the nearest rotation.
    """
    scale = np.linalg.norm(found[:, :, :-1], axis=1).mean(axis=1)
    own = found / scale[:, np.newaxis, np.newaxis]
    axes = own[:, :, :3]
    if found.shape[2] == 3:
        axes = np.stack([own[:, :, 0], own[:, :, 1], np.cross(own[:, :, 0], own[:, :, 1])], axis=2)
    return composed(nearest_rotations(axes), own[:, :, -1])


def nearest_rotations(matrices: Floats) -> Floats:
    """Return (k, 3, 3) the rotations nearest to matrices."""
    left, _, right = np.linalg.svd(matrices)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, np.newaxis]
    return np.asarray(left @ right)


def centres(of_boards: Floats) -> Floats:
    """Return (P, 3) camera positions in the axes of the board, C = -R't."""
    return np.asarray(-np.einsum("pji,pj->pi", of_boards[:, :3, :3], of_boards[:, :3, 3]))


def frontal_tilts(of_boards: Floats) -> Floats:
    """Return (P,) the angles (rad) between boards and the image plane."""
    third = of_boards[:, :3, 2]
    return np.arctan2(np.hypot(third[:, 0], third[:, 1]), np.abs(third[:, 2]))


def _with_one(points: Floats) -> Floats:
    return np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1)


def _scaled(points: Floats, seen: Bools) -> tuple[Floats, Floats]:
    """Return (P, n, m) centred points scaled to distance sqrt m, and the matrices."""
    m = points.shape[2]
    kept = np.where(seen[..., np.newaxis], points, np.nan)
    middle = np.nanmean(kept, axis=1)
    apart = kept - middle[:, np.newaxis]
    made = np.tile(np.eye(m + 1), (len(points), 1, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = math.sqrt(m) / np.nanmean(np.linalg.norm(apart, axis=-1), axis=1)
        made[:, :m, :m] *= scale[:, np.newaxis, np.newaxis]
        made[:, :m, m] = -scale[:, np.newaxis] * middle
        return apart * scale[:, np.newaxis, np.newaxis], made


def _equations(board: Floats, rays: Floats) -> Floats:
    """Return (P, n, 3, 3 (m + 1)) rows of ray x H b = 0; b is a point and 1."""
    x, y, z = (rays[..., k, np.newaxis] for k in range(3))
    b = _with_one(board)
    zero = np.zeros_like(b)
    rows = (
        np.concatenate([zero, -z * b, y * b], axis=-1),
        np.concatenate([z * b, zero, -x * b], axis=-1),
        np.concatenate([-y * b, x * b, zero], axis=-1),
    )
    return np.stack(rows, axis=2)


def _smallest(rows: Floats, seen: Bools) -> Floats:
    """Return (P, 3, m + 1) least-squares H of norm 1 for rows (P, n, k, 3 (m + 1))."""
    used = np.where(seen[..., np.newaxis, np.newaxis], rows, 0.0).reshape(len(rows), -1, rows.shape[-1])
    squares = used.transpose(0, 2, 1) @ used
    finite = np.isfinite(squares).all(axis=(1, 2))[:, np.newaxis, np.newaxis]
    _, vectors = np.linalg.eigh(np.where(finite, squares, 0.0))
    return np.where(finite, vectors[:, :, 0].reshape(len(rows), 3, -1), np.nan)


CORNER_ORDERS = (
    "as they are numbered",
    "rows from the last to the first",
    "columns from the last to the first",
    "from the last corner to the first",
    "column by column",
    "column by column, each from its last",
    "column by column, from the last column",
    "column by column, from the last corner",
)
MAX_DEPTH_OF_PLANE = 0.05  # of a planar board, relative to its extent
WEIGHT_OF_FIXED_AXIS = 1e3  # relative to other axes
_MIN_ORDER_DIFFERENCE = 1e-6  # relative to the extent of the board


@dataclass(frozen=True, eq=False)
class Listings:
    points: Indices  # (g, n) board point of the k-th corner of a list
    # First of the orders that differ by more than a board symmetry: homographies separate only these
    shapes: tuple[int, ...]
    # Symmetries that rotate the board in its plane, by order: (4, 4) listed -> actual coordinates
    turns: dict[int, Floats]
    one_sided: bool  # Whether the board is visible from one side only, as a printed board is

    @classmethod
    def of(cls, board: Board) -> Self:
        """Return the orders of a board; coded targets have one."""
        columns, rows = board.grid
        k = np.arange(len(board.places))
        points = [k]
        if board.kind in ("chessboard", "circles", "asymmetric_circles"):
            points = _listed(k % columns, k // columns, columns, rows)
        if board.kind in ("chessboard", "circles"):
            points += _listed(k // rows, k % rows, columns, rows)
        places = board.places
        tolerance = _MIN_ORDER_DIFFERENCE * float(np.ptp(places, axis=0).max())
        shapes: list[int] = []
        turns: dict[int, Floats] = {}
        for own, listed in enumerate(points):
            # The motion that fits board points to the listed ones, with fixed z direction
            middles = places.mean(axis=0), places[listed].mean(axis=0)
            products = (places[listed] - middles[1]).T @ (places - middles[0])
            products[2, 2] += WEIGHT_OF_FIXED_AXIS * np.abs(products).max()
            rotation = nearest_rotations(products[np.newaxis])[0]
            turn = composed(rotation, middles[1] - rotation @ middles[0])
            if np.abs(places @ turn[:3, :3].T + turn[:3, 3] - places[listed]).max() < tolerance:
                turns[own] = turn
            with_one = np.column_stack([places[:, :2], np.ones(len(places))])
            known = [with_one[points[other]] for other in shapes]
            affine = [each @ np.linalg.lstsq(each, with_one[listed], rcond=None)[0] for each in known]
            if not any(np.abs(each - with_one[listed]).max() < tolerance for each in affine):
                shapes.append(own)
        return cls(np.array(points), tuple(shapes), turns, one_sided=board.kind != "points")


def _listed(i: Indices, j: Indices, columns: int, rows: int) -> list[Indices]:
    """Return the numbers of points in columns i and rows j, counted from either end."""
    last = [(i, j), (i, rows - 1 - j), (columns - 1 - i, j), (columns - 1 - i, rows - 1 - j)]
    return [row * columns + column for column, row in last]


@dataclass(frozen=True, eq=False)
class Sightings:
    places: Floats  # (n, 3) board points, in axes whose x and y are in its plane, if it is flat
    axes: Floats  # (4, 4) board -> these axes; the identity except for arbitrary points
    listings: Listings  # Possible orders of its corners
    xy: Floats  # (P, n, 2) pixels, NaN if unobserved
    sd: Floats  # (P, n) standard deviations

    @classmethod
    def of_corners(cls, board: Board, corners: Corners) -> Self:
        """Return the used corners; InputError if points are missing on the board."""
        check_points(corners, board)
        places = board.places
        axes = np.eye(4)
        if board.kind == "points":  # axes of the least-squares plane, from the centroid
            middle = places.mean(axis=0)
            turn = np.linalg.svd(places - middle)[2]
            turn[2] *= np.sign(np.linalg.det(turn))
            axes = composed(turn, -turn @ middle)
        xy, sd = (np.full((len(corners.pictures), len(places), *more), np.nan) for more in ((2,), ()))
        at = corners.picture[corners.use], corners.point[corners.use]
        xy[at], sd[at] = corners.xy[corners.use], corners.sd[corners.use]
        return cls(places @ axes[:3, :3].T + axes[:3, 3], axes, Listings.of(board), xy, sd)

    @property
    def is_flat(self) -> bool:
        """Whether the board is approximately planar."""
        low, _, high = np.sort(np.ptp(self.places, axis=0))
        return bool(low <= MAX_DEPTH_OF_PLANE * high)

    @property
    def coordinates(self) -> Floats:
        """(n, 2) coordinates in the plane of a flat board, or (n, 3) in space."""
        return self.places[:, :2] if self.is_flat else self.places

    def in_a_plane(self) -> Bools:
        """Return (P,) whether an image of a non-flat board shows only coplanar points."""
        seen = np.isfinite(self.xy[..., 0])
        if self.is_flat:
            return np.zeros(len(seen), dtype=bool)
        parts = [self.places[own] - self.places[own].mean(axis=0) for own in seen if own.any()]
        spans = [np.linalg.svd(own, compute_uv=False) for own in parts]
        found = np.ones(len(seen), dtype=bool)
        found[seen.any(axis=1)] = [span[-1] <= MAX_DEPTH_OF_PLANE * span[0] for span in spans]
        return found

    def of(self, rows: Indices | Bools) -> Self:
        return replace(self, xy=self.xy[rows], sd=self.sd[rows])

    def listed(self, orders: Indices) -> Self:
        """Return the images with corners reordered from (P,) listed orders."""
        taken = np.argsort(self.listings.points, axis=1)[orders]
        xy = np.take_along_axis(self.xy, taken[..., np.newaxis], axis=1)
        return replace(self, xy=xy, sd=np.take_along_axis(self.sd, taken, axis=1))
