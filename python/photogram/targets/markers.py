"""Boards whose corners tags tell apart: which tags a picture shows, and where the corners beside them are.

Tags are placed by their centres, where their diagonals meet: a homography of these says which corner of a tag
lies where on the board, whichever way its pattern was printed, and tells false tags apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.targets.board import Board
from photogram.targets.saddles import settled

__all__ = ["Tags", "charuco_tags", "grid_tags"]

FAMILIES = ("4X4", "5X5", "6X6", "7X7")
COUNTS = (50, 100, 250, 1000)
"""Tags of the dictionaries of a family; the smaller ones are the first of the larger ones."""
FEWEST = 4
"""Tags that fix a homography."""
NEAR = 0.5
"""Of the pitch of the board: how far a tag may be from where the others put it, as lenses are."""
CLEAR = 0.8
"""Of the way to what is beside a corner, a tag or a square: half the side of its window."""

Corners = tuple[Indices, Floats]
Found = tuple[Corners, float] | None


@dataclass
class Tags:
    """How tags of a board are looked for, and what becomes of them.

    Attributes
    ----------
    ways
        Detectors of families of tags that the board may have, and where on it their centres are, by number.
    corners_of
        Returns corners from a picture, the way, numbers and corners of tags, the homography of their centres;
        with them half the window of a corner over the distance between nearest points of the board.
    places
        (n, 2) of the points of the board.
    cv2
        OpenCV.
    """

    ways: Sequence[tuple[Any, Floats]]
    corners_of: Callable[..., Found]
    places: Floats
    cv2: Any
    chosen: int | None = field(default=None, init=False)
    """The way of the first picture that showed the board: it has one family of tags."""

    def corners(self, picture: Any) -> Corners | None:
        """Return points of the board and where a picture shows them; None where it shows too few tags."""
        numbers = range(len(self.ways)) if self.chosen is None else [self.chosen]
        placed = [(number, found) for number in numbers if (found := self._placed(picture, number))]
        if not placed:
            return None
        self.chosen, (ids, tags, plane) = max(placed, key=lambda each: len(each[1][0]))
        seen = self.corners_of(picture, self.chosen, ids, tags, plane)
        if seen is None:
            return None
        (points, xy), half = seen
        return settled(self.cv2, picture, points, xy, self.places, half)

    def _placed(self, picture: Any, number: int) -> tuple[Indices, Floats, Floats] | None:
        """Return numbers, (n, 4, 2) corners, and the homography to the board of tags that fit together."""
        detector, centres = self.ways[number]
        found, ids, _ = detector.detectMarkers(picture)
        if ids is None:
            return None
        ids = np.asarray(ids).ravel()
        tags = np.asarray(found, dtype=np.float64).reshape(-1, 4, 2)
        known = (ids < len(centres)) & (np.bincount(ids)[ids] == 1)
        ids, tags = ids[known], tags[known]
        if len(ids) < FEWEST:
            return None
        pitch = float(np.abs(np.diff(np.unique(centres.round(9)))).min())
        plane, fits = self.cv2.findHomography(_centres(tags), centres[ids], self.cv2.RANSAC, NEAR * pitch)
        own = np.zeros(0, dtype=bool) if plane is None else fits.ravel().astype(bool)
        return (ids[own], tags[own], np.asarray(plane)) if np.count_nonzero(own) >= FEWEST else None


def charuco_tags(cv2: Any, board: Board) -> Tags:
    """Return the tags of a ChArUco board: in its white squares, of any family of ArUco, of any size."""
    squares = board.columns + 1, board.rows + 1
    i, j = np.tile(np.arange(squares[0]), squares[1]), np.repeat(np.arange(squares[1]), squares[0])
    ways, boards = [], []
    for family in FAMILIES:
        for legacy in (False, True) if squares[1] % 2 == 0 else (False,):
            white = (i + j) % 2 == (0 if legacy else 1)
            count = int(np.count_nonzero(white))
            size = next((each for each in COUNTS if each >= count), None)
            if size is None:
                continue
            dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{family}_{size}"))
            centres = np.stack([i[white], j[white]], axis=1) + 0.5
            ways.append((cv2.aruco.ArucoDetector(dictionary), centres))
            boards.append((dictionary, legacy))

    def corners_of(picture: Any, number: int, ids: Indices, tags: Floats, plane: Floats) -> Found:
        dictionary, legacy = boards[number]
        # Interpolated between tags, whose edge in squares the picture says.
        flat = _mapped(plane, tags)
        edge = float(np.median(np.linalg.norm(flat - np.roll(flat, 1, axis=1), axis=2)))
        layout = cv2.aruco.CharucoBoard(squares, 1.0, min(edge, 0.99), dictionary)
        layout.setLegacyPattern(legacy)
        detector = cv2.aruco.CharucoDetector(layout)
        given = [each[np.newaxis].astype(np.float32) for each in tags]
        xy, points, _, _ = detector.detectBoard(picture, None, None, given, ids.astype(np.int32)[:, None])
        if points is None or not len(points):
            return None
        seen = np.asarray(points).ravel().astype(int), np.asarray(xy, dtype=np.float64).reshape(-1, 2)
        return seen, CLEAR * (1 - edge) / 2

    return Tags(ways, corners_of, board.places[:, :2], cv2)


def grid_tags(cv2: Any, board: Board) -> Tags:
    """Return the tags of an AprilGrid: of the family 36h11, with a black border of two bits, or of one."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    columns, wide = board.columns, 2 * board.columns
    t = np.arange(board.columns * board.rows)
    first = 2 * (t // columns) * wide + 2 * (t % columns)
    points = np.stack([first, first + 1, first + wide + 1, first + wide], axis=1)
    places = board.places[:, :2][points]
    ways = []
    for bits in (2, 1):
        how = cv2.aruco.DetectorParameters()
        how.markerBorderBits = bits
        ways.append((cv2.aruco.ArucoDetector(dictionary, how), places.mean(axis=1)))

    def corners_of(_picture: Any, _number: int, ids: Indices, tags: Floats, plane: Floats) -> Found:
        flat, own = _mapped(plane, tags), places[ids]
        # Seen from the front OpenCV goes round clockwise, and the board does not.
        turns = [np.roll(flat[:, ::-1], turn, axis=1) for turn in range(4)]
        turn = int(np.argmin([np.abs(each - own).sum() for each in turns]))
        return (points[ids].ravel(), np.roll(tags[:, ::-1], turn, axis=1).reshape(-1, 2)), CLEAR / 2

    return Tags(ways, corners_of, board.places[:, :2], cv2)


def _centres(tags: Floats) -> Floats:
    """Return (n, 2) where the diagonals of (n, 4, 2) corners meet: images of the centres of squares."""
    a, b, c, d = np.concatenate([tags, np.ones((*tags.shape[:2], 1))], axis=2).transpose(1, 0, 2)
    meet = np.cross(np.cross(a, c), np.cross(b, d))
    return np.asarray(meet[:, :2] / meet[:, 2:])


def _mapped(plane: Floats, xy: Floats) -> Floats:
    """Return (..., 2) places behind a homography."""
    found = np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], axis=-1) @ plane.T
    return np.asarray(found[..., :2] / found[..., 2:])
