"""`project.toml`: settings of a plain project.

Each row of `keys.csv` declares a key: its section, `kind`, allowed words (the first is the default), the
`field` of the settings, and an example and the content for docs/formats/plain.md.
"""

from __future__ import annotations

import difflib
import math
import os
from collections.abc import Callable, Mapping
from datetime import date, datetime
from pathlib import Path
from typing import Any, NamedTuple

from photogram.adjustment.options import AdjustOptions
from photogram.arguments.arrays import value_field
from photogram.errors import InputError, message_of
from photogram.formats.columns import Columns, columns_given
from photogram.formats.declarations import declared
from photogram.formats.plain.schema import TABLES, WITH_SD
from photogram.formats.read_options import ReadOptions
from photogram.io.places import at_place
from photogram.io.toml import TomlTree, quoted_text, read_document, read_toml
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message, unknown_name
from photogram.network.geometry import Frame
from photogram.results.features import KINDS, Definition
from photogram.words import Phrase, phrase

SENTENCES = "sentences.toml"  # File for sentences
_CLASS = "class_"
_NUMBERS: Mapping[str, tuple[int, Callable[..., bool], str]] = {
    "place": (3, lambda lat, lon, h: abs(lat) <= 90 and abs(lon) <= 360 and math.isfinite(h), "plain.origin"),
    "axes": (2, lambda a, b: 0 < b <= a < math.inf, "plain.ellipsoid"),
    "limit": (3, lambda a, k, _: math.isfinite(a) and math.isfinite(k), "plain.length-limit"),
}
"""Number of values, their condition and the code of the error of several kinds."""
_SOME_LENGTH = {"line": "1", "from": "A", "to": "B", "length": 1.0, "sd": 0.0}


class Key(NamedTuple):
    section: str
    name: str
    kind: str
    words: str
    field: str  # Field of the settings, of their frame, options or photo files, or of a statement
    example: str
    content: str

    def described(self) -> str:
        """Return the line of the reference."""
        words = self.words.split()
        example = self.example or f'"{words[0]}"'
        comment = "; ".join(filter(None, [" | ".join(words), self.content]))
        return f"{f'{self.name} = {example}':<31} # {comment}" if comment else f"{self.name} = {example}"

    def value(self, table: TomlTree, unit: str) -> Any:
        """Return the value in a table; lengths without a unit are in `unit`."""
        name, value = self.name, table.value[self.name]
        match self.kind:
            case "word":
                return table[name].choice(self.words.split())
            case "number" | "positive" | "switch" | "texts":
                return getattr(table[name], self.kind)()
            case "count":
                return table[name].whole(1)
            case "sd":
                return tuple(table[name].numbers(1, 3, infinite=True))
            case "place" | "axes" | "limit":
                count, valid, code = _NUMBERS[self.kind]
                numbers = tuple(table[name].numbers(count, infinite=True))
                if not valid(*numbers):
                    raise table[name].value_error(code)
                return numbers
            case "moment" if isinstance(value, int | float):
                return table[name].number()
            case "moment":
                try:  # TOML has a date type.
                    day = value if isinstance(value, date) else datetime.fromisoformat(value)
                except (TypeError, ValueError):
                    raise table[name].value_error("plain.time-origin") from None
                return day.isoformat()
            case "day":
                return table[name].day()
            case "date" if type(value) is date:
                return value.isoformat()
            case "length" | "area":
                from photogram.results.statement.request import length_of

                length = value if isinstance(value, str) else str(value_field(value))
                return length_of(length, unit, area=self.kind == "area")
            case "reasons":
                reasons = table.table(name)
                for point in reasons.value:
                    if not reasons[point].text().strip():
                        raise reasons[point].error(phrase("plain.reason"))
                return value
            case "folder":
                return _existing(table, name, value, "folder") if table[name].text() else None
            case "files":
                names = [value] if isinstance(value, str) else table[name].texts() if value else []
                return tuple(_existing(table, name, each) for each in dict.fromkeys(names))
            case "sentences":
                return read_sentences(_existing(table, name, table[name].text()))
        return table[name].text()

    def written(self, value: Any, unit: str) -> Any:
        """Return a value in the form for :meth:`value`."""
        if value is None or self.kind not in ("length", "area", "sentences"):
            return value
        ending = {"length": unit, "area": f"{unit}2"}
        return SENTENCES if self.kind == "sentences" else f"{float(value)!r}{ending[self.kind]}"


def _existing(table: TomlTree, key: str, name: str, kind: str = "file") -> Path:
    path = table.file.parent / name
    # The functions of os.path also accept names that are too long for the system.
    if not (os.path.isdir if kind == "folder" else os.path.isfile)(path):
        raise table[key].error(phrase("error.absent", kind=kind, name=name))
    return path


KEYS = tuple(Key(*row) for row in declared(__file__, "keys.csv"))
"""Keys in the order of reading and writing."""


