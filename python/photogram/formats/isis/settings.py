"""Settings of the ISIS program jigsaw, by their names."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

from photogram.errors import InputError, message_of
from photogram.io.files import read_lines
from photogram.lazy_dataclasses import dataclass
from photogram.messages import unknown_name
from photogram.words import Phrase, phrase

Solved = Literal["none", "first", "second", "third", "all"]
"""Free coefficients: none, of degree 0, to degree 1, to degree 2, all."""
Sigmas = tuple[float | None, float | None, float | None]
"""Standard deviations of three parameters, None if they are free."""
Axes = Literal["latitudinal", "rectangular"]

MOST = 8  # The highest degree of a polynomial


@dataclass(frozen=True)
class Settings:
    """Adjusted parameters and their weights; defaults are the defaults of jigsaw."""

    # Degrees of the polynomials fitted to the angles of an image, and of the adjusted ones
    ck_degree: int = 2
    ck_solve_degree: int = 2
    # Free coefficients, and whether coefficients of the third angle are free
    angles: Solved = "first"
    twist: bool = True
    over_existing: bool = False  # Whether polynomials are added to the angles of the table instead
    spk_degree: int = 2  # The same for positions
    spk_solve_degree: int = 2
    positions: Solved = "none"
    over_hermite: bool = False
    # Degrees: coefficients of degree 0, 1 and 2, by scaled time
    angle_sigmas: Sigmas = (None, None, None)
    position_sigmas: Sigmas = (None, None, None)  # Metres: as for angles
    radius: bool = False  # Whether radii of free points are free
    axes: Axes = "latitudinal"  # Coordinates in which points are adjusted
    # Metres: latitude, longitude, radius of all points, and X, Y, Z
    latitude_sigmas: Sigmas = (None, None, None)
    rectangular_sigmas: Sigmas = (None, None, None)
    observations: bool = False  # Whether images of one observation share their coefficients
    held: Path | None = None  # List of images with fixed poses; None: no image
    # Whether measures with large residuals are rejected, and the limit in standard deviations
    rejects: bool = False
    multiplier: float = 3.0
    remarks: tuple[Phrase, ...] = ()  # Remarks on settings replaced by others

    @property
    def angle_coefficients(self) -> int:
        """Number of free coefficients of each angle."""
        return _count(self.angles, self.ck_solve_degree)

    @property
    def position_coefficients(self) -> int:
        """Number of free coefficients of each coordinate."""
        return _count(self.positions, self.spk_solve_degree)

    @property
    def point_sigmas(self) -> Sigmas:
        """Standard deviations of the adjusted coordinates of all points, metres."""
        return self.latitude_sigmas if self.axes == "latitudinal" else self.rectangular_sigmas


def _count(solved: Solved, degree: int) -> int:
    return degree + 1 if solved == "all" else ("none", "first", "second", "third").index(solved)


def _yes(text: str) -> bool:
    if text.lower() in ("yes", "y", "true", "t", "on", "1"):
        return True
    if text.lower() in ("no", "n", "false", "f", "off", "0"):
        return False
    raise InputError(phrase("format.unknown", what="value", value=text, names=["yes", "no"]))


def _degree(text: str) -> int:
    if not re.fullmatch(r"\d+", text) or int(text) > MOST:
        raise InputError(phrase("isis.degree", most=MOST, value=text))
    return int(text)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise InputError(phrase("format.positive", name="the number", value=text))
    return value


def _sigma(text: str) -> float | None:
    return None if text.lower() in ("none", "null", "") else _positive(text)


def _word(**words: str) -> Callable[[str], str]:
    def found(text: str) -> str:
        if text.lower() not in words:
            raise InputError(
                phrase("format.unknown", what="value", value=text, names=[word.upper() for word in words])
            )
        return words[text.lower()]

    return found


_SOLVED = {"velocities": "second", "accelerations": "third", "all": "all", "none": "none"}
_AXES = _word(latitudinal="latitudinal", rectangular="rectangular")


class _Parameter(NamedTuple):
    """A field of settings, its reader, and its index in a field of three."""

    field: str
    read: Callable[[str], Any]
    place: int | None = None


PARAMETERS: Mapping[str, _Parameter] = {
    "CKDEGREE": _Parameter("ck_degree", _degree),
    "CKSOLVEDEGREE": _Parameter("ck_solve_degree", _degree),
    "CAMSOLVE": _Parameter("angles", _word(**_SOLVED, angles="first")),
    "TWIST": _Parameter("twist", _yes),
    "OVEREXISTING": _Parameter("over_existing", _yes),
    "SPKDEGREE": _Parameter("spk_degree", _degree),
    "SPKSOLVEDEGREE": _Parameter("spk_solve_degree", _degree),
    "SPSOLVE": _Parameter("positions", _word(**_SOLVED, position="first", positions="first")),
    "OVERHERMITE": _Parameter("over_hermite", _yes),
    "RADIUS": _Parameter("radius", _yes),
    "CONTROL_POINT_COORDINATE_TYPE_BUNDLE": _Parameter("axes", _AXES),
    **{
        f"{name}_SIGMA": _Parameter(own, _sigma, place)
        for own, names in {
            "angle_sigmas": ("CAMERA_ANGLES", "CAMERA_ANGULAR_VELOCITY", "CAMERA_ANGULAR_ACCELERATION"),
            "position_sigmas": ("SPACECRAFT_POSITION", "SPACECRAFT_VELOCITY", "SPACECRAFT_ACCELERATION"),
            "latitude_sigmas": ("POINT_LATITUDE", "POINT_LONGITUDE", "POINT_RADIUS"),
            "rectangular_sigmas": ("POINT_X", "POINT_Y", "POINT_Z"),
        }.items()
        for place, name in enumerate(names)
    },
    "OBSERVATIONS": _Parameter("observations", _yes),
    "HELDLIST": _Parameter("held", Path),
    "OUTLIER_REJECTION": _Parameter("rejects", _yes),
    "REJECTION_MULTIPLIER": _Parameter("multiplier", _positive),
}
"""Field of each jigsaw name."""

OTHERWISE: Mapping[str, str] = {
    "MAXITS": "iterations",
    "SIGMA0": "convergence",
    "ERRORPROPAGATION": "covariance-computed",
    "CONTROL_POINT_COORDINATE_TYPE_REPORTS": "coordinates-written",
    "UPDATE": "labels",
    **dict.fromkeys(("BUNDLEOUT_TXT", "IMAGESCSV", "OUTPUT_CSV", "RESIDUALS_CSV"), "written"),
    **dict.fromkeys(("FROMLIST", "CNET", "ONET", "FILE_PREFIX"), "paths"),
}
"""Remarks on settings replaced by others."""
REFUSED = ("SOLVETARGETBODY",)


def read_settings(text: str) -> Settings:
    """Read settings from a jigsaw command line or a file.

    Settings are `NAME=value`, separated by blanks, with names in any case and values with blanks in quotes.
    Alternatively, `text` is the path of a file with such lines, in which # begins a comment. The last value
    of a name is used.
    """
    given: dict[str, Any] = {}
    remarks: dict[str, Phrase] = {}
    for name, value, where in _said(text):
        try:
            if name in PARAMETERS:
                _put(given, PARAMETERS[name], value)
            else:
                remarks |= _elsewhere(name, value)
        except InputError as error:
            raise InputError(
                phrase("error.at", what=f"{name}={value}", message=message_of(error)), **where
            ) from None
    return Settings(**given, remarks=tuple(remarks.values()))


def _said(text: str) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield names and values, and their locations in a file."""
    path = Path(text) if text.strip() and "=" not in text else None
    lines = [text] if path is None else read_lines(path)
    for record, line in enumerate(lines, 1):
        where: dict[str, Any] = {} if path is None else {"file": path, "record": record, "text": line.strip()}
        try:
            # `NAME = value` is one setting in jigsaw.
            words = shlex.split(re.sub(r"\s*=\s*", "=", line), comments=path is not None)
        except ValueError:
            raise InputError(phrase("isis.syntax", value=line), **where) from None
        for word in words:
            name, equals, value = word.partition("=")
            if not equals:
                if word.lower() == "jigsaw":
                    continue
                raise InputError(phrase("isis.syntax", value=word), **where)
            yield name.upper(), value, where


def _put(given: dict[str, Any], own: _Parameter, value: str) -> None:
    found = own.read(value)
    if own.place is not None:
        three = list(given.get(own.field, (None, None, None)))
        three[own.place] = found
        found = tuple(three)
    given[own.field] = found


def _elsewhere(name: str, value: str) -> dict[str, Phrase]:
    """Return a remark on a replaced setting; none for a setting without effect."""
    if name in OTHERWISE:
        return {name: phrase("error.at", what=name, message=phrase(f"isis.{OTHERWISE[name]}"))}
    if name not in REFUSED:
        known = [*PARAMETERS, *OTHERWISE, *REFUSED]
        raise InputError(unknown_name("setting of jigsaw", name, known))
    if _yes(value):
        raise InputError(phrase("isis.refused", name=name))
    return {}
