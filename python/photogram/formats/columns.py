"""Standardised headings and roles for tables of points from other sources."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from types import MappingProxyType

import numpy as np

from photogram.errors import InputError
from photogram.formats.column_words import (
    ANGULAR,
    KINDS_OF_UNITS,
    ROLE,
    WORDS,
    bare_name,
    column_of,
    coverage_of,
    is_angular,
    is_photo,
    role_of,
    units_of,
    words_of,
)
from photogram.io.column_table import FALSE, TRUE, ColumnTable
from photogram.io.delimited import NAMELESS
from photogram.io.numbers import finite_number, scaled
from photogram.io.places import Place, one_word
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message
from photogram.words import Phrase, phrase, quoted

ROLES = ("control", "check", "off")
OURS = (
    *("point", "photo", "x", "y", "z", "sd", "sd_x", "sd_y", "sd_z"),
    *("cov_xy", "cov_xz", "cov_yz", "use", "time", "group"),
)
"""Columns that a user may assign."""
STRICT = ("control", "gnss")  # Tables in which every number must be read
SHORT = {"p": "point", "n": "y", "e": "x", "z": "z", "d": "d", "x": "x", "y": "y", "h": "z"}
"""Letters for the order of columns, as in PNEZD."""
_PLAIN_ROLES = frozenset({"use", "used", "usage", "role", "rolle", "verwendung", "ruolo", "papel", "uso"})
"""Headings used for roles only; a type or a status may describe something else."""
_FLAGS = {"check": "check", "enabled": "enabled"}
_WITH_NOTES = ("x", "y", "z", "sd", "sd_x", "sd_y", "sd_z", "sd_xy")
"""Columns whose headings may have other words than units in brackets: X (UTM32)."""
Units = Mapping[str, tuple[str, float]]
"""Type of unit of each column, a key of `KINDS_OF_UNITS` or empty, and the size of the internal unit."""
_MARKED = frozenset({"x", "xx", "ja", "oui", "si", "sim"})
_DMS = re.compile(
    r"([NSEW]?)\s*([+-]?)(\d+(?:[.,]\d*)?)"
    r"(?:[\s:°ºd-]+(\d+(?:[.,]\d*)?)(?:[\s:'′’m-]+(\d+(?:[.,]\d*)?))?)?[\s\"″”s'′’°m]*([NSEW]?)"
)


def degrees(text: str, other: str = "") -> float:
    """Return degrees from spellings such as `47 22 12.3` or `8°32'24.5" W`; reject `other` letters."""
    if any(letter in text for letter in other):
        raise ValueError(f"{quoted(text)} must not have a letter of the other axis")
    match = _DMS.fullmatch(text.strip())
    before, sign, *parts, behind = match.groups() if match else ("", "", "", "")
    values = [float(part.replace(",", ".")) for part in parts if part]
    # A value with smaller units after it is an integer.
    if not match or (before and behind) or not all(each.is_integer() for each in values[:-1]):
        raise ValueError(f"{quoted(text)} must be an angle in degrees, minutes and seconds")
    if any(each >= 60 for each in values[1:]):
        raise ValueError(f"{quoted(text)} must have minutes and seconds below 60")
    value = sum((each / 60.0**k for k, each in enumerate(values)), 0.0)
    return -value if (sign == "-") != (before + behind in ("S", "W")) else value


@dataclass(frozen=True)
class Columns:
    # Heading of each internal column; a leading `-` reverses the sign, a trailing `[ft]` is the unit
    headings: Mapping[str, str] = field(default_factory=dict)
    # Internal columns in the order of a table without header; `-` is not read
    order: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()  # Headings that are not read
    # Meaning of words of the column `use`: control, check, off
    roles: Mapping[str, str] = field(default_factory=dict)

    def spelled(self, known: Collection[str], own: Sequence[str]) -> list[str]:
        """Return the internal names of all columns from the headings of a file."""
        names = [""] * len(own)
        for column, heading in (*self.headings.items(), *((each, each) for each in self.ignored)):
            for place in _places(heading, own):
                names[place] = column
        taken = {*names, *(each for each in own if each in known)}
        # A heading of photos has precedence over one that names anything.
        for k in sorted(range(len(own)), key=lambda k: not is_photo(own[k])):
            heading = own[k]
            if names[k] or not heading:
                continue
            if heading in known:
                # The user has assigned another column, so this one is not used.
                names[k] = "" if heading in self.headings else heading
                continue
            meaning = bare_name(heading, known) or column_of(heading) or ""
            column = ANGULAR.get(meaning, meaning)
            if "photo" in known and (is_photo(heading) or (column == "point" and "point" not in known)):
                column = "photo"
            elif column not in known:
                column = WORDS["pixel"].get(" ".join(words_of(heading)), column)
            fits = column in known and (column != ROLE or "cov_xz" in known)
            fits |= column == "sd_xy" and "sd_x" in known
            first = column not in taken or column not in ("point", "photo", "column", "row", ROLE)
            names[k] = column if fits and first and column not in self.headings else heading
            taken.add(names[k])
        return names


PLAIN = Columns()


def _places(heading: str, own: Sequence[str]) -> list[int]:
    """Return the index of the column of a user's heading; at most one."""
    plain = heading.strip().lower()
    for given in (plain, plain.removeprefix("-").strip(), plain.removeprefix("-").partition("[")[0].strip()):
        found = [k for k, each in enumerate(own) if each == given] or [
            k for k, each in enumerate(own) if each and words_of(each) == words_of(given)
        ]
        if len(found) == 1:
            return found
    return []


