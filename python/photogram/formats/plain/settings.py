"""`project.toml`: settings of a plain project."""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Mapping
from datetime import date, datetime
from pathlib import Path
from typing import Any, cast

from photogram.adjustment.options import AdjustOptions, DatumName
from photogram.errors import InputError, message_of
from photogram.formats.columns import PLAIN, Columns, columns_given
from photogram.formats.format import PhotoFiles, Wishes
from photogram.formats.plain.schema import ANGLES, FILM_MODELS, TABLES
from photogram.formats.plain.statement_settings import KEYS, read_asked
from photogram.formats.project import Frame
from photogram.io.toml import Document, Table, day_of, read_document
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message, unknown_name
from photogram.results.features import KINDS, Definition
from photogram.words import Phrase, phrase

VERSION = 1
WITH_CRS = tuple(name for name, each in TABLES.items() if each.has_system)
WITH_SD = {name: each.deviations for name, each in TABLES.items() if each.deviations} | {"check": (1, 3)}
"""Check points have the standard deviations of the table of control."""
ENDINGS = (".csv", ".tsv", ".txt", ".parquet")

LENGTHS = ("m", "km", "mm", "ft", "us-ft")
_CHOICES: Mapping[tuple[str, str], tuple[str, ...]] = {
    ("frame", "kind"): ("cartesian", "topocentric", "geocentric", "geographic"),
    ("units", "length"): LENGTHS,
    ("units", "angle"): ("deg", "gon", "rad", "dms"),
    ("units", "image"): ("px", "mm", "um"),
    ("axes", "image_y"): ("down", "up"),
    ("axes", "pixel_origin"): ("corner", "center"),
    ("axes", "attitude"): tuple(ANGLES),
    ("axes", "rotation"): ("object_to_photo", "photo_to_object"),
    ("axes", "photo"): ("y_up", "y_down"),
    ("time", "scale"): ("none", "utc", "gps", "tai", "et"),
    ("film", "model"): FILM_MODELS,
    ("film", "interior"): ("inside", "before"),
    ("adjust", "datum"): ("control", "minimum", "inner"),
    ("adjust", "loss"): ("none", "huber", "cauchy"),
    ("adjust", "unit_variance"): ("constrained", "unity", "redundancy", "free"),
}
"""Allowed words of a key; the first is the default."""
_KEYS: Mapping[str, tuple[str, ...] | None] = {
    "project": ("format", "name"),
    "frame": ("kind", "crs", "origin", "ellipsoid"),
    "units": ("length", "angle", "image"),
    "axes": ("image_y", "pixel_origin", "attitude", "rotation", "photo"),
    "time": ("origin", "scale"),
    "sd": tuple(WITH_SD),
    "tables": tuple(TABLES),
    "film": ("model", "interior", "certificate", "flown"),
    "adjust": ("datum", "loss", "unit_variance", "iterations", "max_bias_ratio"),
    **dict.fromkeys(WITH_CRS, ("crs", "columns", "roles")),
    "photos": ("crs", "columns", "roles", "directory", "directory_crs", "mrk_antenna"),
    "features": None,
    **KEYS,
}


