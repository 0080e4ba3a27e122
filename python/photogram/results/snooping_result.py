"""The result of data snooping: network without gross errors, log, and exchanged names."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.network import AdjustedNetwork
from photogram.results.network_trial import NamedSuspects, Standing
from photogram.results.snooping_log import Exchange, Outcome, Removal, Rival, disputes
from photogram.results.snooping_options import SnoopOptions
from photogram.show.methods import Documented
from photogram.show.page import Document, Fact, Facts, Part, Remarks, Section, about
from photogram.show.quantity import Quantity, Table, for_people, members, members_of_each, of_each, records
from photogram.statistics.findings import Removed
from photogram.statistics.limits import global_test
from photogram.summaries import Rows, few
from photogram.words import Phrase

if TYPE_CHECKING:
    import pandas as pd

    from photogram.statistics.verdict import Verdict


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Snooped(Documented):
    """A network after data snooping.

    Attributes
    ----------
    result
        The adjusted network without the removed observations. Its standard deviations and its variance of
        unit weight are conditional on the selection: the largest residuals are removed.
    outcome
        The log with its data.
    suspects
        The groups of observations that were tested.
    options
        The options of data snooping.
    exchanged
        Names of points that are exchanged, among the excluded images.
    """

    result: AdjustedNetwork
    outcome: Outcome
    suspects: NamedSuspects
    options: SnoopOptions
    exchanged: tuple[Exchange, ...] = ()

    def brief(self) -> tuple[str, Rows]:
        """Return a summary of the removed observations."""
        title, rows = self.result.brief()
        own = [
            ("verdict", self.verdict.headline),
            ("tests", about("count", n=self.outcome.tests)),
            ("removed", few([entry.name for entry in self.removed])),
        ]
        others = [row for row in rows if row[0] != "verdict"]
        return about("brief.without-errors", title=title), [*own, *others]

    @property
    def verdict(self) -> Verdict:
        """The verdict of the result, which considers the removed observations."""
        return self.result.verdict

    @property
    def log(self) -> list[Removal]:
        """All removals in order, including reinstated and retained observations."""
        return self.outcome.log

    @property
    def removed(self) -> list[Removal]:
        """The removed observations at the end, in order."""
        return [entry for entry in self.outcome.log if entry.is_out]

    @property
    def rivals(self) -> list[Phrase]:
        """Messages on removed groups and their alternatives."""
        return [entry.sentence for entry in self.removed if entry.in_dispute]

    def table(self) -> pd.DataFrame:
        """Return the log as a data frame, a row for each removed component, with its unit."""
        import pandas as pd

        rows, names = list[dict[str, Any]](), ("component", "unit", "error", "error_sd", "predicted_error")
        for entry, member in zip(self.log, records(log_table(self.log).columns), strict=True):
            common = {name: math.nan if value is None else value for name, value in member.items()} | {
                "rivals": rivals_of(entry.rivals, 3),
                "consequences": "; ".join(member["consequences"]),
                "returned": entry.returned,
                "kept": str(entry.kept),
            }
            predicted = entry.prediction_error or (math.nan,) * len(entry.rows)
            parts = zip(entry.components, entry.units, entry.error, entry.error_sd, predicted, strict=True)
            rows += [common | dict(zip(names, part, strict=True)) for part in parts]
        return pd.DataFrame(rows, columns=list(_COLUMNS))

    def _members(self) -> dict[str, Any]:
        outcome, options = self.outcome, self.options
        return {
            **(
                {"family_level": options.level}
                if options.fdr is None
                else {"false_discovery_rate": options.fdr}
            ),
            "unit_weight": options.unit_weight,
            "distribution": "chi2" if options.is_known else "F",
            **members(outcome, "tests", robust_factors="factors"),
            "remarks": [*map(str, outcome.remarks)],
            "before": _standing(outcome.before),
            "after": _standing(outcome.standing),
            "rounds": [
                members(each, "number", *_STANDING, "removed", "returned", limit_p="limit")
                for each in outcome.rounds
            ],
            "exchanged_names": [
                members(each, "photos", "points", T_as_named="as_named", T_exchanged="exchanged")
                | {"dimension": each.dimension}
                for each in self.exchanged
            ],
        }

    def document(self) -> Document:
        """Return the network's document without removed observations, with the log."""
        network, log, count = self.result.document(), self.log, len(self.removed)
        remarks = [
            *([] if log else [about("removed.nothing")]),
            *map(str, self.outcome.remarks),
            *(f"{each.sentence}: {each.reason}" for each in self.exchanged),
            *(f"{each.name}: {line}" for each in log for line in each.consequences),
        ]
        tests = [
            of_each(log, "name", kind="name", head="What"),
            of_each(log, "first_statistic", head="T at first", decimals=2),
            of_each(log, "statistic", head="T", decimals=2),
            of_each(log, "dimension", head="Dimension", decimals=0),
            of_each(log, "fisher", head="F", decimals=2),
            of_each(log, "log10_p", head="log10 p", decimals=1),
            Quantity([math.log10(each.limit) for each in log], head="Limit", decimals=1),
            of_each(log, "prediction", head="T against the rest", decimals=2),
            of_each(log, "prediction_log10_p", head="log10 p", decimals=1),
        ]
        parts: list[Part] = [Facts("Data snooping", self._facts())]
        parts += [log_table(log), Table("removed-tests", "Tests", for_people(tests))]
        parts += [Remarks(remarks)] if remarks else []
        section = Section("removed", "What was taken out", parts, about("removed"))
        note = about("removed.groups", n=len(self.suspects))
        highlights = [Fact.of("Taken out", count, note=note), *network.highlights]
        return replace(
            network.with_members(lambda: {"snooping": self._members()}),
            highlights=highlights,
            sections=[section, *network.sections],
        )

    def _facts(self) -> list[Fact]:
        outcome, options = self.outcome, self.options
        returned = sum(entry.returned is not None for entry in self.log)
        suspect = sum(bool(entry.kept) for entry in self.log)
        name, level = (
            ("Family level", options.level) if options.fdr is None else ("False discovery rate", options.fdr)
        )
        count = len(self.removed)
        biased = about("removed.biased", n=count) if count else ""
        return [
            Fact("Unit weight", about(f"unit-weight.{'known' if options.is_known else 'unknown'}")),
            Fact.of(name, level, note=about("removed.tests", n=outcome.tests)),
            Fact("Unit variance before", _variance(outcome.before)),
            Fact("Unit variance after", _variance(outcome.standing), note=biased),
            Fact.of("Rounds", len(outcome.rounds)),
            Fact.of("Taken out", count, note=about("removed.others", returned=returned, kept=suspect)),
        ]


