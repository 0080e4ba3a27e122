"""Measurement files: card decks or plain tables.

Tables have the columns case, point, x_um, y_um and optionally plate, leg, operator. A deck (NOAA TR NOS 57,
section II) consists of a header card, data cards in the order measured, and one blank card. Decks follow each
other. A header with comparator number 0 (a blank card) ends the job. Blanks in numbers count as zeros, as on
the CDC 6600.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.objects import path_of, require
from photogram.comparator.grid import (
    BUILT_IN,
    Grid,
    Keys,
    Table,
    built_in_grid,
    find_grid,
    read_table,
    settings_lines,
    switch,
    text_of,
)
from photogram.comparator.readings import LARGEST_UM, Reading, Session, collect_cases
from photogram.errors import InputError
from photogram.io.numbers import is_whole_number
from photogram.io.places import Failing, Place, at_place
from photogram.io.records import Record, Source
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.words import Phrase, phrase

SPECIAL_GRID, MAX_COMPARATOR = 3, 15
CASES = 20  # operators in a header
MAX_LEG = 4


@dataclass(frozen=True)
class _Format:
    """Columns (first, last) of a data card; x and y are Fw.d in metres (`decimals`)."""

    plate_case: tuple[int, int]
    leg: int
    point: tuple[int, int]
    x: tuple[int, int]
    y: tuple[int, int]
    decimals: int
    plate: tuple[int, int] | None = None


# Formats 122 and 143, with an additional centre of the range (TRANS, F9.6)
STANDARD = _Format((3, 7), 8, (9, 10), (12, 21), (22, 31), 8)
TRANS = (61, 69)
TRANS_ON_CARDS = 15  # The comparator whose cards contain it
SECONDARY = _Format((3, 7), 8, (9, 10), (32, 41), (42, 51), 8)  # Format 146: right stage of the STK1
PSK_LEFT = _Format((2, 3), 4, (5, 6), (20, 25), (30, 35), 6, plate=(8, 10))  # Format 123
PSK_RIGHT = _Format((6, 7), 8, (9, 10), (40, 45), (50, 55), 6, plate=(2, 5))  # Format 124
# Subroutine MICRON: separate unit digits in columns 3 and 4
LEAST_COUNT = _Format((5, 7), 8, (9, 10), (11, 19), (20, 29), 6)


def _integer(record: Record, first: int, last: int) -> int:
    """Read an Iw field with blanks as zeros."""
    digits = record.columns(first, last).ljust(last - first + 1).lstrip(" ").replace(" ", "0")
    if digits and not (digits.isascii() and digits.isdigit()):
        raise _refusal(record, first, last, phrase("error.whole", value=record.columns(first, last)))
    return int(digits or 0)


def _refusal(record: Record, first: int, last: int, message: Phrase) -> InputError:
    return record.error(phrase("error.columns", first=first, last=last, message=message))


def _micrometres(record: Record, columns: tuple[int, int], decimals: int) -> float:
    """Read an Fw.d field in metres, blanks as zeros, as micrometres."""
    first, last = columns
    text = record.columns(first, last).ljust(last - first + 1).lstrip(" ")
    sign, digits = (-1, text[1:]) if text.startswith("-") else (1, text.removeprefix("+"))
    whole, point, fraction = digits.partition(".")
    figures = (whole + fraction).replace(" ", "0")
    if figures and not (figures.isascii() and figures.isdigit()):
        raise _refusal(record, first, last, phrase("error.number", value=record.columns(first, last)))
    places = len(fraction) if point else decimals
    return sign * int(figures or 0) * 1e6 / float(10**places)


def join_least_count(coarse: int, unit: int) -> int:
    """Join a coarse reading and its separate unit digit (subroutine MICRON)."""
    tens, digit = divmod(coarse, 10)
    if abs(digit - unit) <= 5:
        return 10 * tens + unit
    return 10 * tens + unit + (10 if unit < digit else -10)


def _plate_case(record: Record, columns: tuple[int, int]) -> tuple[int, int]:
    """Split KASE, 100 x plate + case."""
    text = record.columns(*columns)
    digits = text.strip(" ")
    if len(digits) == 5 and digits.endswith("0"):
        digits = digits[:-1]
    if not (digits.isascii() and digits.isdigit()):
        raise _refusal(record, *columns, phrase("comparators.plate-case", value=text))
    return int(digits[:-2] or 0), int(digits[-2:])


def check_number(place: Failing, what: str, number: int, low: int, high: int) -> None:
    with at_place(place):
        require(low <= number <= high, what, "range", value=number, low=low, high=high)


class _Deck:
    """A header card, FORMAT (5I1,I2,A1,1X,20I3,2X,A8,I1), and the cards after it."""

    def __init__(self, cards: Iterator[Record], first: Record) -> None:
        flags = [_integer(first, column, column) != 0 for column in range(1, 6)]
        self.cards, self.first, self.skips_card = cards, first, flags[3]
        self.header = Session(
            cases=(),
            grids={},
            comparator=_integer(first, 6, 7),  # 0 ends the job
            secondary=first.columns(8, 8) == "R",  # The right stage of a stereocomparator
            date=first.columns(72, 79).strip(" "),
            left_handed=flags[0],
            sorted_input=flags[1],
            least_count_one_micrometre=not flags[2],  # Comparator 11 may have separate unit digits
            plot_each_case=flags[4],  # As in the text (the listing reverses it)
            source=first.source.path,
        )
        # Operator of each case, 0 if none
        self.operators = [_integer(first, 10 + 3 * case, 12 + 3 * case) for case in range(CASES)]
        self.master = _integer(first, 80, 80)  # 0 grid 773, 1 grid 1320, 2 grid 778, 3 special grid follows
        for columns, value, high in (
            ((6, 7), self.header.comparator, MAX_COMPARATOR),
            ((80, 80), self.master, SPECIAL_GRID),
        ):
            if value > high:
                raise _refusal(first, *columns, phrase("error.most", high=high, value=value))
        self.centre_um: float | None = None
        self.grids: dict[int, Grid] = {}

    def _special_grid(self) -> Grid:
        points, xy = [], []
        for card in self.cards:
            points.append(_integer(card, *STANDARD.point))
            xy.append([_micrometres(card, columns, 8) for columns in (STANDARD.x, STANDARD.y)])
            if not card.blank(80, 80):
                number = 1000 * self.operators[18] + self.operators[19]
                return Grid(number, np.array(points), np.array(xy))
        raise self.first.error(phrase("comparators.grid-end"))

    def session(self, grids: Iterable[Grid]) -> Session:
        messages, readings, number = list[Message](), list[Reading](), self.header.comparator
        if self.master == SPECIAL_GRID:
            master = self._special_grid()
            messages.append(self.first.message(phrase("comparators.special-grid", plate=master.number)))
        else:
            master = built_in_grid(BUILT_IN[self.master])
        self.grids = {grid.number: grid for grid in [*grids] or [master]}
        if self.skips_card:
            next(self.cards, None)
        layout = {12: PSK_LEFT, 13: PSK_RIGHT}.get(number, STANDARD)
        if number == 11 and not self.header.least_count_one_micrometre:
            layout = LEAST_COUNT
        layout = SECONDARY if self.header.secondary else layout
        for card in self.cards:
            if card.blank(1, 80):
                break
            reading = self._reading(card, layout)
            if reading.xy_um == (0.0, 0.0):
                messages.append(card.message(phrase("comparators.zero-readings", point=reading.point)))
            else:
                readings.append(reading)
        session = replace(
            self.header,
            cases=collect_cases(readings),
            grids=self.grids,
            range_centre_um=self.centre_um,
            messages=messages,
        )
        if not session.cases:
            raise self.first.error(phrase("comparators.empty-deck"))
        session.check()
        return session

    def _reading(self, card: Record, layout: _Format) -> Reading:
        if self.header.comparator == TRANS_ON_CARDS and not card.blank(*TRANS):
            self.centre_um = _micrometres(card, TRANS, 6)
        plate, case = _plate_case(card, layout.plate_case)
        if layout.plate is not None:
            plate = _integer(card, *layout.plate)
        check_number(card, "case", case, 1, CASES)
        leg = _integer(card, layout.leg, layout.leg)
        check_number(card, "leg", leg, 0, MAX_LEG)
        xy = [_micrometres(card, columns, layout.decimals) for columns in (layout.x, layout.y)]
        if layout is LEAST_COUNT:
            xy = [float(join_least_count(round(xy[k]), _integer(card, 3 + k, 3 + k))) for k in range(2)]
        return Reading(
            plate=self._plate(card, plate),
            case=case,
            operator=self.operators[case - 1],
            leg=leg,
            point=_integer(card, *layout.point),
            xy_um=(xy[0], xy[1]),
            place=card.place,
        )

    def _plate(self, card: Record, digits: int) -> int:
        """Return the plate number that ends with given digits; blank: the only plate."""
        if digits == 0 and len(self.grids) == 1:
            return next(iter(self.grids))
        plates = [number for number in self.grids if digits in (number, number % 100)]
        if len(plates) != 1:
            fields = {"kind": "plate", "name": f"{digits:02d}", "names": [*map(str, self.grids)]}
            raise card.error(phrase("error.unknown", **fields))
        return plates[0]


def read_cards(path: Path, grids: Iterable[Grid] = (), *, left_handed: bool | None = None) -> list[Session]:
    """Read the decks of a file.

    Parameters
    ----------
    path
        File with 80 columns per record.
    grids
        Plates that replace the one in the header.
    left_handed
        Whether the comparator is left-handed relative to the plate. It overrides the headers.

    Raises
    ------
    InputError
        If the file or a card cannot be read. The message names the record.
    """
    path, plates = path_of("path", path), list(grids)
    source = Source.read(path)
    cards = (source.record(number) for number in range(1, len(source.lines) + 1))
    sessions = []
    for first in cards:
        deck = _Deck(cards, first)
        if deck.header.comparator == 0:
            break
        session = deck.session(plates)
        sessions.append(session if left_handed is None else replace(session, left_handed=left_handed))
    if not sessions:
        raise InputError(phrase("comparators.no-deck"), file=path)
    return sessions


def to_cards(session: Session) -> bytes:
    """Return a session as a deck in the standard format 122, ending with a blank card.

    Raises
    ------
    InputError
        If the session does not use exactly one of the three master grids, or exceeds the columns.
    """
    number = next(iter(session.grids))
    if len(session.grids) != 1 or number not in BUILT_IN:
        raise InputError(phrase("comparators.deck-grid", names=[*session.grids]))
    operators = {case.number: case.operator for case in session.cases}
    for case_number in operators:
        check_number(Place(), "case", case_number, 1, CASES)
    least_count = not session.least_count_one_micrometre
    options = session.left_handed, session.sorted_input, least_count, False, session.plot_each_case
    flags = "".join(str(int(bool(option))) for option in options)
    named = "".join(f"{operators.get(case, 0):3d}" for case in range(1, CASES + 1))
    stage = "R" if session.secondary else " "
    lines = [f"{flags}{session.comparator:2d}{stage} {named}  {session.date:8.8}{BUILT_IN.index(number)}"]
    for case in session.cases:
        kase = 100 * (number % 100) + case.number
        rows = zip(case.legs.tolist(), case.points.tolist(), case.xy_um.tolist(), strict=True)
        lines += [
            f"  {kase:5d}{leg:1d}{point:2d} {round(x * 100):10d}{round(y * 100):10d}"
            for leg, point, (x, y) in rows
        ]
    return ("\n".join([*lines, ""]) + "\n").encode()


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
    if wrong := np.flatnonzero(columns["leg"] > MAX_LEG).tolist():
        check_number(rows.place(wrong[0]), "leg", int(columns["leg"][wrong[0]]), 0, MAX_LEG)
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
