"""Settings of the ISIS program jigsaw, by their names."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

from photogram.errors import InputError, message_of
from photogram.io.column_table import FALSE, TRUE
from photogram.io.files import read_lines
from photogram.lazy_dataclasses import dataclass, field, fields
from photogram.messages import unknown_name
from photogram.words import Phrase, phrase

Solved = Literal["none", "first", "second", "third", "all"]
"""Free coefficients: none, of degree 0, to degree 1, to degree 2, all."""
Sigmas = tuple[float | None, float | None, float | None]
"""Standard deviations of three parameters, None if they are free."""
Axes = Literal["latitudinal", "rectangular"]

MOST = 8  # The highest degree of a polynomial


def _yes(text: str) -> bool:
    if text.lower() not in TRUE | FALSE:
        raise InputError(phrase("format.unknown", what="value", value=text, names=["yes", "no"]))
    return text.lower() in TRUE


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


def _setting(names: str, read: Callable[[str], Any], default: Any) -> Any:
    """Declare a field with its names in jigsaw and the reader of their values."""
    return field(default=default, metadata={"names": names.split(), "read": read})


_FREE: Sigmas = (None, None, None)


@dataclass(frozen=True)
class Settings:
    """Adjusted parameters and their weights; defaults are the defaults of jigsaw."""

    # Degrees of the polynomials fitted to the angles of an image, and of the adjusted ones
    ck_degree: int = _setting("CKDEGREE", _degree, 2)
    ck_solve_degree: int = _setting("CKSOLVEDEGREE", _degree, 2)
    # Free coefficients, and whether coefficients of the third angle are free
    angles: Solved = _setting("CAMSOLVE", _word(**_SOLVED, angles="first"), "first")
    twist: bool = _setting("TWIST", _yes, True)
    # Whether polynomials are added to the angles of the table instead
    over_existing: bool = _setting("OVEREXISTING", _yes, False)
    # The same for positions
    spk_degree: int = _setting("SPKDEGREE", _degree, 2)
    spk_solve_degree: int = _setting("SPKSOLVEDEGREE", _degree, 2)
    positions: Solved = _setting("SPSOLVE", _word(**_SOLVED, position="first", positions="first"), "none")
    over_hermite: bool = _setting("OVERHERMITE", _yes, False)
    radius: bool = _setting("RADIUS", _yes, False)  # Whether radii of free points are free
    # Coordinates in which points are adjusted
    axes: Axes = _setting(
        "CONTROL_POINT_COORDINATE_TYPE_BUNDLE",
        _word(latitudinal="latitudinal", rectangular="rectangular"),
        "latitudinal",
    )
    # Degrees: coefficients of degree 0, 1 and 2, by scaled time
    angle_sigmas: Sigmas = _setting(
        "CAMERA_ANGLES_SIGMA CAMERA_ANGULAR_VELOCITY_SIGMA CAMERA_ANGULAR_ACCELERATION_SIGMA", _sigma, _FREE
    )
    # Metres: as for angles
    position_sigmas: Sigmas = _setting(
        "SPACECRAFT_POSITION_SIGMA SPACECRAFT_VELOCITY_SIGMA SPACECRAFT_ACCELERATION_SIGMA", _sigma, _FREE
    )
    # Metres: latitude, longitude, radius of all points, and X, Y, Z
    latitude_sigmas: Sigmas = _setting(
        "POINT_LATITUDE_SIGMA POINT_LONGITUDE_SIGMA POINT_RADIUS_SIGMA", _sigma, _FREE
    )
    rectangular_sigmas: Sigmas = _setting("POINT_X_SIGMA POINT_Y_SIGMA POINT_Z_SIGMA", _sigma, _FREE)
    # Whether images of one observation share their coefficients
    observations: bool = _setting("OBSERVATIONS", _yes, False)
    held: Path | None = _setting("HELDLIST", Path, None)  # List of images with fixed poses; None: no image
    # Whether measures with large residuals are rejected, and the limit in standard deviations
    rejects: bool = _setting("OUTLIER_REJECTION", _yes, False)
    multiplier: float = _setting("REJECTION_MULTIPLIER", _positive, 3.0)
    remarks: tuple[Phrase, ...] = ()  # Remarks on settings replaced by others

    @property
    def angle_coefficients(self) -> int:
        """Number of free coefficients of each angle."""
        return _count(self.angles, self.ck_solve_degree)

    @property
    def position_coefficients(self) -> int:
        """Number of free coefficients of each coordinate."""
        return _count(self.positions, self.spk_solve_degree)


def _count(solved: Solved, degree: int) -> int:
    return degree + 1 if solved == "all" else ("none", "first", "second", "third").index(solved)


class _Parameter(NamedTuple):
    """A field of settings, its reader, and its index in a field of three."""

    field: str
    read: Callable[[str], Any]
    place: int | None = None


PARAMETERS: Mapping[str, _Parameter] = {
    name: _Parameter(own.name, own.metadata["read"], place if len(own.metadata["names"]) > 1 else None)
    for own in fields(Settings)
    if own.metadata
    for place, name in enumerate(own.metadata["names"])
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
    for name, value, where in _words(text):
        try:
            if (own := PARAMETERS.get(name)) is not None:
                found = own.read(value)
                if own.place is not None:
                    three = given.get(own.field, _FREE)
                    found = (*three[: own.place], found, *three[own.place + 1 :])
                given[own.field] = found
            else:
                remarks |= _elsewhere(name, value)
        except InputError as error:
            raise InputError(
                phrase("error.at", what=f"{name}={value}", message=message_of(error)), **where
            ) from None
    return Settings(**given, remarks=tuple(remarks.values()))


def _words(text: str) -> Iterator[tuple[str, str, dict[str, Any]]]:
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
