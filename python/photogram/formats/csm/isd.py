"""Support data of an image: detector, lens, times, poses, body rotation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from photogram.arguments.arrays import one_of
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.lens import Lens
from photogram.network.moving_photos import Lines
from photogram.network.trajectories import Interpolation
from photogram.words import Phrase

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
    interpolation: Interpolation | None = None


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
    """Reject unknown pixel counting and interpolation."""
    one_of("pixels", pixels, get_args(Pixels))
    one_of("interpolation", interpolation, get_args(Pixels))
