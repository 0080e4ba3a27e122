"""Effect of an additional view of the board on the cofactors of a calibration.

Let A_v be the whitened rows of the pose of a view and A_c the rows of the common unknowns. The view adds M =
A_c' A_c - A_c' A_v (A_v' A_v)^-1 A_v' A_c to the inverse of the cofactors Q of the latter. As observations,
with a free pose,

    (Q^-1 + M)^-1 = Q - G' W G,   W = S^-1 - S^-1 A_v (A_v' S^-1 A_v)^-1 A_v' S^-1,
    G = A_c Q,   S = I + A_c Q A_c'.

Q contains cameras, sensors, and the positions of all board points, of which a row depends on one.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from itertools import islice, product
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.fields import Checked
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.summaries import Brief, Rows
from photogram.targets.board import Board
from photogram.targets.housing import (
    Housing,
    camera_number,
    common_partials,
    datum_rows,
    housed_with,
    housing_of,
    middle_of,
    of_functions,
    size_of,
    worst,
)
from photogram.targets.uncertainty import at_distance, checked_distance, image_grid, parts_of
from photogram.targets.vision import TURNED, composed, inverted, motion_partials, rays, transformed
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated

MIN_CORNERS_PER_PICTURE = 12
CORNER_MARGIN_PX = 5.0  # around a corner, for its detection
EXACT_VIEWS = 24  # the most promising views, whose gain is computed exactly
MAX_RAY_ERROR = 1e-6  # of a reprojected image; beyond it the distortion is not invertible


@dataclass(frozen=True, eq=False)
class Candidate(Checked):
    """Candidate view of the board.

    Attributes
    ----------
    name
        Board position and orientation, in words.
    pose
        (4, 4) board -> camera 0.
    """

    name: str
    pose: Floats


@dataclass(frozen=True, eq=False)
class Added:
    """Image points (m) of a candidate view, over their standard deviation."""

    # (t,) unknowns of cameras and sensors that affect them, and (2 m, t) partials
    touched: Indices
    by_cameras: Floats
    places: Indices  # (m, 3) rows of the coordinates of their points, and (m, 2, 3) partials
    by_place: Floats
    by_pose: Floats  # (2 m, 6)
    corners: Indices  # (K,) number of corners in the image of each camera

    def gain(self, cofactors: Floats, rows: Indices | slice) -> Floats:
        """Return (k, k) the reduction of :func:`placed_cofactors` by the view: G' W G."""
        if not cofactors[self.places].any():
            return self.likely_gain(cofactors, np.arange(len(cofactors))[rows])
        whole = self._times(cofactors)
        spread = self._times(whole.T) + np.eye(len(whole))
        own = whole[:, rows]
        solved = np.linalg.solve(spread, np.hstack([own, self.by_pose]))
        by_pose = solved[:, own.shape[1] :]
        found = solved.T @ own
        lost = found[own.shape[1] :]
        gained = found[: own.shape[1]] - lost.T @ np.linalg.solve(self.by_pose.T @ by_pose, lost)
        return np.asarray((gained + gained.T) / 2)

    def likely_gain(self, cofactors: Floats, rows: Indices) -> Floats:
        """Return a fast approximation with independent points: Q M (I + Q M)^-1 Q."""
        of_points = cofactors[self.places[:, :, np.newaxis], self.places[:, np.newaxis]]
        noise = np.eye(2) + self.by_place @ of_points @ self.by_place.transpose(0, 2, 1)
        both, count = np.hstack([self.by_cameras, self.by_pose]), len(self.touched)
        weighted = np.linalg.solve(noise, both.reshape(len(noise), 2, -1)).reshape(both.shape)
        normal = both.T @ weighted
        mixed = normal[count:, :count]
        normal = normal[:count, :count] - mixed.T @ np.linalg.solve(normal[count:, count:], mixed)
        own, across = cofactors[np.ix_(self.touched, self.touched)], cofactors[np.ix_(self.touched, rows)]
        return np.asarray(across.T @ normal @ np.linalg.solve(np.eye(count) + own @ normal, across))

    def _times(self, cofactors: Floats) -> Floats:
        """Return (2 m, k) A_c Q."""
        of_places = self.by_place @ cofactors[self.places]
        found: Floats = self.by_cameras @ cofactors[self.touched] + of_places.reshape(len(self.by_pose), -1)
        return found


