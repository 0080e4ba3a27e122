"""The rounds of data snooping: choose, take out, adjust, test what is out again."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.statistics.distributions import LEVEL, log_chi_square, log_fisher
from photogram.statistics.limits import global_test
from photogram.statistics.reliability import TESTABLE
from photogram.statistics.snooping.choosing import Choice, Choosing, Level
from photogram.statistics.snooping.conditioning import UnitWeight
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

__all__ = ["Outcome", "Settings", "snooped"]

MEDIAN = 0.6744897501960817
"""Of the absolute value of a standard normal variable."""
OPTIMISTIC = 2.0
"""Standard deviations that are too small by more than this are told from gross errors by the median."""
ENOUGH = 20
"""Test values that a median needs."""
MANY = 0.05
"""Share of the images beyond `FAR` robust standard deviations from which on a robust start is needed."""
FAR = 5.0
CANDIDATE = 4.4
"""Robust standard deviations from which on a residual is put aside: Cauchy's loss leaves it a quarter of its
weight."""
MEDIAN_OF_TWO = 1.1774100225154747
"""Of the length of a vector of two standard normal variables."""
SCALES = 5
"""Robust adjustments at the most until their scale stands."""
LEAST_OF_PHOTO, MOST_OF_PHOTO = 4, 0.5
"""Images of a photo that are out, by number and share, from which on the whole photo goes."""
EVEN = 0.25
"""Share of the largest test value of a photo that the median of all of them has where all its images are
bad: a few huge errors, such as exchanged names, lift the others, but far less."""
BAD_PHOTOS = 5
"""Photos that are taken out before single images are tested, at the most."""
RESCUES = 5
"""Attempts to leave a round with everything determined."""


@dataclass(frozen=True)
class Settings:
    """How to snoop.

    Attributes
    ----------
    level
        Family level of all tests together, or the false discovery rate.
    fdr
        Whether it is the latter.
    known
        Whether the unit weight is known: chi-square decides, else F.
    robust
        Whether to start robustly; None where many observations are wrong.
    max_rounds
        Rounds at the most.
    """

    level: float = LEVEL
    fdr: bool = False
    known: bool = True
    robust: bool | None = None
    max_rounds: int = 20


@dataclass(frozen=True, eq=False)
class Outcome:
    """What snooping has ended with.

    Attributes
    ----------
    log
        Everything that was taken out, in order.
    rounds
        Every round; the last takes nothing out.
    out
        What takes no part.
    tests
        How many groups are tested: it is kept from the start.
    before, standing
        How the network stood at first, and without what is out.
    factors
        By kind, the robust factors by which standard deviations were multiplied for the tests; empty where
        the given ones stand.
    final
        Tests of what takes part, at the end.
    remarks
        What else there is to say.
    """

    log: list[Removal]
    rounds: list[Round]
    out: Out
    tests: int
    before: Standing
    standing: Standing
    factors: dict[str, float]
    final: Tests
    remarks: list[str]


def snooped(trial: Trial, settings: Settings) -> Outcome:
    """Take gross errors out of a network, and return what was done."""
    return _Snooping(trial, settings).run()


class _Snooping:
    def __init__(self, trial: Trial, settings: Settings) -> None:
        self.trial, self.settings = trial, settings
        suspects = trial.suspects
        self.suspects: Suspects = suspects
        self.out = Out(np.zeros(int(suspects.row_starts[-1]), dtype=bool))
        self.log: list[Removal] = []
        self.rounds: list[Round] = []
        self.remarks: list[str] = []
        self.returns: set[int] = set()
        self.kept: set[int] = set()
        self.predicted: dict[int, tuple[Prediction, float]] = {}
        self.before = self.standing = trial.adjust(self.out)
        self.tests = trial.tests()
        self.level = Level(settings.level, int(self._testable().sum()), settings.fdr)
        self.factors: dict[str, float] = {}
        self.scales: Floats = np.ones(len(suspects))
        self.images = frozenset(np.flatnonzero(suspects.kinds == 0).tolist())

    def run(self) -> Outcome:
        self._take_bad_photos_out()
        if self._needs_robust_start():
            self._start_robustly()
        else:
            self.factors, self.scales = self._scales()
        for number in range(1, self.settings.max_rounds + 1):
            removed, returned = self._round(number)
            if not removed and not returned:
                break
        else:
            self.remarks.append(f"snooping has not ended after {self.settings.max_rounds} rounds")
        out = [place for place, each in enumerate(self.log) if each.is_out]
        for place in out:
            self.log[place] = self._with_prediction(place)
        return Outcome(
            log=self.log,
            rounds=self.rounds,
            out=self.out,
            tests=self.level.tests,
            before=self.before,
            standing=self.standing,
            factors=self.factors,
            final=self.tests,
            remarks=self.remarks,
        )

    def _unit(self) -> UnitWeight:
        standing = self.standing
        return UnitWeight(self.settings.known, standing.weighted_sum_of_squares, standing.degrees_of_freedom)

    def _round(self, number: int) -> tuple[list[int], list[int]]:
        standing = self.standing
        count = sum(each.is_out for each in self.log)
        choices = self._choosing(self._allowed(), count, ahead=True).choose()
        remarks: list[str] = []
        # In a large network what went before returns in the adjustment that takes others out.
        returned = [] if self.trial.whole else self._agreeing()
        removed = self._take_out(choices, number, remarks, returned)
        if self.trial.whole:
            returned = self._take_back(number)
        removed += self._take_photos_out(number)
        self.rounds.append(
            Round(
                number=number,
                status=standing.status,
                weighted_sum_of_squares=standing.weighted_sum_of_squares,
                degrees_of_freedom=standing.degrees_of_freedom,
                tests=self.level.tests,
                limit=self.level.limit(count),
                removed=removed,
                returned=returned,
                remarks=remarks,
            )
        )
        return removed, returned

    def _choosing(self, allowed: Bools, out: int, *, ahead: bool) -> Choosing:
        return Choosing(
            trial=self.trial,
            tests=self.tests,
            unit=self._unit(),
            scales=self.scales,
            allowed=allowed,
            level=self.level,
            out=out,
            ahead=ahead,
        )

    def _allowed(self) -> Bools:
        allowed = self.suspects.removable & self._testable()
        allowed[list(self.kept)] = False
        return allowed

    def _testable(self) -> Bools:
        """Return (G,) which groups have a direction whose errors show notably in their own residuals."""
        return self.tests.testable(self.suspects.row_starts)

    def _scales(self) -> tuple[dict[str, float], Floats]:
        """Return robust factors k by kind where standard deviations are too optimistic, and k^2 by group."""
        suspects, tests = self.suspects, self.tests
        scales = np.ones(len(suspects))
        if not self.settings.known:
            return {}, scales
        everything = self._values(np.ones(len(suspects), dtype=bool))
        overall = _factor(everything)
        if len(everything) < ENOUGH or not overall > OPTIMISTIC:
            return {}, scales
        factors = {}
        for kind, name in enumerate(suspects.kind_names):
            own = np.asarray(suspects.kinds == kind)
            if not (own & tests.active).any():
                continue
            values = self._values(own)
            factor = max(_factor(values) if len(values) >= ENOUGH else overall, 1.0)
            factors[name] = factor
            scales[own] = factor**2
        named = ", ".join(f"{name} {factor:.3g}" for name, factor in factors.items())
        self.remarks.append(
            "standard deviations are too small by about the robust factor"
            f" {overall:.3g} (median of the test values): tested with them times {named}"
        )
        return factors, scales

    def _values(self, groups: Bools) -> Floats:
        """Return |w| of all rows of some groups that are testable."""
        rows = np.repeat(groups, np.diff(self.suspects.row_starts))
        with np.errstate(invalid="ignore", divide="ignore"):
            w = np.abs(self.tests.residual) / np.sqrt(self.tests.redundancy)
            return np.asarray(w[rows & (self.tests.redundancy > TESTABLE) & np.isfinite(w)])

    def _needs_robust_start(self) -> bool:
        if self.settings.robust is not None:
            return self.settings.robust
        if self.standing.status != "converged":
            return True
        everything = self._values(np.ones(len(self.suspects), dtype=bool))
        if len(everything) < ENOUGH:
            return False
        factor = max(_factor(everything), 1.0)
        images = self._values(np.asarray(self.suspects.kinds == 0))
        many = bool(images.size) and float(np.mean(images > FAR * factor)) > MANY
        return many or (self.settings.known and factor > OPTIMISTIC)

    def _robust_sizes(self) -> tuple[Floats, float] | None:
        """Return the sizes of residuals in a robust adjustment, and the factor of its standard deviations.

        None where no robust adjustment converges.

        The median of all is lifted by many gross errors, whose effects spread: the factor is found anew from
        residuals of the robust adjustment, until it stands.
        """
        active = self.tests.active & (self.suspects.kinds == 0)
        rows = np.repeat(active, np.diff(self.suspects.row_starts))
        expected = MEDIAN_OF_TWO * math.sqrt(float(np.mean(self.tests.redundancy[rows])))
        scale = max(_factor(self._values(active)), 1.0)
        sizes = self.trial.resist(scale)
        for _ in range(SCALES):
            if sizes is None:
                return None
            found = max(float(np.median(sizes[active])) / expected, 1.0)
            if found > 0.8 * scale:
                break
            scale = found
            sizes = self.trial.resist(scale)
        return None if sizes is None else (sizes, scale)

    def _start_robustly(self) -> None:
        """Put points aside where robust weights nearly vanish, and test them against all others.

        A robust adjustment tells that something is wrong with a point, but not which of its rays it is: of
        two rays both lose their weight, and a good one beside a large error often does.
        """
        suspects = self.suspects
        try:
            robust = self._robust_sizes()
        except LostSupportError:
            robust = None
        if robust is None:
            self.factors, self.scales = self._scales()
            return
        sizes, scale = robust
        candidates = np.flatnonzero((sizes > CANDIDATE * scale) & suspects.removable & self.tests.active)
        first, standing, start = self.tests, self.standing, self.out
        points = np.unique(suspects.points[candidates])
        choices, judged = self._on_points_aside(points[points >= 0].tolist(), candidates, first)
        others = candidates[~np.isin(suspects.points[candidates], sorted(judged))]
        entries = [self._as_it_was(group, first) for group in others.tolist()]
        entries += self._entries(choices, 0)
        self.out = start
        removed = self._apply(entries, [])
        if not removed:
            self._adjust(self.out)
        if not self.factors:
            self.factors, self.scales = self._scales()
        self.remarks.append(
            f"many observations disagree: a robust adjustment (Huber, then Cauchy) put {len(points)} points"
            " aside; tests against the photos of the others decided which of their rays stay out"
        )
        returned = self._take_back(0)
        self.rounds.append(
            Round(
                number=0,
                status=standing.status,
                weighted_sum_of_squares=standing.weighted_sum_of_squares,
                degrees_of_freedom=standing.degrees_of_freedom,
                tests=self.level.tests,
                limit=self.level.limit(0),
                removed=removed,
                returned=returned,
            )
        )

    def _on_points_aside(
        self, points: list[int], candidates: Indices, first: Tests
    ) -> tuple[list[Choice], set[int]]:
        """Adjust without some points and all candidates; choose on these points; tell which were judged."""
        out = self.out.copy()
        out.points |= set(points)
        aside = np.isin(self.suspects.points, points)
        aside[candidates] = True
        out.rows[np.repeat(aside, np.diff(self.suspects.row_starts))] = True
        try:
            self._adjust(out)
        except LostSupportError:
            # Photos are not determined without them: what has lost its weight goes, and is tested alone.
            return [], set()
        self.factors, self.scales = self._scales()
        choosing = self._choosing(np.asarray(self.suspects.removable), 0, ahead=False)
        return replace(choosing, tests=first).on_gone_points(points)

    def _as_it_was(self, group: int, tests: Tests) -> Removal:
        """Return the entry of a group that goes without a test of its own."""
        rows = self.suspects.rows(group)
        statistic, dimension = float(tests.statistic[group]), int(tests.rank[group])
        return self._entry(
            group,
            rows,
            0,
            statistic,
            statistic,
            dimension,
            self._unit().fisher(statistic, dimension),
            math.nan,
            tests.error[rows],
            tests.error_sd[rows],
            self.level.limit(0),
            (),
        )

    def _take_out(
        self, choices: list[Choice], number: int, remarks: list[str], returning: list[int]
    ) -> list[int]:
        removed = self._apply(self._entries(choices, number), remarks, returning)
        self._note_return(returning, number)
        return removed

    def _entries(self, choices: list[Choice], number: int) -> list[Removal]:
        """Return what was chosen as entries of the log."""
        entries = []
        for choice in choices:
            own = choice.chosen
            deviations = self.trial.deviations[own.rows]
            rivals = tuple(
                Rival(self.suspects.name(group), statistic, dimension, odds)
                for group, statistic, dimension, odds in own.rivals
            )
            entries.append(
                self._entry(
                    choice.group,
                    own.rows,
                    number,
                    choice.first_statistic,
                    own.statistic,
                    own.dimension,
                    own.fisher,
                    own.log_probability,
                    own.error * deviations,
                    np.sqrt(np.diagonal(own.cofactors)) * deviations,
                    choice.limit,
                    rivals,
                )
            )
        return entries

    def _note_return(self, places: list[int], number: int) -> None:
        for place in places:
            self.returns.add(self.log[place].group)
            self.log[place] = self._with_prediction(place).with_(returned=number)

    def _entry(
        self,
        group: int,
        rows: np.ndarray,
        number: int,
        first: float,
        statistic: float,
        dimension: int,
        fisher: float,
        log_probability: float,
        error: Floats,
        error_sd: Floats,
        limit: float,
        rivals: tuple[Rival, ...],
    ) -> Removal:
        suspects = self.suspects
        name = suspects.name(group)
        if len(rows) < len(suspects.rows(group)):
            name = f"{', '.join(suspects.row_name(int(row)) for row in rows)} of {name}"
        return Removal(
            round=number,
            group=group,
            kind=suspects.kind(group),
            name=name,
            rows=tuple(rows.tolist()),
            components=tuple(suspects.row_name(int(row)) for row in rows),
            units=tuple(suspects.unit(int(row)) for row in rows),
            dimension=dimension,
            first_statistic=first,
            statistic=statistic,
            fisher=fisher,
            log_probability=log_probability,
            limit=limit,
            error=tuple(error.tolist()),
            error_sd=tuple(error_sd.tolist()),
            redundancy=float(self.tests.least[group]),
            rivals=rivals,
        )

    def _apply(self, entries: list[Removal], remarks: list[str], returning: Sequence[int] = ()) -> list[int]:
        """Take groups out with what cannot stay without them, and adjust.

        Groups without which the network falls apart stay, and are said to.
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
                self._adjust(out)
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

    def _take_bad_photos_out(self) -> None:
        """Take out as one group each photo whose images all disagree: those of another exposure, wrong names.

        Such a photo spoils all around it, so that nothing can be told of single images. The median of its
        test values stands out: a few gross errors do not move it. Where that is by its observed station, the
        photo stays, and the station is left to its own test.
        """
        for _ in range(BAD_PHOTOS):
            middles = self._middles()
            if not len(middles) or np.isnan(middles).all():
                return
            worst, usual = int(np.nanargmax(middles)), float(np.nanmedian(middles))
            single = middles[worst] < EVEN * self._largest(worst)
            if (
                single
                or not middles[worst] > FAR * max(usual, 1.0)
                or self._is_by_station(worst, middles[worst])
            ):
                return
            said = f"its test values have the median {middles[worst]:.3g}, those of other photos {usual:.3g}"
            if self._photo_out(worst, 0, said) is None:
                return

    def _largest(self, photo: int) -> float:
        """Return the largest test value of the images of a photo, in standard deviations."""
        own = self.suspects.on_photo(photo)
        own = own[(self.suspects.kinds[own] == 0) & self._testable()[own]]
        return float(np.sqrt(self.tests.statistic[own] / self.tests.rank[own]).max(initial=0.0))

    def _middles(self) -> Floats:
        """Return the median of the test values of the images of each photo, in standard deviations."""
        suspects, tests = self.suspects, self.tests
        tested = (suspects.kinds == 0) & self._testable()
        size = np.sqrt(tests.statistic / np.maximum(tests.rank, 1))
        photos = int(suspects.photos.max(initial=-1)) + 1
        found: Floats = np.full(photos, math.nan)
        for photo in range(photos):
            own = suspects.on_photo(photo)
            own = own[tested[own]]
            if own.size >= LEAST_OF_PHOTO:
                found[photo] = float(np.median(size[own]))
        return found

    def _is_by_station(self, photo: int, middle: float) -> bool:
        """Whether the images of a photo agree as soon as its observed position and attitude are out."""
        own = self.suspects.on_photo(photo)
        stations = own[(self.suspects.kinds[own] != 0) & self.tests.active[own]]
        if not stations.size:
            return False
        out, before = self.out.copy(), self.out
        for group in stations.tolist():
            out.rows[self.suspects.rows(group)] = True
        try:
            self._adjust(out)
            left = self._middles()[photo]
            self._adjust(before)
        except LostSupportError:
            return False
        return bool(left < middle / FAR)

    def _take_photos_out(self, number: int) -> list[int]:
        """Take out as a whole the photos most of whose images are out, each by itself."""
        suspects = self.suspects
        single = [self.log[place] for place in range(len(self.log)) if self.log[place].is_out]
        photos = [int(suspects.photos[each.group]) for each in single if each.group in self.images]
        counts = np.bincount([photo for photo in photos if photo >= 0])
        added = []
        for photo in np.flatnonzero(counts >= LEAST_OF_PHOTO).tolist():
            images = sum(group in self.images for group in suspects.on_photo(photo).tolist())
            if photo in self.out.photos or counts[photo] <= MOST_OF_PHOTO * images:
                continue
            said = f"{counts[photo]} of its {images} images had gone one by one"
            place = self._photo_out(photo, number, said)
            added += [] if place is None else [place]
        return added

    def _photo_out(self, photo: int, number: int, said: str) -> int | None:
        """Take a photo out with all that was observed of it; return the place of its entry in the log."""
        suspects = self.suspects
        own = suspects.on_photo(photo)
        images = [group for group in own.tolist() if group in self.images]
        out, before = self.out.copy(), self.standing
        out.rows[np.concatenate([suspects.rows(group) for group in own.tolist()])] = True
        out.photos.add(photo)
        consequences: list[str] = []
        for group in images:
            for point in sorted(self.trial.consequences(out, group)[0] - out.points):
                out.points.add(point)
                consequences += self._left(out, point)
        try:
            self._adjust(out)
        except LostSupportError:
            self._adjust(self.out)
            return None
        omega = before.weighted_sum_of_squares - self.standing.weighted_sum_of_squares
        freedom = before.degrees_of_freedom - self.standing.degrees_of_freedom
        self.log.append(
            Removal(
                round=number,
                group=images[0],
                kind="photo",
                name=f"all of {suspects.photo_name(photo)}",
                rows=(),
                components=(),
                units=(),
                dimension=freedom,
                first_statistic=omega,
                statistic=omega,
                fisher=math.nan,
                log_probability=float(log_chi_square(max(omega, 0.0), max(freedom, 1))),
                limit=self.level.limit(0),
                error=(),
                error_sd=(),
                redundancy=math.nan,
                consequences=(said, *consequences),
            )
        )
        return len(self.log) - 1

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
        self.log.append(entry.with_(kept="nothing else determines what it belongs to"))

    def _out_with(self, out: Out, entry: Removal) -> Removal:
        """Put a group out, and what cannot stay without it."""
        out.rows[list(entry.rows)] = True
        points, photos = self.trial.consequences(out, entry.group)
        consequences = list(entry.consequences)
        if photos:
            out.rows[list(entry.rows)] = False
            self.kept.add(entry.group)
            return entry.with_(kept="it would leave a photo with fewer than three points")
        own = int(self.suspects.points[entry.group])
        if _NOT_DETERMINED in consequences and own >= 0:
            points = points | {own}
        for point in sorted(points - out.points):
            out.points.add(point)
            consequences += self._left(out, point)
        return entry.with_(consequences=tuple(dict.fromkeys(consequences))) if consequences else entry

    def _left(self, out: Out, point: int) -> Iterator[str]:
        """Put everything of a point out, and say so."""
        for group in self.suspects.on_point(point).tolist():
            rows = self.suspects.rows(group)
            if not out.rows[rows].all():
                out.rows[rows] = True
                yield f"{self.suspects.name(group)} is no longer used (its point is left with one ray)"

    def _adjust(self, out: Out) -> None:
        self.standing = self.trial.adjust(out)
        self.out = out
        self.tests = self.trial.tests()

    def _take_back(self, number: int) -> list[int]:
        """Take back what agrees with the rest, one adjustment after the other."""
        returning = self._agreeing()
        if not returning:
            return []
        out = self.out.copy()
        for place in returning:
            out.rows[list(self.log[place].rows)] = False
        try:
            self._adjust(out)
        except LostSupportError:
            return []
        self._note_return(returning, number)
        return returning + self._take_back(number)

    def _agreeing(self) -> list[int]:
        """Test what is out against the rest, and return what agrees: the best, or all that are apart."""
        places = [place for place, each in enumerate(self.log) if each.is_out and each.rows]
        if not places:
            return []
        predictions = self.trial.predictions([self.log[place].group for place in places])
        known = [(place, own) for place, own in zip(places, predictions, strict=True) if own is not None]
        log_p = self._log_probability(
            np.array([own.statistic for _, own in known]),
            np.array([len(own.rows) for _, own in known]),
            np.array([self.log[place].group for place, _ in known], dtype=np.int64),
        ).tolist()
        self.predicted = {place: (own, value) for (place, own), value in zip(known, log_p, strict=True)}
        limit = math.log(self.level.limit(0))
        agreeing = sorted(
            (-value, place)
            for place, (_, value) in self.predicted.items()
            if value >= limit and self.log[place].group not in self.returns
        )
        return self._apart([place for _, place in agreeing])

    def _apart(self, places: list[int]) -> list[int]:
        """Return the first where every one is tested alone, else those that have no photo in common."""
        if self.trial.whole:
            return places[:1]
        taken: set[int] = set()
        apart = []
        for place in places:
            group = self.log[place].group
            photo = int(self.suspects.photos[group])
            photos = {photo} if photo >= 0 else set(self.suspects.loads(group).tolist())
            if not photos & taken:
                taken |= photos
                apart.append(place)
        return apart

    def _with_prediction(self, place: int) -> Removal:
        """Return an entry of the log with what the rest says of it."""
        if place not in self.predicted:
            return self.log[place]
        prediction, log_p = self.predicted[place]
        return self.log[place].with_(
            prediction=prediction.statistic,
            prediction_log_probability=log_p,
            prediction_error=prediction.error,
        )

    def _log_probability(self, statistic: Floats, dimension: Indices, groups: Indices) -> Floats:
        """Return log-probabilities of what is out as observations of the network without it."""
        if self.settings.known:
            return log_chi_square(statistic / self.scales[groups], dimension)
        f = self.standing.degrees_of_freedom
        if not (f > 0 and self.standing.weighted_sum_of_squares > 0):
            return np.zeros(len(statistic))
        s2 = self.standing.weighted_sum_of_squares / f
        return log_fisher(statistic / dimension / s2, dimension, f)


_NOT_DETERMINED = "its point is no longer determined and has left the network"


def _factor(values: Floats) -> float:
    """Return the robust standard deviation of test values whose sizes are given."""
    return float(np.median(values)) / MEDIAN if values.size else 1.0


def verdict_of(standing: Standing) -> str:
    """Return what the global test says of a standing, in a few words."""
    test = global_test(standing.weighted_sum_of_squares, standing.degrees_of_freedom)
    if test is None:
        return "no degrees of freedom"
    said = "too high" if test.rejected_high else "too low" if test.rejected_low else "accepted"
    return f"unit variance {test.variance:.4g}, expected {test.limits[0]:.3g} to {test.limits[1]:.3g}: {said}"
