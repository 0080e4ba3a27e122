"""Parameters of the photos of a collection: pose and camera."""

from __future__ import annotations

from photogram.network.cameras import camera_facts

POSE = ("w1", "w2", "w3", "t1", "t2", "t3")  # Angle-axis vector w (rad) and translation t of a photo
PARAMETERS = (*POSE, "f", "k1", "k2")  # Photo with the camera `bal`: also f (pixels), k1, k2


def parameters_of(camera: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units of the k parameters of a photo with this camera model."""
    powers = camera_facts(camera)[1]
    units = ("rad",) * 3 + ("",) * 3 + tuple("px" if power == 1 else "" for _, power in powers)
    return (*POSE, *(name for name, _ in powers)), units
