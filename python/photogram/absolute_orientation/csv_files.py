"""Stations as CSV files; `docs/absolute-orientation.md` describes the columns."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from photogram.absolute_orientation.stations import (
    CONTROL_COLUMNS,
    CONTROL_SD_COLUMNS,
    MODEL_COLUMNS,
    MODEL_SD_COLUMNS,
    Stations,
)
from photogram.errors import InputError
from photogram.files import read_lines

__all__ = ["is_csv", "read_csv"]

REQUIRED = ("id", *CONTROL_COLUMNS, *MODEL_COLUMNS)
OPTIONAL = (*CONTROL_SD_COLUMNS, *MODEL_SD_COLUMNS)
SPELLINGS = {f"{letter}{k + 1}": "xyz"[k] if letter == "x" else "XYZ"[k] for letter in "xX" for k in range(3)}
"""X1, X2, X3, x1, x2, x3 of the bulletin for X, Y, Z, x, y, z."""

Rows = list[tuple[int, dict[str, str]]]


def is_csv(path: Path) -> bool:
    """Whether the first line that says anything is the header of a CSV file and not a record of numbers."""
    first = next((line for line in read_lines(path) if line.strip() and not line.startswith("#")), "")
    return "x" in header(first.split(","))


def header(cells: list[str]) -> list[str]:
    """Return the names of columns, in the spelling X, Y, Z, x, y, z."""
    names = [cell.strip().strip('"') for cell in cells]
    return [SPELLINGS.get(name, name) for name in names]


def read_csv(path: Path, *, ground_unit: str = "ground unit", model_unit: str = "model unit") -> Stations:
    """Read stations from a CSV file with a header.

    Columns, in any order: `id`; `X`, `Y`, `Z` (empty where unknown); `x`, `y`, `z`; if there are any `sd_X`,
    `sd_Y`, `sd_Z` (empty: 0, exact; `inf`: takes no part) and `sd_x`, `sd_y`, `sd_z`. Empty lines and lines
    that begin with `#` are skipped.

    Raises
    ------
    InputError
        The file cannot be read, a column is missing or unknown, a field is no number; names file, record and
        text.
    """
    lines = read_lines(path)
    names, rows = _rows(path, lines)
    weighted = [name for name in MODEL_SD_COLUMNS if name in names]
    if weighted and len(weighted) < 3:
        raise InputError(f"has {', '.join(weighted)} only; sd_x, sd_y and sd_z come together", file=path)

    def table(columns: tuple[str, ...], empty: float | None) -> list[list[float]]:
        return [
            [_number(path, number, lines, row.get(name, ""), name, empty) for name in columns]
            for number, row in rows
        ]

    known: dict[str, int] = {}
    for number, row in rows:
        if known.setdefault(row["id"], number) != number:
            text = f"station {row['id']} occurs in record {known[row['id']]} already"
            raise InputError(text, file=path, record=number, text=lines[number - 1])
    control, model = table(CONTROL_COLUMNS, np.nan), table(MODEL_COLUMNS, None)
    control_sd = table(CONTROL_SD_COLUMNS, 0.0)
    model_sd = table(MODEL_SD_COLUMNS, None) if weighted else None
    try:
        return Stations(
            [row["id"] for _, row in rows],
            control,
            model,
            control_sd=control_sd,
            model_sd=model_sd,
            ground_unit=ground_unit,
            model_unit=model_unit,
        )
    except InputError as error:
        raise InputError(error.message, file=path) from None


def _rows(path: Path, lines: list[str]) -> tuple[list[str], Rows]:
    """Read the header and the rows with their record numbers."""
    names: list[str] = []
    rows: Rows = []
    for number, line in enumerate(lines, 1):
        if not line.strip(" ,") or line.startswith("#"):
            continue
        cells = [cell.strip() for cell in next(csv.reader([line]))]
        if not names:
            names = header(cells)
            _check_header(path, names, number, line)
            continue
        if len(cells) != len(names):
            text = f"has {len(cells)} fields, but the header has {len(names)}"
            raise InputError(text, file=path, record=number, text=line)
        rows.append((number, dict(zip(names, cells, strict=True))))
        if not rows[-1][1]["id"]:
            raise InputError("the id is empty", file=path, record=number, text=line)
    if not rows:
        raise InputError("holds no stations", file=path)
    return names, rows


def _check_header(path: Path, names: list[str], number: int, line: str) -> None:
    missing = [name for name in REQUIRED if name not in names]
    unknown = [name for name in names if name not in (*REQUIRED, *OPTIONAL)]
    repeated = [name for name in names if names.count(name) > 1]
    for faulty, what in ((missing, "lacks"), (unknown, "does not know"), (repeated, "repeats")):
        if faulty:
            text = (
                f"the header {what} the column {faulty[0]!r} (columns: {', '.join((*REQUIRED, *OPTIONAL))})"
            )
            raise InputError(text, file=path, record=number, text=line)


def _number(path: Path, number: int, lines: list[str], text: str, column: str, empty: float | None) -> float:
    """Read a number; NaN is refused, and so is infinity but for a standard deviation of control."""
    if not text and empty is not None:
        return empty
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if np.isnan(value) or (np.isinf(value) and column not in CONTROL_SD_COLUMNS):
        what = f"{text!r} is not a number" if text else "is empty"
        raise InputError(f"column {column}: {what}", file=path, record=number, text=lines[number - 1])
    return value
