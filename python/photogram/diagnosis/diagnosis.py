"""The outcome of a check: its findings and its verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.diagnosis.findings import Finding, Section
from photogram.lazy_dataclasses import dataclass
from photogram.show.methods import Documented
from photogram.show.page import Document
from photogram.show.summary import Brief, Rows
from photogram.statistics.verdict import EXIT_NOT_CONVERGED, Verdict, as_phrase

if TYPE_CHECKING:
    from photogram.results.result import Result

__all__ = ["Diagnosis"]

CONVENTIONS = frozenset(
    {
        "mirrored",
        "kappa",
        "sign-of-principal-distance",
        "sense-of-rotation",
        "convention",
        "lens",
        "rolling-shutter",
        "control-set",
        "control-system",
        "observed-positions",
    }
)
"""Kinds of findings that are mistakes in what the data of a whole set mean."""
_CORRECT = (
    "Correct what the first finding names, and check again: one mistake may hide another, and explain it.",
)
_LOOK = ("Look at what was found first.",)
_ADJUST = ("Adjust: `photogram adjust`, `giant` for a GIANT project, `collection` for a collection.",)


@dataclass(repr=False)
class Diagnosis(Documented, Brief):
    """The outcome of a check.

    Attributes
    ----------
    title
        Of the project.
    sections
        In the order of Appendix H of the guide.
    result
        The adjustment, where there was one; without what the check left out of it.
    adjusted_before
        Whether it is the adjustment that was to be explained: the verdict is its own then, with the mistakes
        that were found.
    """

    title: str
    sections: list[Section]
    result: Result | None
    adjusted_before: bool = False

    def brief(self) -> tuple[str, Rows]:
        """Return how many findings there are, and which, the grave ones first."""
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
        """What the findings come to, in the form of the verdict on an adjustment.

        Grave findings make results wrong: exit code 3, that of the command. Mistakes in what data mean stand
        as hints; tests are those of the adjustment, where there was one.
        """
        if self.adjusted_before and self.result is not None:
            return self.result.verdict
        grave, look = self.grave, [each for each in self.findings if each.level == "look"]
        hints = tuple(each.text for each in grave if each.kind in CONVENTIONS)
        tests = () if self.result is None else self.result.verdict.tests
        if grave:
            code, exit_code = ("hint" if hints else "gross-errors"), EXIT_NOT_CONVERGED
            what = "The data are likely wrong" if hints else "Gross errors likely"
            named = [each.text for each in sorted(grave, key=lambda each: each.kind not in CONVENTIONS)]
            headline = f"{what}: {named[0]}" + (f" (and {len(named) - 1} more)" if named[1:] else "")
        else:
            code, exit_code = ("look-at", 0) if look else ("accepted", 0)
            headline = f"Nothing grave was found; {len(look)} to look at" if look else "Nothing was found"
        return Verdict(
            code=code,
            message=as_phrase(headline),
            exit=exit_code,
            warning=bool(grave or look),
            lines=tuple(as_phrase(each.text) for each in [*grave[1:], *look]),
            next=tuple(map(as_phrase, _CORRECT if grave else (*_LOOK, *_ADJUST) if look else _ADJUST)),
            tests=tests,
            hints=hints,
        )

    def document(self) -> Document:
        """Return the document of the check; `docs/giant-check.md` lists the members of its JSON form."""
        from photogram.diagnosis.document import check_document

        return check_document(self.title, self.verdict, self.sections, self.result)
