"""Tables of the plain project, as declared in `tables.csv`.

Each row of this file declares the columns of one quantity: their names, `kind`, unit, default (a value, or
words for the reference), the `field` of the object that a row of the table makes, or the table with the
objects that the column names, and their content for docs/formats/plain-tables.md. Rows with an equal cell
`unknown` declare a shared unknown: its class, field and rule (see :class:`Parameter`). A row without columns
declares the table: its observations, whether it may have a coordinate system, and the lengths of its `[sd]`.

Kinds of text are `text`, `key` (the name of the row, once), `ref` (a name in the table `field`), `word` (one
of the words in backticks of the content), `flag`, `point`, `photo`, `shared` (an unknown), `group` (of
unknowns) and `subject` (a photo, or a trajectory at a time). Kinds of numbers are `number`, `whole`,
`positive`, `place` (a position in the frame of the project), `body` (a vector in the axes of a photo),
`attitude`, `turn` (an attitude relative to a photo), `mounting` (the inverse of a `turn`), `sd`, and `matrix`
or `body matrix` (with covariances).
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import groupby
from typing import Any, NamedTuple

from photogram import _photocore
from photogram.formats.column_words import KINDS_OF_UNITS, UNITS
from photogram.formats.columns import Units
from photogram.formats.declarations import declared
from photogram.lazy_dataclasses import dataclass

AXES = ("x", "y", "z")
ROTATIONS = ("rotation_x", "rotation_y", "rotation_z")  # Small rotations about the axes of the photo
VELOCITY, RATE = ("vx", "vy", "vz"), ("rate_x", "rate_y", "rate_z")
BASES = ("position", "rotation")  # Corrections of a trajectory
FACTORS = ("factor_0", "factor_1", "factor_2", "factor_3")
"""Factors of neighbouring coefficients in an observed sum."""
ANGLES: Mapping[str, tuple[str, ...]] = {
    "omega_phi_kappa": ("omega", "phi", "kappa"),
    "phi_omega_kappa": ("phi", "omega", "kappa"),
    "yaw_pitch_roll": ("yaw", "pitch", "roll"),
    "azimuth_tilt_swing": ("azimuth", "tilt", "swing"),
    "quaternion": ("qw", "qx", "qy", "qz"),
    "rotation_vector": ("rx", "ry", "rz"),
    "matrix": ("m11", "m12", "m13", "m21", "m22", "m23", "m31", "m32", "m33"),
}
"""Columns of each representation of attitudes."""
OPK = ANGLES["omega_phi_kappa"]  # Representation in written files
ALL_ANGLES = tuple(dict.fromkeys(name for names in ANGLES.values() for name in names))
ANGULAR = frozenset((*ALL_ANGLES[:9], *ROTATIONS))  # Columns with a unit of angles, also among lengths


def covariance_columns(names: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Return covariance columns by index pair: `cov_xy`, `cov_x_rotation_y`."""
    return {
        f"cov_{names[i]}{names[j]}" if len(names[i] + names[j]) == 2 else f"cov_{names[i]}_{names[j]}": (i, j)
        for j in range(len(names))
        for i in range(j)
    }


def deviation_columns(names: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"sd_{name}" for name in names)


ENDS = ("from", "to")
SD_AXES = deviation_columns(AXES)
DEVICE = ("sx", "sy", "alpha_rad")  # Scales and obliqueness of a scanner
CURVES = tuple(f"{axis}{letter}" for axis in "xy" for letter in "abcdefghj")
"""Coefficients of its polynomials."""
GRID = ("grid_x", "grid_y", "grid_dx", "grid_dy", "grid_columns", "grid_rows")
"""Numbers of a pattern of shifts of nodes."""
BENDS = ("bend_x", "bend_y")  # Deflections of a board
PITCHES = ("spacing_x", "spacing_y", "tag_size", "tag_spacing")  # Lengths of a board

TURNS = ("attitude", "turn", "mounting")  # Kinds of columns with rotations
REQUIRED, SETTINGS = "required", "[sd]"  # Defaults of cells that may not be empty, or that the settings fill
TEXTS = frozenset(("text", "key", "ref", "word", "flag", "point", "photo", "shared", "group", "subject"))
_GROUPS = {
    "@parameters": sorted(
        {name.lower() for _, facts in _photocore.camera_models() for name, _ in facts[1]}
        - {"f", "fx", "fy", "c", "cx", "cy", "x0", "y0", "s0"}
    ),
    "@curves": CURVES,
}
"""Names in `tables.csv` of many columns: other parameters of all cameras, and coefficients of polynomials."""


class Column(NamedTuple):
    """The columns of one quantity; those without content are not in the reference."""

    table: str
    components: tuple[str, ...]  # Columns, or their names without the prefix `sd_`
    kind: str
    unit: str
    default: str
    field: str  # Argument of the object that a row makes, or table that contains the objects of the column
    unknown: str
    heading: str  # Names in the reference, unless these are all columns
    content: str

    @property
    def names(self) -> tuple[str, ...]:
        names = self.components
        if self.kind == "sd":
            return deviation_columns(names) or ("sd",)
        if self.kind in TURNS:
            return ALL_ANGLES
        if not self.kind.endswith("matrix"):
            return names
        single = () if names and names[-1] == "rotation_z" else ("sd",)
        return (*single, *deviation_columns(names), *covariance_columns(names))

    @property
    def words(self) -> tuple[str, ...]:
        """Allowed words, with the default first; empty for other kinds."""
        default = self.default.strip("`")
        found = re.findall(r"`([\w ]+)`", self.content) if self.kind == "word" else []
        return tuple(sorted(found, key=lambda word: word != default))

    @property
    def number(self) -> float:
        """The value of an empty cell; NaN without default."""
        try:
            return float(self.default)
        except ValueError:
            return math.nan

    def unit_of(self, name: str) -> str:
        """Return the unit of a column; covariances and quaternions have none."""
        angular = name.removeprefix("sd_") in ANGULAR
        if name.startswith("cov_") or (self.kind in TURNS and not angular):
            return ""
        return "angle" if self.unit and angular else self.unit

    def described(self) -> tuple[str, str, str]:
        """Return columns, content and default for the reference."""
        names, more = self.names, {"time": " (s)", "mm": " (mm)"}.get(self.unit, "")
        heading = self.heading or ", ".join(f"`{name}`" for name in names)
        if names == ALL_ANGLES:
            heading = "angles"
        elif self.kind.endswith("matrix") and len(names) > 1:
            covariances = list(covariance_columns(self.components))
            heading = "`sd`, " if names[0] == "sd" else ""
            heading += f"`sd_{self.components[0]}` .., `{covariances[0]}` .."
        default = f"`[sd] {self.table}`" if self.default == SETTINGS else self.default
        if self.kind == "sd":
            default = {"0": "0 (fixed)", "inf": "empty: free"}.get(default, default)
        return heading, self.content + more, default


