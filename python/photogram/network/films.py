"""Scanned films and measured plates: shared unknowns and image transformation.

From the camera's frame q (mm, x right, y up, seen as the positive) to a reading:
n = q + [m + b1, b2; b2, m - b1] q + D(q); e = n + (h1 x y, h2 x y) or n/(1 + g1 x + g2 y);
p = R(theta) J e + t; the reading is the scanner coordinate of p.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, elements, object_name, one_of, shaped
from photogram.arguments.fields import check_fields, option
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.cameras import Camera
from photogram.network.passages import Passage
from photogram.network.unknowns import Numbers, Unknown
from photogram.words import phrase

PATTERNS = ("none", "w1 w2", "ebner", "grid")  # In the order of their numbers in the core
MOST_SHIFTS = 200  # Maximum number of unknowns of the reseau of a photo


class FilmNumbers(Numbers):
    """Unknown numbers shared by readings of scanned films."""


class FilmPlacement(FilmNumbers):
    """Placement of the film of a photo on the scanner: t1, t2 in mm, theta in radians."""

    KIND: ClassVar[str] = "film placement"


class FilmSize(FilmNumbers):
    """Size change of the film of a photo: m, b1, b2."""

    KIND: ClassVar[str] = "film size"


class FilmBend(FilmNumbers):
    """Non-affine deformation of the film of a photo: h1, h2 or g1, g2 in 1/mm."""

    KIND: ClassVar[str] = "film bend"


class Roll(FilmNumbers):
    """Mean size change m of the films of a roll."""

    KIND: ClassVar[str] = "roll"


class Mark(FilmNumbers):
    """Position of a fiducial mark in the camera frame, mm."""

    KIND: ClassVar[str] = "fiducial"


class Weights(FilmNumbers):
    """Two coefficients of a deformation pattern, mm."""

    KIND: ClassVar[str] = "pattern"


@dataclass(frozen=True, eq=False)
class Scanner(FilmNumbers):
    """Scales Sx, Sy and angle alpha (radians) of a scanner or comparator."""

    KIND: ClassVar[str] = "scanner"

    value: ArrayLike = (1.0, 1.0, 0.0)


class ScannerCurve(FilmNumbers):
    """Three coefficients of the polynomials of a scanner, mm."""

    KIND: ClassVar[str] = "scanner curve"


@dataclass(frozen=True)
class Readings:
    """Coordinate system of the readings of a scanner.

    Parameters
    ----------
    pitch
        Millimetres per unit of readings.
    origin
        (o1, o2): reading at the origin of the scanner correction.
    down
        Whether the second coordinate increases downwards, as rows do.
    half_range
        (hx, hy) mm, half ranges of the scanner polynomials.
    """

    pitch: float = option(1.0, 0, is_open=True)
    origin: tuple[float, float] = (0.0, 0.0)
    down: bool = False
    half_range: tuple[float, float] = (1.0, 1.0)

    def __post_init__(self) -> None:
        check_fields(self, "readings")
        shaped("origin of readings", self.origin, (2,), "finite")
        shaped("half_range of readings", self.half_range, (2,), "positive")


@dataclass(frozen=True, eq=False)
class Pattern:
    """Systematic film deformation D(q): functions of the position, each with a coefficient.

    Parameters
    ----------
    kind
        `w1 w2`: `w1 x y/h^2` in x, `w2 (x^2 - y^2)/h^2` in y. `ebner`: the functions of Ebner (1976) of
        x/h and y/h, without the two linear ones. `grid`: bilinear interpolation of node shifts.
    numbers
        h in mm. For a grid: x, y of its first node, its spacing along x and y in mm, number of columns
        and number of rows.
    weights
        Coefficients in pairs: 1, 5 or, row by row, one for each node.
    """

    kind: str
    numbers: ArrayLike
    weights: Sequence[Weights]

    def __post_init__(self) -> None:
        one_of("kind of a pattern", self.kind, PATTERNS[1:])
        count = 6 if self.kind == "grid" else 1
        own = shaped(f"numbers of the pattern {self.kind}", self.numbers, (count,))
        positive = own[2:] if self.kind == "grid" else own
        good = np.isfinite(own).all() and (positive > 0).all() and (own[4:] >= 2).all()
        require(good, f"numbers of the pattern {self.kind}", "positive", value=own.tolist())
        object.__setattr__(self, "numbers", own)
        needed = {"w1 w2": 1, "ebner": 5}.get(self.kind, int(np.prod(own[4:])))
        weights = elements(f"weights of the pattern {self.kind}", self.weights, Weights)
        actual = len(weights)
        require(actual == needed, f"weights of the pattern {self.kind}", "count", count=needed, actual=actual)


@dataclass(frozen=True, eq=False, init=False)
class Reseau(Pattern):
    """Grid of a single photo: smooth shifts of its nodes, observed as 0.

    Parameters
    ----------
    photo
        Name of the photo.
    numbers
        As for the pattern `grid`.
    sd
        (2,) standard deviations of a shift in x and in y, mm.
    smooth
        Standard deviation of second differences along rows and columns, mm; infinite: independent shifts.
    weights
        Shifts of the nodes, row by row; free shifts are created by default.

    Raises
    ------
    InputError
        If the photo would have too many unknowns, or standard deviations are invalid.
    """

    kind: str = field(default="grid", init=False)
    photo: str
    sd: ArrayLike
    smooth: float

    def __init__(
        self,
        photo: str,
        numbers: ArrayLike,
        sd: ArrayLike,
        smooth: float = np.inf,
        weights: Sequence[Weights] = (),
    ) -> None:
        own = shaped("numbers of the reseau", numbers, (6,))
        nodes = int(np.prod(own[4:]))
        where = f"unknowns of the reseau of photo {photo}"
        require(2 * nodes <= MOST_SHIFTS, where, "most", high=MOST_SHIFTS, value=2 * nodes)
        deviations = shaped("sd of the reseau", sd, (2,), "positive")
        require(smooth > 0, "smooth of the reseau", "positive", value=smooth)
        object.__setattr__(self, "photo", photo)
        object.__setattr__(self, "sd", deviations)
        object.__setattr__(self, "smooth", float(smooth))
        super().__init__("grid", own, weights or _nodes(photo, np.zeros((nodes, 2)), np.inf))

    def with_shifts(self, shifts: ArrayLike) -> Reseau:
        """Return a reseau with (n, 2) errorless shifts of its nodes, row by row."""
        given = shaped("shifts of the reseau", shifts, (len(self.weights), 2))
        return Reseau(self.photo, self.numbers, self.sd, self.smooth, _nodes(self.photo, given, 0.0))

    @property
    def covariance(self) -> Floats:
        """(2 n, 2 n) covariance of shifts, x, y node by node: (I/sd^2 + D' D/smooth^2)^-1."""
        columns, rows = np.asarray(self.numbers)[4:].astype(int).tolist()
        along, across = (np.diff(np.eye(count), 2, axis=0) for count in (columns, rows))
        second = np.concatenate([np.kron(np.eye(rows), along), np.kron(across, np.eye(columns))])
        stiff = second.T @ second / self.smooth**2
        found = np.zeros((2 * rows * columns,) * 2)
        for k, sd in enumerate(np.asarray(self.sd).tolist()):
            found[k::2, k::2] = np.linalg.inv(np.eye(rows * columns) / sd**2 + stiff)
        return np.asarray((found + found.T) / 2)


def _nodes(photo: str, shifts: Floats, sd: float) -> list[Weights]:
    return [Weights(f"{photo} node {k}", shift, sd) for k, shift in enumerate(shifts, 1)]


@dataclass(frozen=True, eq=False)
class Film:
    """Film of a photo, or a plate, with the parameters of its readings.

    Parameters
    ----------
    placement, size
        Unknowns of this film only.
    scanner
        Scanner, one object for all its readings.
    readings
        Coordinate system of the readings.
    bend
        Coefficients h or, with `projective`, g; None: the film is affine.
    projective
        Whether `bend` contains g.
    roll
        Roll whose m is added to the m of `size`; None: `size` contains the whole change.
    curves
        Coefficients of the scanner polynomials, six of three, x first; may be empty.
    pattern
        Systematic deformation of the film.
    mirrored
        Whether the film was scanned from the emulsion side (mirrored).
    """

    placement: FilmPlacement
    size: FilmSize
    scanner: Scanner
    readings: Readings
    bend: FilmBend | None = None
    projective: bool = False
    roll: Roll | None = None
    curves: Sequence[ScannerCurve] = ()
    pattern: Pattern | None = None
    mirrored: bool = False

    def __post_init__(self) -> None:
        check_fields(self, "a film")
        if len(self.curves) not in (0, 6):
            raise kind_error("curves of a scanner", "6 or 0 objects", len(self.curves))

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Unknowns of the film, in the order of the core."""
        weights = () if self.pattern is None else tuple(self.pattern.weights)
        single = (self.placement, self.size, self.bend, self.roll, self.scanner)
        return (*(each for each in single if each is not None), *self.curves, *weights)

    def numbers(self) -> Floats:
        """Return the numbers for the core that are not unknowns."""
        own = self.readings
        bend = 0 if self.bend is None else 2 if self.projective else 1
        pattern = 0 if self.pattern is None else PATTERNS.index(self.pattern.kind)
        first = [
            *(self.mirrored, own.down, own.pitch, *own.origin, *own.half_range),
            *(bend, self.roll is not None, bool(self.curves), pattern),
        ]
        rest = [] if self.pattern is None else np.asarray(self.pattern.numbers).tolist()
        return np.array([*first, *rest], dtype=float)


@dataclass(frozen=True, eq=False)
class Scan(Passage):
    """Image transformation of a photo whose images are readings of a film or plate.

    Parameters
    ----------
    photo
        Name of the photo; its camera is in mm.
    film
        Film of the photo.
    """

    KIND = "scan"

    photo: str = field(metadata={"check": object_name})
    film: Film

    def __post_init__(self) -> None:
        check_fields(self, "a scan")

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Unknowns of the film."""
        return self.film.unknowns

    def of(self, points: Mapping[str, int], photos: Mapping[str, int]) -> list[int]:
        """Return the row of the photo."""
        if self.photo not in photos:
            raise argument_error("scan", "absent", kind="photo", name=self.photo)
        return [photos[self.photo]]

    def numbers(self) -> Floats:
        """Return the numbers of the film for the core."""
        return self.film.numbers()


def reads_pixels(passages: Sequence[Passage]) -> bool:
    """Return whether film readings are pixels: their unit is not the millimetre."""
    return any(isinstance(each, Scan) and each.film.readings.pitch != 1.0 for each in passages)


def check_scans(
    passages: Sequence[Passage],
    photos: Sequence[str],
    cameras: Sequence[Camera],
    photo_cameras: Indices | None,
    image_photos: Indices,
) -> None:
    """Reject scans without a camera frame of marks, repeated photos, and mixed units."""
    scans = [each for each in passages if isinstance(each, Scan)]
    rows = {name: row for row, name in enumerate(photos)} if scans else {}
    seen: set[str] = set()
    for each in scans:
        require(each.photo not in seen, "scans", "repeated", kind="photo", name=each.photo)
        seen.add(each.photo)
        if photo_cameras is None:
            continue
        camera = cameras[int(photo_cameras[rows[each.photo]])]
        cases = {
            "unit": camera.unit != "mm" or (camera.image_y == "down" and camera.model != "plate"),
            "comparator": camera.model.startswith("on_comparator"),
            "weights": camera.direction == "backward" and camera.weights == "corrected",
        }
        for code, wrong in cases.items():
            if wrong:
                raise InputError(phrase(f"block.scan.{code}", photo=each.photo, camera=camera.title))
    read = {rows[each.photo] for each in scans if each.film.readings.pitch != 1.0}
    if read and (others := set(np.unique(image_photos).tolist()) - read):
        raise InputError(phrase("block.scan.units", photo=photos[min(read)], other=photos[min(others)]))