def columns_given(columns: str | None, roles: str | None) -> Columns:
    """Return columns of `point=Name,x=Rechtswert` or `PNEZD`, and roles."""
    headings, ignored, order = dict[str, str](), list[str](), list[str]()
    words = [each.strip() for each in (columns or "").split(",") if each.strip()]
    if len(words) == 1 and set(words[0].lower()) <= set(SHORT) and len(words[0]) > 2:
        order = [SHORT[letter] for letter in words[0].lower()]
        words = []
    for word in words:
        name, equals, heading = (each.strip() for each in word.partition("="))
        if name.lower() != "-" and name.lower() not in OURS:
            one_word(Place(), "column in --columns", name, OURS)
        if not equals:
            order.append(name.lower())
        elif name == "-":
            ignored.append(heading)
        else:
            headings[name.lower()] = heading
    if order and (headings or ignored):
        raise InputError(phrase("columns.order"))
    meanings = dict[str, str]()
    for word in (each.strip() for each in (roles or "").split(",") if each.strip()):
        own, _, role = (each.strip() for each in word.rpartition("="))
        if role not in ROLES or not own:
            raise InputError(phrase("columns.roles", value=word))
        meanings[own.casefold()] = role
    return Columns(headings, tuple(order), tuple(ignored), meanings)


def settled(
    table: ColumnTable,
    columns: Columns,
    known: Collection[str],
    units: Units,
    required: Collection[str],
    names: Collection[str],
    name: str,
    messages: list[Message],
) -> ColumnTable:
    """Return a table of points with standard column names, units and role words."""
    users = (*columns.headings.values(), *columns.ignored)
    missing = [each for each in users if not _places(each, table.own)]
    if missing and not columns.order:
        one_word(table.head, "heading in --columns", missing[0], table.own)
    if "point" in required:
        table = _with_points(table, names, messages)
    if lacking := [each for each in required if each not in table]:
        fields = {"name": lacking[0], "names": list(table.own), "option": guess(table, known)}
        raise table.head.error(phrase("columns.missing", **fields))
    if name == "control":
        table = _with_roles(table, columns, messages)
    table = in_units(table, units, name, messages, columns.headings)
    cells = dict(table.cells)
    for column, own in table.headings:
        heading = columns.headings.get(column, own)
        if column in ("x", "y") and is_angular(own):
            read = partial(degrees, other="NS" if column == "x" else "EW")
            cells[column] = table.numbers(column, read=read)
        if column == "sd_xy":
            cells["sd_x"] = cells["sd_y"] = table.numbers(column, infinite=True)
        elif column in ("x", "y", "z") and heading.startswith("-") and heading.lower() != own:
            cells[column] = -table.numbers(column)
    wide = tuple(each for each in ("sd_x", "sd_y") if each in cells and each not in table.columns)
    check_unread(table, columns, known, name, messages)
    names = (*(table.own or table.columns), *("" for _ in wide))
    return replace(table, cells=cells, columns=(*table.columns, *wide), own=names)


