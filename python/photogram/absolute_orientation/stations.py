"""Stations of models and control, and their CSV files (`docs/absolute-orientation.md`)."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from photogram.arguments.arrays import names, text
from photogram.arguments.fields import array, check_arrays, check_fields
from photogram.arguments.objects import path_of
from photogram.arguments.types import NONE, ZERO, Array, Bools, Floats, Identifiers, OptionalArray
from photogram.errors import InputError
from photogram.io.delimited import cells, read_records
from photogram.io.files import read_lines
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import converting_dataclass, field
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
            If a column is missing, or the class raises it.
        """
        missing = [name for name in ("id", *CONTROL_COLUMNS, *MODEL_COLUMNS) if name not in table]
        if missing:
            raise InputError(phrase("orientation.missing-columns", names=missing))
        control_sd = [
            table[name].fillna(0.0) if name in table else 0.0 * table["x"] for name in CONTROL_SD_COLUMNS
        ]
        weighted = all(name in table for name in MODEL_SD_COLUMNS)
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
        for row, column in np.argwhere(faulty).tolist():
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
    return [spelling(cell) for cell in cells(place)]


def spelling(name: str) -> str:
    return SPELLINGS.get(name, name)


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
    table = read_records(path, spelling=lambda names: [spelling(name) for name in names])
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
    weighted = [name for name in MODEL_SD_COLUMNS if name in table.columns]
    if weighted and len(weighted) < 3:
        raise InputError(phrase("orientation.incomplete-sd", names=weighted), file=path)

    control, model = table.vectors(CONTROL_COLUMNS), table.given(MODEL_COLUMNS)
    control_sd = table.vectors(CONTROL_SD_COLUMNS, 0.0, infinite=True)
    model_sd = table.given(MODEL_SD_COLUMNS) if weighted else None
    with at_place(Place(path)):
        return Stations(
            ids,
            control,
            model,
            control_sd=control_sd,
            model_sd=model_sd,
            ground_unit=ground_unit,
            model_unit=model_unit,
        )
