"""Decks of cards of program W5344 (USGS Computer Contribution 2, 1969, "Input").

A deck is one or more jobs. A job is a title, two FORMATs, specifications, coordinatograph factors if asked
for, the plate grid, and one or more sets of readings, each with initial approximations before it and a flag
card behind it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.records import Record, Source
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.perspective_center.formats import CardFormat
from photogram.perspective_center.grid import MINUTES_PER_RADIAN, Coordinatograph, Grid, reduce

__all__ = ["OUT_OF_ORDER", "Deck", "Job", "read_deck"]


OUT_OF_ORDER = "ERROR - CARDS ARE OUT OF ORDER AT POINT NO."
SPECIFICATIONS = CardFormat("(3I5,2F10.0)", integers=3, reals=2)
FACTORS = CardFormat("(3D20.8)", integers=0, reals=3)
APPROXIMATIONS = CardFormat("(6F10.0)", integers=0, reals=6)


@dataclass(frozen=True, eq=False)
class Job:
    """What the sets of a job share: cards 1 to 6.

    Attributes
    ----------
    title
        Card 1.
    projected_format
        Card 3.
    sets
        Number of sets of readings on the same grid (ICALF).
    coordinatograph
        Factors of card 5, None without.
    principal_distance, tolerance
        Millimetres, positive (FOCAL); the limit of the iteration as published (GDIF), in the unit of the
        model.
    numbers, plate_xy
        Point numbers, and (n, 2) coordinates in millimetres, of the plate grid.
    """

    title: str
    projected_format: CardFormat
    sets: int
    coordinatograph: Coordinatograph | None
    principal_distance: float
    tolerance: float
    numbers: list[int]
    plate_xy: Floats


class Deck:
    """A deck that is read set by set, so that a fault in a later set does not lose the earlier ones.

    Attributes
    ----------
    title, number
        Title of the job and number of the set that are being read; None and 0 before the first.
    messages
        Remarks on the cards.
    """

    def __init__(self, path: Path) -> None:
        self._source = Source.read(path)
        # The flag card of the last set may be blank; cards after it hold nothing.
        self._end = max(self._source.filled(), default=0)
        self._next = 1
        self.title: str | None = None
        self.number = 0

    @property
    def messages(self) -> list[Message]:
        """Remarks on the cards read so far."""
        return self._source.messages

    def grids(self) -> Iterator[Grid]:
        """Read the sets one after the other.

        Raises
        ------
        InputError
            A card that cannot be used; its file, number and text are named.
        """
        while self._next <= self._end:
            self.title, self.number = self._card("the title").text.rstrip(), 0
            job = self._job(self.title)
            for number in range(1, job.sets + 1):
                self.number = number
                yield self._grid(job, number)

    def _card(self, what: str) -> Record:
        if self._next > len(self._source.lines):
            raise self._source.error(f"the deck ends where {what} is expected")
        self._next += 1
        return self._source.record(self._next - 1)

    def _job(self, title: str) -> Job:
        plate_format = CardFormat.of(self._card("the FORMAT of the plate grid"), reals=2)
        projected_format = CardFormat.of(self._card("the FORMAT of the readings"), reals=3)
        card = self._card("the card of specifications")
        points, sets, correct, principal_distance, tolerance = SPECIFICATIONS.read(card)
        if points < 1:
            raise card.error(f"the number of points cannot be {points}")
        if not principal_distance > 0:
            raise card.error(f"the principal distance must be positive, not {principal_distance}")
        factors = None
        if correct == 1:
            factors = Coordinatograph(*FACTORS.read(self._card("the card of coordinatograph factors")))
        rows = self._plate(plate_format, int(points))
        return Job(
            title=title,
            projected_format=projected_format,
            sets=max(1, int(sets)),
            coordinatograph=factors,
            principal_distance=principal_distance,
            tolerance=tolerance,
            numbers=[int(row[0]) for row in rows],
            plate_xy=np.array([row[1:] for row in rows]),
        )

    def _plate(self, plate_format: CardFormat, points: int) -> list[list[float]]:
        rows: dict[float, list[float]] = {}
        for _ in range(points):
            card = self._card("a card of the plate grid")
            row = plate_format.read(card)
            if row[0] == 0:
                raise card.error(
                    "a point of the plate grid cannot have the number 0, which is that of the flag card"
                )
            if row[0] in rows:
                raise card.error(f"point {row[0]} stands in the plate grid twice")
            rows[row[0]] = row
        return list(rows.values())

    def _grid(self, job: Job, number: int) -> Grid:
        omega, phi, kappa, *position = APPROXIMATIONS.read(self._card("the card of initial approximations"))
        angles = np.array([omega, phi, kappa]) / MINUTES_PER_RADIAN
        readings = self._readings(job)
        return reduce(
            readings,
            ids=job.numbers,
            plate_xy=job.plate_xy,
            principal_distance=job.principal_distance,
            tolerance=job.tolerance,
            coordinatograph=job.coordinatograph,
            initial=np.array([*position, *angles]),
            title=job.title,
            number=number,
        )

    def _readings(self, job: Job) -> list[Floats]:
        """Read all readings of all points, (k, 3) each, and the flag card (specification, 5.1)."""
        readings: list[Floats] = []
        card, point, xyz = self._reading(job)
        for expected in job.numbers:
            if point != expected:
                raise card.error(f"{OUT_OF_ORDER} {expected}")
            rows = []
            while point == expected:
                rows.append(xyz)
                if self._next > len(self._source.lines):
                    if expected != job.numbers[-1]:
                        raise self._source.error(f"the deck ends after the readings of point {expected}")
                    card.remark("the deck ends here without a flag card")
                    return [*readings, np.array(rows)]
                card, point, xyz = self._reading(job)
            readings.append(np.array(rows))
        if point != 0:
            raise card.error(f"a flag card is expected behind the readings of point {job.numbers[-1]}")
        return readings

    def _reading(self, job: Job) -> tuple[Record, int, list[float]]:
        card = self._card("a card of readings")
        number, *xyz = job.projected_format.read(card)
        return card, int(number), xyz


def read_deck(path: Path) -> list[Grid]:
    """Read all sets of a deck.

    Raises
    ------
    InputError
        A card that cannot be used; its file, number and text are named. Points in another order than on the
        plate say `ERROR - CARDS ARE OUT OF ORDER AT POINT NO.` and the number expected, as the report has it.
    """
    return list(Deck(path).grids())
