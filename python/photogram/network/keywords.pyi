from collections.abc import Sequence
from typing import TypedDict

import numpy as np

from photogram.network.cameras import Camera
from photogram.network.geometry import Spheroid
from photogram.network.refraction import Refraction
from photogram.network.simulation_options import ControlPattern, LineScanner, RollingShutter

class SimulationKeywords(TypedDict, total=False):
    """Fields of `SimulationOptions` as keywords of functions."""

    strips: int
    photos_per_strip: int
    forward_overlap: float
    side_overlap: float
    principal_distance: float
    frame_size: float
    flying_height: float
    relief: float
    points_per_photo: float
    crab: float
    tilt: float
    control: ControlPattern
    control_spacing: int
    control_sd: float
    check_points: int
    image_sd: float
    position_sd: float
    attitude_sd: float
    position_error: float
    attitude_error: float
    blunders: int
    blunder_size: float
    spheroid: Spheroid | None
    origin: tuple[float, float, float]
    photo_to_ground: bool
    refraction: Refraction | None
    cameras: Sequence[Camera]
    start_cameras: Sequence[Camera] | None
    motion: RollingShutter | LineScanner | None
    seed: int | np.random.Generator
