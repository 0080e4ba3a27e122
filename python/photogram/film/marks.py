"""Fiducial marks: names, usual coordinates, and assignment of readings.

Sides refer to the positive with the data strip (clock, level, number) at the left. They are `ll, ul, ur, lr`
in the corners, and `ml, mt, mr, mb` in the middle of the sides. If readings are unnamed, quarter rotations
and both sides of the film are tested.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import frozen, number, shaped
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

DataStrip = Literal["left", "top"]
SD_PLACE = 0.002  # Default (mm) for positions in certificates, which are printed to 0.001

SIDES = ("ll", "ur", "ul", "lr", "ml", "mr", "mt", "mb")
"""The marks in the order of their numbers in USGS certificates, 1 to 8."""
_NUMBERS = {str(number): side for number, side in enumerate(SIDES, 1)}
_LETTERS = {"a": "ml", "b": "mr", "c": "mb", "d": "mt"}
_TURNED = {"ul": "ll", "ll": "lr", "lr": "ur", "ur": "ul", "mt": "ml", "ml": "mb", "mb": "mr", "mr": "mt"}
"""Sides of a frame with the strip at the top, by their names with it at the left."""


def by_side(name: str) -> str:
    """Return the side for the number or letter of a mark; other names are unchanged."""
    plain = name.strip()
    low = plain.lower()
    return low if low in SIDES else (_NUMBERS | _LETTERS).get(low, plain)


def turned_name(name: str, data_strip: DataStrip) -> str:
    return _TURNED.get(name, name) if data_strip == "top" else name


def turned(xy: Floats, data_strip: DataStrip) -> Floats:
    """Rotate coordinates (..., 2) so that the data strip is at the left."""
    return np.stack([-xy[..., 1], xy[..., 0]], axis=-1) if data_strip == "top" else xy


def marks_in_use(table: ColumnTable, cameras: Collection[str]) -> dict[tuple[str, str], int]:
    """Return the rows of the marks of cameras by camera and mark, without marks with `use` off.

    InputError: if a mark is repeated.
    """
    use, names = table.flags("use"), zip(table.texts("camera"), table.texts("fiducial"), strict=True)
    rows: dict[tuple[str, str], int] = {}
    for row, (camera, mark) in enumerate(names):
        if use[row] and camera in cameras and rows.setdefault((camera, mark), row) != row:
            raise table.error(row, phrase("error.repeated", kind=f"fiducial of {camera}", name=mark))
    return rows


_SIGNS = dict(zip(SIDES, [(-1, -1), (1, 1), (-1, 1), (1, -1), (-1, 0), (1, 0), (0, 1), (0, -1)], strict=True))
"""Directions of marks from the centre."""


# Corners at (a, a) and middles at (a, 0) by type: a, and the robust standard deviation of a mark (mm) in
# public reports (docs/certificates.md)
_WILD = ((106.0, 0.013), (110.0, 0.013))
_TYPES = {"rc8": _WILD, "rc10": _WILD, "rmka15/23": ((103.96, 0.04), (113.0, 0.015))}


def usual_places(camera_type: str) -> dict[str, tuple[tuple[float, float], float]]:
    """Return usual coordinates (mm) of the marks of a camera type by side, and their sd; empty if unknown.

    A prefix of the type is ignored.
    """
    plain = "".join(camera_type.lower().split())
    known = next((own for name, own in _TYPES.items() if plain.endswith(name)), None)
    if known is None:
        return {}
    corner, middle = known
    found = {}
    for side, (x, y) in _SIGNS.items():
        away, sd = middle if side.startswith("m") else corner
        found[side] = (x * away, y * away), sd
    return found


CHANCE = 1e-4  # Probability of a wrong choice among the eight
DECIDED = 2.0 * float(np.log(8.0 / CHANCE))
"""Difference of the weighted sums of squares that separates the two best choices."""
NEAR = 0.1  # Largest distance of a reading from its mark, relative to the format


@dataclass(frozen=True, eq=False)
class FilmWay:
    """Possible film orientation on the scanner.

    Attributes
    ----------
    marks
        (n,) the number of the mark of each reading.
    quarter_turns, mirrored
        As of :class:`WhichMark`.
    """

    marks: Indices
    quarter_turns: int
    mirrored: bool

    def __str__(self) -> str:
        code = "films.turned-mirrored" if self.mirrored else "films.turned"
        return str(phrase(code, degrees=90 * self.quarter_turns))


@dataclass(frozen=True, eq=False)
class WhichMark:
    """Assignment of unnamed readings to marks, over the eight film orientations.

    Attributes
    ----------
    marks
        (n,) the number of the mark of each reading, for the best orientation.
    quarter_turns
        Quarter rotations of the film, counter-clockwise in the camera frame, for the best.
    mirrored
        Whether the film was scanned mirrored, for the best.
    omega
        (8,) weighted sums of squares after an affine fit: four quarter rotations, then four mirrored.
        Infinite if readings fit no marks.
    decided
        Whether the second best is significantly worse.
    ways
        (8,) all orientations in the same order; None if readings fit no marks.
    alike
        The best orientation and those not separable from it.
    """

    marks: Indices
    quarter_turns: int
    mirrored: bool
    omega: Floats
    decided: bool
    ways: tuple[FilmWay | None, ...]
    alike: tuple[FilmWay, ...]

    def __str__(self) -> str:
        return str(self.alike[0] if self.decided else phrase("films.undecided"))


def which_mark(places: ArrayLike, true: ArrayLike, *, sd: float = 0.004) -> WhichMark:
    """Assign unnamed readings to marks, over four quarter rotations and two sides.

    Marks of modern cameras are symmetric to some 0.01 mm. They cannot separate the orientations then, and the
    flight or tie points must.

    Parameters
    ----------
    places
        (m, 2) coordinates of the marks in the camera frame, mm.
    true
        (n, 2) true coordinates of unnamed readings on the scanner, mm, y up; at least three.
    sd
        Standard deviation of readings relative to the certificate, mm.

    Raises
    ------
    InputError
        If there are fewer than three readings, or if readings fit no marks in all eight orientations.
    """
    q, p = shaped("places", places, (None, 2)), shaped("true", true, (None, 2))
    if len(p) < 3 or len(q) < len(p):
        raise InputError(phrase("films.few-readings", readings=len(p), marks=len(q)))
    number("sd", sd, "positive")
    every, squares = [], []
    for mirrored, turns in product((False, True), range(4)):
        turn = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), turns)
        marks = _nearest((q * [-1.0, 1.0] if mirrored else q) @ turn.T, p)
        left = np.full(p.shape, np.inf)
        if marks is not None:
            design = np.column_stack([np.ones(len(p)), q[marks]])
            left = p - design @ np.linalg.lstsq(design, p, rcond=None)[0]
        squares.append(float((left**2).sum()))
        every.append(FilmWay(frozen(np.zeros(len(p), np.int64) if marks is None else marks), turns, mirrored))
    omega = np.array(squares) / sd**2
    best = int(np.argmin(omega))
    if not np.isfinite(omega[best]):
        raise InputError(phrase("films.readings-of-no-marks"))
    alike = sorted(np.flatnonzero(omega - omega[best] <= DECIDED).tolist(), key=lambda k: k != best)
    return WhichMark(
        marks=every[best].marks,
        quarter_turns=best % 4,
        mirrored=best >= 4,
        omega=frozen(omega),
        decided=len(alike) == 1,
        ways=tuple(each if np.isfinite(one) else None for each, one in zip(every, omega, strict=True)),
        alike=tuple(every[k] for k in alike),
    )


def _nearest(lain: Floats, p: Floats) -> Indices | None:
    """Return the mark of each reading, each used once, for the best shift; else None.

    Every mark is tested for the first reading, since marks may be missing.
    """
    limit = NEAR * np.ptp(lain, axis=0).max()
    best, found = np.inf, None
    for place in lain:
        apart = np.linalg.norm((p - p[0] + place)[:, np.newaxis] - lain, axis=2)
        marks = apart.argmin(axis=1)
        worst = apart[np.arange(len(p)), marks].max()
        if worst < min(limit, best) and len(set(marks.tolist())) == len(p):
            best, found = worst, marks
    return found