def read_keys(file: TomlTree) -> dict[str, dict[str, Any]]:
    """Return the values of the keys in a file by the first part of their fields, and by field."""
    parts = ("", "frame", "options", "photo_files", "statement")
    found: dict[str, dict[str, Any]] = {part: {} for part in parts}
    for key in KEYS:
        table = file.table(key.section)
        if key.name not in table or key.kind == "version":
            continue
        of, _, field = key.field.rpartition(".")
        with at_place(table[key.name]):
            value = key.value(table, found[""].get("length", "m"))
            if of == "statement":
                from photogram.results.statement.request import Asked
                from photogram.results.statement.texts import Texts

                if field.startswith(_CLASS):
                    field, value = "classes", {field.removeprefix(_CLASS): value}
                if field == "language":
                    Texts(value)
                # The existence of lengths is unknown before the tables are read.
                value = getattr(Asked.checked(lengths=(_SOME_LENGTH,), **{field: value}), field)
        found[of][field] = {**found[of].get(field, {}), **value} if field == "classes" else value
    return found


def key_tables(
    values: Mapping[str, Any], statement: Mapping[str, Any], unit: str
) -> dict[str, Mapping[str, Any]]:
    """Return values by field, and the options of a statement, as sections of keys."""
    fields = {**values, **{f"statement.{name}": value for name, value in statement.items()}}
    fields |= {f"statement.{_CLASS}{name}": size for name, size in statement.get("classes", {}).items()}
    found: dict[str, dict[str, Any]] = {}
    for key in KEYS:
        found.setdefault(key.section, {})[key.name] = key.written(fields.get(key.field), unit)
    return dict(found)


def asked_files(asked: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the requested file of sentences by name; empty without."""
    if (sentences := asked.get("text")) is None:
        return {}
    lines = [f"{quoted_text(key)} = {quoted_text(sentence)}\n" for key, sentence in sentences.items()]
    return {SENTENCES: "".join(lines).encode()}


def read_sentences(path: Path) -> dict[str, str]:
    """Return sentences of a TOML file by key."""
    from photogram.results.statement.texts import Texts

    file = read_toml(path)
    for key, member in file.items():
        if not isinstance(member.value, str):
            raise member.value_error("plain.sentence-key" if isinstance(member.value, dict) else "error.text")
        try:
            Texts(own={key: member.value})
        except InputError as error:
            raise file.source.error(key, message_of(error)) from None
    return dict(file.value)


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
    project = file.table("project")
    if project.at("format").value is not VERSION:
        raise project.at("format").value_error("plain.version", version=VERSION)
    values = read_keys(file)
    given, sd = file.table("sd"), dict[str, tuple[float, ...]]()
    for name in given.value:
        sd[name] = tuple(given[name].numbers(*WITH_SD[name], infinite=True))
        if min(sd[name]) < 0:
            raise given[name].value_error("error.not-negative")
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
        sd=sd | dict(reading.sd),
        tables=_tables(file.table("tables")),
        crs={name: file[name]["crs"].text() for name in WITH_CRS if "crs" in file.table(name)},
        columns={name: _columns(file[name]) for name in WITH_CRS if name in file}
        | ({"control": reading.control_columns} if reading.columns or reading.roles else {}),
        features=_features(file.table("features")),
        photo_files=ReadOptions(**photo_files) if photo_files.get("photos_dir") else None,
        statement=values["statement"],
    )


def _columns(table: TomlTree) -> Columns:
    with at_place(table.at("columns")):
        columns = columns_given(table.get("columns", "").text(), None)
    with at_place(table.at("roles")):
        return replace(columns, roles=columns_given(None, table.get("roles", "").text()).roles)


def _features(table: TomlTree) -> dict[str, Definition]:
    features: dict[str, Definition] = {}
    for name, value in table.value.items():
        if not isinstance(value, dict) or len(value) != 1:
            raise table[name].value_error("plain.feature")
        (kind,) = value
        if kind not in KINDS:
            raise table[name].error(unknown_name("kind of features", kind, KINDS))
        features[name] = kind, table[name][kind].texts()
    return features


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


def _tables(table: TomlTree) -> dict[str, Path]:
    folder = table.file.parent
    found: dict[str, Path] = {}
    for name in TABLES:
        if name in table:
            found[name] = folder / table[name].text()
            if not os.path.isfile(found[name]):  # Also if the name is too long for the system
                raise table[name].error(phrase("error.absent", kind="file", name=str(found[name])))
            continue
        present = [path for ending in ENDINGS if (path := folder / f"{name}{ending}").is_file()]
        if len(present) > 1:
            fields = {"table": name, "names": [path.name for path in present]}
            raise InputError(phrase("plain.two-files", **fields), file=table.file)
        if present:
            found[name] = present[0]
    return found
