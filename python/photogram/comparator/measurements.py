"""Measurement files: card decks or plain tables.

Tables have the columns case, point, x_um, y_um and optionally plate, leg, operator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

from photogram.arguments.objects import path_of, require
from photogram.comparator.cards import MAX_LEG, check_number, read_cards
from photogram.comparator.csvfile import Setting, Table, read_table
from photogram.comparator.grid import Grid, find_grid
from photogram.comparator.readings import LARGEST_UM, Reading, Session, collect_cases
from photogram.errors import InputError
from photogram.io.column_table import TableRow
from photogram.io.numbers import is_whole_number
from photogram.io.places import at_place
from photogram.words import phrase

T = TypeVar("T")

# Settings above the table
KEYS = ("grid", "comparator", "date", "left_handed", "range_centre_um", "temperature_c")


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
    cases = collect_cases(
        _reading(row, xy, only_plate)
        for table in tables
        for row in table.records.rows
        if (xy := table.coordinates_um(row)) is not None
    )
    session = Session(
        cases=cases,
        grids=plates,
        comparator=_one(tables, "comparator", Setting.integer) or 0,
        date=next((table.text("date") for table in tables if table.text("date")), ""),
        left_handed=left_handed if left_handed is not None else _one(tables, "left_handed", Setting.switch),
        range_centre_um=_one(tables, "range_centre_um", _range_centre_um),
        temperature_c=_one(tables, "temperature_c", Setting.number),
        source=paths[0],
    )
    session.check()
    return session


def _one(tables: Sequence[Table], key: str, value_of: Callable[[Setting], T]) -> T | None:
    """Return a setting of the tables of a calibration, None if it is missing."""
    settings = [table.settings[key] for table in tables if key in table.settings]
    values = [value_of(setting) for setting in settings]
    for setting, value in zip(settings, values, strict=True):
        if value != values[0]:
            fields = {"key": key, "value": setting.text, "other": settings[0].text}
            raise setting.place.error(phrase("comparators.contradiction", **fields))
    return values[0] if values else None


def _range_centre_um(setting: Setting) -> float:
    value = setting.number()
    with at_place(setting.place):
        require(abs(value) <= LARGEST_UM, setting.key, "most", value=value, high=LARGEST_UM)
    return value


def _named_grids(table: Table) -> list[Grid]:
    """Return the plates named in a table: built in, or files in its folder."""
    names = [name.strip() for name in table.text("grid").split(",") if name.strip()]
    folder = table.records.path.parent
    return [find_grid(name if is_whole_number(name) else str(folder / name)) for name in names]


def _reading(row: TableRow, xy_um: tuple[float, float], only_plate: int) -> Reading:
    leg = row.integer("leg", 0)
    check_number(row.place, "leg", leg, 0, MAX_LEG)
    return Reading(
        plate=row.integer("plate", only_plate),
        case=row.integer("case"),
        operator=row.integer("operator", 0),
        leg=leg,
        point=row.integer("point"),
        xy_um=xy_um,
        place=row.place,
    )


def to_csv(session: Session) -> bytes:
    """Return the measurements in micrometres as a table for :func:`read_csv`."""
    lines = [f"# comparator = {session.comparator}"]
    lines += [f"# grid = {', '.join(str(number) for number in session.grids)}"]
    lines += [f"# date = {session.date}"] if session.date else []
    if session.range_centre_um is not None:
        lines.append(f"# range_centre_um = {session.range_centre_um:g}")
    if session.temperature_c is not None:
        lines.append(f"# temperature_c = {session.temperature_c:g}")
    if session.left_handed is not None:
        lines.append(f"# left_handed = {'yes' if session.left_handed else 'no'}")
    lines.append("plate,case,operator,leg,point,x_um,y_um")
    for case in session.cases:
        rows = zip(case.legs.tolist(), case.points.tolist(), case.xy_um.tolist(), strict=True)
        head = f"{case.plate},{case.number},{case.operator}"
        lines += [f"{head},{leg},{point},{x:.3f},{y:.3f}" for leg, point, (x, y) in rows]
    return ("\n".join(lines) + "\n").encode()
