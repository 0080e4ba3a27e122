"""Data snooping in the core, with its log: all removals and their reasons."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.results.network_trial import (
    CONTROL,
    KINDS,
    LostSupportError,
    NamedSuspects,
    NetworkTrial,
    Out,
    Standing,
    Tests,
)
from photogram.results.snooping_options import SnoopOptions
from photogram.words import Phrase, phrase

LN10 = math.log(10)
MAX_ROWS = 1500  # Largest number of rows for the complete R; an exact round has this number of solutions
NEAR = 3.0  # Likelihood ratio of alternatives in the log
ODDS = 20.0  # Largest likelihood ratio of alternatives
KEPT = {
    code: Phrase(f"snooping.{code}") for code in ("needed", "photo-undetermined", "disputed")
}  # Reasons for not removing a group although its test rejects


@dataclass(frozen=True)
class Aside:
    """Exclusions by the consensus from which a network was restarted."""

    images: Indices  # Images, by number, that do not agree with most of their point and photo
    photos: dict[int, str | Phrase]  # Photos whose observations agree with no pose, with the reason
    found_by: str | Phrase = Phrase("snooping.by-consensus")  # The origin of the start
    control: Indices | tuple[()] = ()  # Control points, by number


@dataclass(frozen=True)
class Rival:
    group: int
    name: str
    statistic: float  # T when the other was chosen
    dimension: int
    odds: float  # likelihood ratio of the chosen group and this one


@dataclass(frozen=True)
class Removal:
    """A removed group of observations, or a part of one."""

    round: int  # from 1; 0: by a robust adjustment before the first
    group: int  # number among all groups
    kind: str  # type of its observations
    subject: Phrase
    rows: tuple[int, ...]  # removed rows
    components: tuple[str, ...]
    units: tuple[str, ...]
    dimension: int  # m', number of directions in which the error is visible
    first_statistic: float  # T at the start of the round
    # statistic, fisher: T conditional on earlier removals of the round, and its F
    statistic: float
    fisher: float
    log_probability: float  # Natural logarithm of the p-value
    limit: float  # Level it was compared with
    # Estimated errors of the rows and standard deviations (a priori unit weight), in the units of the rows
    error: tuple[float, ...]
    error_sd: tuple[float, ...]
    redundancy: float  # The smallest redundancy of a visible direction
    rivals: tuple[Rival, ...] = ()  # groups that may contain the error instead
    consequences: tuple[Phrase | str, ...] = ()  # further removals and their reasons
    # prediction, prediction_log_probability, prediction_error: T of it, its log-probability, and observed
    # minus predicted, from the other observations; None if its point or photo is excluded
    prediction: float | None = None
    prediction_log_probability: float | None = None
    prediction_error: tuple[float, ...] = ()
    returned: int | None = None  # round of reinstatement; None while it is excluded
    kept: Phrase | str = ""  # reason for not removing it although its test rejects

    @property
    def name(self) -> str:
        """Name of the group in English."""
        return str(self.subject)

    @property
    def log10_p(self) -> float:
        return self.log_probability / LN10

    @property
    def prediction_log10_p(self) -> float | None:
        log_p = self.prediction_log_probability
        return None if log_p is None else log_p / LN10

    @property
    def is_out(self) -> bool:
        """Whether it is removed and not reinstated."""
        return self.returned is None and not self.kept

    @property
    def in_dispute(self) -> tuple[Rival, ...]:
        """Alternatives that are nearly as likely: likelihood ratio of less than three."""
        return tuple(rival for rival in self.rivals if rival.odds < NEAR)

    @property
    def sentence(self) -> Phrase:
        """The removed group with its alternatives."""
        return _alternatives(self, self.in_dispute)


@dataclass(frozen=True)
class Exchange:
    """Exchanged names of two points on a photo."""

    photos: tuple[str, ...]  # several if the images do not determine the photo
    points: tuple[str, str]
    # as_named, exchanged: T of both points with the given names, and with exchanged names on the first of the
    # photos
    as_named: float
    exchanged: float
    dimension: int  # degrees of freedom of both

    @property
    def sentence(self) -> Phrase:
        one, other = self.points
        photos = [Phrase("named.photo", {"photo": photo.removeprefix("photo ")}) for photo in self.photos]
        return Phrase("exchange", {"one": one, "other": other, "photos": photos})

    @property
    def probable(self) -> Phrase:
        """The sentence for a network that was not adjusted without it."""
        one, other = self.points
        return Phrase("exchange.probable", {"one": one, "other": other, "photos": list(self.photos)})

    @property
    def reason(self) -> Phrase:
        fields = {"named": self.as_named, "exchanged": self.exchanged, "dimension": self.dimension}
        return Phrase(f"exchange.reason{'' if math.isfinite(self.as_named) else '.apart'}", fields)


@dataclass(frozen=True)
class Round:
    number: int  # From 1; 0 for the robust start
    status: str  # of the adjustment at the start of the round
    weighted_sum_of_squares: float  # Omega and f at the start
    degrees_of_freedom: int
    tests: int  # number of tested groups
    limit: float  # Probability below which a group is removed
    removed: Sequence[int]  # numbers in the log
    returned: Sequence[int]


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of data snooping."""

    log: list[Removal]  # all removals in order
    rounds: list[Round]  # the last one is without removals
    out: Out  # excluded observations
    tests: int  # number of tested groups, as at the start
    before: Standing  # with all observations, and without the excluded ones
    standing: Standing
    # Robust factors of standard deviations by type; empty if the given ones are used
    factors: dict[str, float]
    active: Bools  # (G,) groups in use at the end
    remarks: list[Phrase]