@dataclass(frozen=True, eq=False)
class NewView:
    """Suggested or planned view, and the uncertainty map after adding it.

    Attributes
    ----------
    candidate
        Board position in words, and its pose: board -> camera 0.
    corners
        (K,) number of corners in the image of each camera.
    sd
        (n,) standard deviations of the map in the worst direction, pixels; NaN without a map.
    """

    candidate: Candidate
    corners: Indices
    sd: Floats

    @property
    def largest(self) -> float:
        """Largest standard deviation of the map, pixels."""
        return float(self.sd.max())

    @property
    def rms(self) -> float:
        """Root mean square over the map, pixels."""
        return float(np.sqrt(np.mean(self.sd**2)))


def effects_of(views: Sequence[NewView], before: float) -> list[str]:
    """Return the effect of each view on the largest standard deviation; `before` is NaN without a map."""
    said = []
    for each in views:
        code = "unknown" if math.isnan(each.largest) else "smaller" if math.isfinite(before) else "first"
        sizes = {"before": before, "largest": each.largest}
        said.append(str(phrase(f"views.{code}", view=each.candidate.name, **sizes)))
        before = each.largest
    return said


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Suggestions(Brief):
    """Suggested views of the board, each chosen in addition to the previous ones.

    Attributes
    ----------
    camera, distance, unit
        Camera, distance and unit of the uncertainty map to improve, in the datum `corners`.
    pixels
        (n, 2) pixels of the map.
    before
        (n,) current standard deviations in the worst direction, pixels.
    views
        Suggested views in order.
    """

    camera: str
    distance: float
    unit: str
    pixels: Floats
    before: Floats
    views: tuple[NewView, ...]

    @property
    def sentences(self) -> list[str]:
        """Suggested views and their effect, one line per view."""
        return effects_of(self.views, float(self.before.max()))

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the suggested views."""
        at = at_distance(self.distance, self.unit)
        title = str(phrase("views.next", camera=self.camera, at=at))
        return title, [(f"{number}", said) for number, said in enumerate(self.sentences, 1)]


def shown_of(camera: Camera, size: Floats, places: Floats) -> tuple[Indices, Floats]:
    """Return the visible ones of (n, 3) points with images; none if fewer than 12."""
    xy = camera.project(places * TURNED)
    with np.errstate(invalid="ignore"):
        inside: Bools = np.asarray(
            ((xy >= CORNER_MARGIN_PX) & (xy <= size - 1 - CORNER_MARGIN_PX)).all(axis=1)
        )
        back = rays(camera, np.where(inside[:, np.newaxis], xy, np.nan))
        towards = places / np.linalg.norm(places, axis=1)[:, np.newaxis]
        own = np.flatnonzero(inside & (np.linalg.norm(back - towards, axis=1) < MAX_RAY_ERROR))
    own = own if len(own) >= MIN_CORNERS_PER_PICTURE else own[:0]
    return own, xy[own]


def added_by(housing: Housing, pose: Floats, sizes: Floats, sd: float) -> Added | None:
    """Return the effect of a view with corners of given sd (px); None if not visible."""
    before, parts = housing.board.start, []
    turned = housing.points @ pose[:3, :3].T
    for number, (camera, size, sensor) in enumerate(
        zip(housing.cameras, sizes, housing.sensors, strict=True)
    ):
        own, _ = shown_of(camera, size, transformed(sensor @ pose, housing.points))
        _, by_point, by_common = housing.linearized(number, turned[own] + pose[:3, 3])
        by_pose = by_point @ motion_partials(turned[own])
        parts.append((own, by_common[:, :, :before] / sd, by_point @ pose[:3, :3] / sd, by_pose / sd))
    points, by_cameras, by_place, by_pose = (np.concatenate(each) for each in zip(*parts, strict=True))
    if not len(points):
        return None
    by_cameras = by_cameras.reshape(-1, before)
    touched = np.flatnonzero(by_cameras.any(axis=0))
    return Added(
        touched=touched,
        by_cameras=by_cameras[:, touched],
        places=before + 3 * points[:, np.newaxis] * (housing.points_by_board.shape[2] > 0) + np.arange(3),
        by_place=by_place,
        by_pose=by_pose.reshape(-1, 6),
        corners=np.array([len(own) for own, *_ in parts]),
    )


def placed_cofactors(housing: Housing) -> Floats:
    """Return the cofactors of cameras, sensors and coordinates of all board points."""
    before, own = housing.board.start, housing.cofactors[: housing.common, : housing.common]
    points = len(housing.points) if housing.points_by_board.shape[2] else 1
    by_board = housing.points_by_board[:points].reshape(3 * points, housing.common - before)
    across = own[:before, before:] @ by_board.T
    return np.block(
        [[own[:before, :before], across], [across.T, by_board @ own[before:, before:] @ by_board.T]]
    )


def best_views(
    housing: Housing, functions: Floats, candidates: list[Candidate], sizes: Floats, sd: float, count: int
) -> list[NewView]:
    """Return views that minimise the largest standard deviation of a map, one by one.

    For splined lenses the root mean square is minimised, since a view affects only some knots and hardly
    reduces the largest value. Functions are (n, 2, c) J of the map by the common unknowns in a fixed datum, 0
    for the board. Candidates are used once each; sizes are (K, 2) of images, `sd` is the corner sd in pixels.
    """
    seen = [(each, added_by(housing, each.pose, sizes, sd)) for each in candidates]
    left = [(each, added) for each, added in seen if added is not None]
    rows = np.flatnonzero(functions.any(axis=(0, 1)))
    partials, cofactors = functions[:, :, rows], placed_cofactors(housing)
    knots = any(each.knots is not None for each in housing.cameras)

    def badness(own: Floats) -> tuple[float, float]:
        return 0.0 if knots else _rounded(own.max()), _rounded(float(np.mean(own**2)))

    found: list[NewView] = []
    while left and len(found) < count:
        own = cofactors[np.ix_(rows, rows)]

        def after(gain: Floats, own: Floats = own) -> Floats:
            return worst(of_functions(partials, own - gain))

        likely = [badness(after(added.likely_gain(cofactors, rows))) for _, added in left]
        few = sorted(range(len(left)), key=likely.__getitem__)[:EXACT_VIEWS]
        tried = {row: after(left[row][1].gain(cofactors, rows)) for row in sorted(few)}
        best = min(tried, key=lambda row: badness(tried[row]))
        candidate, added = left.pop(best)
        found.append(NewView(candidate, added.corners, np.sqrt(housing.variance) * tried[best]))
        cofactors = cofactors - added.gain(cofactors, slice(None))
    return found


def _rounded(value: float) -> float:
    """Round to six digits, so that the first of two mirrored views is chosen."""
    return float(f"{value:.6g}")


DISTANCE_QUANTILES = (0.1, 0.5, 0.9)  # of the boards
TILT_DEG, TURN_DEG = 30.0, 90.0
TILTS = {
    "": (0.0, 0.0),
    f"tilted {TILT_DEG:g} degrees about x": (TILT_DEG, 0.0),
    f"tilted {-TILT_DEG:g} degrees about x": (-TILT_DEG, 0.0),
    f"tilted {TILT_DEG:g} degrees about y": (0.0, TILT_DEG),
    f"tilted {-TILT_DEG:g} degrees about y": (0.0, -TILT_DEG),
}
TURNS = {"": 0.0, f"turned by {TURN_DEG:g} degrees": TURN_DEG}
STEPS_TO_MIDDLE = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)  # relative distances from the image part to the image centre
GRID = (12, 8)  # pixels across and down


def suggest_views(
    result: Calibrated,
    distance: float = np.inf,
    candidates: Sequence[Candidate] | None = None,
    *,
    camera: int | str = 0,
    views: int = 1,
) -> Suggestions:
    """Suggest views of the board that minimise the largest image uncertainty.

    Parameters
    ----------
    result
        The adjusted calibration. The board has the same size, and corners have the best observed precision.
    distance
        Distance of the uncertainty map, in the unit of the board; infinite: directions.
    candidates
        Possible views. None: the board at 5 x 4 image positions and three observed distances, frontal and
        tilted by 30 degrees, upright and rotated. It is completely visible if detection requires it.
    camera
        Camera of the map: number or name. On a rig, all cameras observe the board.
    views
        Number of views, each chosen in addition to the previous ones.

    Raises
    ------
    InputError
        If the camera does not exist, if the image size is unknown, or if no candidate shows the board.
    """
    number = camera_number(result, camera)
    checked_distance(distance)
    housing, own = housing_of(result, number)
    sizes = np.array([size_of(result, each) for each in housed_with(result, number)])
    pixels = image_grid(size_of(result, number), GRID)[2]
    functions = common_partials(housing, own, pixels, distance, datum_rows(housing, own, "corners"))
    known = np.isfinite(functions).all(axis=(1, 2))
    common = housing.cofactors[: housing.common, : housing.common]
    before = worst(housing.variance * functions[known] @ common @ functions[known].transpose(0, 2, 1))
    if candidates is None:
        candidates = candidate_views(housing, own, size_of(result, number), result.calibration.board)
    found = best_views(
        housing, functions[known], list(candidates), sizes, float(housing.seen.sd.min()), views
    )
    if not found:
        raise InputError(phrase("targets.no-candidate"))
    return Suggestions(
        camera=result.cameras[number].name,
        distance=float(distance),
        unit=result.calibration.board.unit,
        pixels=pixels[known],
        before=before,
        views=tuple(found),
    )


def candidate_views(housing: Housing, camera: int, size: tuple[int, int], board: Board) -> list[Candidate]:
    away = np.quantile(housing.board_distances(camera), DISTANCE_QUANTILES).tolist()
    to_first = inverted(housing.sensors[camera])
    counts = np.unique(housing.seen.views[housing.seen.cameras == camera], return_counts=True)[1]
    whole = board.found_whole and np.median(counts) == len(housing.points)
    found = views_over_picture(housing.cameras[camera], size, board, away, whole=bool(whole))
    return [Candidate(each.name, to_first @ each.pose) for each in found]


def views_over_picture(
    camera: Camera, size: tuple[int, int], board: Board, distances: Sequence[float], *, whole: bool
) -> list[Candidate]:
    """Return views, board -> camera, with the board centre in each part of the image.

    `distances` are between board centre and camera. A board that must be detected as a `whole` is moved
    towards the image centre until it is completely visible.
    """

    def is_shown(view: Candidate) -> bool:
        places = transformed(view.pose, board.places)
        return not whole or len(shown_of(camera, np.array(size), places)[0]) == len(places)

    found: list[Candidate] = []
    steps = STEPS_TO_MIDDLE if whole else STEPS_TO_MIDDLE[:1]
    centre = (np.array(size) - 1) / 2
    for part in parts_of(size):
        tried = rays(camera, np.array([part.middle + step * (centre - part.middle) for step in steps]))
        tried = tried[np.isfinite(tried).all(axis=1)]
        ways = zip(*(views_towards(each, part.name, board, distances) for each in tried), strict=True)
        found += [view for way in ways for view in islice(filter(is_shown, way), 1)]
    return found


def views_towards(
    towards: Floats,
    place: str,
    board: Board,
    distances: Sequence[float],
    tilts: Collection[str] = TILTS,
    turns: Collection[str] = TURNS,
) -> list[Candidate]:
    """Return views, board -> camera, with the board centre in a direction (3,)."""
    found, middle = [], middle_of(board.places)
    # The shortest rotation from z, the board normal, to the direction
    axis = np.cross([0.0, 0.0, 1.0], towards)
    sine = float(np.linalg.norm(axis))
    vector = axis * np.arctan2(sine, towards[2]) / sine if sine > 0 else axis
    facing = _photocore.vector_rotations(vector[np.newaxis])[0]
    for distance, tilt, turn in product(
        dict.fromkeys(f"{float(f'{each:.2g}'):g}" for each in distances), tilts, turns
    ):
        angles = np.radians([[*TILTS[tilt], 0.0], [0.0, 0.0, TURNS[turn]]])
        tilted, turned = _photocore.vector_rotations(angles)
        rotation = facing @ tilted @ turned
        pose = composed(rotation, float(distance) * towards - rotation @ middle)
        words = (place, f"{distance} {board.unit}", tilt, turn)
        found.append(Candidate(", ".join(filter(None, words)), pose))
    return found
