"""Support data of an image: detector, lens, times, poses, body rotation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from photogram.arguments.arrays import one_of
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.places import Failing
from photogram.lazy_dataclasses import dataclass
from photogram.network.attitudes import Attitudes
from photogram.network.lens import Lens
from photogram.network.moving_photos import Lines
from photogram.network.trajectories import AttitudeInterpolation, Interpolation
from photogram.words import Phrase, phrase

RECORDS = 64  # Intervals for sampling polynomials; interpolation by eight neighbours is exact to rounding
MAX_LENGTH_DIFFERENCE = 1e-3
BEYOND = 4  # Records beyond either end: the number of neighbours on a side


def of_quaternions(place: Failing, quaternions: Floats) -> Floats:
    """Return (n, 3, 3) matrices C (as in C v) of (n, 4) unit quaternions w, x, y, z."""
    lengths = np.linalg.norm(quaternions, axis=1)
    if not (np.abs(lengths - 1) < MAX_LENGTH_DIFFERENCE).all():
        row = int(np.argmax(np.abs(lengths - 1)))
        length = phrase("format.length", length=float(lengths[row]))
        raise place.error(phrase("error.at", what=phrase("csm.record", n=row + 1), message=length))
    return Attitudes.of("quaternion", quaternions).matrices


def of_angles(angles: Floats) -> Floats:
    """Return (n, 3, 3) matrices [a3]_3 [a2]_1 [a1]_3 of (n, 3) angles, radians."""
    (c1, c2, c3), (s1, s2, s3) = np.cos(angles).T, np.sin(angles).T
    rows = [
        [c3 * c1 - s3 * c2 * s1, c3 * s1 + s3 * c2 * c1, s3 * s2],
        [-s3 * c1 - c3 * c2 * s1, -s3 * s1 + c3 * c2 * c1, c3 * s2],
        [s2 * s1, -s2 * c1, c2],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def to_angles(matrices: Floats) -> Floats:
    """Return (n, 3) continuous angles of consecutive (n, 3, 3) matrices."""
    m = matrices
    a1 = np.arctan2(m[:, 2, 0], -m[:, 2, 1])
    a2 = np.arctan2(np.hypot(m[:, 2, 0], m[:, 2, 1]), m[:, 2, 2])
    a3 = np.arctan2(m[:, 0, 2], m[:, 1, 2])
    return np.unwrap(np.column_stack([a1, a2, a3]), axis=0)


def angle_axes(angles: Floats) -> Floats:
    """Return (n, 3, 3) rotation axes of (n, 3) angles, as columns."""
    (c1, c2, _), (s1, s2, _) = np.cos(angles).T, np.sin(angles).T
    zero, one = np.zeros_like(c1), np.ones_like(c1)
    return np.moveaxis(np.array([[zero, c1, s2 * s1], [zero, s1, -s2 * c1], [one, zero, c2]]), 2, 0)


def to_quaternions(matrices: Floats) -> Floats:
    """Return (n, 4) quaternions w, x, y, z of consecutive (n, 3, 3) matrices."""
    found = np.array(Attitudes(matrices).values("quaternion"))
    turned = np.einsum("ni,ni->n", found[1:], found[:-1]) < 0
    found[1:][np.cumsum(turned) % 2 == 1] *= -1
    return found


class Polynomials(NamedTuple):
    """Three angles or coordinates: polynomials of (t - reference) / scale, seconds.

    `coefficients` are (3, degree + 1), powers from 0 on.
    """

    coefficients: Floats
    reference: float
    scale: float

    def at(self, times: Floats) -> Floats:
        """Return (n, 3) values at (n,) times."""
        powers = np.vander((times - self.reference) / self.scale, self.coefficients.shape[1], increasing=True)
        return np.asarray(powers @ self.coefficients.T)

    def rates(self, times: Floats) -> Floats:
        """Return the (n, 3) rates of change per second at (n,) times."""
        powers = np.arange(1, self.coefficients.shape[1])
        slopes = self.coefficients[:, 1:] * (powers / self.scale)
        return self._replace(coefficients=slopes).at(times) if len(powers) else np.zeros((len(times), 3))

    def sampled(self, first: float, last: float) -> tuple[Floats, Floats]:
        """Return (k,) times and (k, 3) values for lossless interpolation."""
        steps = np.arange(-BEYOND, RECORDS + BEYOND + 1, dtype=float)
        times: Floats = first + (last - first) / RECORDS * steps
        return times, self.at(times)


def fitted(times: Floats, values: Floats, degree: int) -> Polynomials:
    """Return polynomials fitted to (k, 3) values at (k,) seconds with equal weights.

    Time is reduced to the centre and scaled by half of the span of the records.
    """
    reference, scale = (times[0] + times[-1]) / 2, (times[-1] - times[0]) / 2 or 1.0
    powers = np.vander((times - reference) / scale, degree + 1, increasing=True)
    # Values are reduced to their mean: positions in metres are large compared with their changes.
    middle = values.mean(axis=0)
    solved = np.asarray(np.linalg.lstsq(powers, values - middle, rcond=None)[0].T)
    solved[:, 0] += middle
    return Polynomials(solved, float(reference), float(scale))


Pixels = Literal["isis", "csm"]
"""Pixel counting: the centre of the first pixel is 1 (ISIS) or 0.5, a shift of half a detector pixel."""
HALF: Mapping[Pixels, float] = {"isis": 0.5, "csm": 0.0}  # Coordinate of the corner of the first pixel


@dataclass(frozen=True, eq=False)
class Positions:
    """Camera positions (k, 3), metres, and velocities, inertial, at (k,) seconds.

    `interpolation` is specified by the records; None: by the user.
    """

    times: Floats
    places: Floats
    velocities: Floats | None = None
    interpolation: Interpolation | None = None


@dataclass(frozen=True, eq=False)
class Turns:
    """Rotations (k, 3, 3) from inertial axes at (k,) seconds.

    `interpolation` as for :class:`Positions`.
    """

    times: Floats
    matrices: Floats
    interpolation: AttitudeInterpolation | None = None


@dataclass(frozen=True, eq=False)
class Plane:
    """Detector to focal plane: offset + matrix (sample, line), millimetres."""

    offset: Floats
    matrix: Floats

    def places(self, detector: Floats) -> Floats:
        """Return (n, 2) x, y in camera axes of (n, 2) centred sample, line."""
        return self.offset + detector @ self.matrix.T

    def detector(self, places: Floats) -> Floats:
        """Return the inverse of :meth:`places`."""
        return np.asarray(np.linalg.solve(self.matrix, (places - self.offset).T).T, dtype=float)


@dataclass(frozen=True, eq=False)
class Detector:
    """Position of an image on its detector; pairs are (sample, line).

    The camera axis meets the detector in `centre`, in detector pixels. The image begins at the pixel `first`,
    from 0. `summing` detector pixels form an image pixel. `planes` transform to the focal plane, as in the
    Community Sensor Model and in ISIS.
    """

    centre: Floats
    first: Floats
    summing: Floats
    planes: Mapping[Pixels, Plane]

    def from_centre(self, image: Floats, pixels: Pixels) -> Floats:
        """Return (n, 2) detector pixels, centred, of (n, 2) image sample, line.

        Image coordinates are 0.5 in the centre of the first pixel for any pixel counting. In ISIS they are
        half a detector pixel larger.
        """
        return image * self.summing + self.first + HALF[pixels] - self.centre

    def image(self, from_centre: Floats, pixels: Pixels) -> Floats:
        """Return the inverse of :meth:`from_centre`."""
        return (from_centre + self.centre - self.first - HALF[pixels]) / self.summing


@dataclass(frozen=True, eq=False)
class Jitter:
    """Line shifts of a frame, pixels: polynomials of (n,) line times.

    `coefficients` are (2, k), of samples and of lines, from the highest power to the first.
    """

    coefficients: Floats
    times: Floats

    def shifts(self, lines: Floats) -> Floats:
        """Return (m, 2) corrections to subtract from samples and lines."""
        rows = np.clip(np.floor(lines + 0.5), 1, len(self.times)).astype(int) - 1
        powers = self.times[rows, np.newaxis] ** np.arange(self.coefficients.shape[1], 0, -1)
        return np.asarray(powers @ self.coefficients.T)


@dataclass(frozen=True)
class Framelets:
    """Framelets of a push frame camera: `count` of `height` lines.

    The earliest is at `first` seconds, the next `every` seconds later. If `backwards`, the last framelet of
    the image is the earliest. If `flipped`, the first line of each is the last of the detector.
    """

    height: float
    count: int
    first: float
    every: float
    backwards: bool = False
    flipped: bool = False

    def time(self, number: int) -> float:
        """Return the time of a framelet of the image, from 0."""
        return self.first + self.every * (self.count - 1 - number if self.backwards else number)

    def numbers(self, lines: Floats) -> Floats:
        """Return the framelets of lines from the upper edge."""
        return np.clip(np.floor(lines / self.height), 0, self.count - 1)

    def rows(self, lines: Floats, numbers: Floats) -> Floats:
        """Return the rows in framelets, from their edge, of lines."""
        own = lines - numbers * self.height
        return self.height - own if self.flipped else own

    def lines(self, rows: Floats, numbers: Floats) -> Floats:
        """Return the lines of rows of framelets."""
        return numbers * self.height + (self.height - rows if self.flipped else rows)


@dataclass(frozen=True, eq=False)
class Isd:
    """The support data of an image: a line scanner, a frame, or a push frame camera.

    Attributes
    ----------
    size
        Samples and lines.
    radii
        Semi-axes a and b of the body's spheroid, metres.
    focal_length
        Millimetres.
    lens
        Lens distortion; None: no distortion.
    position, pointing, body
        Tables of camera positions, of rotations from inertial axes to the camera (x along samples as in the
        plane, viewing direction along z as in `look`), and to the body.
    time
        Time of a frame; centre time of others.
    lines
        Times of the lines of a scanner, by lines from the upper edge (0).
    remarks
        Contradictions in the file and their resolution, in sentences.
    look
        1: the camera looks along +z of its axes; -1: along -z.
    """

    path: Path
    kind: Literal["line", "frame", "push frame"]
    platform: str
    sensor: str
    size: tuple[int, int]
    radii: tuple[float, float]
    focal_length: float
    detector: Detector
    lens: Lens | None
    position: Positions
    pointing: Turns
    body: Turns
    time: float
    lines: Lines | None = None
    framelets: Framelets | None = None
    jitter: Jitter | None = None
    remarks: tuple[Phrase, ...] = ()
    look: Literal[1, -1] = 1

    @property
    def axes(self) -> Floats:
        """(3,) factors between camera axes and photo axes (looking along -z)."""
        return np.array([1.0, -self.look, -self.look])

    def error(self, message: str | Phrase) -> InputError:
        """Return an error that names the file."""
        return InputError(message, file=self.path)


def check_choice(pixels: Any, interpolation: Any) -> None:
    one_of("pixels", pixels, get_args(Pixels))
    one_of("interpolation", interpolation, get_args(Pixels))
