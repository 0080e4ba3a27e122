"""Corners from photographs of a board (needs `pip install 'photogram[targets]'`).

Pixels count from 0 at the centre of the first one, as files hold them: an orientation in the head of a
picture is not applied, since a camera is calibrated as its sensor is read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.io.files import read_bytes
from photogram.messages import Message, counted, listed
from photogram.targets.board import Board
from photogram.targets.corner_views import Measured
from photogram.targets.markers import charuco_tags, grid_tags
from photogram.targets.saddles import Picture, refined

__all__ = ["detected"]

Found = tuple[Indices, Floats]
"""Numbers of points of the board, and where they are: (n,), (n, 2)."""
PART = 0.4
"""Half the side of the window of a corner, over the least distance to its neighbours."""
ENOUGH = 1600
"""Pixels of the longer side of a picture that is searched at first."""
LEAST = (25.0, 8.0)
"""Square pixels of the smallest circles: large ones first, among which grain is none."""
ROUND, FLAT = 0.5, 0.05
"""Of circles that are tilted by 75 degrees: 4 pi A / P^2, and the ratio of moments."""


def detected(
    path: Path, files: Sequence[Path], board: Board, progress: Callable[[str], None] | None = None
) -> Measured:
    """Find a board in photographs; where these lie in several folders, each folder is a camera.

    Errors name `path`, what was asked for; `progress` is told which picture is searched. InputError: OpenCV
    is absent, a board whose targets nobody knows by their look, a file that is no picture, a board that no
    picture shows.
    """
    cv2 = _opencv(path)
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
        raise InputError(
            f"no board ({board.described}) is found in {counted(len(files), 'picture')}: columns and rows of"
            " a chessboard are counted in corners between squares",
            file=path,
        )
    told = [Message(f"no board is found in {listed(without)}")] if without else []
    return _measured(path, found, told)


def _opencv(path: Path) -> Any:
    try:
        import cv2
    except ModuleNotFoundError:
        raise InputError(
            "corners of a board in photographs need OpenCV: pip install 'photogram[targets]'", file=path
        ) from None
    return cv2


def _picture(cv2: Any, file: Path) -> Picture:
    """Return the grey values of a picture as its file holds them."""
    content = np.frombuffer(read_bytes(file), dtype=np.uint8)
    how = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    found = cv2.imdecode(content, how) if len(content) else None
    if found is None:
        raise InputError("is no picture that OpenCV can read", file=file)
    return np.asarray(found)


def _name(path: Path, file: Path) -> str:
    return file.relative_to(path).as_posix() if path.is_dir() else file.name


def _measured(
    path: Path, found: Sequence[tuple[Path, tuple[int, int], Found]], told: list[Message]
) -> Measured:
    """Return what was found as the corners of a file."""
    folders = [file.parent.name for file, _, _ in found]
    several = len({file.parent for file, _, _ in found}) > 1
    counts = [len(points) for _, _, (points, _) in found]
    total = sum(counts)
    return Measured(
        path=path,
        images=[_name(path, file) for file, _, _ in found],
        image=np.repeat(np.arange(len(found)), counts),
        point=np.concatenate([points for _, _, (points, _) in found]),
        xy=np.concatenate([xy for _, _, (_, xy) in found]),
        sd=np.ones(total),
        use=np.ones(total, dtype=bool),
        cameras=folders if several else None,
        picture_sizes=[size for _, size, _ in found],
        messages=told,
    )


def _finder(cv2: Any, board: Board, path: Path) -> Callable[[Picture], Found | None]:
    """Return what looks for a board in a picture."""
    if board.kind == "points":
        raise InputError(
            "targets that lie anywhere are not looked for in photographs: give their corners", file=path
        )
    if board.kind in ("charuco", "aprilgrid"):
        tags = charuco_tags(cv2, board) if board.kind == "charuco" else grid_tags(cv2, board)
        return tags.corners
    ways = {"chessboard": _chessboard, "circles": _circles, "asymmetric_circles": _circles}

    def found(picture: Picture) -> Found | None:
        xy = ways[board.kind](cv2, board, picture)
        return None if xy is None else (np.arange(len(xy)), xy)

    return found


def _chessboard(cv2: Any, board: Board, picture: Picture) -> Floats | None:
    """Return all corners: by the detector of squares, which is quick, or else by that of sectors.

    That of sectors, which blur does not disturb, takes seconds for a large picture: a reduced one goes first.
    """
    how = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    there, xy = cv2.findChessboardCorners(picture, board.grid, flags=how)
    start = _flat(xy) if there else None
    for times in _reductions(picture) if start is None else ():
        start = _by_sectors(cv2, board, picture, times)
        if start is not None:
            break
    if start is None:
        return None
    return refined(cv2, picture, start, PART * _nearest(start.reshape(*board.grid[::-1], 2)))


def _reductions(picture: Picture) -> list[int]:
    """Return how many times smaller a picture is searched, one after the other."""
    times = math.ceil(max(picture.shape) / ENOUGH)
    return [times, 1] if times > 1 else [1]


def _by_sectors(cv2: Any, board: Board, picture: Picture, times: int) -> Floats | None:
    """Return all corners in a picture that is made so many times smaller, in pixels of the picture."""
    high, wide = (side // times for side in picture.shape)
    if times > 1:
        # Whole squares of pixels become one.
        picture = cv2.resize(
            picture[: high * times, : wide * times], (wide, high), interpolation=cv2.INTER_AREA
        )
    there, xy = cv2.findChessboardCornersSB(picture, board.grid, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    return (_flat(xy) + 0.5) * times - 0.5 if there else None


def _circles(cv2: Any, board: Board, picture: Picture) -> Floats | None:
    """Return the centres of all circles, which tilted boards show as ellipses."""
    skewed = board.kind == "asymmetric_circles"
    how = cv2.CALIB_CB_ASYMMETRIC_GRID if skewed else cv2.CALIB_CB_SYMMETRIC_GRID
    for least in LEAST:
        blobs = cv2.SimpleBlobDetector_Params()
        blobs.minArea, blobs.maxArea = least, picture.size / len(board.places)
        blobs.minDistBetweenBlobs = math.sqrt(least)
        blobs.minCircularity, blobs.minInertiaRatio = ROUND, FLAT
        detector = cv2.SimpleBlobDetector_create(blobs)
        for more in (cv2.CALIB_CB_CLUSTERING, 0):
            there, xy = cv2.findCirclesGrid(picture, board.grid, flags=how | more, blobDetector=detector)
            if there:
                return _flat(xy)
    return None


def _nearest(grid: Floats) -> Floats:
    """Return (n,) distances of corners (rows, columns, 2) to the next one along their row or column."""
    found = np.full(grid.shape[:2], np.inf)
    for turned, own in ((grid, found), (grid.swapaxes(0, 1), found.T)):
        apart = np.linalg.norm(np.diff(turned, axis=0), axis=2)
        own[1:] = np.minimum(own[1:], apart)
        own[:-1] = np.minimum(own[:-1], apart)
    return found.ravel()


def _flat(xy: Any) -> Floats:
    return np.asarray(xy, dtype=np.float64).reshape(-1, 2)
