"""What support data say of an image: detector, lens, times, pose and body as tables."""

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
"""How pixels are counted: the middle of the first is 1 (ISIS) or 0.5, half a pixel of the detector apart."""
HALF: Mapping[Pixels, float] = {"isis": 0.5, "csm": 0.0}  # What the corner of the first pixel is counted as


@dataclass(frozen=True, eq=False)
class Positions:
    """Where a camera was: (k,) seconds, (k, 3) metres from the body's centre, inertial, (k, 3) m/s.

    `interpolation` is that which the records ask for; None: whoever uses them says it.
    """

    times: Floats
    places: Floats
    velocities: Floats | None = None
    interpolation: Interpolation | None = None


@dataclass(frozen=True, eq=False)
class Turns:
    """How axes were turned: (k,) seconds, (k, 3, 3) matrices from the inertial axes, constant ones included.

    `interpolation` as for :class:`Positions`.
    """

    times: Floats
    matrices: Floats
    interpolation: Interpolation | None = None


@dataclass(frozen=True, eq=False)
class Plane:
    """From the detector to the focal plane: offset + matrix (sample, line), from the centre, millimetres."""

    offset: Floats
    matrix: Floats

    def places(self, detector: Floats) -> Floats:
        """Return (n, 2) x, y in the axes of the camera, y down, of (n, 2) sample, line from the centre."""
        return self.offset + detector @ self.matrix.T

    def detector(self, places: Floats) -> Floats:
        """Return what :meth:`places` makes these of."""
        return np.asarray(np.linalg.solve(self.matrix, (places - self.offset).T).T, dtype=float)


@dataclass(frozen=True, eq=False)
class Detector:
    """How an image lies on its detector; pairs are (sample, line).

    The axis of the camera meets the detector in `centre`, in its pixels; the image begins at the pixel
    `first`, from 0; `summing` pixels of the detector are one of the image; `planes` lead to the focal plane,
    as the Community Sensor Model has it, and as ISIS does.
    """

    centre: Floats
    first: Floats
    summing: Floats
    planes: Mapping[Pixels, Plane]

    def from_centre(self, image: Floats, pixels: Pixels) -> Floats:
        """Return (n, 2) pixels of the detector, from its centre, of (n, 2) sample, line from the corner.

        Image coordinates are 0.5 in the middle of the first pixel however pixels are counted; ISIS has them
        half a pixel of the detector farther on.
        """
        return image * self.summing + self.first + HALF[pixels] - self.centre

    def image(self, from_centre: Floats, pixels: Pixels) -> Floats:
        """Return what :meth:`from_centre` makes these of."""
        return (from_centre + self.centre - self.first - HALF[pixels]) / self.summing


@dataclass(frozen=True, eq=False)
class Jitter:
    """What moved the lines of a frame: pixels, as polynomials of the (n,) times at which each was read.

    `coefficients` are (2, k), of samples and of lines, the highest power first, down to the first.
    """

    coefficients: Floats
    times: Floats

    def shifts(self, lines: Floats) -> Floats:
        """Return (m, 2) samples and lines by which what is measured at (m,) lines is too far."""
        rows = np.clip(np.floor(lines + 0.5), 1, len(self.times)).astype(int) - 1
        powers = self.times[rows, np.newaxis] ** np.arange(self.coefficients.shape[1], 0, -1)
        return np.asarray(powers @ self.coefficients.T)


@dataclass(frozen=True)
class Framelets:
    """The framelets of a push frame camera: `count` of `height` lines, each at one time.

    The earliest is at `first` seconds, the next `every` seconds later; `backwards`: the last of the image is
    the earliest; `flipped`: the first line of each is the last of the detector.
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
        """Return the framelets of lines from the upper edge; the last one has the lower edge."""
        return np.clip(np.floor(lines / self.height), 0, self.count - 1)

    def rows(self, lines: Floats, numbers: Floats) -> Floats:
        """Return the rows of framelets, from their edge, of lines."""
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
        Of the body's spheroid, a and b in metres.
    focal_length
        Millimetres.
    lens
        Before the detector; None: a perfect one.
    position, pointing, body
        Tables of the camera's places, of inertial axes to those of the camera (x along samples as the plane
        has it, looking along z as `look` has it), and to those of the body.
    time
        Of a frame; the middle of others.
    lines
        The times of the lines of a scanner, by lines from the upper edge (0).
    remarks
        What the file contradicts itself in, and what was made of it, in sentences.
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
        """(3,) factors from the axes of the camera to those of photos, which look along -z; and back."""
        return np.array([1.0, -self.look, -self.look])

    def error(self, message: str | Phrase) -> InputError:
        """Return an error that names the file."""
        return InputError(message, file=self.path)


def check_choice(pixels: Any, interpolation: Any) -> None:
    """Refuse other ways to count pixels, and other interpolations, than there are."""
    one_of("pixels", pixels, get_args(Pixels))
    one_of("interpolation", interpolation, get_args(Pixels))
