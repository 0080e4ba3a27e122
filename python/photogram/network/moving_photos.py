"""Photos whose poses follow from others: rigs, rolling shutters, line scanners, and times of records."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, elements, number, numbers, object_name, shaped
from photogram.arguments.equality import Valued
from photogram.arguments.fields import check_fields
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.attitudes import Attitudes, angles_form
from photogram.network.lens import Lens
from photogram.network.trajectories import Clock, Polynomial, Readout, Table, Trajectory
from photogram.network.unknowns import Sensor, Unknown
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Block


Direction = Literal["down", "up", "right", "left"]

STEPS = 100
CLOSE = 1e-10  # Convergence limit of the sample next to a position, samples


@cache
def _known(readout: float) -> Readout:
    """Return a fixed readout time; one object for all shutters with the same seconds."""
    return Readout(f"{readout!r} s", readout, sd=0.0)


@dataclass(frozen=True)
class Shutter:
    """A rolling shutter: row r of h is exposed at t_e + (r / h) T.

    Parameters
    ----------
    readout
        T: one object for all photos of a camera, or a fixed value in seconds.
    edges
        Image coordinates of the edges at the start and the end of the readout (r = 0 and r = h): 0 and the
        height in pixels from the upper edge. In millimetres with y up, the larger coordinate is first.
    direction
        `down` and `up` read rows, `right` and `left` columns. `edges` define the start, so that T is also
        positive for `up` and `left`.
    """

    readout: Readout | float
    edges: tuple[float, float]
    direction: Direction = "down"

    def __post_init__(self) -> None:
        check_fields(self)
        first, last = shaped("edges of a shutter", self.edges, (2,)).tolist()
        if not np.isfinite([first, last]).all() or first == last:
            raise kind_error("edges of a shutter", "two different coordinates", self.edges)
        object.__setattr__(self, "edges", (first, last))
        if not isinstance(self.readout, Readout):
            object.__setattr__(self, "readout", _known(number("readout", self.readout)))

    def times(self, xy: Floats) -> Floats:
        """Return (n,) r / h of (n, 2) images."""
        first, last = self.edges
        along = xy[:, 1] if self.direction in ("down", "up") else xy[:, 0]
        return np.asarray((along - first) / (last - first))


@dataclass(frozen=True, eq=False)
class Lines:
    """Exposure times of scan lines: t = t_j + (line - l_j) dt_j from line l_j on.

    Parameters
    ----------
    table
        (k, 3) first line, time in seconds and seconds per line. Lines are counted from the upper edge (0);
        the centre of line number k (from 0) is k + 0.5. The first and the last row are extrapolated.
    """

    table: ArrayLike

    def __post_init__(self) -> None:
        rows = np.atleast_2d(numbers("lines", self.table))
        sound = rows.ndim == 2 and rows.shape[1] == 3 and len(rows) and np.isfinite(rows).all()
        if not sound or not (np.diff(rows[:, 0]) > 0).all() or not (rows[:, 2] != 0).all():
            raise kind_error("lines", "rows of first line, time, seconds per line, ascending", self.table)
        object.__setattr__(self, "table", rows)

    def times(self, lines: ArrayLike, start: float = 0.0) -> Floats:
        """Return line times in seconds relative to `start`, which preserves the digits of late times."""
        rows, lines = np.asarray(self.table), np.asarray(lines, dtype=float)
        own = rows[np.maximum(np.searchsorted(rows[:, 0], lines, side="right") - 1, 0)]
        return np.asarray(own[..., 1] - start + (lines - own[..., 0]) * own[..., 2])

    def at(self, times: ArrayLike) -> Floats:
        """Return the lines at times in seconds, the inverse of :meth:`times`."""
        rows, times = np.asarray(self.table), np.asarray(times, dtype=float)
        # Times of the rows all increase with the lines, or all decrease.
        sense = np.sign(rows[0, 2])
        own = rows[np.maximum(np.searchsorted(sense * rows[:, 1], sense * times, side="right") - 1, 0)]
        return np.asarray(own[..., 0] + (times - own[..., 1]) / own[..., 2])


@dataclass(frozen=True, eq=False)
class LineSensor(Valued):
    """Focal-plane positions of samples: (x0, y0) + (sample - s0) (pitch_x, pitch_y).

    Parameters
    ----------
    pitch
        Millimetres from sample to sample, along x and y.
    s0
        Sample at (x0, y0), counted from the edge of the first: half of all samples for the centre.
    x0, y0
        Millimetres.
    lens
        Fixed lens model, which corrects positions before the camera does and makes the line curved. None:
        only the camera corrects.
    bends
        (k, 3) samples, increasing, with x and y deviations of the sensor from the straight line in
        millimetres. Interpolation is linear, extrapolation constant. None: the line is straight.

    Raises
    ------
    InputError
        If the pitch is zero, the lens is invalid, or the bends are invalid.
    """

    pitch: tuple[float, float]
    s0: float
    x0: float = 0.0
    y0: float = 0.0
    lens: Lens | None = None
    bends: ArrayLike | None = None

    def __post_init__(self) -> None:
        check_fields(self, "a line of sensors")
        pitch = shaped("pitch of a line of sensors", self.pitch, (2,))
        if not (np.isfinite(pitch).all() and pitch.any()):
            raise kind_error("pitch of a line of sensors", "finite and not 0", self.pitch)
        object.__setattr__(self, "pitch", tuple(pitch.tolist()))
        if self.bends is not None:
            rows = numbers("bends of a line of sensors", self.bends)
            sound = rows.ndim == 2 and rows.shape[1] == 3 and len(rows) and np.isfinite(rows).all()
            if not sound or not (np.diff(rows[:, 0]) > 0).all():
                raise kind_error("bends of a line of sensors", "rows of sample, x, y, ascending", self.bends)
            object.__setattr__(self, "bends", rows)

    @classmethod
    def of_table(cls, table: ArrayLike, lens: Lens | None = None) -> LineSensor:
        """Create the line sensor from (k, 3) samples, increasing, and their x, y in millimetres.

        Raises
        ------
        InputError
            If there are fewer than two samples, the shape is wrong, or samples do not increase.
        """
        rows = numbers("table of a line of sensors", table)
        if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) < 2:
            raise kind_error("table of a line of sensors", "rows of sample, x, y", table)
        (s0, x0, y0), across = rows[0], rows[-1] - rows[0]
        if not across[0] > 0:
            raise kind_error("samples of a line of sensors", "ascending", table)
        pitch = across[1:] / across[0]
        bends = np.column_stack([rows[:, 0], rows[:, 1:] - [x0, y0] - (rows[:, [0]] - s0) * pitch])
        return cls((float(pitch[0]), float(pitch[1])), float(s0), float(x0), float(y0), lens, bends)

    @property
    def is_straight(self) -> bool:
        """Whether the sensor has neither a lens model nor bends."""
        return self.lens is None and self.bends is None

    def places(self, samples: Floats) -> Floats:
        """Return (n, 2) focal-plane positions of samples, corrected by the lens, in millimetres."""
        straight = np.asarray([self.x0, self.y0] + (samples[:, np.newaxis] - self.s0) * np.array(self.pitch))
        if self.bends is not None:
            known, *off = np.asarray(self.bends).T
            straight = straight + np.column_stack([np.interp(samples, known, each) for each in off])
        return straight if self.lens is None else self.lens.corrected(straight)

    def abreast(self, places: Floats) -> tuple[Floats, Floats]:
        """Return the samples next to (n, 2) positions, and their distances from the line in mm.

        On a curved line, the connection to the sample is perpendicular to the pitch.
        """
        length = float(np.hypot(*self.pitch))
        along = np.array(self.pitch) / length
        samples = self.s0 + (places - [self.x0, self.y0]) @ along / length
        for _ in range(0 if self.is_straight else STEPS):
            step = (places - self.places(samples)) @ along / length
            samples = samples + step
            if not (np.abs(step) > CLOSE).any():
                break
        return samples, (places - self.places(samples)) @ np.array([-along[1], along[0]])


@dataclass(frozen=True, eq=False)
class Moment:
    """Time on a trajectory to which an additional observation refers."""

    trajectory: Trajectory
    time: float
    clock: Clock | None = None

    @property
    def name(self) -> str:
        clock = "" if self.clock is None else f", {self.clock.name}"
        return f"{self.trajectory.name} at {self.time!r} s{clock}"


@dataclass(frozen=True, eq=False)
class Timed:
    """Assignment of a photo to a trajectory: each image has the pose at its own time.

    Parameters
    ----------
    photo
        Name of the photo. Its own pose is only an approximation.
    trajectory
        None: a trajectory of its own, uniform motion from its pose. Position and attitude in the block and
        their standard deviations then refer to `time`.
    time
        t_e in seconds: of a frame, or of the edge at the start of the readout. For a scanner, the origin of
        times for the factor of line rates; None: the mean time of its images.
    shutter, lines
        Rolling shutter of the camera, or line times of a scanner, whose coordinates are samples and lines.
    line_sensor
        Focal-plane positions of the samples of a scanner.
    sensor
        Pose of the camera on the moving platform; None: the platform pose.
    offset
        Unknown offset of the clock of the photo.
    rate
        Unknown factor of the line rates.
    velocity, rotation_rate
        (3,) given velocity of its own trajectory in the linear unit per second along X, Y, Z, and rotation
        rate about its own axes in radians per second.
    sd_velocity, sd_rate
        (3,) standard deviations of `velocity` and `rotation_rate`; infinite: free.
    """

    photo: str
    trajectory: Trajectory | None = None
    time: float | None = field(default=None, metadata={"check": partial(number, rule="finite")})
    shutter: Shutter | None = None
    lines: Lines | None = None
    line_sensor: LineSensor | None = None
    sensor: Sensor | None = None
    offset: Clock | None = None
    rate: Readout | None = None
    velocity: ArrayLike = field(default=0.0, metadata={"check": partial(shaped, shape=(3,))})
    rotation_rate: ArrayLike = field(default=0.0, metadata={"check": partial(shaped, shape=(3,))})
    sd_velocity: ArrayLike = field(default=np.inf, metadata={"check": partial(shaped, shape=(3,))})
    sd_rate: ArrayLike = field(default=np.inf, metadata={"check": partial(shaped, shape=(3,))})

    def __post_init__(self) -> None:
        vars(self)["photo"] = object_name("photo of a trajectory", self.photo)
        check_fields(self, f"photo {self.photo}")
        scanner = self.lines is not None
        where = f"photo {self.photo}"
        require(
            scanner == (self.line_sensor is not None), where, "together", name="lines", other="line_sensor"
        )
        conflict = self.shutter is not None and (scanner or self.rate is not None)
        require(not conflict, where, "exclusive", first="shutter", second="lines and rate")
        require(scanner or self.rate is None, where, "requires", name="rate", other="lines")
        placed = self.trajectory is not None or self.time is not None
        require(placed or not scanner, where, "requires", name="lines", other="trajectory or time")

    @property
    def readout(self) -> Readout | None:
        """Unknown that multiplies the image times."""
        shutter = self.shutter.readout if self.shutter is not None else None
        return shutter if isinstance(shutter, Readout) else self.rate

    @property
    def scalars(self) -> list[Unknown]:
        """Unknowns of the image times."""
        return [each for each in (self.readout, self.offset) if each is not None]

    def times(self, xy: Floats) -> Floats:
        """Return the (n,) times of (n, 2) images, with given values of offset, readout and rate."""
        time, scale, _ = self.images(xy)
        rate = 1.0 if self.readout is None else float(self.readout.position[0])
        return time + self.delay + rate * scale

    @property
    def delay(self) -> float:
        """Given offset of the clock, seconds."""
        return 0.0 if self.offset is None else float(self.offset.position[0])

    def images(self, xy: Floats) -> tuple[float, Floats, Floats]:
        """Return the time, and image times and coordinates for the core, of (n, 2) images."""
        if self.lines is not None and self.line_sensor is not None:
            time, lines = self.time, xy[:, 1]
            if time is None:
                first = float(np.asarray(self.lines.table)[0, 1])
                time = first + (float(self.lines.times(lines, first).mean()) if len(lines) else 0.0)
            return time, self.lines.times(lines, time), self.line_sensor.places(xy[:, 0])
        time = self.time or 0.0
        return time, np.zeros(len(xy)) if self.shutter is None else self.shutter.times(xy), xy


def require_photos(name: str, own: Sequence[str], photos: Sequence[str]) -> None:
    known, seen = set(photos), set[str]()
    for photo in own:
        if photo not in known or photo in seen:
            code = "repeated" if photo in seen else "absent"
            raise argument_error(name, code, kind="photo", name=photo)
        seen.add(photo)


def trajectory_of(block: Block, own: Timed) -> Trajectory:
    """Return the given trajectory, or uniform motion from the pose: c_0 + (t - t_e) v, r_0 + (t - t_e) w."""
    if own.trajectory is not None:
        return own.trajectory
    row = block._photo_rows[own.photo]
    if block.geographic:
        raise InputError(phrase("block.timed.geographic", photo=own.photo))
    sd_position, sd_attitude = block.photo_position_sd[row], block.photo_attitude_sd[row]
    if np.isfinite(sd_attitude).any() and not (sd_attitude == 0).all():
        raise InputError(phrase("block.timed.attitude-sd", photo=own.photo, sd=sd_attitude.tolist()))
    observed = block.photo_positions_observed
    place = block.photo_positions[row]
    if observed is not None:
        place = np.where(np.isfinite(sd_position), observed[row], place)
    time = own.time or 0.0
    form = angles_form(block.photo_to_ground)
    attitude = Attitudes.of(form, block.photo_attitudes[[row]]).matrices
    table = Table(np.array([time]), place[np.newaxis], np.array([time]), attitude)
    values, turns = (np.array([np.zeros(3), each]) for each in (own.velocity, own.rotation_rate))
    sd, sd_turn = np.array([sd_position, own.sd_velocity]), np.array([sd_attitude, own.sd_rate])
    return Trajectory(
        own.photo,
        table,
        position=Polynomial(1, time, 1.0, values, sd),
        rotation=Polynomial(1, time, 1.0, turns, sd_turn),
    )


@dataclass(frozen=True, eq=False)
class Mount:
    """Mount of a photo: its sensor is fixed on a frame, A = A_f A_s, C = C_f + A_f c.

    The pose of the photo follows from frame and sensor; its pose in the block is only an approximation.

    Parameters
    ----------
    photo
        Name of the photo.
    frame
        Name of the photo that represents the frame: the photo of the first sensor. It may be without images.
    sensor
        Pose of the sensor in the frame, one object for all its photos.
    """

    photo: str = field(metadata={"check": object_name})
    frame: str = field(metadata={"check": object_name})
    sensor: Sensor

    def __post_init__(self) -> None:
        check_fields(self, "a mount")


def checked_mounts(mounts: object, photos: Sequence[str]) -> tuple[Mount, ...]:
    """Return validated mounts that are consistent with each other and with a block."""
    checked = elements("mounts", mounts, Mount)
    frames = {each.frame for each in checked}
    require_photos("mounts", [each.photo for each in checked], photos)
    require_photos("mounts", sorted(frames), photos)
    if both := sorted(frames & {each.photo for each in checked}):
        raise InputError(phrase("block.mounted-frame", photo=both[0]))
    return checked
