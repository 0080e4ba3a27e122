"""What snooping has done, and why: a record of everything that was taken out."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.lazy_dataclasses import dataclass, replace
from photogram.words import Phrase

__all__ = ["Removal", "Rival", "Round"]


@dataclass(frozen=True)
class Rival:
    """What may hold the error instead.

    Attributes
    ----------
    name
        What it is called.
    statistic, dimension
        Its T and degrees of freedom when the other was chosen.
    odds
        That of the two the chosen one errs, to one.
    """

    name: str
    statistic: float
    dimension: int
    odds: float


@dataclass(frozen=True)
class Removal:
    """A group of observations, or a part of one, that was taken out.

    Attributes
    ----------
    round
        In which round, from 1; 0 before the first, by a robust adjustment.
    group
        Its number among all groups.
    kind, subject
        The kind of its observations, and its name as a message.
    rows, components, units
        The rows that went, what they are, and their units.
    dimension
        m', the directions in which the error shows.
    first_statistic
        T at the start of the round.
    statistic, fisher
        T conditional on what went before it in the round, and the F that it gives.
    log_probability
        Natural logarithm of the probability that a good group has as large a value.
    limit
        The level that it was compared with.
    error, error_sd
        The estimated error and its standard deviation (a priori unit weight), by row, in its unit.
    redundancy
        The smallest redundancy of a direction that shows.
    rivals
        What may hold the error instead, the nearest first.
    consequences
        What went with it, and why.
    prediction, prediction_log_probability, prediction_error
        T of it, its log-probability, and observed minus predicted, against the network without it; None where
        its point or photo is out with it.
    returned
        The round in which it came back; None while it is out.
    kept
        Why it was not taken out although its test says so; empty otherwise.
    """

    round: int
    group: int
    kind: str
    subject: Phrase
    rows: tuple[int, ...]
    components: tuple[str, ...]
    units: tuple[str, ...]
    dimension: int
    first_statistic: float
    statistic: float
    fisher: float
    log_probability: float
    limit: float
    error: tuple[float, ...]
    error_sd: tuple[float, ...]
    redundancy: float
    rivals: tuple[Rival, ...] = ()
    consequences: tuple[str, ...] = ()
    prediction: float | None = None
    prediction_log_probability: float | None = None
    prediction_error: tuple[float, ...] = ()
    returned: int | None = None
    kept: str = ""

    @property
    def name(self) -> str:
        """Its name in English."""
        return str(self.subject)

    @property
    def is_out(self) -> bool:
        """Whether it was taken out and has not come back."""
        return self.returned is None and not self.kept

    def with_(self, **changes: object) -> Removal:
        """Return the same with other values."""
        return replace(self, **changes)  # type: ignore[arg-type]

    @property
    def in_dispute(self) -> tuple[Rival, ...]:
        """Rivals that are nearly as likely: odds of less than three."""
        return tuple(rival for rival in self.rivals if rival.odds < NEAR)

    @property
    def sentence(self) -> str:
        """What was found, with what it cannot be told apart from."""
        others = [f"{rival.name} (odds {rival.odds:.2g} : 1)" for rival in self.in_dispute]
        return " or ".join([self.name, *others])


NEAR = 3.0
"""Odds below which both are named."""


@dataclass(frozen=True)
class Round:
    """One round.

    Attributes
    ----------
    number
        From 1; 0 for the robust start.
    status
        Of the adjustment at its start.
    weighted_sum_of_squares, degrees_of_freedom
        Omega and f at its start.
    tests
        How many groups are tested.
    limit
        Probability below which a group is taken out.
    removed, returned
        Numbers in the log of what went and what came back.
    remarks
        What else there is to say.
    """

    number: int
    status: str
    weighted_sum_of_squares: float
    degrees_of_freedom: int
    tests: int
    limit: float
    removed: Sequence[int]
    returned: Sequence[int]
    remarks: Sequence[str] = ()
