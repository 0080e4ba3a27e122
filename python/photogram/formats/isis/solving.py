"""Settings of jigsaw, and trajectories with its corrections, shared by the images of an observation."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError, message_of
from photogram.formats.csm.isd import Isd, Polynomials, Positions, Turns, fitted, of_angles, to_angles
from photogram.formats.csm.photos import trajectory_of
from photogram.io.column_table import FALSE, TRUE
from photogram.io.files import read_lines
from photogram.lazy_dataclasses import dataclass, field, fields, replace
from photogram.messages import unknown_name
from photogram.network.motion import given_poses
from photogram.network.trajectories import Polynomial, Trajectory
from photogram.words import Phrase, phrase


@dataclass(frozen=True, eq=False)
class Solving:
    """The trajectory of an image, in metres and radians, and its initial polynomials.

    `position` and `angles` are (3, n) coefficients of the polynomials that replace the tables and receive
    corrections. Time is reduced to the centre of a table and scaled by half of its span. They are 0 if the
    tables are used. `over` is True for tables of positions, and of angles, that are used.
    """

    trajectory: Trajectory
    position: Floats
    angles: Floats
    over: tuple[bool, bool]


def solving(isd: Isd, name: str, settings: Settings, *, held: bool, first: Isd) -> Solving:
    """Return the free parameters of an image or an observation; none if it is fixed.

    `isd` contains the tables of all images of an observation. `first` is its first image, which defines time
    origin and initial polynomials, as in jigsaw.
    """
    counts = (0, 0) if held else (settings.position_coefficients, settings.angle_coefficients)
    position, isd, places = _positions(isd, first.position, settings, counts[0])
    rotation, isd, angles = _angles(isd, first.pointing, settings, counts[1])
    own = trajectory_of(isd, name, interpolation="isis", position=position)
    over = settings.over_hermite, settings.over_existing
    return Solving(replace(own, rotation=rotation, angles="zxz"), places, angles, over)


def _scaled(times: Floats) -> tuple[float, float]:
    """Return the centre and half of the span of records; 1 s for a single record."""
    return float(times[0] + times[-1]) / 2, float(times[-1] - times[0]) / 2 or 1.0


def _positions(
    isd: Isd, own: Positions, settings: Settings, count: int
) -> tuple[Polynomial | None, Isd, Floats]:
    """Return position corrections, support data they refer to, coefficients.

    The initial polynomials are fitted to the image's own records; the support data may extend beyond them.
    """
    if not count:
        return None, isd, np.zeros((3, 0))
    reference, scale = _scaled(own.times)
    sd = deviations(settings.position_sigmas, count, count - 1)
    basis = Polynomial(count - 1, reference, scale, sd=sd)
    if settings.over_hermite:
        return basis, isd, np.zeros((3, count))
    fit = _fit(own.times, own.places, settings.spk_degree, max(settings.spk_solve_degree, count - 1))
    if len(own.times) > 1:
        times, places = fit.sampled(float(isd.position.times[0]), float(isd.position.times[-1]))
        isd = replace(isd, position=Positions(times, places, None, "lagrange"))
    return basis, isd, fit.coefficients


def _angles(isd: Isd, own: Turns, settings: Settings, count: int) -> tuple[Polynomial | None, Isd, Floats]:
    """Return angle corrections, support data they refer to, coefficients.

    Polynomial angles are added to a table of one record, the attitude at the centre.
    """
    if not count:
        return None, isd, np.zeros((3, 0))
    degree = count - 1 if settings.over_existing else max(settings.ck_solve_degree, count - 1)
    reference, scale = _scaled(own.times)
    sigmas = [None if each is None else float(np.deg2rad(each)) for each in settings.angle_sigmas]
    sd = deviations(sigmas, count, degree)
    if not settings.twist:
        sd[:, 2] = 0.0
    if settings.over_existing:
        return Polynomial(degree, reference, scale, sd=sd), isd, np.zeros((3, degree + 1))
    fit = _fit(own.times, to_angles(own.matrices), settings.ck_degree, degree)
    value = fit.coefficients.T.copy()
    value[0] = 0.0
    middle = Turns(np.array([reference]), of_angles(fit.coefficients[:, :1].T), "linear")
    basis = Polynomial(degree, reference, scale, value=value, sd=sd)
    return basis, replace(isd, pointing=middle), fit.coefficients


def _fit(times: Floats, values: Floats, fitted_degree: int, degree: int) -> Polynomials:
    """Return fitted polynomials as polynomials of another degree, padded or truncated."""
    fit = fitted(times, values, min(fitted_degree, len(times) - 1))
    padded = np.pad(fit.coefficients, ((0, 0), (0, degree)))
    return fit._replace(coefficients=padded[:, : degree + 1])


def deviations(sigmas: Sequence[float | None], count: int, degree: int) -> Floats:
    """Return (degree + 1, 3) standard deviations; the first `count` are free."""
    given = [np.inf if sigma is None else sigma for sigma in sigmas]
    of_degrees = [*given, *[np.inf] * count][:count] + [0.0] * (degree + 1 - count)
    return np.repeat(of_degrees, 3).reshape(-1, 3)


_KEYWORDS: Mapping[str, int | None] = {
    r"LO[345]/[HM]RC/": 3,
    r"MRO/HIRISE/": 3,
    r"TGO/CaSSIS/": 3,
    r"JUNO/JNC/": 4,
    r"LRO/.*/NAC[LR]$": None,
    r"APOLLO1[567]/METRIC/": None,
    r"MRO/CTX/": None,
    r"MGS/MOC": None,
}
"""Start of serial numbers, and number of their keywords (between slashes) that name the observation, as in
ISIS (`ObservationKeys` of `appdata/serialnumbers`). None: all keywords, so that each image is an observation.
"""
APART = 5.0  # Largest difference (pixels) of poses of one flight between images with overlapping tables
COMPARED = 16  # Number of times for the comparison


def observation_number(serial: str) -> str:
    """Return the observation of an image from its serial number."""
    count = next((count for begin, count in _KEYWORDS.items() if re.match(begin, serial)), 0)
    if count == 0:
        raise InputError(phrase("isis.observation-rule", image=serial))
    return serial if count is None else "/".join(serial.split("/")[:count])


def observations_of(serials: Sequence[str], *, shared: bool) -> dict[str, list[str]]:
    """Return the images of each observation by number."""
    found: dict[str, list[str]] = {}
    for serial in serials:
        found.setdefault(observation_number(serial) if shared else serial, []).append(serial)
    return found


def one_flight(isds: Sequence[Isd]) -> Isd:
    """Return the first support data with the tables of all, which must agree."""
    first, *others = isds
    for each in others:
        _check(first, each)
    positions = [each.position for each in isds]
    times, rows = _once([each.times for each in positions])
    speeds = [each.velocities for each in positions if each.velocities is not None]
    return replace(
        first,
        position=Positions(
            times,
            np.concatenate([each.places for each in positions])[rows],
            np.concatenate(speeds)[rows] if len(speeds) == len(isds) else None,
            first.position.interpolation,
        ),
        pointing=_joined([each.pointing for each in isds]),
        body=_joined([each.body for each in isds]),
    )


def _once(times: Sequence[Floats]) -> tuple[Floats, Indices]:
    """Return different times in order, and the first record of each."""
    own, rows = np.unique(np.concatenate(times), return_index=True)
    return own, rows


def _joined(tables: Sequence[Turns]) -> Turns:
    """Return one table of all records, with one record per time."""
    times, rows = _once([each.times for each in tables])
    return Turns(times, np.concatenate([each.matrices for each in tables])[rows], tables[0].interpolation)


def _check(first: Isd, other: Isd) -> None:
    """Reject an image whose tables contradict the poses of the first one."""
    one, two = (trajectory_of(each, "flight", interpolation="isis") for each in (first, other))
    begin, end = max(one.reach[0], two.reach[0]), min(one.reach[1], two.reach[1])
    if not begin < end:
        return
    # Single records have equal times.
    times = np.linspace(begin, end, COMPARED) if np.isfinite(end - begin) else np.array([first.time])
    (places, axes), (others, turned) = (given_poses(each, times) for each in (one, two))
    (x, y), _ = first.detector.planes["isis"].matrix.T
    pixel = float(np.hypot(x, y)) / abs(first.focal_length)
    heights = np.linalg.norm(places, axis=1) - max(first.radii)
    shift = float((np.linalg.norm(places - others, axis=1) / heights).max()) / pixel
    turn = float(np.linalg.norm(axes - turned, axis=(1, 2)).max()) / np.sqrt(2.0) / pixel
    if not max(shift, turn) < APART:
        raise InputError(
            phrase("isis.flight", path=first.path, shift=shift, turn=turn, limit=APART), file=other.path
        )


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