def recorded(found: Snooped) -> Snooped:
    """Return a copy with the removed observations in its result."""
    record = Removed(
        [
            record | {"subject": entry.subject}
            for record, entry in zip(records(log_table(found.removed).columns), found.removed, strict=True)
        ],
        found.suspects.counts(found.outcome.out.rows, found.outcome.active),
        rivals=found.rivals,
        exchanged=[each.sentence for each in found.exchanged],
        kept=[
            Phrase("line.kept", {"name": entry.subject, "reason": entry.kept})
            for entry in found.log
            if entry.kept
        ],
        disputed=disputes(found.log),
    )
    return replace(found, result=replace(found.result, snooped=record))


_COLUMNS = (
    *("round", "kind", "name", "component", "unit", "error", "error_sd"),
    *("dimension", "first_T", "T", "F", "log10_p", "limit_p", "redundancy"),
    *("rivals", "consequences", "predicted_error", "prediction_T", "prediction_log10_p", "returned", "kept"),
)


def log_table(log: Sequence[Removal]) -> Table:
    rivals = [
        [members(one, "name", T="statistic") | members(one, "dimension", "odds") for one in each.rivals]
        for each in log
    ]
    codes = ["kept" if each.kept else "out" if each.returned is None else "back" for each in log]
    states = [about(f"removed.{code}", **vars(each)) for code, each in zip(codes, log, strict=True)]
    columns = [
        of_each(log, "round", head="Round", decimals=0),
        of_each(log, "name", kind="name", head="What"),
        Quantity([*map(estimated_errors, log)], kind="name", head="Estimated error"),
        *members_of_each(log, "kind", "components", "units", "dimension", "log10_p", "returned"),
        *members_of_each(log, "prediction_log10_p", prediction_T="prediction", limit_p="limit"),
        *members_of_each(log, estimated_error="error", estimated_error_sd="error_sd"),
        *members_of_each(log, predicted_error="prediction_error", first_T="first_statistic"),
        *members_of_each(log, T="statistic", F="fisher"),
        Quantity([[*map(str, each.consequences)] for each in log], member="consequences"),
        Quantity(np.exp([each.log_probability for each in log]), member="p"),
        of_each(log, "redundancy", head="Redundancy", decimals=3),
        Quantity(rivals, member="rivals"),
        Quantity([str(each.kept) or None for each in log], member="kept"),
        Quantity([rivals_of(each.rivals[:3], 2) for each in log], kind="name", head="Or instead"),
        Quantity(states, kind="name", head="Now"),
    ]
    return Table("snooping.log", "In order", columns)


_STANDING = ("status", "weighted_sum_of_squares", "degrees_of_freedom")


def _standing(standing: Standing) -> dict[str, Any]:
    f = standing.degrees_of_freedom
    variance = standing.weighted_sum_of_squares / f if f > 0 else None
    return members(standing, *_STANDING) | {"variance_of_unit_weight": variance}


def _variance(standing: Standing) -> str:
    test = global_test(*standing.sum_and_freedom)
    if test is None:
        return about("variance.undefined")
    side = "high" if test.rejected_high else "low" if test.rejected_low else "good"
    (low, high), freedom = test.limits, standing.degrees_of_freedom
    return about(f"variance.{side}", value=test.variance, freedom=freedom, low=low, high=high)


def rivals_of(rivals: Iterable[Rival], figures: int) -> str:
    """Return alternatives to a removed group, with significant figures of their odds."""
    code = f"rival.{figures}"
    return "; ".join(about(code, name=rival.name, odds=rival.odds) for rival in rivals)


def estimated_errors(entry: Removal) -> str:
    rows = zip(entry.components, entry.error, entry.units, entry.error_sd, strict=True)
    return ", ".join(
        about("estimated-error", component=component, error=error, unit=f" {unit}".rstrip(), sd=sd)
        for component, error, unit, sd in rows
    )
