"""Card decks of program W5344 (USGS Computer Contribution 2, 1969, "Input").

A deck is one or more jobs. A job consists of a title, two FORMATs, specifications, optional coordinatograph
factors, the plate grid, and one or more sets of readings. Each set starts with initial approximations and
ends with a flag card.

Cards are read by the FORMAT on a card, with the rules of FORTRAN IV. The package fortranformat reads the
FORMAT and the numbers. This module implements the differences between FORTRAN IV (1969) and later FORTRAN,
and rejects invalid cards. Blanks inside a field are zeros, a card has eighty columns, and NaN cannot be
written.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import get_args

import fortranformat
import numpy as np

from photogram.arguments.arrays import one_of, truth_value
from photogram.arguments.objects import path_of
from photogram.arguments.types import Floats
from photogram.errors import InputError, PhotogramError
from photogram.io.places import Place, at_place
from photogram.io.records import Record, Source
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.perspective_center.grid import MINUTES_PER_RADIAN, Coordinatograph, Grid, joined, reduce
from photogram.perspective_center.solution import PerspectiveCenter, Weights, determine
from photogram.show.methods import Documented
from photogram.show.page import Document, Judgement
from photogram.words import phrase

COLUMNS = 80
_NUMERIC = re.compile(r"([IFED])(\d+)(?:\.\d+)?", re.ASCII)
_ALLOWED = re.compile(r"(?:\d*[IFED]\d+(?:\.\d+)?|\d*X|T\d+|\d*\(|[),])+", re.ASCII)
_NUMBERS = {
    int: re.compile(r"[+-]?\d+", re.ASCII),
    float: re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[ED][+-]?\d+|[+-]\d+)?", re.ASCII),
}
_NAMES = {int: "whole number", float: "number"}
_FIRST = 0x2500  # A ruler: its characters do not occur on cards and count the columns


class CardFormat:
    """The FORMAT of a card with integers, followed by real numbers."""

    def __init__(self, text: str, *, reals: int, integers: int = 1) -> None:
        self.text = _parenthesised("".join(text.split()).upper())
        if _ALLOWED.fullmatch(self.text) is None:
            raise ValueError(phrase("format.descriptors", format=self.text))
        # Sizes beyond a card would cost memory or time. Nine digits suffice, because int() has a limit.
        numbers = [int(digits[:9]) for digits in re.findall(r"[0-9]+", self.text)]
        groups = math.prod(int(digits[:9]) for digits in re.findall(r"([0-9]+)\(", self.text))
        if max(numbers, default=0) > COLUMNS or groups > COLUMNS**2:
            raise ValueError(phrase("format.sizes", format=self.text, columns=COLUMNS))
        try:
            self._reader = fortranformat.FortranRecordReader(self.text)
            ruler = "".join(chr(_FIRST + column) for column in range(4 * COLUMNS))
            # Read as text, the ruler gives the columns of a field; a card of zeros gives its type.
            fields = fortranformat.FortranRecordReader(_NUMERIC.sub(r"A\2", self.text)).read(ruler)
            kinds = [type(value) for value in self._reader.read("0" * 4 * COLUMNS)]
        except Exception:  # fortranformat raises many types of exceptions, including its own
            raise ValueError(phrase("format.invalid", format=self.text)) from None
        wanted = [int] * integers + [float] * reals
        if kinds[: len(wanted)] != wanted:
            raise ValueError(phrase("format.numbers", format=self.text, integers=integers, reals=reals))
        columns = [(ord(field[0]) - _FIRST, ord(field[-1]) - _FIRST + 1) for field in fields[: len(wanted)]]
        if max(last for _, last in columns) > COLUMNS:
            raise ValueError(phrase("format.columns", format=self.text, columns=COLUMNS))
        self._fields = [*zip(columns, wanted, strict=True)]

    @classmethod
    def of(cls, record: Record, *, reals: int) -> CardFormat:
        try:
            return cls(record.text, reals=reals)
        except ValueError as error:
            raise record.error(error.args[0]) from None

    def read(self, record: Record) -> list[float]:
        """Return the numbers of a card; integers are of type int."""
        card = record.text.ljust(COLUMNS)
        for (first, last), kind in self._fields:
            card = card[:first] + self._filled(first, last, kind, record, card) + card[last:]
        values: list[float] = self._reader.read(card)
        return values[: len(self._fields)]

    def _filled(self, first: int, last: int, kind: type, record: Record, card: str) -> str:
        """Return the characters of a field, with FORTRAN IV blanks replaced by zeros."""
        raw = card[first:last].upper()
        digits = raw.lstrip(" ").replace(" ", "0")
        columns = {"first": first + 1, "last": last}
        if digits and _NUMBERS[kind].fullmatch(digits) is None:
            raise record.error(
                phrase("deck.number", **columns, kind=_NAMES[kind], format=self.text, value=raw.strip())
            )
        counts = " " in raw.lstrip(" ") and (kind is int or "." not in raw or "E" in raw or "D" in raw)
        if counts:
            record.remark(phrase("deck.blanks", **columns, value=raw, number=digits))
        return digits.rjust(last - first)


def _parenthesised(text: str) -> str:
    """Return the text up to the parenthesis that closes the first one."""
    depth = 0
    for position, character in enumerate(text):
        depth += (character == "(") - (character == ")")
        if depth == 0 and position > 0:
            return text[: position + 1]
        if depth == 0:
            break
    raise ValueError(phrase("format.parentheses", value=text))


SPECIFICATIONS = CardFormat("(3I5,2F10.0)", integers=3, reals=2)
FACTORS = CardFormat("(3D20.8)", integers=0, reals=3)
APPROXIMATIONS = CardFormat("(6F10.0)", integers=0, reals=6)


class Deck:
    """A deck that is read by set, so that errors do not affect earlier sets."""

    def __init__(self, path: Path) -> None:
        self._source = Source.read(path)
        # The flag card of the last set may be blank; later cards are empty.
        self._end = max(self._source.filled(), default=0)
        self._next = 1
        self.title: str | None = None
        self.number = 0

    @property
    def messages(self) -> list[Message]:
        """Warnings on the cards read so far."""
        return self._source.messages

    def grids(self) -> Iterator[Grid]:
        while self._next <= self._end:
            self.title, self.number = self._card("the title").text.rstrip(), 0
            plate_format = CardFormat.of(self._card("the FORMAT of the plate grid"), reals=2)
            projected_format = CardFormat.of(self._card("the FORMAT of the readings"), reals=3)
            card = self._card("the card of specifications")
            points, sets, correct, principal_distance, tolerance = SPECIFICATIONS.read(card)
            if points < 1:
                raise card.error(phrase("deck.points", value=points))
            if not principal_distance > 0:
                raise card.error(phrase("projector.principal-distance", value=principal_distance))
            factors = None
            if correct == 1:
                factors = Coordinatograph(*FACTORS.read(self._card("the card of coordinatograph factors")))
            plate = self._plate(plate_format, int(points))
            for self.number in range(1, max(1, int(sets)) + 1):
                card = self._card("the card of initial approximations")
                omega, phi, kappa, *position = APPROXIMATIONS.read(card)
                angles = np.array([omega, phi, kappa]) / MINUTES_PER_RADIAN
                yield reduce(
                    self._readings(projected_format, [*plate]),
                    ids=[*plate],
                    plate_xy=np.array([*plate.values()]),
                    principal_distance=principal_distance,
                    tolerance=tolerance,
                    coordinatograph=factors,
                    initial=np.array([*position, *angles]),
                    title=self.title,
                    number=self.number,
                )

    def _card(self, what: str) -> Record:
        if self._next > len(self._source.lines):
            raise self._source.error(phrase("deck.end", subject=what))
        self._next += 1
        return self._source.record(self._next - 1)

    def _plate(self, plate_format: CardFormat, points: int) -> dict[int, list[float]]:
        """Return coordinates (mm) of the plate grid by point number."""
        plate: dict[int, list[float]] = {}
        for _ in range(points):
            card = self._card("a card of the plate grid")
            number, *xy = plate_format.read(card)
            if number == 0:
                raise card.error(phrase("deck.zero"))
            if number in plate:
                raise card.error(phrase("deck.point-repeated", point=number))
            plate[int(number)] = xy
        return plate

    def _readings(self, projected_format: CardFormat, numbers: list[int]) -> list[Floats]:
        """Read all readings, (k, 3) for each point, and the flag card (5.1)."""

        def read() -> tuple[Record, float, list[float]]:
            card = self._card("a card of readings")
            number, *xyz = projected_format.read(card)
            return card, number, xyz

        readings: list[Floats] = []
        card, point, xyz = read()
        for expected in numbers:
            if point != expected:
                raise card.error(phrase("deck.order", point=expected))
            rows = []
            while point == expected:
                rows.append(xyz)
                if self._next > len(self._source.lines):
                    if expected != numbers[-1]:
                        raise self._source.error(phrase("deck.end-after-point", point=expected))
                    card.remark(phrase("deck.no-flag"))
                    return [*readings, np.array(rows)]
                card, point, xyz = read()
            readings.append(np.array(rows))
        if point != 0:
            raise card.error(phrase("deck.flag", point=numbers[-1], value=point))
        return readings


def read_deck(path: Path) -> list[Grid]:
    """Read all sets of a deck.

    Raises
    ------
    InputError
        If a card is invalid; the message contains file, number and text. If points are not in the order of
        the plate, it contains `ERROR - CARDS ARE OUT OF ORDER AT POINT NO.` and the expected number, as in
        the report.
    """
    path = path_of("path", path)
    return list(Deck(path).grids())


@dataclass(frozen=True)
class Stop:
    """State of a run that stopped before the end of the deck.

    Attributes
    ----------
    error
        Reason.
    title, number
        Title of the current job and number of the current set; None and 0 before the first.
    grid
        The set that could not be solved; None if it was not read.
    """

    error: PhotogramError
    title: str | None
    number: int
    grid: Grid | None


@dataclass(repr=False)
class Run(Documented):
    """Result of processing a deck.

    Attributes
    ----------
    results
        The solved sets, in the order of the deck.
    messages
        Warnings on the cards and the solutions.
    stop
        None if the whole deck was processed.
    """

    results: list[PerspectiveCenter] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)
    stop: Stop | None = None

    @property
    def converged(self) -> bool:
        """Whether all sets of the deck were solved and converged."""
        return self.stop is None and all(result.converged for result in self.results)

    def document(self) -> Document:
        """Return the document of the run; each set is a layer of its sections."""
        from photogram.perspective_center.document import run_document

        stop = self.stop
        end = None if stop is None else Judgement("Stopped", str(stop.error), (), "bad", f"set {stop.number}")
        return run_document(self.results, self.messages, end)


def run_deck(
    path: Path,
    *,
    as_published: bool = False,
    weights: Weights = "equal",
    together: bool = False,
    unknown: Sequence[str] = (),
) -> Run:
    """Process a deck like the program, up to the first unreadable or unsolved set.

    A set that does not converge does not stop the run. Earlier results are returned.

    Parameters
    ----------
    path
        The deck.
    as_published, weights, unknown
        As in :func:`photogram.perspective_center.determine`.
    together
        True if all sets of a job are of one projector, at several heights, and solved as one.

    Raises
    ------
    InputError
        If the deck cannot be read at all, or `together` and `as_published` are combined.
    """
    truth_value("as_published", as_published)
    truth_value("together", together)
    path = path_of("path", path)
    one_of("weights", weights, get_args(Weights))
    if together and as_published:
        raise InputError(phrase("projector.published-sets"))
    deck = Deck(path)
    run = Run()
    grid: Grid | None = None
    try:
        with at_place(Place(path)):
            for grid in _jobs(deck.grids()) if together else deck.grids():
                result = determine(grid, as_published=as_published, weights=weights, unknown=unknown)
                run.results.append(result)
                grid = None
    except PhotogramError as error:
        run.stop = Stop(error, deck.title, deck.number, grid)
    run.messages = [*deck.messages, *(message for result in run.results for message in result.messages)]
    return run


def _jobs(grids: Iterable[Grid]) -> Iterator[Grid]:
    job: list[Grid] = []
    for grid in grids:
        if grid.number == 1 and job:
            yield joined(job)
            job = []
        job.append(grid)
    if job:
        yield joined(job)
