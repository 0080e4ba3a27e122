"""A network during data snooping: exclusions, state, log, reinstatement."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.statistics.distributions import LEVEL, log_chi_square, log_fisher
from photogram.statistics.snooping.choosing import Choosing, Level
from photogram.statistics.snooping.conditioning import Chosen, UnitWeight
from photogram.statistics.snooping.log import Removal, Rival, Round
from photogram.statistics.snooping.suspects import (
    LostSupportError,
    Out,
    Prediction,
    Standing,
    Suspects,
    Tests,
    Trial,
)
from photogram.words import Phrase


@dataclass(frozen=True)
class Settings:
    level: float = LEVEL  # Joint level of all tests, or the false discovery rate
    fdr: bool = False  # Whether `level` is the false discovery rate
    known: bool = True  # Whether the unit weight is known: chi-square decides, otherwise F
    robust: bool | None = None  # Whether to start robustly; None if many observations are wrong
    max_rounds: int = 20


RESCUES = 5  # Largest number of attempts per round to determine all unknowns
NEEDED = Phrase("snooping.needed")
_NOT_DETERMINED = Phrase("snooping.point-undetermined")


class TakingOut:
    """A network during data snooping."""

    def __init__(self, trial: Trial, settings: Settings, out: Out | None = None) -> None:
        self.trial, self.settings = trial, settings
        suspects = trial.suspects
        self.suspects: Suspects = suspects
        self.out = Out(np.zeros(int(suspects.row_starts[-1]), dtype=bool)) if out is None else out
        self.log: list[Removal] = []
        self.rounds: list[Round] = []
        self.remarks: list[Phrase] = []
        self.returns: set[int] = set()
        self.kept: set[int] = set()
        self.predicted: dict[int, tuple[Prediction, float]] = {}
        self.before = self.standing = trial.adjust(self.out)
        self.tests = trial.tests()
        self.level = Level(settings.level, int(self.testable().sum()), settings.fdr)
        self.factors: dict[str, float] = {}
        self.scales: Floats = np.ones(len(suspects))
        self.images = frozenset(np.flatnonzero(suspects.kinds == 0).tolist())

    def unit(self) -> UnitWeight:
        """Return the unit weight of tests of the current network."""
        standing = self.standing
        return UnitWeight(self.settings.known, standing.weighted_sum_of_squares, standing.degrees_of_freedom)

    def choosing(self, allowed: Bools, out: int, *, ahead: bool) -> Choosing:
        """Return the selection among allowed groups after `out` removals."""
        return Choosing(
            self.trial, self.tests, self.unit(), self.scales, allowed, self.level, out, ahead=ahead
        )

    def note_round(
        self,
        number: int,
        standing: Standing,
        removed: Sequence[int],
        returned: Sequence[int],
        *,
        out: int = 0,
    ) -> None:
        """Add a round to the log: its previous state, `out` removals, and changes."""
        self.rounds.append(
            Round(
                number=number,
                status=standing.status,
                weighted_sum_of_squares=standing.weighted_sum_of_squares,
                degrees_of_freedom=standing.degrees_of_freedom,
                tests=self.level.tests,
                limit=self.level.limit(out),
                removed=removed,
                returned=returned,
            )
        )

    def allowed(self) -> Bools:
        """Return (G,) groups that may be removed: testable, and not retained before."""
        allowed = self.suspects.removable & self.testable()
        allowed[list(self.kept)] = False
        return allowed

    def testable(self) -> Bools:
        """Return (G,) groups with a direction of notable errors in own residuals."""
        return self.tests.testable(self.suspects.row_starts)

    def as_it_was(self, group: int, tests: Tests) -> Removal:
        """Return the entry of a group that is removed without a separate test."""
        rows = self.suspects.rows(group)
        statistic, dimension = float(tests.statistic[group]), int(tests.rank[group])
        return self.entry(
            group,
            rows,
            0,
            first_statistic=statistic,
            statistic=statistic,
            dimension=dimension,
            fisher=self.unit().fisher(statistic, dimension),
            log_probability=math.nan,
            error=tests.error[rows],
            error_sd=tests.error_sd[rows],
            limit=self.level.limit(0),
        )

    def entries(self, choices: list[Chosen], number: int) -> list[Removal]:
        """Return the selected groups as entries of the log."""
        entries = []
        for choice in choices:
            deviations = self.trial.deviations[choice.rows]
            rivals = tuple(
                Rival(str(self.suspects.name(group)), statistic, dimension, odds)
                for group, statistic, dimension, odds in choice.rivals
            )
            names = ("first_statistic", "statistic", "dimension", "fisher", "log_probability", "limit")
            entries.append(
                self.entry(
                    choice.group,
                    choice.rows,
                    number,
                    error=choice.error * deviations,
                    error_sd=np.sqrt(np.diagonal(choice.cofactors)) * deviations,
                    rivals=rivals,
                    **{name: getattr(choice, name) for name in names},
                )
            )
        return entries

    def entry(
        self, group: int, rows: Indices, number: int, *, error: Floats, error_sd: Floats, **values: Any
    ) -> Removal:
        """Return the entry of a group or some of its rows; see :class:`Removal`."""
        suspects = self.suspects
        subject, components = suspects.name(group), tuple(map(suspects.row_name, rows.tolist()))
        if len(rows) < len(suspects.rows(group)):
            axes = [Phrase(f"axis.{each}") for each in components]
            subject = Phrase("named.parts", {"axes": axes, "named": subject})
        return Removal(
            round=number,
            group=group,
            kind=suspects.kind(group),
            subject=subject,
            rows=tuple(rows.tolist()),
            components=components,
            units=tuple(map(suspects.unit, rows.tolist())),
            error=tuple(error.tolist()),
            error_sd=tuple(error_sd.tolist()),
            redundancy=float(self.tests.least[group]),
            **values,
        )

    def apply(self, entries: list[Removal], returning: Sequence[int] = ()) -> list[int]:
        """Remove groups with all dependent observations, and adjust.

        Groups that are needed to determine the network are retained and reported.
        """
        if not entries and not returning:
            return []
        pending = entries
        for _ in range(RESCUES):
            out = self.out.copy()
            for place in returning:
                out.rows[list(self.log[place].rows)] = False
            log = [self._out_with(out, entry) for entry in pending]
            try:
                self.adjust(out)
            except LostSupportError as lost:
                if lost.points and not lost.photos:
                    pending = [self._forced(each, lost.points) for each in pending]
                    continue
                kept = [each for each in pending if self._concerns(each, lost)]
                for each in kept or pending:
                    self._keep(each)
                pending = [each for each in pending if each.group not in self.kept]
                continue
            first = len(self.log)
            self.log += log
            return [first + place for place, each in enumerate(log) if not each.kept]
        for each in pending:
            self._keep(each)
        return []

    def _forced(self, entry: Removal, points: tuple[int, ...]) -> Removal:
        own = int(self.suspects.points[entry.group])
        if own not in points:
            return entry
        return entry.with_(consequences=(*entry.consequences, _NOT_DETERMINED))

    def _concerns(self, entry: Removal, lost: LostSupportError) -> bool:
        photos = set(self.suspects.loads(entry.group).tolist()) | {int(self.suspects.photos[entry.group])}
        return bool(photos & set(lost.photos))

    def _keep(self, entry: Removal) -> None:
        self.kept.add(entry.group)
        self.log.append(entry.with_(kept=NEEDED))

    def _out_with(self, out: Out, entry: Removal) -> Removal:
        """Exclude a group and all observations that depend on it."""
        out.rows[list(entry.rows)] = True
        points, photos = self.trial.consequences(out, entry.group)
        consequences = list(entry.consequences)
        if photos:
            out.rows[list(entry.rows)] = False
            self.kept.add(entry.group)
            return entry.with_(kept=Phrase("snooping.photo-undetermined"))
        own = int(self.suspects.points[entry.group])
        if _NOT_DETERMINED in consequences and own >= 0:
            points = points | {own}
        for point in sorted(points - out.points):
            out.points.add(point)
            consequences += self.left(out, point)
        return entry.with_(consequences=tuple(dict.fromkeys(consequences))) if consequences else entry

    def left(self, out: Out, point: int) -> Iterator[Phrase]:
        """Exclude all observations of a point, with a message for each group."""
        for group in self.suspects.on_point(point).tolist():
            rows = self.suspects.rows(group)
            if not out.rows[rows].all():
                out.rows[rows] = True
                yield Phrase("snooping.single-ray", {"name": self.suspects.name(group)})

    def adjust(self, out: Out, *, exact: bool = False) -> None:
        """Adjust without exclusions and test; raise LostSupportError if undetermined."""
        self.standing = self.trial.adjust(out, exact=exact)
        self.out = out
        self.tests = self.trial.tests()


def note_return(work: TakingOut, places: list[int], number: int) -> None:
    """Record the reinstatement of log entries in a round."""
    for place in places:
        work.returns.add(work.log[place].group)
        work.log[place] = with_prediction(work, place).with_(returned=number)


def take_back(work: TakingOut, number: int) -> list[int]:
    """Reinstate observations that agree with the rest, one adjustment after the other."""
    returning = agreeing(work)
    if not returning:
        return []
    out = work.out.copy()
    for place in returning:
        out.rows[list(work.log[place].rows)] = False
    try:
        work.adjust(out)
    except LostSupportError:
        return []
    note_return(work, returning, number)
    return returning + take_back(work, number)


def agreeing(work: TakingOut) -> list[int]:
    """Test exclusions; return the best agreeing one, or all independent ones."""
    places = [place for place, each in enumerate(work.log) if each.is_out and each.rows]
    if not places:
        return []
    predictions = work.trial.predictions([work.log[place].group for place in places])
    known = [(place, own) for place, own in zip(places, predictions, strict=True) if own is not None]
    log_p = log_probability(
        work,
        np.array([own.statistic for _, own in known]),
        np.array([len(own.rows) for _, own in known]),
        np.array([work.log[place].group for place, _ in known], dtype=np.int64),
    ).tolist()
    work.predicted = {place: (own, value) for (place, own), value in zip(known, log_p, strict=True)}
    limit = math.log(work.level.limit(0))
    agreeing = sorted(
        (-value, place)
        for place, (_, value) in work.predicted.items()
        if value >= limit and work.log[place].group not in work.returns
    )
    return _apart(work, [place for _, place in agreeing])


def _apart(work: TakingOut, places: list[int]) -> list[int]:
    """Return the first for single tests, else the ones without a common photo."""
    if work.trial.whole:
        return places[:1]
    taken: set[int] = set()
    apart = []
    for place in places:
        group = work.log[place].group
        photo = int(work.suspects.photos[group])
        photos = {photo} if photo >= 0 else set(work.suspects.loads(group).tolist())
        if not photos & taken:
            taken |= photos
            apart.append(place)
    return apart


def with_prediction(work: TakingOut, place: int) -> Removal:
    """Return an entry of the log with its prediction from the rest."""
    if place not in work.predicted:
        return work.log[place]
    prediction, log_p = work.predicted[place]
    # Another entry may have removed other components of the same group.
    errors = dict(zip(prediction.rows, prediction.error, strict=True))
    return work.log[place].with_(
        prediction=prediction.statistic,
        prediction_log_probability=log_p,
        prediction_error=tuple(errors.get(row, math.nan) for row in work.log[place].rows),
    )


def log_probability(work: TakingOut, statistic: Floats, dimension: Indices, groups: Indices) -> Floats:
    """Return log-probabilities of exclusions relative to the network without them."""
    if work.settings.known:
        return log_chi_square(statistic / work.scales[groups], dimension)
    f = work.standing.degrees_of_freedom
    if not (f > 0 and work.standing.weighted_sum_of_squares > 0):
        return np.zeros(len(statistic))
    s2 = work.standing.weighted_sum_of_squares / f
    return log_fisher(statistic / dimension / s2, dimension, f)
