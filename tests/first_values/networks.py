"""Networks whose photos have no poses, with the truth behind them."""

import numpy as np

from photogram import Block
from photogram.network import project, rotation_angles

C = -50.0
SD = 0.003


def looking_at(positions, targets, up=(0.0, 0.0, 1.0), roll=0.0):
    """Return omega, phi, kappa of photos at positions that look at targets."""
    angles = []
    for position, target in zip(positions, targets, strict=True):
        z = (position - target) / np.linalg.norm(position - target)
        x = np.cross(up, z)
        x /= np.linalg.norm(x)
        y = np.cross(z, x)
        c, s = np.cos(roll), np.sin(roll)
        angles.append(rotation_angles(np.array([[c * x + s * y, c * y - s * x, z]]))[0])
    return np.array(angles)


def network(positions, angles, points, *, seed, control=(), wrong=0.0, half=40.0, visible=None, sd=SD):
    """Return a block without poses and the same with true ones; `wrong` is the part of wrong images."""
    rng = np.random.default_rng(seed)
    photos, seen, xy = [], [], []
    for k, (position, turn) in enumerate(zip(positions, angles, strict=True)):
        many = np.ones((len(points), 1))
        image = project(points, many * position, many * turn, np.full(len(points), C))
        from_photo = points - position
        matrix = rotation(turn)
        inside = (np.abs(image) < half).all(axis=1) & ((from_photo @ matrix[2]) < 0)
        if visible is not None:
            inside &= visible(k)
        rows = np.flatnonzero(inside)
        photos += [k] * len(rows)
        seen += rows.tolist()
        xy.append(image[rows])
    xy = np.concatenate(xy)
    xy += rng.normal(0.0, sd, xy.shape)
    bad = rng.random(len(xy)) < wrong
    xy[bad] = rng.uniform(-half, half, (int(bad.sum()), 2))
    known = np.full((len(points), 3), np.nan)
    point_sd = np.full((len(points), 3), np.inf)
    control = list(control)
    known[control], point_sd[control] = points[control], 0.001
    block = Block(
        photo_ids=[f"F{k}" for k in range(len(positions))],
        photo_positions=np.nan,
        photo_attitudes=np.nan,
        principal_distances=C,
        point_ids=[f"P{k}" for k in range(len(points))],
        point_positions=known,
        image_photos=photos,
        image_points=seen,
        image_xy=xy,
        image_sd=sd,
        point_sd=point_sd,
    )
    return block, block.replace(photo_positions=positions, photo_attitudes=angles), bad


def rotation(angles):
    from photogram.network import rotation_matrix

    return rotation_matrix(angles[np.newaxis])[0]


def strips(seed, *, strips=2, photos=5, relief=60.0):
    """Return vertical photos in strips over terrain, heights 1000 m: positions, angles, points."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(400.0 * np.arange(photos), 700.0 * np.arange(strips))
    positions = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 1000.0)]) + rng.normal(
        0, 8, (x.size, 3)
    )
    angles = rng.normal(0, 0.02, (x.size, 3))
    angles[:, 2] += np.where(y.ravel() % 1400 > 0, np.pi, 0.0)
    count = 40 * photos * strips
    points = np.column_stack(
        [
            rng.uniform(-400, 400 * photos, count),
            rng.uniform(-400, 700 * strips - 300, count),
            rng.uniform(0, relief, count) if relief else np.zeros(count),
        ]
    )
    return positions, angles, points


def ring(seed, *, photos=10, points=80):
    """Return photos on a circle about an object, their axes level: some have phi of 90 degrees."""
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * np.arange(photos) / photos
    positions = np.column_stack([8 * np.cos(turn), 8 * np.sin(turn), np.zeros(photos)])
    angles = looking_at(positions, np.zeros((photos, 3)))
    return positions, angles, rng.uniform(-2, 2, (points, 3))