@dataclass(frozen=True)
class Settings:
    """The settings of `project.toml`, or defaults for tables without it."""

    path: Path  # The file, or the path for error messages
    name: str = ""  # Name of the project
    frame: Frame = field(default_factory=Frame)  # As in a project
    options: AdjustOptions = field(default_factory=AdjustOptions)
    length: str = "m"  # Units
    angle: str = "deg"
    image: str = "px"
    image_y: str = ""  # Axes
    pixel_origin: str = "corner"
    attitude: str = "omega_phi_kappa"
    rotation: str = "object_to_photo"
    photo: str = "y_up"
    # Time origin of all tables, a number or a date, and time scale: documentation only
    time_origin: float | str = 0.0
    time_scale: str = "none"
    # Standard deviations of tables without columns for them: three numbers, of images two
    sd: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    tables: Mapping[str, Path] = field(default_factory=dict)  # The file of each existing table
    crs: Mapping[str, str] = field(default_factory=dict)  # Systems of tables not in the frame
    # Columns of point tables in the form of `--columns` and `--roles`
    columns: Mapping[str, Columns] = field(default_factory=dict)
    # By name, as arguments of :func:`photogram.features`
    features: Mapping[str, Definition] = field(default_factory=dict)
    photo_files: PhotoFiles | None = None  # Folder of photographs with positions; None without
    # Contents of `[check]` and `[statement]`, as arguments of :meth:`photogram.Result.statement`
    statement: Mapping[str, Any] = field(default_factory=dict)
    # Default model of films; whether interior orientation is estimated in the adjustment, or fitted in
    # advance and fixed
    film: str = "affine"
    interior: str = "inside"
    certificates: tuple[Path, ...] = ()  # The files of the certificates of the cameras of films
    flown: date | None = None  # Date of flight; None if unknown

    def __post_init__(self) -> None:
        if not self.image_y:
            object.__setattr__(self, "image_y", "down" if self.image == "px" else "up")

    @property
    def times(self) -> str:
        """Time origin for users; empty if unknown."""
        if self.time_origin == 0.0 and self.time_scale == "none":
            return ""
        return f"seconds from {self.time_origin}" + (
            "" if self.time_scale == "none" else f", {self.time_scale}"
        )


def read_settings(path: Path, wishes: Wishes | None = None) -> Settings:
    """Read a file of settings, and find its tables, named or in its folder."""
    wishes = wishes or Wishes()
    file = read_document(path, _KEYS, wishes.settings)
    project, frame, adjust = (file.optional(name) for name in ("project", "frame", "adjust"))
    if project.value("format", "") is not VERSION:
        raise project.value_error("format", "plain.version", version=VERSION)
    length = _word(file, "units", "length")
    # Defaults of the keys are the defaults of the settings.
    words: dict[str, Any] = {
        key: _word(file, section, key)
        for section in ("units", "axes")
        for key in _KEYS[section] or ()
        if key in file.optional(section)
    }
    axes = tuple(frame.numbers("ellipsoid", 2)) if "ellipsoid" in frame else Frame().ellipsoid
    if not 0 < axes[1] <= axes[0] < math.inf:
        raise frame.value_error("ellipsoid", "plain.ellipsoid")
    datum, loss = (_word(file, "adjust", key) for key in ("datum", "loss"))
    basis = _word(file, "adjust", "unit_variance")
    return Settings(
        path=path,
        name=project.text("name", ""),
        frame=Frame(_word(file, "frame", "kind"), frame.text("crs", ""), _origin(frame), (axes[0], axes[1])),
        options=AdjustOptions(
            datum=cast("DatumName", datum) if "datum" in adjust else None,
            loss=cast("Any", None if loss == "none" else loss),
            # Earlier versions wrote `free` for the default.
            unit_variance=cast("Any", "constrained" if basis == "free" else basis),
            max_iterations=adjust.count("iterations", low=1) if "iterations" in adjust else None,
            max_bias_ratio=adjust.positive("max_bias_ratio") if "max_bias_ratio" in adjust else None,
        ),
        **words,
        time_origin=_time_origin(file.optional("time")),
        time_scale=_word(file, "time", "scale"),
        sd=_deviations(file.optional("sd")) | dict(wishes.sd),
        tables=_tables(file.optional("tables")),
        crs={name: file.table(name).text("crs") for name in WITH_CRS if "crs" in file.optional(name)},
        columns={name: _columns(file.table(name)) for name in WITH_CRS if name in file}
        | ({} if wishes.columns == PLAIN else {"control": wishes.columns}),
        features=_features(file.optional("features")),
        photo_files=_photo_files(file.optional("photos")),
        statement=read_asked(file, length),
        film=_word(file, "film", "model"),
        interior=_word(file, "film", "interior"),
        certificates=_certificates(file.optional("film")),
        flown=_flown(file.optional("film")),
    )


def _word(file: Document, section: str, key: str) -> str:
    """Return the allowed word of a key."""
    words = _CHOICES[section, key]
    return file.optional(section).choice(key, words, words[0])


def _columns(table: Table) -> Columns:
    """Return the columns and roles of a table of points."""
    key = "columns"
    try:
        columns = columns_given(table.text(key, ""), None)
        key = "roles"
        return replace(columns, roles=columns_given(None, table.text(key, "")).roles)
    except InputError as error:
        raise (error if error.file else table.error(key, message_of(error))) from None


