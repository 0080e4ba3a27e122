"""The log of data snooping: all removals and their reasons."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.lazy_dataclasses import dataclass, replace
from photogram.words import Phrase, phrase


@dataclass(frozen=True)
class Rival:
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
    def is_out(self) -> bool:
        """Whether it is removed and not reinstated."""
        return self.returned is None and not self.kept

    def with_(self, **changes: object) -> Removal:
        """Return a copy with changed values."""
        return replace(self, **changes)  # type: ignore[arg-type]

    @property
    def in_dispute(self) -> tuple[Rival, ...]:
        """Alternatives that are nearly as likely: likelihood ratio of less than three."""
        return tuple(rival for rival in self.rivals if rival.odds < NEAR)

    @property
    def sentence(self) -> Phrase:
        """The removed group with its alternatives."""
        rivals = [phrase("snooping.rival", name=rival.name, odds=rival.odds) for rival in self.in_dispute]
        return phrase("snooping.rivals", groups=[self.subject, *rivals])


NEAR = 3.0  # Likelihood ratio of alternatives in the log


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
