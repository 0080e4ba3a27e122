"""A stereo head: two cameras on one frame, taken to six places; their relative pose is adjusted.

There is no control: the base, measured to a tenth of a millimetre, gives the scale, the first photo the rest.
Prints the pose of the second camera on the frame.
"""

from __future__ import annotations

import numpy as np

from photogram import Attitudes, Block, Result, adjust
from photogram.network import Base, Mount, Sensor, project, rotation_matrix

IMAGE_SD = 0.001
"""Millimetres."""
BASE_SD = 1e-4
"""Metres."""
POSITION = np.array([0.52, 0.013, -0.021])
"""Of the second camera in the axes of the frame, metres."""
TURN = np.array([0.02, -0.09, 0.016])
"""Its rotation there, a rotation vector in radians."""
FRAMES = 6


def poses() -> tuple[np.ndarray, np.ndarray]:
    """Return positions and matrices, photo to object, of the frames, then of the second cameras."""
    turns = 0.35 * (np.arange(FRAMES) - 2.5)
    positions = 5.0 * np.column_stack([np.sin(turns), 0.2 * np.cos(3 * turns), np.cos(turns)])
    angles = np.column_stack([-0.2 * np.cos(3 * turns), turns, 0.8 * np.arange(FRAMES)])
    frames = rotation_matrix(angles).transpose(0, 2, 1)
    second = frames @ Attitudes.of("rotation_vector", TURN[np.newaxis]).matrices
    return np.concatenate([positions, positions + frames @ POSITION]), np.concatenate([frames, second])


def measured(seed: int = 5) -> Block:
    """Return the block with its measurements, errors drawn with the given seed."""
    random = np.random.default_rng(seed)
    positions, matrices = poses()
    angles = Attitudes(matrices).values("omega_phi_kappa")
    points = np.random.default_rng(1).uniform(-1.5, 1.5, (40, 3)) * [1.0, 1.0, 0.4]
    photos, seen = (each.ravel() for each in np.indices((2 * FRAMES, len(points))))
    distances = np.full(2 * FRAMES, -35.0)
    xy = project(points[seen], positions[photos], angles[photos], distances[photos])
    photo_ids = [f"{camera} {k + 1}" for camera in ("left", "right") for k in range(FRAMES)]
    sensor = Sensor("right", [0.5, 0.0, 0.0])
    length = float(np.linalg.norm(POSITION)) + BASE_SD * random.standard_normal()
    return Block(
        photo_ids=photo_ids,
        photo_positions=positions + random.normal(0, 0.02, positions.shape),
        photo_attitudes=angles + random.normal(0, 0.01, angles.shape),
        principal_distances=distances,
        point_ids=[f"P{k}" for k in range(len(points))],
        point_positions=np.full(points.shape, np.nan),
        image_photos=photos,
        image_points=seen,
        image_xy=xy + IMAGE_SD * random.standard_normal(xy.shape),
        image_sd=np.full(xy.shape, IMAGE_SD),
        title="a stereo head",
        observations=[Base(None, sensor, length, sd=BASE_SD)],
        mounts=[Mount(photo_ids[FRAMES + k], photo_ids[k], sensor) for k in range(FRAMES)],
    )


def main() -> Result:
    """Adjust the block and print the pose of the second camera."""
    result = adjust(measured())
    columns = ["unknown", "component", "unit", "value", "sd"]
    print(result.unknown_table()[columns].to_string(index=False, float_format="%.6f"))
    return result


if __name__ == "__main__":
    main()
