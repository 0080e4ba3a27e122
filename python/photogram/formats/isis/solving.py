"""Settings of jigsaw, and trajectories with its corrections, shared by the images of an observation."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError, message_of
from photogram.formats.csm.isd import Isd, Polynomials, Positions, Turns, fitted, of_angles, to_angles
from photogram.formats.csm.photos import trajectory_of
from photogram.formats.declarations import declared
from photogram.io.column_table import FALSE, TRUE
from photogram.io.files import read_lines
from photogram.lazy_dataclasses import dataclass, fields, replace
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
    counts = (0, 0) if held else settings.coefficients
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
    count = next((count for begin, count in _KEYWORDS.items() if re.match(begin, serial)), 0)
    if count == 0:
        raise InputError(phrase("isis.observation-rule", image=serial))
    return serial if count is None else "/".join(serial.split("/")[:count])


def one_flight(isds: Sequence[Isd]) -> Isd:
    """Return the first support data with the tables of all, which must agree."""
    first, *others = isds
    for each in others:
        _check(first, each)
    names = ("position", "pointing", "body")
    return replace(first, **{name: _joined([getattr(each, name) for each in isds]) for name in names})


def _joined(tables: Sequence[Any]) -> Any:
    """Return one table of the records of all in order of time, the first one of each time."""
    _, rows = np.unique(np.concatenate([each.times for each in tables]), return_index=True)
    joined: dict[str, Any] = {}
    for name in (each.name for each in fields(tables[0]) if each.name != "interpolation"):
        columns = [getattr(each, name) for each in tables]
        is_known = all(column is not None for column in columns)
        joined[name] = np.concatenate(columns)[rows] if is_known else None
    return replace(tables[0], **joined)


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
        found = {"path": first.path, "shift": shift, "turn": turn, "limit": APART}
        raise other.error(phrase("isis.flight", **found))


Solved = Literal["none", "first", "second", "third", "all"]
"""Free coefficients: none, of degree 0, to degree 1, to degree 2, all."""
Sigmas = tuple[float | None, float | None, float | None]
"""Standard deviations of three parameters, None if they are free."""
Axes = Literal["latitudinal", "rectangular"]

MOST = 8  # The highest degree of a polynomial
_FREE: Sigmas = (None, None, None)


class JigsawSetting(NamedTuple):
    """A setting of `jigsaw.csv`, or three that are one field.

    Kinds `otherwise` are settings that photogram replaces; `field` is the code of the remark.
    """

    names: list[str]
    kind: str
    words: Mapping[str, str]  # Values by their words, the first of a value is written
    field: str
    default: str
    content: str

    def value(self, text: str) -> Any:
        """Return the value of a text."""
        word = text.lower()
        match self.kind:
            case "flag" | "word" if word not in (self.words or TRUE | FALSE):
                names = [each.upper() for each in self.words] or ["yes", "no"]
                raise InputError(phrase("format.unknown", what="value", value=text, names=names))
            case "flag":
                return word in TRUE
            case "word":
                return self.words[word]
            case "degree":
                if not re.fullmatch(r"\d+", text) or int(text) > MOST:
                    raise InputError(phrase("isis.degree", most=MOST, value=text))
                return int(text)
            case "path":
                return Path(text)
            case "sigma" if word in ("none", "null", ""):
                return None
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not 0 < value < math.inf:
            raise InputError(phrase("format.positive", name="the number", value=text))
        return value

    def text(self, settings: Settings, name: str) -> str:
        """Return the value of one of the names in settings, in the words of jigsaw."""
        value = getattr(settings, self.field)
        value = value[self.names.index(name)] if len(self.names) > 1 else value
        if isinstance(value, bool):
            return "YES" if value else "NO"
        word = next((word for word, own in self.words.items() if own == value), str(value))
        return "NONE" if value is None else word.upper()


DECLARED = tuple(
    JigsawSetting(names.split(), kind, dict(word.split("=") for word in words.split()), *rest)
    for names, kind, words, *rest in declared(__file__, "jigsaw.csv")
)
PARAMETERS: Mapping[str, JigsawSetting] = {
    name: each for each in DECLARED if each.kind != "otherwise" for name in each.names
}
OTHERWISE: Mapping[str, str] = {
    name: each.field for each in DECLARED if each.kind == "otherwise" for name in each.names
}
"""Settings by name, and codes of remarks on settings that photogram replaces."""
REFUSED = ("SOLVETARGETBODY",)


@dataclass(frozen=True)
class Settings:
    """Adjusted parameters and their weights, as in `jigsaw.csv`; defaults are the defaults of jigsaw."""

    ck_degree: int = 2
    ck_solve_degree: int = 2
    angles: Solved = "first"
    twist: bool = True
    over_existing: bool = False
    spk_degree: int = 2
    spk_solve_degree: int = 2
    positions: Solved = "none"
    over_hermite: bool = False
    radius: bool = False
    axes: Axes = "latitudinal"
    angle_sigmas: Sigmas = _FREE  # Of coefficients of degree 0, 1 and 2, by scaled time
    position_sigmas: Sigmas = _FREE
    latitude_sigmas: Sigmas = _FREE
    rectangular_sigmas: Sigmas = _FREE
    observations: bool = False
    held: Path | None = None
    rejects: bool = False
    multiplier: float = 3.0
    remarks: tuple[Phrase, ...] = ()  # Remarks on settings replaced by others

    @property
    def coefficients(self) -> tuple[int, int]:
        """Numbers of free coefficients of each coordinate, and of each angle."""
        solved = (self.positions, self.spk_solve_degree), (self.angles, self.ck_solve_degree)
        counts = {"none": 0, "first": 1, "second": 2, "third": 3}
        positions, angles = (counts.get(word, degree + 1) for word, degree in solved)
        return positions, angles


def read_settings(text: str) -> Settings:
    """Read settings from a jigsaw command line or a file.

    Settings are `NAME=value`, separated by blanks, with names in any case and values with blanks in quotes.
    Alternatively, `text` is the path of a file with such lines, in which # begins a comment. The last value
    of a name is used.
    """
    given, remarks = dict[str, Any](), dict[str, Phrase]()
    for name, value, where in _words(text):
        try:
            if (own := PARAMETERS.get(name)) is not None:
                found = own.value(value)
                if len(own.names) > 1:
                    three = dict(zip(own.names, given.get(own.field, _FREE), strict=True))
                    found = tuple((three | {name: found}).values())
                given[own.field] = found
            elif name in OTHERWISE:
                remarks[name] = phrase("error.at", what=name, message=phrase(f"isis.{OTHERWISE[name]}"))
            elif name not in REFUSED:
                raise InputError(unknown_name("setting of jigsaw", name, [*PARAMETERS, *OTHERWISE, *REFUSED]))
            elif value.lower() not in FALSE:
                raise InputError(phrase("isis.refused", name=name))
        except InputError as error:
            message = phrase("error.at", what=f"{name}={value}", message=message_of(error))
            raise InputError(message, **where) from None
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