class Parameter(NamedTuple):
    """A shared unknown of each row: columns of its name, values and standard deviations.

    It exists in each row with the rule `row`; with `name` if its cell is true or a name; with `sd` if it is
    not fixed, otherwise its value is an array; with `any` if a cell is not the default.
    """

    class_name: str
    field: str  # Argument of observations
    rule: str
    columns: tuple[Column, ...]

    @property
    def name(self) -> str:
        return self.columns[0].names[0]

    @property
    def values(self) -> list[Column]:
        """The columns of values by quantity."""
        return [column for column in self.columns[1:] if column.kind != "sd"]

    @property
    def sd(self) -> list[str]:
        """The columns of the standard deviations."""
        return [name for column in self.columns if column.kind == "sd" for name in column.names]


@dataclass(frozen=True)
class Schema:
    all_columns: tuple[Column, ...]
    class_name: str = ""  # Of the observations of its rows
    # Allowed numbers of standard deviations in `[sd]`; empty: not allowed
    deviations: tuple[int, ...] = ()
    # Whether coordinates may be in another system than the frame, with other headings
    has_system: bool = False

    @cached_property
    def parts(self) -> tuple[Column | Parameter, ...]:
        """The columns, with those of an unknown in one part."""
        found: list[Column | Parameter] = []
        for unknown, group in groupby(self.all_columns, lambda column: column.unknown):
            columns = tuple(group)
            if unknown:
                class_name, field, rule = unknown.split()
                found.append(Parameter(class_name, field, rule, columns))
            else:
                found += columns
        return tuple(found)

    @property
    def unknowns(self) -> list[Parameter]:
        return [part for part in self.parts if isinstance(part, Parameter)]

    def unknown(self, field: str) -> Parameter:
        return next(part for part in self.unknowns if part.field == field)

    @cached_property
    def columns(self) -> tuple[str, ...]:
        texts = [name for column in self.all_columns if column.kind in TEXTS for name in column.names]
        return (*dict.fromkeys(texts), *self.numbers)

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        columns = (column for column in self.all_columns if column.kind not in TEXTS)
        return tuple(dict.fromkeys(name for column in columns for name in column.names))

    @cached_property
    def defaults(self) -> dict[str, Any]:
        """Numbers and words of empty cells by column, if they are declared."""
        found: dict[str, Any] = {}
        for column in self.all_columns:
            word = column.default.strip("`")
            value = word if word in column.words else column.number
            found |= dict.fromkeys(column.names if value == value else (), value)
        return found

    @cached_property
    def words(self) -> dict[str, tuple[str, ...]]:
        """Allowed words of columns, with the default first."""
        columns = (column for column in self.all_columns if column.words)
        return {name: column.words for column in columns for name in column.names}

    def needed(self, there: Collection[str]) -> tuple[str, ...]:
        """Return the required columns of a table that has some columns."""
        of_trajectories = "trajectory" in there and self.class_name
        columns = (column for column in self.all_columns if column.default == REQUIRED)
        names = (name for column in columns for name in column.components)
        return tuple(name for name in names if name != "photo" or not of_trajectories)


def _declared() -> Iterator[tuple[str, Schema]]:
    for name, group in groupby(declared(__file__, "tables.csv"), lambda row: row[0]):
        (_, _, class_name, system, deviations, *_), *own = group
        columns = []
        for _, names, *cells in own:
            components = [each for word in names.split() for each in _GROUPS.get(word, (word,))]
            columns.append(Column(name, tuple(components), *cells))
        yield name, Schema(tuple(columns), class_name, tuple(map(int, deviations.split())), system == "crs")


TABLES: Mapping[str, Schema] = dict(_declared())
"""Tables in the order of reading and writing."""
WITH_SD = {name: each.deviations for name, each in TABLES.items() if each.deviations} | {"check": (1, 3)}
"""Check points have the standard deviations of the table of control."""


def column_units(name: str, length: str = "m", angle: str = "deg", image: str = "px") -> Units:
    """Return unit type and size of each numeric column of a table."""
    units = {
        "length": ("length", UNITS[length]),
        "angle": ("angle", KINDS_OF_UNITS["angle"].get(angle, KINDS_OF_UNITS["angle"]["deg"])),
        "image": ("pixel", 1.0) if image == "px" else ("length", UNITS[image]),
        "mm": ("length", UNITS["mm"]),
        "time": ("time", 1.0),
    }
    columns = [column for column in TABLES[name].all_columns if column.kind not in TEXTS]
    return {each: units.get(column.unit_of(each), ("", 1.0)) for column in columns for each in column.names}
