"""Measurement files: card decks or plain tables.

Tables have the columns case, point, x_um, y_um and optionally plate, leg, operator.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.objects import path_of, require
from photogram.comparator.cards import MAX_LEG, check_number, read_cards
from photogram.comparator.csvfile import Keys, Table, read_table, settings_lines, switch, text_of
from photogram.comparator.grid import Grid, find_grid
from photogram.comparator.readings import LARGEST_UM, Reading, Session, collect_cases
from photogram.errors import InputError
from photogram.io.numbers import is_whole_number
from photogram.io.places import Place, at_place
from photogram.words import phrase


def _centre(place: Place, text: str, key: str) -> float:
    value = place.number(text, key)
    with at_place(place):
        require(abs(value) <= LARGEST_UM, key, "most", value=value, high=LARGEST_UM)
    return value


# Settings above the table
KEYS: Keys = {
    "grid": text_of,
    "comparator": Place.whole,
    "date": text_of,
    "left_handed": switch,
    "range_centre_um": _centre,
    "temperature_c": Place.number,
}


def read(
    paths: Sequence[Path | str], grids: Iterable[Grid] = (), *, left_handed: bool | None = None
) -> list[Session]:
    """Read measurements: files named *.csv are tables, all others are card decks.

    Parameters
    ----------
    paths
        Tables of one calibration, or card decks with one calibration each.
    grids
        Plates that replace the ones in the files.
    left_handed
        Whether the comparator is left-handed relative to the plate. It overrides the files.

    Raises
    ------
    InputError
        If a file cannot be read, if tables and decks are mixed, or if no file is given.
    """
    files = [path_of("paths", path) for path in paths]
    if not files:
        raise InputError(phrase("comparators.files"))
    tables = [path for path in files if path.suffix.lower() == ".csv"]
    plates = list(grids)
    if not tables:
        return [session for path in files for session in read_cards(path, plates, left_handed=left_handed)]
    if len(tables) < len(files):
        raise InputError(phrase("comparators.mixed-files"), file=tables[0])
    return [read_csv(tables, plates, left_handed=left_handed)]


def read_csv(
    paths: Sequence[Path], grids: Iterable[Grid] = (), *, left_handed: bool | None = None
) -> Session:
    """Read the tables of one calibration.

    Required columns are `case`, `point` and `x_um`, `y_um` (or `x_mm`, `y_mm`). Optional columns are `plate`
    (grid number), `leg` (1 to 4; 0 or blank: intersection) and `operator`. Rows are in the order measured;
    rows with blank coordinates are missing readings.

    Settings above the table are:

    * `# grid = 1320`: a built-in grid, or a file in the same folder
    * `# comparator = 3`, `# date = 7/17/72`, `# left_handed = yes`
    * `# range_centre_um = 125000`: centre of the comparator range
    * `# temperature_c = 21.7`: plate temperature during the measurement
    * `# note = ...`: a comment

    Parameters
    ----------
    paths
        Table files.
    grids
        Plates that replace the ones in the tables.
    left_handed
        Whether the comparator is left-handed relative to the plate. It overrides the tables.

    Raises
    ------
    InputError
        If a file is not such a table, if a plate is missing, if a case is repeated, or if a key is unknown.
        If settings of tables differ.
    """
    if not paths:
        raise InputError(phrase("comparators.files"))
    tables = [read_table(path_of("paths", path), "case", "point", keys=KEYS) for path in paths]
    plates = {grid.number: grid for grid in grids}
    if not plates:
        plates = {grid.number: grid for table in tables for grid in _named_grids(table)}
    if not plates:
        raise InputError(phrase("comparators.no-grid"), file=paths[0])
    only_plate = next(iter(plates)) if len(plates) == 1 else 0
    cases = collect_cases(reading for table in tables for reading in _readings(table, only_plate))
    settings = _settings(tables, {} if left_handed is None else {"left_handed": left_handed})
    session = Session(cases=cases, grids=plates, source=paths[0], **settings)
    session.check()
    return session


def _settings(tables: Sequence[Table], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return given settings and others of the tables of a calibration; reject contradictions."""
    settings = dict(given)
    for table in tables:
        for key, value in table.settings.items():
            if key in ("grid", *given) or (key == "date" and (not value or key in settings)):
                continue
            if settings.setdefault(key, value) != value:
                fields = {"key": key, "value": str(value), "other": str(settings[key])}
                raise table.places[key].error(phrase("comparators.contradiction", **fields))
    return settings


def _named_grids(table: Table) -> list[Grid]:
    """Return the plates named in a table: built in, or files in its folder."""
    names = [name.strip() for name in table.settings.get("grid", "").split(",") if name.strip()]
    folder = table.records.path.parent
    return [find_grid(name if is_whole_number(name) else str(folder / name)) for name in names]


def _readings(table: Table, only_plate: int) -> Iterator[Reading]:
    rows, xy_um = table.measured()
    defaults = {"plate": only_plate, "case": None, "operator": 0, "leg": 0, "point": None}
    columns = {name: rows.wholes(name, default) for name, default in defaults.items()}
    for row in np.flatnonzero(columns["leg"] > MAX_LEG)[:1].tolist():
        check_number(rows.place(row), "leg", int(columns["leg"][row]), 0, MAX_LEG)
    for row, (x, y) in enumerate(xy_um.tolist()):
        numbers = {name: int(column[row]) for name, column in columns.items()}
        yield Reading(xy_um=(x, y), place=rows.place(row), **numbers)


def to_csv(session: Session) -> bytes:
    """Return the measurements in micrometres as a table for :func:`read_csv`."""
    names = ("comparator", "grid", "date", "range_centre_um", "temperature_c", "left_handed")
    settings = {name: getattr(session, name, ", ".join(map(str, session.grids))) for name in names}
    lines = [f"# {line}" for line in settings_lines(settings)]
    lines.append("plate,case,operator,leg,point,x_um,y_um")
    for case in session.cases:
        rows = zip(case.legs.tolist(), case.points.tolist(), case.xy_um.tolist(), strict=True)
        head = f"{case.plate},{case.number},{case.operator}"
        lines += [f"{head},{leg},{point},{x:.3f},{y:.3f}" for leg, point, (x, y) in rows]
    return ("\n".join(lines) + "\n").encode()