def in_units(
    table: ColumnTable,
    units: Units,
    name: str,
    messages: list[Message],
    headings: Mapping[str, str] = MappingProxyType({}),
) -> ColumnTable:
    """Return a table in internal units, by units and factors of its headings."""
    cells, remarks = dict(table.cells), list[Phrase]()
    for column, own in table.headings:
        heading = headings.get(column, own)
        heading = heading if units_of(heading) else own
        kind, size = units.get("sd_x" if column == "sd_xy" else column, (None, 1.0))
        if kind is None or heading == column:
            continue
        factor, parts = 1.0, list[Phrase]()
        known = KINDS_OF_UNITS.get(kind, {})
        words = [word for word in units_of(heading) if word in known or not _has_notes(column, own, word)]
        if words:
            word = words[0]
            if word not in known:
                code = "columns.unit" if known else "columns.no-unit"
                raise table.head.error(phrase(code, column=own, unit=word, names=list(known)))
            factor = known[word] / size
            parts.append(phrase("columns.in", unit=word))
        if (coverage := coverage_of(own)) is not None:
            if not column.startswith("sd") or not coverage > 0:
                raise table.head.error(phrase("columns.coverage", column=own))
            factor /= coverage
            parts.append(phrase("columns.divided", k=coverage))
        if factor != 1.0:
            cells[column] = scaled(table.numbers(column, infinite=column.startswith("sd")), factor)
        if parts:
            remarks.append(phrase("columns.converted", heading=own, column=column, parts=parts))
    remark = Message(phrase("columns.units", table=name, parts=remarks), table.path)
    if remarks and remark not in messages:
        messages.append(remark)
    return replace(table, cells=cells)


def _has_notes(column: str, own: str, word: str) -> bool:
    """Return whether a word in brackets may be a note, as in X (UTM32)."""
    angle = word in KINDS_OF_UNITS["angle"]
    units = any(word in known for known in KINDS_OF_UNITS.values())
    if column.startswith("sd") and "%" in word:
        return False
    return column in _WITH_NOTES and (not units or (angle and (column in "xy" or is_angular(own))))


def is_geographic(table: ColumnTable) -> bool:
    return all(axis in table and is_angular(heading_of(table, axis)) for axis in ("x", "y"))


def heading_of(table: ColumnTable, column: str) -> str:
    return dict(table.headings).get(column) or column


def _with_points(table: ColumnTable, names: Collection[str], messages: list[Message]) -> ColumnTable:
    """Select the column of names with the most observed points."""
    found = [
        column for column, own in table.headings if column in ("point", NAMELESS) or column_of(own) == "point"
    ]
    if not found or found == ["point"]:
        return table
    first = "point" if "point" in found else found[0]
    hits = {column: len(set(table.texts(column)).intersection(names)) for column in found}
    best = max(found, key=lambda column: (hits[column], column == first))
    if best == "point":
        return table
    headings = dict(table.headings)
    if "point" in table:
        messages.append(Message(phrase("columns.names", heading=headings[best]), table.path))
    return table.renamed({"point": headings.get("point", ""), best: "point"})


def _with_roles(table: ColumnTable, columns: Columns, messages: list[Message]) -> ColumnTable:
    """Return a table with control, check and off in its column `use`."""
    headings, words = dict(table.headings), dict[str, list[str | None]]()
    read = [column for column in headings if column not in columns.ignored]
    named = [column for column in read if column == ROLE or column_of(headings[column]) in (ROLE, *_FLAGS)]
    texts = [
        column for column in read if column not in ("", "point") and isinstance(table.cells[column], list)
    ]
    for column in named or texts:
        cells = table.texts(column)
        found = [columns.roles.get(cell.casefold()) or role_of(cell) if cell else "" for cell in cells]
        own, meaning = headings[column], column_of(headings[column])
        sure = column == ROLE and (ROLE in columns.headings or not _PLAIN_ROLES.isdisjoint(words_of(own)))
        if meaning in _FLAGS and not any(found):
            words[column] = [_flag(table, row, cell.lower(), meaning) for row, cell in enumerate(cells)]
        # Other types describe something else; columns without a heading of roles contain "check".
        elif (sure or any(found)) and (named or "check" in found):
            words[column] = found
    if len(words) > 1:
        several = [headings[column] for column in words]
        raise table.head.error(phrase("columns.several-roles", names=several))
    if not words:
        return table.renamed({ROLE: headings[ROLE]}) if ROLE in table and headings[ROLE] != ROLE else table
    ((column, own_roles),) = words.items()
    uses = _settled_roles(table, column, own_roles)
    if headings[column] != ROLE:
        counts = [f"{uses.count(role)} {role}" for role in ROLES if role in uses]
        roles = phrase("columns.roles-read", heading=headings[column], counts=counts)
        messages.append(Message(roles, table.path))
    return table.renamed({column: ROLE}).with_texts(ROLE, uses)


