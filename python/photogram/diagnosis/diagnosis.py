"""The outcome of a check: its findings and its verdict."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from photogram.diagnosis.findings import Finding, Section
from photogram.lazy_dataclasses import dataclass
from photogram.show.methods import Documented
from photogram.show.page import Document
from photogram.statistics.verdict import EXIT_NOT_CONVERGED, Rule, Verdict, as_phrase, fitting_rules
from photogram.summaries import Rows
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.results.result import Result

CONVENTIONS = frozenset(
    {
        "mirrored",
        "kappa",
        "sign-of-principal-distance",
        "sense-of-rotation",
        "convention",
        "lens",
        "common-error",
        "control-set",
        "control-system",
        "observed-positions",
    }
)
"""Kinds of findings on conventions of a whole data set."""


@dataclass(repr=False)
class Diagnosis(Documented):
    """The outcome of a check.

    Attributes
    ----------
    title
        Title of the project.
    sections
        Sections, in the order of Appendix H of the guide.
    result
        The adjustment without the observations that the check rejected; None if there is none.
    adjusted_before
        True if the given adjustment was to be explained. The verdict is then its own, with the mistakes
        found.
    """

    title: str
    sections: list[Section]
    result: Result | None
    adjusted_before: bool = False

    def brief(self) -> tuple[str, Rows]:
        """Return the number of findings, and the findings, grave ones first."""
        grave = self.grave
        found = [*grave, *(each for each in self.findings if each.level == "look")]
        title = (
            f"Check of {self.title or 'a network'}: {len(grave)} grave, {len(found) - len(grave)} to look at"
        )
        return title, [(each.level, each.text) for each in found]

    @property
    def findings(self) -> list[Finding]:
        """All findings, section by section."""
        return [finding for section in self.sections for finding in section.findings]

    @property
    def grave(self) -> list[Finding]:
        """The grave findings."""
        return [finding for finding in self.findings if finding.level == "grave"]

    @property
    def verdict(self) -> Verdict:
        """Verdict on the findings, in the same form as the verdict on an adjustment.

        Grave findings make results wrong: exit code 3, as of the command. Mistakes in conventions are hints;
        the tests are the tests of the adjustment, if any.
        """
        if self.adjusted_before and self.result is not None:
            return self.result.verdict
        rule, message, exit_code = fitting_rules(RULES, self)[0]
        first, *others = [*self._ordered, None]
        return Verdict(
            code=rule.code,
            message=message,
            exit=exit_code,
            warning=first is not None,
            lines=tuple(_message(each) for each in (others if self.grave else self._ordered) if each),
            next=tuple(phrase(f"check.verdict.{name}") for name in rule.advice.split()),
            tests=() if self.result is None else self.result.verdict.tests,
            hints=tuple(each.text for each in self.grave if each.kind in CONVENTIONS),
        )

    @property
    def _ordered(self) -> list[Finding]:
        """Findings on conventions, other grave findings, and the findings to look at."""
        return sorted(self.findings, key=lambda each: (each.level != "grave", each.kind not in CONVENTIONS))

    def document(self) -> Document:
        """Return the document of the check; see `docs/giant-check.md` for its members."""
        from photogram.diagnosis.document import check_document

        return check_document(self.title, self.verdict, self.sections, self.result)


def _message(finding: Finding) -> Phrase:
    return getattr(finding, "phrase", None) or as_phrase(finding.text)


def _grave(code: str, check: Diagnosis) -> Phrase | None:
    """Return the message on grave findings, on conventions (`hint`) or on others."""
    if not check.grave or any(each.kind in CONVENTIONS for each in check.grave) is not (code == "hint"):
        return None
    fields = {"finding": _message(check._ordered[0]), "n": len(check.grave) - 1}
    return Phrase(f"check.verdict.{code}{'.more' if fields['n'] else ''}", fields)


def _look(check: Diagnosis) -> Phrase | None:
    return phrase("check.verdict.look-at", n=len(check.findings)) if check.findings else None


RULES = (
    Rule("hint", partial(_grave, "hint"), EXIT_NOT_CONVERGED, "correct"),
    Rule("gross-errors", partial(_grave, "gross-errors"), EXIT_NOT_CONVERGED, "correct"),
    Rule("look-at", _look, 0, "look adjust", warning=True),
    Rule("accepted", lambda _: phrase("check.verdict.accepted"), 0, "adjust"),
)
"""Rules of a check; the first applicable one is the headline."""