def snooped(
    trial: NetworkTrial,
    options: SnoopOptions,
    afresh: Callable[[], Aside | None] | None = None,
    common: Callable[[Tests, Standing], Sequence[Phrase]] | None = None,
    start: Aside | None = None,
) -> Outcome:
    """Remove gross errors from a network and return the outcome.

    `start` excludes suspected images and control at first; those that agree with the others are included
    again.

    `afresh` restarts the trial from a consensus if its adjustment diverges, and returns the rejected
    observations or None. `common` returns common errors of sets that explain the tests better than single
    errors. Then nothing is removed: removing the members one after the other would hide the cause.
    """
    begin = partial(
        _photocore.NetworkSnooping,
        level=options.level if options.fdr is None else options.fdr,
        is_rate=options.fdr is not None,
        known=options.is_known,
        robust=options.robust,
        max_rounds=options.max_rounds,
        control=trial.control,
        rough=trial.rough,
        exact=trial.exact,
        max_rows=MAX_ROWS,
        is_supported=trial.supported.tolist(),
    )

    def excluded(aside: Aside) -> tuple[list[int], set[int]]:
        suspects = trial.suspects
        control = (suspects.kinds == CONTROL) & np.isin(suspects.subjects, aside.control)
        groups = [*suspects.of_images(aside.images).tolist(), *np.flatnonzero(control).tolist()]
        return groups, set(aside.photos)

    aside = start
    try:
        core = trial.asked(begin, trial.core, aside and excluded(aside))
    except LostSupportError:
        aside = None if options.robust is False or afresh is None else afresh()
        if aside is None:
            raise
        core = trial.asked(begin, trial.core, excluded(aside))
    else:
        again = afresh() if afresh is not None and core.needs_consensus else None
        if again is not None:
            aside = again
            trial.asked(core.restart, trial.core, excluded(aside))
    errors: Sequence[Phrase] = []
    if common is not None and trial.asked(core.may_have_common_errors, trial.core):
        standing = Standing(*trial.asked(core.adjust_exactly, trial.core))
        errors = common(trial.tests(), standing)
    if not errors:
        trial.asked(core.run, trial.core)
    log = core.finish()
    names = _Names(trial.suspects, aside)
    remarks = [names.remark(*remark, rounds=options.max_rounds) for remark in log["remarks"]]
    if errors:
        remarks.append(phrase("snooping.common", errors=list(errors)))
    return Outcome(
        log=[names.removal(removal) for removal in log["removals"]],
        rounds=[
            Round(number, status, omega, freedom, log["tests"], limit, removed, returned)
            for number, (status, omega, freedom), limit, removed, returned in log["rounds"]
        ],
        out=Out(log["rows"], set(log["points"]), set(log["photos"])),
        tests=log["tests"],
        before=Standing(*log["before"]),
        standing=Standing(*log["after"]),
        factors={KINDS[kind]: factor for kind, factor in log["factors"]},
        active=log["active"],
        remarks=remarks,
    )