def _flag(table: ColumnTable, row: int, word: str, meaning: str) -> str:
    if word in TRUE | _MARKED:
        return "check" if meaning == "check" else "control"
    if word in FALSE or not word:
        return "control" if meaning == "check" or not word else "check"
    raise table.error(row, phrase("format.unknown", what="value", value=word, names=["true", "false"]))


def _settled_roles(table: ColumnTable, column: str, found: Sequence[str | None]) -> list[str]:
    texts = table.texts(column)
    sure = set(found) & {"control", "check"}
    code = "columns.role" if column == ROLE else "columns.role-or-other"
    uses = []
    for row, role in enumerate(found):
        if role is None:
            raise table.error(row, phrase(code, column=column, value=texts[row], names=list(ROLES)))
        if role == "?" and len(sure) != 1:
            names = ["control", "check"]
            raise table.error(row, phrase("columns.role", column=column, value=texts[row], names=names))
        other = "check" if "control" in sure else "control"
        uses.append(other if role == "?" else role or "control")
    return uses


def check_unread(
    table: ColumnTable, columns: Columns, known: Collection[str], name: str, messages: list[Message]
) -> None:
    """Reject unknown numeric columns of strict tables; report other ones."""
    others = _unread(table, known)
    numbers = [
        own
        for column, own in others
        if name in STRICT
        and column not in columns.ignored
        and column_of(own) not in ("", "point")
        and _is_numeric(table, column)
    ]
    if numbers:
        ignored = ",".join(f"-={own}" for own in numbers)
        unread = phrase("columns.numbers", names=numbers, option=guess(table, known), ignored=ignored)
        raise table.head.error(unread)
    remark = Message.of("columns.unread", table.path, table=name, names=[own for _, own in others])
    if others and remark not in messages:
        messages.append(remark)


def _unread(table: ColumnTable, known: Collection[str]) -> list[tuple[str, str]]:
    return [
        (column, own or column)
        for column, own in table.headings
        if column and column not in known and column not in ("sd_xy", NAMELESS)
    ]


def _is_numeric(table: ColumnTable, column: str) -> bool:
    if not isinstance(own := table.cells.get(column), list):
        return isinstance(own, np.ndarray)
    cells = {cell for cell in table.texts(column) if cell}
    return bool(cells) and all(_is_number(cell) for cell in cells)


def _is_number(cell: str) -> bool:
    try:
        finite_number(re.sub(r"(?<=\d)[.,'’ \u00a0\u202f](?=\d)", "", cell))
    except ValueError:
        return False
    return True


def guess(table: ColumnTable, known: Collection[str]) -> str:
    """Return a `--columns` option guessed from the cells."""
    free = [own for column, own in _unread(table, known) if column_of(own) != ""]
    numeric = [own for column, own in _unread(table, known) if own in free and _is_numeric(table, column)]
    found = []
    key = "point" if "point" in known else "photo"
    if key not in table:
        different = [own for own in free if len(set(table.texts(own))) == table.count] or free
        found += [f"{key}={own}" for own in different[:1]]
        numeric = [own for own in numeric if own not in different[:1]]
    axes = [axis for axis in ("x", "y", "z") if axis not in table] or ["sd_x"]
    found += [f"{axis}={own}" for axis, own in zip(axes, numeric, strict=False)]
    return f"--columns {','.join(found) or 'point=...,x=...,y=...,z=...'} (a guess)"


def nameless(cells: Sequence[str]) -> Phrase:
    """Return the error of a header record without a known column name."""
    numbers = [k for k, cell in enumerate(cells) if _is_number(cell)]
    if len(numbers) < 2:
        guesses = zip(("point", "x", "y", "z"), cells, strict=False)
        return phrase("columns.headings", guess=",".join(f"{column}={cell}" for column, cell in guesses))
    return phrase("columns.header", rest="D" * (len(cells) > 4))