def _photo_files(table: Table) -> PhotoFiles | None:
    """Return the folder of photographs whose files have positions."""
    antenna = table.switch("mrk_antenna", False)
    directory, crs = table.text("directory", ""), table.text("directory_crs", "")
    if not directory:
        return None
    if not (table.file.parent / directory).is_dir():
        raise table.error("directory", phrase("error.absent", kind="folder", name=directory))
    return PhotoFiles(table.file.parent / directory, crs or None, antenna)


def _certificates(table: Table) -> tuple[Path, ...]:
    """Return the certificate files of film cameras: one text, or a list."""
    value = table.values.get("certificate", [])
    names = [value] if isinstance(value, str) else table.texts("certificate") if value else []
    paths = tuple(table.file.parent / name for name in dict.fromkeys(names))
    for path in paths:
        if not path.is_file():
            raise table.error("certificate", phrase("error.absent", kind="file", name=path.name))
    return paths


def _flown(table: Table) -> date | None:
    try:
        return day_of(table.values["flown"]) if "flown" in table else None
    except ValueError:
        raise table.value_error("flown", "error.day") from None


def _features(table: Table) -> dict[str, Definition]:
    """Return the type and the points of each feature."""
    features: dict[str, Definition] = {}
    for name, value in table.values.items():
        if not isinstance(value, dict) or len(value) != 1:
            raise table.value_error(name, "plain.feature")
        (kind,) = value
        if kind not in KINDS:
            raise table.error(name, unknown_name("kind of features", kind, KINDS))
        features[name] = kind, table.table(name).texts(kind)
    return features


def _origin(table: Table) -> tuple[float, float, float] | None:
    if "origin" not in table:
        return None
    latitude, longitude, height = table.numbers("origin", 3)
    if not (abs(latitude) <= 90 and abs(longitude) <= 360 and math.isfinite(height)):
        raise table.value_error("origin", "plain.origin")
    return latitude, longitude, height


def _time_origin(table: Table) -> float | str:
    """Return a number of seconds, or a date as text."""
    value = table.values.get("origin", 0.0)
    if isinstance(value, int | float):
        return table.number("origin", 0.0)
    try:
        # TOML has a date type.
        return value.isoformat() if isinstance(value, date) else datetime.fromisoformat(value).isoformat()
    except (TypeError, ValueError):
        raise table.value_error("origin", "plain.time-origin") from None


def _deviations(table: Table) -> dict[str, tuple[float, ...]]:
    found = {name: tuple(table.numbers(name, WITH_SD[name])) for name in table.values}
    for name, values in found.items():
        if min(values) < 0:
            raise table.value_error(name, "error.not-negative")
    return found


def unread_tables(settings: Settings) -> list[Message]:
    """Return a remark on unused tables, with similar names."""
    used = {os.path.realpath(path) for path in settings.tables.values()}
    others = [
        path
        for path in sorted(settings.path.parent.iterdir())
        if path.suffix in ENDINGS and path.suffix != ".txt" and os.path.realpath(path) not in used
    ]
    if not others:
        return []
    close = {path.name: difflib.get_close_matches(path.stem.lower(), TABLES, 1, 0.75) for path in others}
    names = [
        Phrase("plain.similar", {"name": name, "close": words[0]}) if words else name
        for name, words in close.items()
    ]
    return [Message(phrase("plain.unread-tables", names=names), settings.path)]


def _tables(table: Table) -> dict[str, Path]:
    folder = table.file.parent
    found: dict[str, Path] = {}
    for name in TABLES:
        if name in table:
            found[name] = folder / table.text(name)
            if not os.path.isfile(found[name]):  # Also if the name is too long for the system
                raise table.error(name, phrase("error.absent", kind="file", name=str(found[name])))
            continue
        present = [path for ending in ENDINGS if (path := folder / f"{name}{ending}").is_file()]
        if len(present) > 1:
            fields = {"table": name, "names": [path.name for path in present]}
            raise InputError(phrase("plain.two-files", **fields), file=table.file)
        if present:
            found[name] = present[0]
    return found
