"""`project.toml`: settings of a plain project."""

from __future__ import annotations

import difflib
import os
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any

from photogram.adjustment.options import AdjustOptions
from photogram.errors import InputError, message_of
from photogram.formats.columns import Columns, columns_given
from photogram.formats.plain.keys import KEYS, read_keys
from photogram.formats.plain.schema import TABLES, WITH_SD
from photogram.formats.project import Frame
from photogram.formats.read_options import ReadOptions
from photogram.io.toml import Table, read_document
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message, unknown_name
from photogram.results.features import KINDS, Definition
from photogram.words import Phrase, phrase

VERSION = 1
WITH_CRS = tuple(name for name, each in TABLES.items() if each.has_system)
ENDINGS = (".csv", ".tsv", ".txt", ".parquet")

LENGTHS = next(key.words for key in KEYS if key.field == "length").split()
_SECTIONS: dict[str, tuple[str, ...] | None] = {
    "sd": tuple(WITH_SD),
    "tables": tuple(TABLES),
    "features": None,
    **dict.fromkeys(WITH_CRS, ("crs", "columns", "roles")),
}
"""Names of the keys of each section; None: any."""
for _key in KEYS:
    _SECTIONS[_key.section] = (*(_SECTIONS.get(_key.section) or ()), _key.name)


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
    photo_files: ReadOptions | None = None  # Options of a folder of photographs with positions
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


def read_settings(path: Path, reading: ReadOptions | None = None) -> Settings:
    """Read a file of settings, and find its tables, named or in its folder."""
    reading = reading or ReadOptions()
    file = read_document(path, _SECTIONS, reading.settings)
    project = file.optional("project")
    if project.value("format", "") is not VERSION:
        raise project.value_error("format", "plain.version", version=VERSION)
    values = read_keys(file)
    options, photo_files = values["options"], values["photo_files"]
    photo_files |= {"photos_crs": photo_files.get("photos_crs") or None}
    if options.get("loss") == "none":
        del options["loss"]
    if options.get("unit_variance") == "free":  # Earlier versions wrote this word for the default.
        del options["unit_variance"]
    return Settings(
        path=path,
        frame=Frame(**values["frame"]),
        options=AdjustOptions(**options),
        **values[""],
        sd=_deviations(file.optional("sd")) | dict(reading.sd),
        tables=_tables(file.optional("tables")),
        crs={name: file.table(name).text("crs") for name in WITH_CRS if "crs" in file.optional(name)},
        columns={name: _columns(file.table(name)) for name in WITH_CRS if name in file}
        | ({"control": reading.control_columns} if reading.columns or reading.roles else {}),
        features=_features(file.optional("features")),
        photo_files=ReadOptions(**photo_files) if photo_files.get("photos_dir") else None,
        statement=values["statement"],
    )


def _columns(table: Table) -> Columns:
    """Return the columns and roles of a table of points."""
    key = "columns"
    try:
        columns = columns_given(table.text(key, ""), None)
        key = "roles"
        return replace(columns, roles=columns_given(None, table.text(key, "")).roles)
    except InputError as error:
        raise (error if error.file else table.error(key, message_of(error))) from None


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
