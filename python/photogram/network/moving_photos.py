"""Photos on trajectories: frames, rolling shutters, line scanners; records of GNSS and inertial units."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, names, number, numbers, one_of, shaped
from photogram.arguments.equality import Valued
from photogram.arguments.objects import instances, kind_error, require, require_kind
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.attitudes import Attitudes, Representation
from photogram.network.lens import Lens
from photogram.network.trajectories import Clock, Polynomial, Readout, Table, Trajectory
from photogram.network.unknowns import Sensor, Unknown
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Block

__all__ = ["LineSensor", "Lines", "Moment", "Shutter", "Timed", "checked_timed", "own_trajectories"]

Direction = Literal["down", "up", "right", "left"]

STEPS = 100
CLOSE = 1e-10  # Samples: where steps to the sample abreast of a place end


@cache
def _known(readout: float) -> Readout:
    """Return a readout time that is known: one for all shutters of so many seconds."""
    return Readout(f"{readout!r} s", readout, sd=0.0)


@dataclass(frozen=True)
class Shutter:
    """A rolling shutter: row r of h is exposed at t_e + (r / h) T.

    Parameters
    ----------
    readout
        T, one object for all photos of a camera; or its value in seconds, known.
    edges
        Image coordinates of the edges where reading begins and ends (r = 0 and r = h): 0 and the height, in
        pixels from the upper edge; in millimetres of a photo with y up the larger comes first.
    direction
        `down` and `up` read rows, `right` and `left` columns: which coordinate counts. `edges` say where it
        begins; of `up` and `left` T is positive as well.
    """

    readout: Readout | float
    edges: tuple[float, float]
    direction: Direction = "down"

    def __post_init__(self) -> None:
        one_of("direction", self.direction, get_args(Direction))
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
    """The times of the lines of a scanner: t = t_j + (line - l_j) dt_j from line l_j on.

    Parameters
    ----------
    table
        (k, 3) first line, time in seconds and seconds per line; lines from the upper edge (0), the middle of
        line number k (from 0) being k + 0.5. The first and the last row go on beyond.
    """

    table: ArrayLike

    def __post_init__(self) -> None:
        rows = np.atleast_2d(numbers("lines", self.table))
        sound = rows.ndim == 2 and rows.shape[1] == 3 and len(rows) and np.isfinite(rows).all()
        if not sound or not (np.diff(rows[:, 0]) > 0).all() or not (rows[:, 2] != 0).all():
            raise kind_error("lines", "rows of first line, time, seconds per line, ascending", self.table)
        object.__setattr__(self, "table", rows)

    def times(self, lines: ArrayLike, start: float = 0.0) -> Floats:
        """Return the times of lines, in seconds from another: added to late times they would lose digits."""
        rows, lines = np.asarray(self.table), np.asarray(lines, dtype=float)
        own = rows[np.maximum(np.searchsorted(rows[:, 0], lines, side="right") - 1, 0)]
        return np.asarray(own[..., 1] - start + (lines - own[..., 0]) * own[..., 2])

    def at(self, times: ArrayLike) -> Floats:
        """Return the lines at times in seconds: what :meth:`times` makes of them."""
        rows, times = np.asarray(self.table), np.asarray(times, dtype=float)
        # Rows follow each other in time as in the image, or all of them the other way.
        sense = np.sign(rows[0, 2])
        own = rows[np.maximum(np.searchsorted(sense * rows[:, 1], sense * times, side="right") - 1, 0)]
        return np.asarray(own[..., 0] + (times - own[..., 1]) / own[..., 2])


@dataclass(frozen=True, eq=False)
class LineSensor(Valued):
    """Where a sample is in the focal plane: (x0, y0) + (sample - s0) (pitch_x, pitch_y), behind a lens.

    Parameters
    ----------
    pitch
        Millimetres from sample to sample, along x and y.
    s0
        The sample at (x0, y0): half of all samples, from the edge of the first, where that is the middle.
    x0, y0
        Millimetres.
    lens
        What is known of the lens before it: it corrects the places before the camera does, and makes a line
        of them that is curved. None: the camera alone corrects.
    bends
        (k, 3) samples, increasing, and x, y in millimetres by which the sensors there are off the straight
        line; those between as if they were joined straight, those beyond as the last. None: it is straight.

    Raises
    ------
    InputError
        A line without a pitch, a lens that is none, bends that are none.
    """

    pitch: tuple[float, float]
    s0: float
    x0: float = 0.0
    y0: float = 0.0
    lens: Lens | None = None
    bends: ArrayLike | None = None

    def __post_init__(self) -> None:
        pitch = shaped("pitch of a line of sensors", self.pitch, (2,))
        if not (np.isfinite(pitch).all() and pitch.any()):
            raise kind_error("pitch of a line of sensors", "finite and not 0", self.pitch)
        object.__setattr__(self, "pitch", tuple(pitch.tolist()))
        require_kind("lens of a line of sensors", self.lens, Lens, optional=True)
        if self.bends is not None:
            rows = numbers("bends of a line of sensors", self.bends)
            sound = rows.ndim == 2 and rows.shape[1] == 3 and len(rows) and np.isfinite(rows).all()
            if not sound or not (np.diff(rows[:, 0]) > 0).all():
                raise kind_error("bends of a line of sensors", "rows of sample, x, y, ascending", self.bends)
            object.__setattr__(self, "bends", rows)

    @classmethod
    def of_table(cls, table: ArrayLike, lens: Lens | None = None) -> LineSensor:
        """Return the line that is told by (k, 3) samples, increasing, and their x, y in millimetres.

        Raises
        ------
        InputError
            Fewer than two samples, what is no such table, a last sample in the place of the first.
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
        """Whether the places are what pitch, s0, x0 and y0 say."""
        return self.lens is None and self.bends is None

    def places(self, samples: Floats) -> Floats:
        """Return (n, 2) places of samples in the focal plane, as the lens corrects them, in millimetres."""
        straight = np.asarray([self.x0, self.y0] + (samples[:, np.newaxis] - self.s0) * np.array(self.pitch))
        if self.bends is not None:
            known, *off = np.asarray(self.bends).T
            straight = straight + np.column_stack([np.interp(samples, known, each) for each in off])
        return straight if self.lens is None else self.lens.corrected(straight)

    def abreast(self, places: Floats) -> tuple[Floats, Floats]:
        """Return the samples that are abreast of (n, 2) places, and how far these are from the line, in mm.

        Of a curved line the sample is that at whose place the two are apart square to the pitch.
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


_KINDS: dict[str, type] = {
    "trajectory": Trajectory,
    "shutter": Shutter,
    "lines": Lines,
    "line_sensor": LineSensor,
    "sensor": Sensor,
    "offset": Clock,
    "rate": Readout,
}
"""What some fields of a timed photo are, where they are not None."""


@dataclass(frozen=True, eq=False)
class Moment:
    """A time on a trajectory that an observation beside images is of."""

    trajectory: Trajectory
    time: float
    clock: Clock | None = None

    @property
    def name(self) -> str:
        """What reports call it."""
        clock = "" if self.clock is None else f", {self.clock.name}"
        return f"{self.trajectory.name} at {self.time!r} s{clock}"


@dataclass(frozen=True, eq=False)
class Timed:
    """That a photo is on a trajectory: each of its images has the pose of its own time.

    Parameters
    ----------
    photo
        Its name. Of its own pose nothing counts but where it is about.
    trajectory
        None: its own, uniform motion from its pose on, in which position and attitude of the block, and their
        standard deviations, are those at `time`.
    time
        t_e in seconds: of a frame, or of the edge where a shutter begins. Of a scanner the time that factors
        of its line rates count from; None: the middle of its images.
    shutter, lines
        Of a camera with a rolling shutter; of a scanner, whose images have samples and lines as coordinates.
    line_sensor
        Of a scanner: where its samples are.
    sensor
        The pose of the camera on what moves on the trajectory; None: the same.
    offset
        Of its clock, unknown.
    rate
        The factor of its line rates, unknown.
    velocity, rotation_rate
        (3,) of its own trajectory: what is given of its velocity, in the linear unit a second along X, Y, Z,
        and of its rate about its own axes in radians a second.
    sd_velocity, sd_rate
        (3,) standard deviations of the same; infinite: free.
    """

    photo: str
    trajectory: Trajectory | None = None
    time: float | None = None
    shutter: Shutter | None = None
    lines: Lines | None = None
    line_sensor: LineSensor | None = None
    sensor: Sensor | None = None
    offset: Clock | None = None
    rate: Readout | None = None
    velocity: ArrayLike = 0.0
    rotation_rate: ArrayLike = 0.0
    sd_velocity: ArrayLike = np.inf
    sd_rate: ArrayLike = np.inf

    def __post_init__(self) -> None:
        object.__setattr__(self, "photo", names("photo of a trajectory", [self.photo])[0])
        for name, kind in _KINDS.items():
            require_kind(f"{name} of photo {self.photo}", getattr(self, name), kind, optional=True)
        if self.time is not None and not np.isfinite(number(f"time of photo {self.photo}", self.time)):
            raise argument_error(f"time of photo {self.photo}", "finite", value=self.time)
        for name in ("velocity", "rotation_rate", "sd_velocity", "sd_rate"):
            array = shaped(f"{name} of photo {self.photo}", getattr(self, name), (3,))
            object.__setattr__(self, name, array)
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
        """What the times of images are multiplied by."""
        shutter = self.shutter.readout if self.shutter is not None else None
        return shutter if isinstance(shutter, Readout) else self.rate

    @property
    def scalars(self) -> list[Unknown]:
        """The unknowns of its times."""
        return [each for each in (self.readout, self.offset) if each is not None]

    def times(self, xy: Floats) -> Floats:
        """Return the (n,) times of (n, 2) images, with what is given of offset, readout and rate."""
        time, scale, _ = self.images(xy)
        rate = 1.0 if self.readout is None else float(self.readout.position[0])
        return time + self.delay + rate * scale

    @property
    def delay(self) -> float:
        """What is given of the offset of its clock."""
        return 0.0 if self.offset is None else float(self.offset.position[0])

    def images(self, xy: Floats) -> tuple[float, Floats, Floats]:
        """Return its time, and of (n, 2) images their times on its scale and coordinates for the core."""
        if self.lines is not None and self.line_sensor is not None:
            time, lines = self.time, xy[:, 1]
            if time is None:
                first = float(np.asarray(self.lines.table)[0, 1])
                time = first + (float(self.lines.times(lines, first).mean()) if len(lines) else 0.0)
            return time, self.lines.times(lines, time), self.line_sensor.places(xy[:, 0])
        time = self.time or 0.0
        return time, np.zeros(len(xy)) if self.shutter is None else self.shutter.times(xy), xy


def checked_timed(timed: object, photos: Sequence[str]) -> tuple[Timed, ...]:
    """Return objects of different photos of a block."""
    checked = instances("timed", timed, Timed)
    require_photos("timed", [each.photo for each in checked], photos)
    return checked


def require_photos(name: str, own: Sequence[str], photos: Sequence[str]) -> None:
    """Refuse photos that a block lacks, or that occur twice."""
    known, seen = set(photos), set[str]()
    for photo in own:
        if photo not in known or photo in seen:
            code = "repeated" if photo in seen else "absent"
            raise argument_error(name, code, kind="photo", name=photo)
        seen.add(photo)


def own_trajectories(block: Block) -> list[Trajectory]:
    """Return the trajectory of each timed photo: the given one, or uniform motion from its pose."""
    rows = {name: row for row, name in enumerate(block.photo_ids)} if block.timed else {}
    return [
        _uniform(block, each, rows[each.photo]) if each.trajectory is None else each.trajectory
        for each in block.timed
    ]


def _uniform(block: Block, own: Timed, row: int) -> Trajectory:
    """Return c_0 + (t - t_e) v and r_0 + (t - t_e) w about the pose of a photo."""
    if block.geographic:
        raise InputError(phrase("block.timed.geographic", photo=own.photo))
    sd_position, sd_attitude = block.photo_position_sd[row], block.photo_attitude_sd[row]
    if np.isfinite(sd_attitude).any() and not (sd_attitude == 0).all():
        raise InputError(phrase("block.timed.attitude-sd", photo=own.photo))
    observed = block.photo_positions_observed
    place = block.photo_positions[row]
    if observed is not None:
        place = np.where(np.isfinite(sd_position), observed[row], place)
    time = own.time or 0.0
    form: Representation = "omega_phi_kappa_photo_to_ground" if block.photo_to_ground else "omega_phi_kappa"
    attitude = Attitudes.of(form, block.photo_attitudes[[row]]).matrices
    table = Table(np.array([time]), place[np.newaxis], np.array([time]), attitude)
    shape = (3,)
    values = [np.zeros(3), shaped("velocity", own.velocity, shape)]
    turns = [np.zeros(3), shaped("rotation_rate", own.rotation_rate, shape)]
    sd = [sd_position, shaped("sd_velocity", own.sd_velocity, shape)]
    sd_turn = [sd_attitude, shaped("sd_rate", own.sd_rate, shape)]
    return Trajectory(
        own.photo,
        table,
        position=Polynomial(1, time, 1.0, np.array(values), np.array(sd)),
        rotation=Polynomial(1, time, 1.0, np.array(turns), np.array(sd_turn)),
    )
