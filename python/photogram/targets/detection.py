"""Board detection in photographs (requires `pip install 'photogram[targets]'`).

Pixels count from 0 at the centre of the first one, as stored in files. The orientation in an image header is
ignored, since a calibration refers to the sensor readout.

Tags identify corners. They are located by their centres, the intersections of their diagonals. A homography
of the centres assigns tag corners to board points, for all print patterns, and detects false tags. Corners
are saddle points of grey values near the positions predicted by their neighbours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.io.files import read_bytes
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.targets.board import Board
from photogram.targets.corners import Measured
from photogram.words import phrase

Picture = NDArray[np.uint8]
MAX_REFINEMENT_STEPS, MIN_REFINEMENT_PX = 50, 1e-4
MIN_HALF_WINDOW_PX, MAX_HALF_WINDOW_PX = 2, 15
NEIGHBOURS = 14  # corners that predict the position of another
MAX_PREDICTION_ERROR_PX = 1.0


def refined(cv2: Any, picture: Picture, xy: Floats, half: Floats) -> Floats:
    """Return the saddle points near corners (n, 2), in windows of half sides (n,), px."""
    found = xy.copy()
    end = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, MAX_REFINEMENT_STEPS, MIN_REFINEMENT_PX)
    sides = np.clip(half, MIN_HALF_WINDOW_PX, MAX_HALF_WINDOW_PX).astype(int)
    for each in np.unique(sides).tolist():
        own = sides == each
        start = xy[own].astype(np.float32).reshape(-1, 1, 2)
        moved = cv2.cornerSubPix(picture, start, (each, each), (-1, -1), end)
        found[own] = np.asarray(moved, dtype=np.float64).reshape(-1, 2)
    return found


def settled(
    cv2: Any, picture: Picture, points: Indices, xy: Floats, places: Floats, half: float
) -> tuple[Indices, Floats]:
    """Return refined corners consistent with their neighbours, and point numbers.

    Inconsistent corners are searched again at their predicted positions and rejected if absent. Seven corners
    or fewer do not check each other and are rejected. Points and xy are (n,) numbers and (n, 2) initial image
    positions, `places` (b, 2) board points. `half` is the half window of a corner over the least distance of
    board points.
    """
    own = places[points]
    apart = np.linalg.norm(own[:, np.newaxis] - own, axis=2)
    np.fill_diagonal(apart, np.inf)
    scales = np.linalg.norm(xy - xy[apart.argmin(axis=1)], axis=1)
    # The distance of two wrong corners is not their scale: the median limits windows
    sides = half * np.minimum(scales, np.median(scales))
    found = refined(cv2, picture, xy, sides)
    expected = _by_neighbours(cv2, own, found)
    away = ~(np.linalg.norm(found - expected, axis=1) < MAX_PREDICTION_ERROR_PX)
    known = away & np.isfinite(expected).all(axis=1)
    if known.any():
        found[known] = refined(cv2, picture, expected[known], sides[known])
        expected = _by_neighbours(cv2, own, found)
        away = ~(np.linalg.norm(found - expected, axis=1) < MAX_PREDICTION_ERROR_PX)
    return points[~away], found[~away]


def _by_neighbours(cv2: Any, places: Floats, xy: Floats) -> Floats:
    """Return (n, 2) homography predictions from neighbours; NaN if too few."""
    found = np.full_like(xy, np.nan)
    if len(xy) <= NEIGHBOURS // 2:
        return found
    apart = np.linalg.norm(places[:, np.newaxis] - places, axis=2)
    order = np.argsort(apart, axis=1, kind="stable")[:, 1 : NEIGHBOURS + 1]
    for row, near in enumerate(order):
        plane, _ = cv2.findHomography(places[near], xy[near], cv2.LMEDS)
        if plane is not None:
            to = plane @ [*places[row], 1.0]
            found[row] = to[:2] / to[2]
    return found


FAMILIES = ("4X4", "5X5", "6X6", "7X7")
DICTIONARY_SIZES = (50, 100, 250, 1000)  # smaller dictionaries are the beginning of larger ones
MIN_TAGS_OF_HOMOGRAPHY = 4
MAX_TAG_ERROR = 0.5  # distance of a tag from its prediction, in board spacings
WINDOW_OF_GAP = 0.8  # ratio of half window to the distance of corners, tags or squares

Found = tuple[Indices, Floats]  # (n,) numbers of board points, and their (n, 2) images
Placed = tuple[Found, float] | None


@dataclass
class Tags:
    # Detectors of possible tag families, and tag centres on the board by number
    ways: Sequence[tuple[Any, Floats]]
    # Returns corners from an image, the detector number, tag numbers and corners, and the homography of their
    # centres. The second result is half the corner window over the least distance of board points
    corners_of: Callable[..., Placed]
    places: Floats  # (n, 2) board points
    cv2: Any  # OpenCV
    chosen: int | None = field(default=None, init=False)
    """Detector of the first image with the board, since it has one tag family."""

    def corners(self, picture: Any) -> Found | None:
        """Return board points and their image positions; None for too few tags."""
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
        """Return numbers, (n, 4, 2) corners, and the board homography of consistent tags."""
        detector, centres = self.ways[number]
        found, ids, _ = detector.detectMarkers(picture)
        if ids is None:
            return None
        ids = np.asarray(ids).ravel()
        tags = np.asarray(found, dtype=np.float64).reshape(-1, 4, 2)
        known = (ids < len(centres)) & (np.bincount(ids)[ids] == 1)
        ids, tags = ids[known], tags[known]
        if len(ids) < MIN_TAGS_OF_HOMOGRAPHY:
            return None
        pitch = float(np.abs(np.diff(np.unique(centres.round(9)))).min())
        # Diagonals of tags intersect in the images of the centres of squares
        a, b, c, d = np.concatenate([tags, np.ones((*tags.shape[:2], 1))], axis=2).transpose(1, 0, 2)
        meet = np.cross(np.cross(a, c), np.cross(b, d))
        images = meet[:, :2] / meet[:, 2:]
        plane, fits = self.cv2.findHomography(images, centres[ids], self.cv2.RANSAC, MAX_TAG_ERROR * pitch)
        own = np.zeros(0, dtype=bool) if plane is None else fits.ravel().astype(bool)
        if np.count_nonzero(own) < MIN_TAGS_OF_HOMOGRAPHY:
            return None
        return ids[own], tags[own], np.asarray(plane)


def charuco_tags(cv2: Any, board: Board) -> Tags:
    """Return tags of a ChArUco board: in white squares, any ArUco family and size."""
    squares = board.columns + 1, board.rows + 1
    i, j = np.tile(np.arange(squares[0]), squares[1]), np.repeat(np.arange(squares[1]), squares[0])
    ways, boards = [], []
    for family in FAMILIES:
        for legacy in (False, True) if squares[1] % 2 == 0 else (False,):
            white = (i + j) % 2 == (0 if legacy else 1)
            count = int(np.count_nonzero(white))
            size = next((each for each in DICTIONARY_SIZES if each >= count), None)
            if size is None:
                continue
            dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{family}_{size}"))
            centres = np.stack([i[white], j[white]], axis=1) + 0.5
            ways.append((cv2.aruco.ArucoDetector(dictionary), centres))
            boards.append((dictionary, legacy))

    def corners_of(picture: Any, number: int, ids: Indices, tags: Floats, plane: Floats) -> Placed:
        dictionary, legacy = boards[number]
        # Interpolated between tags, whose edge in squares follows from the image.
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
        return seen, WINDOW_OF_GAP * (1 - edge) / 2

    return Tags(ways, corners_of, board.places[:, :2], cv2)


def grid_tags(cv2: Any, board: Board) -> Tags:
    """Return tags of an AprilGrid: family 36h11, border of two bits or one."""
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

    def corners_of(_picture: Any, _number: int, ids: Indices, tags: Floats, plane: Floats) -> Placed:
        flat, own = _mapped(plane, tags), places[ids]
        # OpenCV runs clockwise as seen from the front, the board counter-clockwise.
        turns = [np.roll(flat[:, ::-1], turn, axis=1) for turn in range(4)]
        turn = int(np.argmin([np.abs(each - own).sum() for each in turns]))
        return (points[ids].ravel(), np.roll(tags[:, ::-1], turn, axis=1).reshape(-1, 2)), WINDOW_OF_GAP / 2

    return Tags(ways, corners_of, board.places[:, :2], cv2)


def _mapped(plane: Floats, xy: Floats) -> Floats:
    found = np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], axis=-1) @ plane.T
    return np.asarray(found[..., :2] / found[..., 2:])


WINDOW_OF_SPACING = 0.4  # ratio of half window to the least distance of corners
MAX_FIRST_SIDE_PX = 1600  # longer side of the reduced image that is searched first
MIN_CIRCLE_AREAS_PX = (25.0, 8.0)  # largest first, so that film grain is not detected as circles
MIN_CIRCULARITY, MIN_INERTIA_RATIO = 0.5, 0.05  # of circles tilted by 75 degrees


def detected(
    path: Path, files: Sequence[Path], board: Board, progress: Callable[[str], None] | None = None
) -> Measured:
    """Detect a board in photographs; each of several folders is a camera."""
    try:
        import cv2
    except ModuleNotFoundError:
        package = {"what": "detection of boards", "package": "OpenCV", "extra": "targets"}
        raise InputError(phrase("error.package", **package), file=path) from None
    find = _finder(cv2, board, path)
    found: list[tuple[Path, tuple[int, int], Found]] = []
    without = []
    for number, file in enumerate(files, 1):
        if progress is not None:
            progress(f"looking for the board in {file.name}, {number} of {len(files)}")
        picture = _picture(cv2, file)
        corners = find(picture)
        if corners is None or not len(corners[0]):
            without.append(_name(path, file))
        else:
            found.append((file, (picture.shape[1], picture.shape[0]), corners))
    if not found:
        message = phrase("targets.no-board-found", board=board.described, n=len(files))
        raise InputError(message, file=path)
    counts = [len(points) for _, _, (points, _) in found]
    several = len({file.parent for file, _, _ in found}) > 1
    return Measured(
        path=path,
        images=[_name(path, file) for file, _, _ in found],
        image=np.repeat(np.arange(len(found)), counts),
        point=np.concatenate([points for _, _, (points, _) in found]),
        xy=np.concatenate([xy for _, _, (_, xy) in found]),
        cameras=[file.parent.name for file, _, _ in found] if several else None,
        picture_sizes=[size for _, size, _ in found],
        messages=[Message(phrase("targets.without-board", names=without))] if without else [],
    )


def _picture(cv2: Any, file: Path) -> Picture:
    content = np.frombuffer(read_bytes(file), dtype=np.uint8)
    how = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    found = cv2.imdecode(content, how) if len(content) else None
    if found is None:
        raise InputError(phrase("targets.no-picture"), file=file)
    return np.asarray(found)


def _name(path: Path, file: Path) -> str:
    return file.relative_to(path).as_posix() if path.is_dir() else file.name


def _finder(cv2: Any, board: Board, path: Path) -> Callable[[Picture], Found | None]:
    if board.kind == "points":
        raise InputError(phrase("targets.points-in-photos"), file=path)
    if board.kind in ("charuco", "aprilgrid"):
        tags = charuco_tags(cv2, board) if board.kind == "charuco" else grid_tags(cv2, board)
        return tags.corners
    ways = {"chessboard": _chessboard, "circles": _circles, "asymmetric_circles": _circles}

    def found(picture: Picture) -> Found | None:
        xy = ways[board.kind](cv2, board, picture)
        return None if xy is None else (np.arange(len(xy)), xy)

    return found


def _chessboard(cv2: Any, board: Board, picture: Picture) -> Floats | None:
    """Return all corners from the fast square detector, else from the sector detector.

    The latter is robust to blur but requires seconds per large image: it first searches a reduced one.
    """
    how = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    there, xy = cv2.findChessboardCorners(picture, board.grid, flags=how)
    start = _flat(xy) if there else None
    if start is None:
        times = math.ceil(max(picture.shape) / MAX_FIRST_SIDE_PX)
        start = _by_sectors(cv2, board, picture, times)
        if start is None and times > 1:
            start = _by_sectors(cv2, board, picture, 1)
    if start is None:
        return None
    return refined(cv2, picture, start, WINDOW_OF_SPACING * _nearest(start.reshape(*board.grid[::-1], 2)))


def _by_sectors(cv2: Any, board: Board, picture: Picture, times: int) -> Floats | None:
    """Return all corners of an image reduced `times`, in full-size pixels."""
    high, wide = (side // times for side in picture.shape)
    if times > 1:
        # Average whole blocks of pixels.
        picture = cv2.resize(
            picture[: high * times, : wide * times], (wide, high), interpolation=cv2.INTER_AREA
        )
    there, xy = cv2.findChessboardCornersSB(picture, board.grid, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    return (_flat(xy) + 0.5) * times - 0.5 if there else None


def _circles(cv2: Any, board: Board, picture: Picture) -> Floats | None:
    """Return the centres of all circles, which are ellipses on tilted boards."""
    skewed = board.kind == "asymmetric_circles"
    how = cv2.CALIB_CB_ASYMMETRIC_GRID if skewed else cv2.CALIB_CB_SYMMETRIC_GRID
    for least in MIN_CIRCLE_AREAS_PX:
        blobs = cv2.SimpleBlobDetector_Params()
        blobs.minArea, blobs.maxArea = least, picture.size / len(board.places)
        blobs.minDistBetweenBlobs = math.sqrt(least)
        blobs.minCircularity, blobs.minInertiaRatio = MIN_CIRCULARITY, MIN_INERTIA_RATIO
        detector = cv2.SimpleBlobDetector_create(blobs)
        for more in (cv2.CALIB_CB_CLUSTERING, 0):
            there, xy = cv2.findCirclesGrid(picture, board.grid, flags=how | more, blobDetector=detector)
            if there:
                return _flat(xy)
    return None


def _nearest(grid: Floats) -> Floats:
    """Return (n,) distances of corners (rows, columns, 2) to the next row or column."""
    found = np.full(grid.shape[:2], np.inf)
    for turned, own in ((grid, found), (grid.swapaxes(0, 1), found.T)):
        apart = np.linalg.norm(np.diff(turned, axis=0), axis=2)
        own[1:] = np.minimum(own[1:], apart)
        own[:-1] = np.minimum(own[:-1], apart)
    return found.ravel()


def _flat(xy: Any) -> Floats:
    return np.asarray(xy, dtype=np.float64).reshape(-1, 2)
