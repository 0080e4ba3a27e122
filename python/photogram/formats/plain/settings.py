"""`project.toml`: units, axes, frame, standard deviations and options of a plain project."""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Mapping
from datetime import date, datetime
from pathlib import Path
from typing import Any, cast

from photogram.arguments.arrays import shown
from photogram.errors import InputError
from photogram.formats.columns import PLAIN, Columns, columns_given
from photogram.formats.format import PhotoFiles, Wishes
from photogram.formats.plain.schema import ANGLES, FILM_MODELS, TABLES
from photogram.formats.plain.statement_settings import KEYS, read_asked
from photogram.formats.project import DatumName, Frame, Options
from photogram.io.toml import Sections, day_of
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message, listed, nearest
from photogram.results.features import KINDS, Definition

VERSION = 1
WITH_CRS = tuple(name for name, each in TABLES.items() if each.has_system)
WITH_SD = {name: each.deviations for name, each in TABLES.items() if each.deviations} | {"check": (1, 3)}
"""Of check points they are those of the table of control."""
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
"""Words that a key may have; the first is the default."""
_KEYS: Mapping[str, tuple[str, ...] | None] = {
    "project": ("format", "name"),
    "frame": ("kind", "crs", "origin", "ellipsoid"),
    "units": ("length", "angle", "image"),
    "axes": ("image_y", "pixel_origin", "attitude", "rotation", "photo"),
    "time": ("origin", "scale"),
    "sd": tuple(WITH_SD),
    "tables": tuple(TABLES),
    "film": ("model", "interior", "certificate", "flown"),
    "adjust": ("datum", "loss", "unit_variance", "iterations"),
    **dict.fromkeys(WITH_CRS, ("crs", "columns", "roles")),
    "photos": ("crs", "columns", "roles", "directory", "directory_crs", "mrk_antenna"),
    "features": None,
    **KEYS,
}


@dataclass(frozen=True)
class Settings:
    """What `project.toml` says, or tables that come without one: all that it leaves out has its default."""

    path: Path  # The file, or what errors name where there is none
    name: str = ""  # Of the project
    frame: Frame = field(default_factory=Frame)  # As in a project
    options: Options = field(default_factory=Options)
    length: str = "m"  # Units
    angle: str = "deg"
    image: str = "px"
    image_y: str = ""  # Axes
    pixel_origin: str = "corner"
    attitude: str = "omega_phi_kappa"
    rotation: str = "object_to_photo"
    photo: str = "y_up"
    # What seconds of all tables count from, a number or a date, and of which scale: said, not
    # calculated with
    time_origin: float | str = 0.0
    time_scale: str = "none"
    # Standard deviations of tables without columns for them: three numbers, of images two
    sd: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    tables: Mapping[str, Path] = field(default_factory=dict)  # The file of each table that is there
    crs: Mapping[str, str] = field(default_factory=dict)  # Of tables whose coordinates are not in the frame
    # What is said of the columns of tables of points, as `--columns` and `--roles` say it
    columns: Mapping[str, Columns] = field(default_factory=dict)
    # By their names, as :func:`photogram.features` takes them
    features: Mapping[str, Definition] = field(default_factory=dict)
    photo_files: PhotoFiles | None = None  # Where photographs lie whose files carry positions; None without
    # What `[check]` and `[statement]` say, as :meth:`photogram.Result.statement` takes it
    statement: Mapping[str, Any] = field(default_factory=dict)
    # The model of films that say none; whether their interior orientation is unknown inside the
    # adjustment, or fitted before it and errorless
    film: str = "affine"
    interior: str = "inside"
    certificates: tuple[Path, ...] = ()  # The files of the certificates of the cameras of films
    flown: date | None = None  # The day of the flight; None where it is not said

    def __post_init__(self) -> None:
        if not self.image_y:
            object.__setattr__(self, "image_y", "down" if self.image == "px" else "up")

    @property
    def times(self) -> str:
        """What seconds count from, as people are told; nothing where it is not said."""
        if self.time_origin == 0.0 and self.time_scale == "none":
            return ""
        return f"seconds from {self.time_origin}" + (
            "" if self.time_scale == "none" else f", {self.time_scale}"
        )


