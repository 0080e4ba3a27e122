"""Stations as CSV files; `docs/absolute-orientation.md` describes the columns."""

from __future__ import annotations

from pathlib import Path

from photogram.absolute_orientation.stations import (
    CONTROL_COLUMNS,
    CONTROL_SD_COLUMNS,
    MODEL_COLUMNS,
    MODEL_SD_COLUMNS,
    Stations,
)
from photogram.arguments.objects import path_of
from photogram.errors import InputError
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import cells, read_records
from photogram.io.files import read_lines
from photogram.io.places import Place, at_place
from photogram.words import phrase

__all__ = ["header", "is_csv", "read_csv", "spelling"]

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
    """Return the standard name of a column."""
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
    _check_header(table)
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


def _check_header(table: ColumnTable) -> None:
    allowed = (*REQUIRED, *OPTIONAL)
    table.require(*REQUIRED)
    if unknown := [name for name in table.columns if name not in allowed]:
        raise table.head.error(phrase("orientation.column", column=unknown[0], names=list(allowed)))
