"""The options of simulated blocks, and the motion of their cameras during exposure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import MISSING
from typing import TYPE_CHECKING, Literal, get_args

from photogram.arguments.fields import Checked, check_fields, option
from photogram.lazy_dataclasses import dataclass, field

if TYPE_CHECKING:
    import numpy as np

    from photogram.network.cameras import Camera
    from photogram.network.geometry import Spheroid
    from photogram.network.moving_photos import Direction
    from photogram.network.refraction import Refraction
    from photogram.network.trajectories import Polynomial, Spline

ControlPattern = Literal["perimeter", "corners", "none"]

LONGEST = 1e12  # Largest length of a block, metres
SHORTEST = 1e-3  # Smallest flying height, metres
GUSTS = 0.03  # Standard deviation of a velocity component, relative to the speed


@dataclass(frozen=True)
class RollingShutter:
    """Simulated rolling shutter: rows are exposed in sequence while the camera moves.

    Parameters
    ----------
    readout
        Time from the first row to the last, seconds.
    speed
        Speed along the strips, metres per second; velocities of photos differ from it by a few percent.
    rate
        Standard deviation of the true rotation rate of a photo about each axis, radians per second.
    readout_sd
        Standard deviation of the readout time and of its initial error, seconds. Infinite: free, with half of
        the true value as initial value. 0: fixed.
    speed_sd, rate_sd
        Standard deviations of the components of observed velocities (GNSS, metres per second) and rotation
        rates (gyroscope, radians per second), used for noise and in the block. Infinite: not observed.
    direction
        Direction in which rows or columns are read. Strips are flown along x of the photos: `right` and
        `left` read along and against the flight, `down` and `up` across it.
    """

    readout: float = option(MISSING, 0, 10)
    speed: float = option(9.0, 0, 1e5)
    rate: float = option(0.1, 0, 10)
    readout_sd: float = option(math.inf, 0)
    speed_sd: float = option(0.05, 0)
    rate_sd: float = option(0.02, 0)
    direction: Direction = "down"

    def __post_init__(self) -> None:
        from photogram.arguments.arrays import one_of
        from photogram.network.moving_photos import Direction

        check_fields(self)
        one_of("direction", self.direction, get_args(Direction))

    @property
    def turned(self) -> float:
        """Practical upper bound of the rotation of a photo during readout, radians."""
        return 5 * self.rate * self.readout

    def margin(self, height: float, half_angle: float) -> float:
        """Return the maximum image motion during readout, in principal distances."""
        flown = (1 + 5 * GUSTS) * self.speed * self.readout / height
        return (flown + self.turned) * (1 + math.tan(half_angle) ** 2)


def _spline() -> Spline:
    from photogram.network.trajectories import Spline

    return Spline(every=4.0)


@dataclass(frozen=True)
class LineScanner:
    """Simulated line scanner: sensor lines across the flight direction behind one lens.

    Parameters
    ----------
    lines
        1: nadir; 2: forward and backward; 3: forward, nadir and backward. Each gives one image per strip.
    view_angle
        Angle between the nadir and the forward or backward view, radians.
    pitch
        Millimetres between samples. The ground distance of lines equals the ground distance of samples.
    speed
        Flying speed, metres per second.
    every
        Seconds between trajectory records, and between GNSS and inertial records.
    position, rotation
        Basis of the trajectory errors; the coefficients are drawn and weighted.
    scenes
        True: each photo of the layout is a scene with the length of a frame, on a trajectory of its own (e.g.
        from orbit). False: each strip is one scene.
    """

    lines: int = option(3, 1, 3)
    view_angle: float = option(0.35, 0, 1.2)
    pitch: float = option(0.01, 1e-6, 10)
    speed: float = option(70.0, 1e-3, 1e5)
    every: float = option(1.0, 1e-6, 1e6)
    position: Polynomial | Spline = field(default_factory=_spline)
    rotation: Polynomial | Spline = field(default_factory=_spline)
    scenes: bool = False

    def __post_init__(self) -> None:
        from photogram.arguments.arrays import argument_error
        from photogram.arguments.objects import kind_error
        from photogram.network.trajectories import Polynomial, Spline

        check_fields(self)
        for name in ("position", "rotation"):
            basis = getattr(self, name)
            if not isinstance(basis, Polynomial | Spline):
                raise kind_error(f"{name} of a scanner", "a Polynomial or a Spline", basis)
            if isinstance(basis, Spline) and (basis.smooth or basis.correlation):
                where, other = f"{name} of a scanner", "a simulation, which draws independent coefficients"
                raise argument_error(where, "not-applicable", name="smooth or correlation", other=other)

    @property
    def views(self) -> dict[str, float]:
        """Names of the lines and their forward viewing angles, radians."""
        ahead = {"forward": self.view_angle, "nadir": 0.0, "backward": -self.view_angle}
        chosen = {1: ["nadir"], 2: ["forward", "backward"], 3: list(ahead)}[self.lines]
        return {name: ahead[name] for name in chosen}


@dataclass(frozen=True, kw_only=True)
class SimulationOptions(Checked):
    """Options of :func:`photogram.simulate`, which are also options of `photogram simulate`.

    Attributes
    ----------
    strips, photos_per_strip
        Number of strips and of photos in each; neighbouring strips are flown in opposite directions.
    forward_overlap, side_overlap
        Overlap of neighbouring photographs (above 0.5) and strips (above 0), as a fraction of the frame,
        below 1.
    principal_distance
        Principal distance in millimetres; negative for the positive (diapositive) plane.
    frame_size
        Side of the square frame, millimetres.
    flying_height, relief
        Height above the mean terrain, and maximum deviation of the smooth terrain from its mean; metres.
    points_per_photo
        Approximate mean number of image points per photograph; the grid has a whole number of points in a
        base and in a strip.
    crab, tilt
        Maximum deviations of kappa from the heading, and of omega and phi from zero (uniform, either sign);
        radians.
    control
        "perimeter": full control around the block every `control_spacing` bases, and chains of height control
        across it at the same distance. "corners": four full control points. "none": without control. Control
        points are the pass points nearest to these positions.
    control_sd
        Standard deviation of each control coordinate, metres; 0 for fixed control.
    check_points
        Number of random points with true positions that are not used as control.
    image_sd
        Standard deviation of image coordinates in millimetres, for the noise and in the block.
    position_error, attitude_error
        Standard deviations of the errors of initial photo positions and attitudes, metres and radians.
    position_sd, attitude_sd
        Standard deviations of observed positions and attitudes (GNSS, inertial) in metres and radians, for
        the noise and in the block. Infinite: not observed. 0: fixed at the true values.
    blunders, blunder_size
        Number of image points with a gross error, and its size in millimetres, in x or y, of either sign.
    spheroid
        None: rectangular space, with x and y of the plan as X and Y. Otherwise geographic space in metres:
        the plan touches the spheroid at the origin, with x to the east. Heights are ellipsoidal, and
        photographs look down the local vertical.
    origin
        Centre of the block on the mean terrain: X, Y, Z in metres, or longitude (rad), latitude (rad), height
        (m).
    photo_to_ground
        Direction of the attitude angles.
    refraction
        Refraction model, for the images and in the block; None for straight rays.
    cameras
        Cameras, assigned to photos cyclically, with distortion, in millimetres or pixels. `frame_size` and
        `principal_distance` then only define the field of view, and image errors have the same angular size.
        Default: one camera without distortion and with the principal distance.
    start_cameras
        Initial cameras of the block, which also define free and weighted parameters. None: cameras are fixed.
    motion
        Motion of the cameras during exposure: a rolling shutter, or line scanners. Trajectories of scanners
        have weighted errors of `position_error` and `attitude_error`, and records of `position_sd` and
        `attitude_sd`. Requires rectangular space without refraction. None: cameras are at rest.
    seed
        Equal seeds and equal arguments give equal blocks.

    Examples
    --------
    >>> from photogram import simulate
    >>> from photogram.network import SimulationOptions
    >>> options = SimulationOptions(strips=1, photos_per_strip=3)
    >>> simulate(options, seed=2).truth.photo_ids
    ['0101', '0102', '0103']
    """

    strips: int = option(4, 1)
    photos_per_strip: int = option(10, 2)
    forward_overlap: float = option(0.6, 0.5, 1.0, is_open=True)
    side_overlap: float = option(0.3, 0.0, 1.0, is_open=True)
    principal_distance: float = option(-152.74, -LONGEST, LONGEST)
    frame_size: float = option(230.0, 0.0, LONGEST, is_open=True)
    flying_height: float = option(4500.0, SHORTEST, LONGEST)
    relief: float = option(150.0, 0.0, LONGEST)
    points_per_photo: float = option(100.0, 4.0, LONGEST)
    crab: float = option(0.03, 0.0, math.pi / 4)
    tilt: float = option(0.01, 0.0, 0.1)
    control: ControlPattern = "perimeter"
    control_spacing: int = option(4, 1)
    control_sd: float = option(0.05, 0.0, LONGEST)
    check_points: int = option(20, 0)
    image_sd: float = option(0.010, 0.0, LONGEST, is_open=True)
    position_sd: float = option(math.inf, 0.0)
    attitude_sd: float = option(math.inf, 0.0)
    position_error: float = option(30.0, 0.0, LONGEST)
    attitude_error: float = option(0.01, 0.0, LONGEST)
    blunders: int = option(0, 0)
    blunder_size: float = option(0.2, 0.0, LONGEST)
    spheroid: Spheroid | None = None
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    photo_to_ground: bool = False
    refraction: Refraction | None = None
    cameras: Sequence[Camera] = ()
    start_cameras: Sequence[Camera] | None = None
    motion: RollingShutter | LineScanner | None = None
    seed: int | np.random.Generator = option(0, 0, kind=int)

    def __post_init__(self) -> None:
        from photogram.arguments.objects import require

        super().__post_init__()
        for name in ("position_sd", "attitude_sd"):
            value = getattr(self, name)
            require(value <= LONGEST or value == math.inf, name, "range", low=0.0, high=LONGEST, value=value)

    @property
    def footprint(self) -> float:
        """Side of a frame on the ground, metres; infinite for a principal distance of zero."""
        distance = abs(self.principal_distance)
        return self.frame_size / distance * self.flying_height if distance else math.inf
