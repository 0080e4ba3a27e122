"""What data snooping gives: the adjusted network without gross errors, and the log of what was taken out."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import orjson

from photogram.io import json
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.exchanged_names import Exchange
from photogram.results.network import AdjustedNetwork
from photogram.show.methods import Paged
from photogram.show.quantity import members
from photogram.show.sections import Section, composed, headline, verdict_sections
from photogram.show.summary import Brief, Rows, few
from photogram.statistics.findings import Removed
from photogram.statistics.limits import global_test
from photogram.statistics.snooping.log import Removal, Rival
from photogram.statistics.snooping.snooping import Outcome
from photogram.statistics.snooping.suspects import Standing, Suspects
from photogram.statistics.snooping.taking_out import Settings
from photogram.words import Phrase

if TYPE_CHECKING:
    import pandas as pd

    from photogram.statistics.verdict import Verdict

__all__ = ["LN10", "Snooped", "estimated_errors", "recorded", "rivals_of"]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Snooped(Brief, Paged):
    """A network after data snooping.

    Attributes
    ----------
    result
        The adjusted network without what was taken out. Its standard deviations and its variance of unit
        weight hold after selection: the largest residuals are gone.
    outcome
        The log with all that belongs to it.
    suspects
        The groups of observations that were tested.
    settings
        How.
    exchanged
        Names of points that are exchanged, among the images that are out.
    """

    result: AdjustedNetwork
    outcome: Outcome
    suspects: Suspects
    settings: Settings
    exchanged: tuple[Exchange, ...] = ()

    def brief(self) -> tuple[str, Rows]:
        """Return what was taken out of what, in a few lines."""
        title, rows = self.result.brief()
        own = [
            ("verdict", self.verdict.headline),
            ("tests", f"{self.outcome.tests:,}"),
            ("removed", few([entry.name for entry in self.removed])),
        ]
        return f"{title}, without gross errors", [*own, *(row for row in rows if row[0] != "verdict")]

    @property
    def verdict(self) -> Verdict:
        """The verdict of the result, which considers the removed observations."""
        return self.result.verdict

    @property
    def log(self) -> list[Removal]:
        """Everything that was taken out, in order, also what came back or had to stay."""
        return self.outcome.log

    @property
    def removed(self) -> list[Removal]:
        """What is out at the end, in order."""
        return [entry for entry in self.outcome.log if entry.is_out]

    @property
    def rivals(self) -> list[str]:
        """Sentences on what cannot be told apart from what was removed."""
        return [entry.sentence for entry in self.removed if entry.in_dispute]

    def share_removed(self, kind: str) -> float:
        """Return the share of the groups of a kind that are out, with what went with them."""
        own = [group for group in range(len(self.suspects)) if self.suspects.kind(group) == kind]
        if not own:
            return 0.0
        gone = sum(bool(self.outcome.out.rows[self.suspects.rows(group)].any()) for group in own)
        return gone / len(own)

    def table(self) -> pd.DataFrame:
        """Return the log as a data frame, a row for each component that was taken out, with its unit."""
        import pandas as pd

        return pd.DataFrame([row for entry in self.log for row in _rows(entry)], columns=list(_COLUMNS))

    def document(self) -> dict[str, Any]:
        """Return the log as it stands in the JSON document."""
        outcome, settings = self.outcome, self.settings
        return {
            "family_level" if not settings.fdr else "false_discovery_rate": settings.level,
            "unit_weight": "known" if settings.known else "unknown",
            "distribution": "chi2" if settings.known else "F",
            "tests": outcome.tests,
            "robust_factors": outcome.factors,
            "before": _standing(outcome.before),
            "after": _standing(outcome.standing),
            "rounds": [
                members(each, "number", *_STANDING, limit_p="limit")
                | members(each, "removed", "returned", "remarks")
                for each in outcome.rounds
            ],
            "log": [_member(entry) for entry in self.log],
            "exchanged_names": [
                members(each, "photos", "points", T_as_named="as_named", T_exchanged="exchanged")
                | {"dimension": each.dimension}
                for each in self.exchanged
            ],
            "remarks": outcome.remarks,
        }

    def to_json(self) -> bytes:
        """Return the whole result with its verdict and the log, `snooping`, as one JSON document (UTF-8)."""
        own = {"snooping": self.document()}
        return json.to_json({**orjson.loads(self.result.to_json()), **own})

    def sections(self) -> list[Section]:
        """Return the log as titled sections of a report."""
        return [*verdict_sections(self.verdict), *self._own()]

    def _own(self) -> list[Section]:
        lines = [line for entry in self.log for line in _lines(entry)] or ["nothing"]
        return [("Data snooping", self._head()), ("Taken out, in order", lines)]

    def report(self) -> str:
        """Return the report: that of the network without what was taken out, then the log of that."""
        return self.result.report() + "\n" + composed(headline("data snooping"), self._own())

    def _head(self) -> list[str]:
        outcome, settings = self.outcome, self.settings
        weight = "known: chi-square tests" if settings.known else "unknown: F tests"
        rate = "false discovery rate" if settings.fdr else "family level"
        out = len(self.removed)
        lines = [
            f"{'unit weight':<36}{weight}",
            f"{rate:<36}{settings.level:g} over {outcome.tests} tests, kept in all rounds",
            f"{'unit variance before':<36}{_said(outcome.before)}",
            f"{'unit variance after':<36}{_said(outcome.standing)}",
            f"{'rounds':<36}{len(outcome.rounds)}",
            f"{'taken out':<36}{out}, returned {sum(e.returned is not None for e in self.log)},"
            f" suspect but kept {sum(bool(e.kept) for e in self.log)}",
            *outcome.remarks,
            *(f"{each.sentence}: {each.reason}" for each in self.exchanged),
        ]
        if out:
            lines.append(f"the unit variance holds after removal of {out} groups: it is biased low by little")
        return lines


def recorded(found: Snooped) -> Snooped:
    """Return the same with the removed observations as part of its result."""
    record = Removed(
        [{**_member(entry), "subject": entry.subject} for entry in found.removed],
        images=found.share_removed("image"),
        control=found.share_removed("control"),
        rivals=found.rivals,
        exchanged=[each.sentence for each in found.exchanged],
        kept=[
            Phrase("line.kept", {"name": entry.subject, "reason": entry.kept})
            for entry in found.log
            if entry.kept
        ],
    )
    return replace(found, result=replace(found.result, snooped=record))


_COLUMNS = (
    *("round", "kind", "name", "component", "unit", "error", "error_sd"),
    *("dimension", "first_T", "T", "F", "log10_p", "limit_p", "redundancy"),
    *("rivals", "consequences", "predicted_error", "prediction_T", "prediction_log10_p", "returned", "kept"),
)


def _rows(entry: Removal) -> list[dict[str, Any]]:
    """Return the rows of the table: what the document has, but for what each component has of its own."""
    member = _member(entry)
    log_p = member["prediction_log10_p"]
    common = member | {
        "rivals": rivals_of(entry.rivals, 3),
        "consequences": "; ".join(entry.consequences),
        "prediction_T": math.nan if entry.prediction is None else entry.prediction,
        "prediction_log10_p": math.nan if log_p is None else log_p,
        "kept": entry.kept,
    }
    names = ("component", "unit", "error", "error_sd", "predicted_error")
    predicted = entry.prediction_error or (math.nan,) * len(entry.rows)
    rows = zip(entry.components, entry.units, entry.error, entry.error_sd, predicted, strict=True)
    return [common | dict(zip(names, row, strict=True)) for row in rows]


LN10 = math.log(10)


def _member(entry: Removal) -> dict[str, Any]:
    log_p, after = entry.log_probability, entry.prediction_log_probability
    return {
        **members(entry, "round", "kind", "name", "components", "units", "dimension"),
        **members(entry, first_T="first_statistic", T="statistic", F="fisher"),
        "p": math.nan if math.isnan(log_p) else math.exp(log_p),
        "log10_p": log_p / LN10,
        **members(entry, limit_p="limit", estimated_error="error", estimated_error_sd="error_sd"),
        "redundancy": entry.redundancy,
        "rivals": [
            members(rival, "name", T="statistic") | members(rival, "dimension", "odds")
            for rival in entry.rivals
        ],
        **members(entry, "consequences", prediction_T="prediction"),
        "prediction_log10_p": None if after is None else after / LN10,
        **members(entry, predicted_error="prediction_error", returned="returned"),
        "kept": entry.kept or None,
    }


_STANDING = ("status", "weighted_sum_of_squares", "degrees_of_freedom")


def _standing(standing: Standing) -> dict[str, Any]:
    f = standing.degrees_of_freedom
    variance = standing.weighted_sum_of_squares / f if f > 0 else None
    return members(standing, *_STANDING) | {"variance_of_unit_weight": variance}


def _said(standing: Standing) -> str:
    test = global_test(standing.weighted_sum_of_squares, standing.degrees_of_freedom)
    if test is None:
        return "undefined: no degrees of freedom"
    said = "too high" if test.rejected_high else "too low" if test.rejected_low else "as expected"
    expected = f"{test.limits[0]:.3f} to {test.limits[1]:.3f}"
    freedom = standing.degrees_of_freedom
    return f"{test.variance:.4f} with {freedom} degrees of freedom, expected {expected}: {said}"


def rivals_of(rivals: Iterable[Rival], figures: int) -> str:
    """Return what else may be wrong in the place of what was taken out, with so many figures of the odds."""
    return "; ".join(f"{rival.name} ({rival.odds:.{figures}g} : 1)" for rival in rivals)


def estimated_errors(entry: Removal) -> str:
    """Return by how much the components of what was taken out are wrong."""
    rows = zip(entry.components, entry.error, entry.units, entry.error_sd, strict=True)
    return ", ".join(
        f"{component} {error:.4g} {unit} (sd {sd:.2g})".replace("  ", " ")
        for component, error, unit, sd in rows
    )


def _lines(entry: Removal) -> list[str]:
    """Write an entry of the log: what, why, how large, what else it may be, what went with it."""
    if entry.kept:
        state = f"suspect, kept: {entry.kept}"
    elif entry.returned is not None:
        state = f"round {entry.round}, returned in round {entry.returned}"
    else:
        state = f"round {entry.round}"
    errors, lines = estimated_errors(entry), [f"{entry.name}: {state}"]
    if not math.isnan(entry.log_probability):
        lines.append(
            f"    T {entry.statistic:.2f} ({entry.first_statistic:.2f} at first sight), dimension"
            f" {entry.dimension}, F {entry.fisher:.2f}, log10 p {entry.log_probability / LN10:.1f}"
            f" (limit {math.log10(entry.limit):.1f})"
        )
    if errors:
        lines.append(f"    estimated error {errors}; redundancy {entry.redundancy:.3f}")
    lines += [
        f"    or {rival.name}: T {rival.statistic:.2f}, odds {rival.odds:.2g} : 1" for rival in entry.rivals
    ]
    lines += [f"    {consequence}" for consequence in entry.consequences]
    if entry.prediction is not None and entry.prediction_log_probability is not None:
        lines.append(
            f"    against the rest: T {entry.prediction:.2f}, log10 p"
            f" {entry.prediction_log_probability / LN10:.1f}"
        )
    return lines
