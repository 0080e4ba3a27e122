"""Targets as a camera that is known would show them: poses at random, spread over its picture."""

import numpy as np

from photogram import Attitudes
from photogram.targets import Corners

FLIP = np.array([1.0, -1.0, -1.0])


def seen(board, camera, size, *, views=12, seed=1, sd=0.3, least=20):
    """Return corners of a board, and (V, 4, 4) poses board -> camera, vision axes."""
    rng, places = np.random.default_rng(seed), board.places
    middle, extent = places.mean(axis=0), np.ptp(places, axis=0).max()
    pixels, poses = [], []
    while len(poses) < views:
        ray = camera.rays(rng.uniform(0.15, 0.85, (1, 2)) * size)[0] * FLIP
        pose = np.eye(4)
        pose[:3, :3] = _towards(ray) @ _tilted(rng)
        far = extent * camera.scale / (rng.uniform(0.3, 0.6) * min(size))
        pose[:3, 3] = far * ray - pose[:3, :3] @ middle
        xy = camera.project((places @ pose[:3, :3].T + pose[:3, 3]) * FLIP) + rng.normal(
            0, sd, (len(places), 2)
        )
        inside = ((xy > 0) & (xy < np.array(size) - 1)).all(axis=1)
        if inside.sum() >= least:
            pixels.append(np.where(inside[:, None], xy, np.nan))
            poses.append(pose)
    xy = np.array(pixels)
    picture, point = np.nonzero(np.isfinite(xy[..., 0]))
    corners = Corners(
        pictures=[f"view{k}" for k in range(views)],
        cameras=np.zeros(views, dtype=int),
        views=np.arange(views),
        camera_names=["camera"],
        sizes=[tuple(size)],
        picture=picture,
        point=point,
        xy=xy[picture, point],
        sd=np.ones(len(picture)),
    )
    return corners, np.array(poses)


def _towards(ray):
    """Return axes whose third is a ray, as columns."""
    across = np.cross([0.0, 1.0, 0.0], ray)
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(ray, across), ray])


def _tilted(rng):
    """Return a board that is tilted by up to 40 degrees, and turned."""
    about = rng.uniform(0, 2 * np.pi)
    vectors = np.radians(rng.uniform(0, 40)) * np.array([[np.cos(about), np.sin(about), 0]])
    turn = np.array([[0, 0, rng.uniform(0, 2 * np.pi)]])
    tilt, turned = (Attitudes.of("rotation_vector", each).values("matrix")[0] for each in (vectors, turn))
    return tilt @ turned
