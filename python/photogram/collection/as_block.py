"""A collection as a block: the same photos with a camera each."""

from __future__ import annotations

import math

import numpy as np

from photogram.collection.collection import POSE, Collection
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.cameras import Camera


def as_block(collection: Collection) -> Block:
    """Return the block of a collection: the same photos with a camera each, and points where rays meet.

    Positions and attitudes are fixed where all components are; other weights of them are left out.
    """
    poses = collection.photo_parameters[:, : len(POSE)]
    attitudes = Attitudes.of("rotation_vector_to_photo", poses[:, :3])
    centres = -np.einsum("pij,pj->pi", attitudes.matrices, poses[:, 3:])
    fixed = (collection.photo_sd[:, : len(POSE)] == 0).all(axis=1)[:, np.newaxis]
    sd = np.broadcast_to(np.where(fixed, 0.0, math.inf), (len(poses), 3))
    names = collection.parameters[len(POSE) :]
    held = np.isfinite(collection.point_sd)
    return Block(
        photo_ids=[f"photo {number}" for number in range(len(poses))],
        photo_positions=centres,
        photo_attitudes=attitudes.values("omega_phi_kappa"),
        photo_position_sd=sd,
        photo_attitude_sd=sd,
        cameras=[
            Camera(
                collection.camera,
                dict(zip(names, values, strict=True)),
                sd={name: one for name, one in zip(names, own, strict=True) if one > 0},
                unit="px",
            )
            for values, own in zip(
                collection.photo_parameters[:, len(POSE) :].tolist(),
                collection.photo_sd[:, len(POSE) :].tolist(),
                strict=True,
            )
        ],
        point_ids=[f"point {number}" for number in range(len(collection.point_positions))],
        point_positions=np.where(held, collection.point_positions, np.nan),
        point_sd=collection.point_sd,
        image_photos=collection.image_photos,
        image_points=collection.image_points,
        image_xy=collection.image_xy,
        image_sd=collection.image_sd,
    )
