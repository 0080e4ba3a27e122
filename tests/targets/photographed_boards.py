"""Photographs of boards as a camera that is known would take them: every pixel is the mean of its parts."""

from functools import cache

import numpy as np
import pytest

from photogram import Attitudes

FLIP = np.array([1.0, -1.0, -1.0])
PARTS = 4
"""Of a pixel, across and down."""
DARK, BRIGHT = 40, 215


def opencv():
    """Return OpenCV; skip the test where it is absent."""
    return pytest.importorskip("cv2", reason="photogram[targets] is not installed")


def chessboard(board):
    """Return what a chessboard is at (n, 2) places: darkness 0 or 1, and whether it is there."""
    step = board.pitch[0]
    columns, rows = board.grid

    def at(places):
        i, j = np.floor(places.T / step).astype(int)
        inside = (i >= -1) & (i < columns) & (j >= -1) & (j < rows)
        return inside & ((i + j) % 2 == 0)

    return at


def circles(board):
    """Return what a grid of circles is at (n, 2) places."""
    radius = 0.3 * min(np.linalg.norm(board.places - board.places[0], axis=1)[1:])

    def at(places):
        found = np.zeros(len(places), dtype=bool)
        across, along = np.ascontiguousarray(places.T)
        for x, y, _ in board.places:
            near = np.flatnonzero(np.abs(across - x) < radius)
            found[near] |= np.hypot(across[near] - x, along[near] - y) < radius
        return found

    return at


def charuco(board, *, legacy=False, family="DICT_5X5_50", edge=0.7):
    """Return what a ChArUco board is at (n, 2) places, drawn by OpenCV."""
    cv2 = opencv()
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, family))
    squares = board.columns + 1, board.rows + 1
    layout = cv2.aruco.CharucoBoard(squares, 1.0, edge, dictionary)
    layout.setLegacyPattern(legacy)
    scale = 140
    drawn = layout.generateImage((squares[0] * scale, squares[1] * scale), marginSize=0)
    return _textured(drawn, lambda places: (places / board.pitch[0] + 1) * scale)


def aprilgrid(board, bits=2):
    """Return what an AprilGrid of Kalibr is at (n, 2) places: tags from the lower left, squares between."""
    cv2 = opencv()
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    scale = 20 * (6 + 2 * bits)
    gap = round(board.tag_spacing * scale)
    high, wide = (count * (scale + gap) + gap for count in (board.rows, board.columns))
    drawn = np.full((high, wide), 255, dtype=np.uint8)
    for row in range(board.rows + 1):
        for column in range(board.columns + 1):
            top, left = high - row * (scale + gap) - gap, column * (scale + gap)
            drawn[top : top + gap, left : left + gap] = 0
    for number in range(board.columns * board.rows):
        row, column = divmod(number, board.columns)
        tag = cv2.aruco.generateImageMarker(dictionary, number, scale, borderBits=bits)
        top, left = high - (row + 1) * (scale + gap), column * (scale + gap) + gap
        drawn[top : top + scale, left : left + scale] = tag
    pixel = board.tag_size / scale
    return _textured(
        drawn, lambda places: np.column_stack([places[:, 0], -places[:, 1]]) / pixel + [gap, high - gap]
    )


def _textured(drawn, pixels):
    """Return a drawing as a pattern; `pixels` count from the corner of its first one."""

    def at(places):
        column, row = np.floor(pixels(places)).astype(int).T
        inside = (column >= 0) & (row >= 0) & (column < drawn.shape[1]) & (row < drawn.shape[0])
        found = np.zeros(len(places), dtype=bool)
        found[inside] = drawn[row[inside], column[inside]] < 128
        return found

    return at


@cache
def rays_of(camera, size):
    """Return (3, n) rays of the parts of all pixels, vision axes."""
    part = (np.arange(PARTS) - (PARTS - 1) / 2) / PARTS
    x, y = (np.add.outer(np.arange(side), part).ravel() for side in size)
    xy = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)
    return (camera.rays(xy) * FLIP).T


def photographed(pattern, camera, size, pose, *, noise=2.0, seed=1):
    """Return (height, width) grey values of a board (board -> camera, vision axes), of a camera in pixels."""
    width, height = size
    towards = pose[:3, :3].T @ rays_of(camera, size)
    start = -pose[:3, :3].T @ pose[:3, 3]
    away = -start[2] / towards[2]
    places = (start[:, None] + away * towards)[:2].T
    dark = pattern(places) & (away > 0)
    grey = np.where(dark, DARK, BRIGHT).reshape(height, PARTS, width, PARTS).mean(axis=(1, 3))
    grey += np.random.default_rng(seed).normal(0, noise, grey.shape)
    return np.clip(grey.round(), 0, 255).astype(np.uint8)


def pose_of(board, camera, ray, tilt, turn, share, size):
    """Return the pose of a board whose middle lies at a ray, tilted about x and y, turned (degrees)."""
    middle, extent = board.places.mean(axis=0), np.ptp(board.places, axis=0).max()
    vectors = np.radians([[*tilt, 0.0], [0.0, 0.0, turn]])
    tilted, turned = Attitudes.of("rotation_vector", vectors).values("matrix")
    pose = np.eye(4)
    pose[:3, :3] = tilted @ turned
    away = extent * camera.scale / (share * min(size))
    pose[:3, 3] = away * np.array([*ray, 1.0]) - pose[:3, :3] @ middle
    return pose


def corners_of(board, camera, pose):
    """Return (n, 2) true images of the corners."""
    return camera.project((board.places @ pose[:3, :3].T + pose[:3, 3]) * FLIP)