def read_settings(path: Path, wishes: Wishes | None = None) -> Settings:
    """Read a file of settings, and find the tables that it names or that lie beside it."""
    wishes = wishes or Wishes()
    file = _File(path, wishes.settings)
    file.check_keys(_KEYS)
    version = file.value("project", "format")
    if isinstance(version, bool) or version != VERSION:
        message = "[project] format is missing" if version is None else f"has format {shown(version)}"
        form = f"this is version {VERSION} of the schema, `format = {VERSION}`"
        file.fail("project", "format", f"{message}: {form}")
    # Defaults of the keys are those of the settings.
    words: dict[str, Any] = {
        key: file.word(section, key)
        for section in ("units", "axes")
        for key in _KEYS[section] or ()
        if file.has(section, key)
    }
    return Settings(
        path=path,
        name=file.text("project", "name"),
        frame=Frame(file.word("frame", "kind"), file.text("frame", "crs"), file.origin(), file.ellipsoid()),
        options=Options(
            cast("DatumName | None", file.word("adjust", "datum") if file.has("adjust", "datum") else None),
            cast("Any", {"none": None}.get(loss := file.word("adjust", "loss"), loss)),
            # `free` is what earlier versions wrote where nobody had asked for anything.
            cast("Any", {"free": "constrained"}.get(basis := file.word("adjust", "unit_variance"), basis)),
            file.count("adjust", "iterations") if file.has("adjust", "iterations") else None,
        ),
        **words,
        time_origin=file.time_origin(),
        time_scale=file.word("time", "scale"),
        sd={name: file.deviations(name) for name in WITH_SD if file.has("sd", name)} | dict(wishes.sd),
        tables=_tables(file),
        crs={name: file.text(name, "crs") for name in WITH_CRS if file.has(name, "crs")},
        columns={name: file.columns(name) for name in WITH_CRS if name in file.content}
        | ({} if wishes.columns == PLAIN else {"control": wishes.columns}),
        features={name: file.feature(name) for name in file.content.get("features", {})},
        photo_files=file.photo_files(),
        statement=read_asked(file, file.word("units", "length")),
        film=file.word("film", "model"),
        interior=file.word("film", "interior"),
        certificates=file.certificates(),
        flown=file.flown(),
    )