class _Names:
    def __init__(self, suspects: NamedSuspects, aside: Aside | None) -> None:
        self.suspects, self.aside = suspects, aside

    def removal(self, entry: dict[str, Any]) -> Removal:
        suspects, group, rows, photo = self.suspects, entry["group"], entry["rows"], entry.pop("photo")
        components = tuple(map(suspects.row_name, rows))
        if photo is not None:
            subject = Phrase("named.whole", suspects.photo_name(photo).fields)
        elif len(rows) < len(suspects.rows(group)):
            axes = [Phrase(f"axis.{each}") for each in components]
            subject = Phrase("named.parts", {"axes": axes, "named": suspects.name(group)})
        else:
            subject = suspects.name(group)
        if entry["prediction"] is not None:
            names = ("prediction", "prediction_log_probability", "prediction_error")
            entry |= dict(zip(names, entry["prediction"], strict=True))
        entry |= {
            "kind": suspects.kind(group) if photo is None else "photo",
            "subject": subject,
            "components": components,
            "units": tuple(map(suspects.unit, rows)),
            "rivals": [
                Rival(rival, str(suspects.name(rival)), *values) for rival, *values in entry["rivals"]
            ],
            "consequences": [self._consequence(*each) for each in entry["consequences"]],
            "kept": KEPT[entry["kept"]] if entry["kept"] else "",
        }
        fields: dict[str, Any] = {
            name: tuple(own) if isinstance(own, list) else own for name, own in entry.items()
        }
        return Removal(**fields)

    def _consequence(self, code: str, values: list[float]) -> Phrase | str:
        if code == "contradicted" and self.aside is not None:
            return self.aside.photos[int(values[0])]
        fields: dict[str, Any] = {}
        if code == "single-ray":
            fields["name"] = self.suspects.name(int(values[0]))
        elif code == "median":
            fields["median"], fields["usual"] = values
        elif code == "singly":
            fields["removed"], fields["images"] = map(int, values)
        return Phrase(f"snooping.{code}", fields)

    def remark(
        self, code: str, values: list[float], factors: list[tuple[int, float]], *, rounds: int
    ) -> Phrase:
        """Return a remark; `rounds` is the largest number of rounds."""
        if code == "factors":
            named = [phrase("snooping.factor", kind=KINDS[kind], factor=factor) for kind, factor in factors]
            return phrase("snooping.factors", overall=values[0], factors=named)
        if code == "aside":
            return phrase("snooping.aside", start=phrase("snooping.robust"), n=int(values[0]))
        if code == "not-ended" or self.aside is None:
            return phrase("snooping.not-ended", n=rounds)
        images, agreeing = map(int, values)
        parts = [phrase("snooping.images", n=images)] if images else []
        parts += [self.suspects.photo_name(photo) for photo in self.aside.photos]
        return Phrase(f"snooping.{code}", {"start": self.aside.found_by, "parts": parts, "n": agreeing})


def disputes(log: Sequence[Removal]) -> list[Phrase]:
    """Return observations with alternatives, also those that the datum requires."""
    found = [_alternatives(each, each.rivals) for each in log if each.kept == KEPT["disputed"]]
    needed = [each for each in log if each.kept == KEPT["needed"] and each.kind != "image"]
    needed.sort(key=lambda each: -each.statistic)
    if len(needed) > 1:
        first, *others = needed
        odds = [math.exp(min(first.statistic - each.statistic, 1e3) / 2) for each in others]
        rivals = zip(others, odds, strict=True)
        near = [
            Rival(each.group, each.name, each.statistic, each.dimension, own)
            for each, own in rivals
            if own < ODDS
        ]
        if near:
            found.append(_alternatives(first, near))
    return found


def _alternatives(entry: Removal, rivals: Sequence[Rival]) -> Phrase:
    names = [phrase("snooping.rival", name=rival.name, odds=rival.odds) for rival in rivals]
    return phrase("snooping.rivals", groups=[entry.subject, *names])
