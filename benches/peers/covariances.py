"""Covariances of the peers in terms of positions and attitudes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from solution import HALF_TURN, Floats

from photogram import Block
from photogram.network.geometry import rotation_angles

Place = tuple[Floats, Floats]
"""The rotation from object to camera space and the projection centre."""

_STEPS = np.array([1e-4, 1e-4, 1e-4, 1.0, 1.0, 1.0])
"""Of the central differences, in radians and metres; positions are linear in shifts."""


def moved(block: Block, place: Callable[[Floats, Floats], Place], covariance: Floats) -> Floats:
    """Propagate a covariance from the tangent space of a pose to its position and attitude, (6, 6).

    `place` turns the pose by a rotation matrix, shifts it by a vector and says where it then is; the
    covariance is in the order rotation, shift.
    """
    derivative = np.empty((6, 6))
    for k in range(6):
        ends = []
        for sign in (1, -1):
            tangent = np.zeros(6)
            tangent[k] = sign * _STEPS[k]
            to_camera, centre = place(_rotation(tangent[:3]), tangent[3:])
            matrix = HALF_TURN @ to_camera
            angles = rotation_angles((matrix.T if block.photo_to_ground else matrix)[np.newaxis])[0]
            ends.append(np.concatenate([centre, angles]))
        difference = ends[0] - ends[1]
        difference[3:] -= 2 * np.pi * np.round(difference[3:] / (2 * np.pi))
        derivative[:, k] = difference / (2 * _STEPS[k])
    propagated: Floats = derivative @ covariance @ derivative.T
    return propagated


def _rotation(vector: Floats) -> Floats:
    """Return the rotation about a vector by its length (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    half = np.sinc(angle / (2 * np.pi))
    matrix: Floats = np.eye(3) + np.sinc(angle / np.pi) * cross + half**2 / 2 * cross @ cross
    return matrix
