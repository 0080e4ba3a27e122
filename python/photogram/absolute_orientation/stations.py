"""Stations of models and control: CSV files (`docs/absolute-orientation.md`), and cards of TB 19.

The bulletin does not define the format of the cards. Here a record is a line of words, separated by blanks or
by commas. A missing control coordinate is a word `-`, or nothing between two commas.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from photogram.absolute_orientation.similarity import Similarity
from photogram.arguments.arrays import names, text, truth_value
from photogram.arguments.fields import array, check_arrays, check_fields
from photogram.arguments.objects import path_of
from photogram.arguments.types import NONE, ZERO, Array, Bools, Floats, Identifiers, OptionalArray
from photogram.errors import InputError
from photogram.io.delimited import cells, read_records
from photogram.io.files import read_lines
from photogram.io.numbers import finite_number, whole_number
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import converting_dataclass, dataclass, field
from photogram.messages import Message
from photogram.network.geometry import rotation_matrix
from photogram.summaries import Brief
from photogram.words import phrase

if TYPE_CHECKING:
    import pandas as pd


CONTROL_COLUMNS = ("X", "Y", "Z")
MODEL_COLUMNS = ("x", "y", "z")
CONTROL_SD_COLUMNS = ("sd_X", "sd_Y", "sd_Z")
MODEL_SD_COLUMNS = ("sd_x", "sd_y", "sd_z")


@converting_dataclass(frozen=True, eq=False, repr=False)
class Stations(Brief):
    """Stations with model and control coordinates; arrays are copied and checked.

    A station without control coordinates is a point to be transformed. The arrays are read-only, so that
    results based on them cannot change.

    Attributes
    ----------
    ids
        (n,) unique identifiers.
    control
        (n, 3) control coordinates X, Y, Z in ground units; NaN if unknown. Each component is independent.
    model
        (n, 3) model coordinates x, y, z in model units.
    control_sd
        Standard deviations of the control in ground units, broadcast to (n, 3): 0 (default) is exact,
        infinite excludes a known coordinate.
    model_sd
        Standard deviations of the model coordinates in model units, broadcast to (n, 3); 0 is exact, if the
        control is not. None if they are equal but unknown; sigma0 is then their estimate.
    ground_unit, model_unit
        Names of the units, for reports.

    Raises
    ------
    InputError
        If shapes differ, a value is not a number, an identifier occurs twice, a model coordinate is not
        finite, a standard deviation is invalid, or a coordinate is exact in both systems.
    """

    ids: Identifiers
    control: Array = field(metadata=array("stations", 3, missing=True, one_row=True))
    model: Array = field(metadata=array("stations", 3, one_row=True))
    control_sd: Array = field(default=ZERO, kw_only=True, metadata=array("stations", 3, one_row=True))
    model_sd: OptionalArray = field(default=NONE, kw_only=True, metadata=array("stations", 3, one_row=True))
    ground_unit: str = field(default="ground unit", kw_only=True, metadata={"check": text})
    model_unit: str = field(default="model unit", kw_only=True, metadata={"check": text})

    def __post_init__(self) -> None:
        object.__setattr__(self, "ids", tuple(names("ids", self.ids)))
        check_arrays(self, stations=len(self.ids))
        check_fields(self)
        self._check()

    @classmethod
    def from_table(cls, table: pd.DataFrame, **units: str) -> Self:
        """Read a data frame with CSV columns: id, X, Y, Z, x, y, z, and sd_ of each.

        Parameters
        ----------
        table
            `id`, `X`, `Y`, `Z` (NaN if unknown), `x`, `y`, `z`; optionally `sd_X`, `sd_Y`, `sd_Z` (0 if
            missing) and `sd_x`, `sd_y`, `sd_z`.
        units
            `ground_unit`, `model_unit`.

        Raises
        ------
        InputError
            If a column is missing, only a part of `sd_x`, `sd_y`, `sd_z` exists, or the class raises it.
        """
        missing = [name for name in ("id", *CONTROL_COLUMNS, *MODEL_COLUMNS) if name not in table]
        if missing:
            raise InputError(phrase("orientation.missing-columns", names=missing))
        control_sd = [
            table[name].fillna(0.0) if name in table else 0.0 * table["x"] for name in CONTROL_SD_COLUMNS
        ]
        weighted = _weighted([*map(str, table)])
        return cls(
            table["id"],
            table[list(CONTROL_COLUMNS)],
            table[list(MODEL_COLUMNS)],
            control_sd=np.column_stack(control_sd) if len(table) else 0.0,
            model_sd=table[list(MODEL_SD_COLUMNS)] if weighted else None,
            **units,
        )

    @property
    def given(self) -> Bools:
        """(n, 3) True for known control coordinates."""
        return np.isfinite(self.control)

    @property
    def held(self) -> Bools:
        """(n, 3) True for known control coordinates with finite standard deviations."""
        return self.given & np.isfinite(self.control_sd)

    def _check(self) -> None:
        repeated = [name for name, count in Counter(self.ids).items() if count > 1]
        if repeated:
            raise InputError(phrase("orientation.repeated", station=repeated[0]))
        self._refuse(self.model, ~np.isfinite(self.model), "model-coordinate")
        self._refuse(self.control, np.isinf(self.control), "control-coordinate")
        sd = np.where(self.given, self.control_sd, 0.0)
        self._refuse(sd, ~(sd >= 0), "control-sd")
        if self.model_sd is not None:
            positive = (self.model_sd >= 0) & np.isfinite(self.model_sd)
            self._refuse(self.model_sd, ~positive, "model-sd")
            exact = self.held & (sd == 0) & (self.model_sd == 0).all(axis=1, keepdims=True)
            self._refuse(sd, exact, "exact")
        elif (sd[self.held] > 0).any():
            raise InputError(phrase("orientation.no-model-sd"))

    def _refuse(self, values: Floats, faulty: Bools, code: str) -> None:
        if faulty.any():
            row, column = np.argwhere(faulty)[0].tolist()
            fields = {"station": self.ids[row], "value": float(values[row, column])}
            raise InputError(phrase(f"orientation.{code}", **fields))


REQUIRED = ("id", *CONTROL_COLUMNS, *MODEL_COLUMNS)
OPTIONAL = (*CONTROL_SD_COLUMNS, *MODEL_SD_COLUMNS)
SPELLINGS = {f"{letter}{k + 1}": "xyz"[k] if letter == "x" else "XYZ"[k] for letter in "xX" for k in range(3)}
"""Names of the bulletin, X1, X2, X3, x1, x2, x3, mapped to X, Y, Z, x, y, z."""


def is_csv(path: Path) -> bool:
    """Whether the first line is a CSV header, not a record of numbers."""
    lines = enumerate(read_lines(path), 1)
    first = next(
        (Place(path, n, line) for n, line in lines if line.strip() and not line.startswith("#")), None
    )
    return first is not None and "x" in header(first)


def header(place: Place) -> list[str]:
    """Return the column names of a record, in the spelling X, Y, Z, x, y, z."""
    return [SPELLINGS.get(cell, cell) for cell in cells(place)]


def _weighted(columns: Collection[str]) -> bool:
    """Return whether there are the columns `sd_x`, `sd_y`, `sd_z`; InputError: if some are missing."""
    names = [name for name in MODEL_SD_COLUMNS if name in columns]
    if names and len(names) < 3:
        raise InputError(phrase("orientation.incomplete-sd", names=names))
    return bool(names)


def read_csv(path: Path, *, ground_unit: str = "ground unit", model_unit: str = "model unit") -> Stations:
    """Read stations from a CSV file with a header.

    Columns, in any order: `id`; `X`, `Y`, `Z` (empty if unknown); `x`, `y`, `z`. Optional columns are `sd_X`,
    `sd_Y`, `sd_Z` (empty: 0, exact; `inf`: not used) and `sd_x`, `sd_y`, `sd_z`. Empty lines and lines that
    begin with `#` are skipped.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing or unknown, or a field is not a number. The message
        contains file, record and text.
    """
    path = path_of("path", path)
    table = read_records(path, spelling=lambda names: [SPELLINGS.get(name, name) for name in names])
    allowed = (*REQUIRED, *OPTIONAL)
    table.require(*REQUIRED)
    if unknown := [name for name in table.columns if name not in allowed]:
        raise table.head.error(phrase("orientation.column", column=unknown[0], names=list(allowed)))
    ids = table.texts("id")
    if not ids:
        raise InputError(phrase("orientation.no-stations"), file=path)
    known: dict[str, int] = {}
    for row, name in enumerate(ids):
        if not name:
            raise table.error(row, phrase("orientation.no-id"))
        if known.setdefault(name, row) != row:
            raise table.error(row, phrase("orientation.repeated", station=name))
    with at_place(table.head):
        weighted = _weighted(table.columns)
    control, model = table.vectors(CONTROL_COLUMNS), table.given(MODEL_COLUMNS)
    control_sd = table.vectors(CONTROL_SD_COLUMNS, 0.0, infinite=True)
    model_sd = table.given(MODEL_SD_COLUMNS) if weighted else None
    units = {"ground_unit": ground_unit, "model_unit": model_unit}
    with at_place(Place(path)):
        return Stations(ids, control, model, control_sd=control_sd, model_sd=model_sd, **units)


MISSING = ("", "-")


@dataclass(frozen=True, eq=False)
class Deck:
    stations: Stations  # The station records
    former: Similarity | None  # The approximate parameters of the first record; None if its words are zeros
    identification: str  # The last word of the constants
    messages: list[Message] = field(default_factory=list)  # Warnings on the records


class _Record(Place):
    def words(self, least: int, most: int, what: str) -> list[str]:
        """Split into words; words between two commas may be empty."""
        text = self.text or ""
        split = text.split(",") if "," in text else text.split()
        words = [word.strip() for word in split]
        if not least <= len(words) <= most:
            counts = sorted({least, most})
            raise self.error(phrase("orientation.words", subject=what, counts=counts, value=len(words)))
        return words

    def number_of(self, word: str, what: str) -> float:
        """Read a number with the exponent letter D or E."""
        try:
            return finite_number(word.upper().replace("D", "E"))
        except ValueError:
            raise self.error(phrase("orientation.number", subject=what, value=word)) from None

    def count_of(self, word: str, what: str) -> int:
        try:
            return whole_number(word)
        except ValueError:
            raise self.error(phrase("orientation.count", subject=what, value=word)) from None


def read_cards(
    path: Path,
    *,
    zero_missing: bool = False,
    ground_unit: str = "ground unit",
    model_unit: str = "model unit",
) -> Deck:
    """Read the cards of part I: approximate parameters, constants, stations.

    Record 1: sin omega, sin phi, sin kappa, s, b1, b2, b3, identification; all zeros without approximation.
    Record 2: M, N, MN, identification. Then M records X1 X2 X3 x1 x2 x3 number.

    Parameters
    ----------
    path
        The file.
    zero_missing
        True if a control coordinate of zero means a missing one, as in the bulletin.
    ground_unit, model_unit
        Names of the units.

    Raises
    ------
    InputError
        If the file cannot be read, a record has other words, or the counts M, N, MN differ from the stations.
        The message contains file, record and text.
    """
    truth_value("zero_missing", zero_missing)
    path = path_of("path", path)
    records = _records(path)
    if len(records) < 2:
        raise InputError(phrase("orientation.deck", count=len(records)), file=path)
    constants = records[1].words(3, 4, "constants M, N, MN and identification")
    m, n, mn = (records[1].count_of(w, name) for w, name in zip(constants, ("M", "N", "MN"), strict=False))
    if len(records) - 2 != m:
        raise records[1].error(phrase("orientation.m", m=m, n=len(records) - 2))
    stations = _stations(path, records[2:], zero_missing, ground_unit=ground_unit, model_unit=model_unit)
    pairs, elevations = int(stations.given[:, :2].all(axis=1).sum()), int(stations.given[:, 2].sum())
    if (elevations, pairs) != (n, mn):
        raise records[1].error(phrase("orientation.counts", n=n, mn=mn, elevations=elevations, pairs=pairs))
    messages: list[Message] = []
    former = _former(records[0], stations, messages)
    identification = constants[3] if len(constants) > 3 else ""
    return Deck(stations, former, identification, messages)


def _records(path: Path) -> list[_Record]:
    lines = enumerate(read_lines(path), 1)
    return [_Record(path, number, text) for number, text in lines if text.strip()]


def _stations(path: Path, records: list[_Record], zero_missing: bool, **units: str) -> Stations:
    control, model = [], []
    ids: dict[str, None] = {}
    for record in records:
        words = record.words(7, 7, "station X1 X2 X3 x1 x2 x3 number")
        row = [
            math.nan if word in MISSING else record.number_of(word, f"X{k}")
            for k, word in enumerate(words[:3], 1)
        ]
        control.append([math.nan if zero_missing and value == 0 else value for value in row])
        model.append([record.number_of(word, f"x{k}") for k, word in enumerate(words[3:6], 1)])
        if words[6] in ids:
            raise record.error(phrase("orientation.repeated", station=words[6]))
        ids[words[6]] = None
    with at_place(Place(path)):
        return Stations(ids, np.reshape(control, (-1, 3)), np.reshape(model, (-1, 3)), **units)


def read_restart(path: Path, stations: Stations, messages: list[Message]) -> Similarity | None:
    """Read a restart record (TB 19, step 12): eight words for a new solution."""
    records = _records(path)
    if len(records) != 1:
        raise InputError(phrase("orientation.restart", count=len(records)), file=path)
    return _former(records[0], stations, messages)


def _former(record: _Record, stations: Stations, messages: list[Message]) -> Similarity | None:
    """Read the parameters of a previous result; None if all are zero."""
    words = record.words(7, 8, "parameters sin omega, sin phi, sin kappa, s, b1, b2, b3, identification")
    values = np.array([record.number_of(word, "parameter") for word in words[:7]])
    if not values.any():
        return None
    if (largest := max(values[:3], key=abs)) ** 2 > 1:
        raise record.error(phrase("orientation.sine", value=float(largest)))
    if values[3] <= 0:
        raise record.error(phrase("error.at", what="s", message=phrase("error.positive", value=values[3])))
    angles = np.arcsin(values[:3])
    kappa = _kappa(stations)
    if kappa is None:
        messages.append(record.message(phrase("orientation.kappa")))
    elif math.cos(kappa) < 0:
        angles[2] = math.pi - angles[2]
    return Similarity.from_parameters(values[3], rotation_matrix(angles[np.newaxis])[0], values[4:])


def _kappa(stations: Stations) -> float | None:
    """Return kappa = theta_X - theta_x of two stations; None without plan."""
    if len(stations.ids) < 2 or not stations.given[:2, :2].all():
        return None
    ground, model = (array[1, :2] - array[0, :2] for array in (stations.control, stations.model))
    return math.atan2(ground[1] * model[0] - ground[0] * model[1], float(ground @ model))


def restart_record(similarity: Similarity, identification: str) -> str:
    """Return record 1 of part I for a new solution: sines, s, B, identification."""
    values = [*np.sin(similarity.angles), similarity.scale, *similarity.translation]
    return _record(values, identification)


def transformation_records(similarity: Similarity, identification: str) -> list[str]:
    """Return the two records of part II: a11 ... a23, then a31 a32 a33 s b1 b2 b3."""
    a = similarity.rotation.ravel()
    last = [*a[6:], similarity.scale, *similarity.translation]
    return [_record(a[:6], identification), _record(last, identification)]


def _record(values: list[float] | Floats, identification: str) -> str:
    if len(identification.replace(",", " ").split()) > 1:
        raise InputError(phrase("orientation.identification", value=identification))
    return " ".join([*(f"{value:.17g}" for value in values), identification or "0"])


def read_transformation(path: Path) -> Similarity:
    """Read the two records of part II; their covariance is unknown."""
    records = _records(path)
    if len(records) < 2:
        raise InputError(phrase("orientation.transformation", count=len(records)), file=path)
    first = records[0].words(6, 7, "a11 a12 a13 a21 a22 a23, identification")
    second = records[1].words(7, 8, "a31 a32 a33 s b1 b2 b3, identification")
    values = [
        *(records[0].number_of(word, "direction cosine") for word in first[:6]),
        *(records[1].number_of(word, "parameter") for word in second[:7]),
    ]
    with at_place(Place(path)):
        return Similarity.from_parameters(values[9], np.reshape(values[:9], (3, 3)), values[10:])
