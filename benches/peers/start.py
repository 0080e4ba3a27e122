"""The coordinates from which photogram starts its points, so that a peer can start from the same."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram import Block
from photogram.geometry import rotation_matrix

Floats = NDArray[np.float64]


def intersections(block: Block) -> Floats:
    """Intersect the initial rays of every point of a block in rectangular space, (n, 3).

    The sum of the squared distances from the rays is least: sum of (I - d d^T) (P - C) = 0 for projection
    centres C and directions d of unit length. Held components of control stay as they are.
    """
    matrices = rotation_matrix(block.photo_attitudes)
    if block.photo_to_ground:
        matrices = matrices.transpose(0, 2, 1)
    distances = block.principal_distances[block.image_photos]
    in_photo = np.column_stack([block.image_xy, distances])
    directions = np.einsum("mij,mi->mj", matrices[block.image_photos], in_photo)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    across = np.eye(3) - directions[:, :, np.newaxis] * directions[:, np.newaxis, :]
    centres = block.photo_positions[block.image_photos]

    normal = np.zeros((len(block.point_ids), 3, 3))
    right = np.zeros((len(block.point_ids), 3))
    np.add.at(normal, block.image_points, across)
    np.add.at(right, block.image_points, np.einsum("mij,mj->mi", across, centres))

    held = np.isfinite(block.point_sd)
    known = np.where(held, block.point_positions, 0.0)
    right = np.where(held, known, right - np.einsum("nij,nj->ni", normal, known))
    normal[held[:, :, np.newaxis] | held[:, np.newaxis, :]] = 0.0
    normal[held[:, :, np.newaxis] & np.eye(3, dtype=bool)] = 1.0
    return np.asarray(np.linalg.solve(normal, right[:, :, np.newaxis])[:, :, 0], dtype=np.float64)
