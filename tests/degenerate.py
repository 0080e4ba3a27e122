"""Set-ups without errors whose observations leave something open: the eleven of the golden text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram import Attitudes, Block, Camera
from photogram.network import Observation, project

C, HEIGHT, SD = -100.0, 1000.0, 0.002
"""Principal distance and image deviation in millimetres, flying height in metres."""
FREE = np.inf


def looking(centres: np.ndarray, at: Sequence[float], kappa: Sequence[float] | float = 0.0) -> np.ndarray:
    """Return omega, phi, kappa of photos that look at a place, upright but for a turn about their axes."""
    matrices = []
    for centre, turn in zip(centres, np.broadcast_to(kappa, len(centres)), strict=True):
        back = (centre - at) / np.linalg.norm(centre - at)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        axes = np.column_stack([right, np.cross(back, right), back])
        cos, sin = np.cos(turn), np.sin(turn)
        matrices.append(axes @ [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return Attitudes(np.array(matrices)).values("omega_phi_kappa")


def block(
    centres: np.ndarray,
    angles: np.ndarray,
    points: np.ndarray,
    free: Sequence[str] = (),
    control: dict[int, Sequence[float]] | None = None,
    positions_sd: float = FREE,
    observations: Sequence[Observation] = (),
    c: float = C,
) -> Block:
    """Return the block whose images of all points on all photos are those of the given places."""
    photos, seen = (each.ravel() for each in np.indices((len(centres), len(points))))
    distances = np.full(len(centres), c)
    point_sd = np.full(points.shape, np.inf)
    for point, sd in (control or {}).items():
        point_sd[point] = sd
    camera = Camera("brown", {"c": c}, dict.fromkeys(free, np.inf), unit="mm", name="camera")
    return Block(
        photo_ids=[f"p{k}" for k in range(len(centres))],
        photo_positions=centres,
        photo_attitudes=angles,
        photo_position_sd=np.full(centres.shape, positions_sd),
        point_ids=[f"P{k}" for k in range(len(points))],
        point_positions=points,
        image_photos=photos,
        image_points=seen,
        image_xy=project(points[seen], centres[photos], angles[photos], distances[photos]),
        image_sd=SD,
        point_sd=point_sd,
        cameras=[camera],
        observations=list(observations),
    )


def drawn(seed: int = 3) -> np.random.Generator:
    """Return where places come from."""
    return np.random.default_rng(seed)


def flat_field(relief: float = 0.0) -> np.ndarray:
    """Return 25 points on a plane, 1,200 m wide; 0, 4, 20 and 24 are its corners."""
    x, y = (each.ravel() for each in np.meshgrid(*[np.linspace(-600.0, 600.0, 5)] * 2))
    return np.column_stack([x, y, relief * drawn().uniform(-1, 1, 25)])


def vertical(turns: Sequence[float] | float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return six vertical photos at one height."""
    centres = np.array([[x, y, HEIGHT] for y in (-200.0, 200.0) for x in (-300.0, 0.0, 300.0)])
    return centres, np.column_stack([np.zeros((6, 2)), np.broadcast_to(turns, 6)])


CORNERS = (0, 4, 20, 24)
IN_PLAN = dict.fromkeys(CORNERS, (0.05, 0.05, FREE))
IN_SPACE = dict.fromkeys(CORNERS, (0.05, 0.05, 0.05))


def around(photos: int = 6, seed: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Return photos in general attitudes about the origin."""
    random = drawn(seed)
    centres = random.standard_normal((photos, 3))
    centres = centres / np.linalg.norm(centres, axis=1)[:, None] * random.uniform(9.0, 12.0, (photos, 1))
    return centres, looking(centres, [0.0, 0.0, 0.0], random.uniform(-3.0, 3.0, photos))


def cloud(points: int = 20, size: float = 2.0, seed: int = 7) -> np.ndarray:
    """Return points in relief about the origin."""
    return drawn(seed).uniform(-size, size, (points, 3))


def ring(elevation: float = 0.0, photos: int = 12, turned: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return photos on a circle that look at a point of its axis."""
    at = 2 * np.pi * np.arange(photos) / photos
    centres = 10.0 * np.column_stack(
        [np.cos(elevation) * np.cos(at), np.cos(elevation) * np.sin(at), np.full(photos, np.sin(elevation))]
    )
    kappa = 0.5 * np.pi * (np.arange(photos) % 2) if turned else 0.0
    return centres, looking(centres, [0.0, 0.0, 0.0], kappa)