class _File(Sections):
    """A file of settings."""

    def word(self, section: str, key: str) -> str:
        """Return one of the words of a key."""
        words = _CHOICES[section, key]
        value = self.value(section, key, words[0])
        if value not in words:
            self.fail(section, key, f"{key} is one of {', '.join(words)}, not {shown(value)}")
        return str(value)

    def columns(self, table: str) -> Columns:
        """Return what is said of the columns of a table."""
        try:
            return columns_given(self.text(table, "columns"), self.text(table, "roles"))
        except InputError as error:
            key = "columns" if "--columns" in error.message else "roles"
            self.fail(table, key, error.message.replace("--", ""))

    def photo_files(self) -> PhotoFiles | None:
        """Return where photographs lie, and what is said of the positions of their files."""
        antenna = self.has("photos", "mrk_antenna") and self.flag("photos", "mrk_antenna")
        directory, crs = self.text("photos", "directory"), self.text("photos", "directory_crs")
        if not directory:
            return None
        if not (self.path.parent / directory).is_dir():
            self.fail("photos", "directory", f"there is no folder {directory}")
        return PhotoFiles(self.path.parent / directory, crs or None, antenna)

    def certificates(self) -> tuple[Path, ...]:
        """Return the files of the certificates of the cameras of films: one text, or a list."""
        if not self.has("film", "certificate"):
            return ()
        one = isinstance(self.value("film", "certificate"), str)
        words = [self.text("film", "certificate")] if one else self.texts("film", "certificate")
        paths = tuple(self.path.parent / each for each in dict.fromkeys(words))
        for path in paths:
            if not path.is_file():
                self.fail("film", "certificate", f"there is no file {path.name}")
        return paths

    def flown(self) -> date | None:
        """Return the day of the flight."""
        value = self.value("film", "flown")
        try:
            return None if value is None else day_of(value)
        except ValueError:
            self.fail("film", "flown", f"flown is a day, as 1983-07-02, not {shown(value)}")

    def feature(self, name: str) -> Definition:
        """Return the kind of a feature, and the points that it goes through."""
        value = self.value("features", name)
        if not isinstance(value, dict) or len(value) != 1:
            form = f'the feature {name} is {{ circle = ["point", "point", ...] }}'
            self.fail("features", name, f"{form}, not {shown(value)}")
        (kind, points), *_ = value.items()
        if kind not in KINDS:
            self.fail("features", name, f"the feature {name}: there is no {kind}{nearest(kind, KINDS)}")
        if not isinstance(points, list) or not all(isinstance(each, str) for each in points):
            form = f"the feature {name} goes through a list of names"
            self.fail("features", name, f"{form}, not {shown(points)}")
        return kind, tuple(points)

    def origin(self) -> tuple[float, float, float] | None:
        """Return latitude, longitude, height."""
        if not self.has("frame", "origin"):
            return None
        latitude, longitude, height = self.numbers("frame", "origin", (3,))
        if not (abs(latitude) <= 90 and abs(longitude) <= 360 and math.isfinite(height)):
            form = "origin is latitude and longitude in degrees, and the ellipsoidal height"
            self.fail("frame", "origin", form)
        return latitude, longitude, height

    def time_origin(self) -> float | str:
        """Return a number of seconds, or a date as text."""
        value = self.value("time", "origin", 0.0)
        if self.has("time", "origin") and isinstance(value, int | float):
            (value,) = self.numbers("time", "origin", (1,))
        if isinstance(value, float) and math.isfinite(value):
            return value
        try:
            # TOML has dates of its own.
            return value.isoformat() if isinstance(value, date) else datetime.fromisoformat(value).isoformat()
        except (TypeError, ValueError):
            self.fail("time", "origin", f"origin is a number of seconds, or a date, not {shown(value)}")

    def ellipsoid(self) -> tuple[float, float]:
        """Return the semi-axes."""
        if not self.has("frame", "ellipsoid"):
            return Frame().ellipsoid
        a, b = self.numbers("frame", "ellipsoid", (2,))
        if not (0 < b <= a < math.inf):
            self.fail("frame", "ellipsoid", "ellipsoid is the semi-major and the semi-minor axis")
        return a, b

    def deviations(self, table: str) -> tuple[float, ...]:
        """Return standard deviations of a table."""
        found = self.numbers("sd", table, WITH_SD[table])
        if not all(each >= 0 for each in found):
            self.fail("sd", table, f"{list(found)} is no standard deviation")
        return found


def unread_tables(settings: Settings) -> list[Message]:
    """Return a remark on tables beside the settings that no table is called, with the nearest names."""
    used = {os.path.realpath(path) for path in settings.tables.values()}
    others = [
        path
        for path in sorted(settings.path.parent.iterdir())
        if path.suffix in ENDINGS and path.suffix != ".txt" and os.path.realpath(path) not in used
    ]
    if not others:
        return []
    close = {path.name: difflib.get_close_matches(path.stem.lower(), TABLES, 1, 0.75) for path in others}
    meant = [f"{name} (did you mean {each[0]}?)" for name, each in close.items() if each]
    rest = [name for name, each in close.items() if not each]
    return [Message(f"tables of other names are not read: {listed([*meant, *rest])}", settings.path)]


def _tables(file: _File) -> dict[str, Path]:
    folder = file.path.parent
    found: dict[str, Path] = {}
    for name in TABLES:
        if file.has("tables", name):
            found[name] = folder / file.text("tables", name)
            if not os.path.isfile(found[name]):  # nor where the name is too long for the system
                file.fail("tables", name, f"the table {name} is not there: {found[name]}")
            continue
        present = [path for ending in ENDINGS if (path := folder / f"{name}{ending}").is_file()]
        if len(present) > 1:
            names = " and ".join(path.name for path in present)
            raise InputError(
                f"two files for the table {name}: {names}; name one under [tables]", file=file.path
            )
        if present:
            found[name] = present[0]
    return found
