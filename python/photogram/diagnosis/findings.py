"""The outcome of a check: its findings, in sections, and its verdict."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Literal

from photogram.arguments.types import Bools
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.show.methods import Documented
from photogram.show.page import Document, Fact, Facts, Part, Text
from photogram.statistics.verdict import EXIT_NOT_CONVERGED, Rule, Verdict, as_phrase, fitting_rules
from photogram.summaries import Rows
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.results.result import Result

Level = Literal["grave", "look"]


def small_unit(unit: str) -> tuple[str, float]:
    """Return the unit of printed image residuals, and its factor."""
    return ("um", 1000.0) if unit == "mm" else (unit, 1.0)


class Words:
    """Wording for any block; a program with its own terms has a subclass."""

    sense: str = "`photo_to_ground`"  # Specifies the sense of the angles
    order: str = "the photos"  # Specifies the order of the photos
    usual_um: tuple[float, float] | None = None  # Usual standard deviations of image coordinates
    bandwidth: bool = False  # Whether the check reports bandwidths of the normal equations
    iterations: bool = False  # Whether each iteration is a key number, as in Appendix H of the guide

    def remedy(self, kept: Bools) -> Phrase:
        """Return the change of a control point; (3,) components `kept` stay control."""
        axes = [name for name, held in zip(("first", "second", "third"), kept.tolist(), strict=True) if held]
        return phrase("check.remedy.components", n=len(axes), axes=axes)

    def values(self, kept: Bools) -> dict[str, float]:
        """Return additional values of such a finding."""
        del kept
        return {}


@dataclass(frozen=True)
class Finding:
    """One finding of a check.

    Attributes
    ----------
    kind
        Type of the finding, hyphenated: `gross-error`, `control-misfit`.
    level
        `grave` makes results wrong or impossible; `look` deserves a look.
    text
        The finding and its remedy, as a sentence.
    photos, points
        Identifiers of the photos and points concerned.
    values
        Numeric values; the names contain the units.
    phrase
        The sentence as a code with fields; None without code.
    """

    kind: str
    level: Level
    text: str
    photos: list[str] = field(default_factory=list)
    points: list[str] = field(default_factory=list)
    values: dict[str, float] = field(default_factory=dict)
    phrase: Phrase | None = None


@dataclass
class Section:
    """A part of the check: title, reason, sentences, tables, and findings."""

    title: str
    why: str
    parts: list[Part] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def remark(self, code: str, /, **fields: object) -> None:
        """Add the sentence of a code."""
        sentence = str(phrase(code, **fields))
        self.parts.append(Text(f"{sentence[:1].upper()}{sentence[1:].removesuffix('.')}."))

    def note(
        self,
        level: Level,
        code: str,
        photos: Sequence[str] = (),
        points: Sequence[str] = (),
        values: dict[str, float] | None = None,
        /,
        **fields: object,
    ) -> None:
        """Add a finding; see :func:`finding`."""
        self.findings.append(finding(level, phrase(code, **fields), photos, points, values))

    def figure(self, name: str, value: object) -> None:
        """Add a named value with its unit."""
        fact = Fact(f"{name[:1].upper()}{name[1:]}", str(value))
        if self.parts and isinstance(self.parts[-1], Facts):
            self.parts[-1] = Facts("", [*self.parts[-1].facts, fact])
        else:
            self.parts.append(Facts("", [fact]))


def section_of(code: str, **fields: str) -> Section:
    """Return an empty section with its title and reason."""
    title, why = (str(phrase(f"check-section.{code}.{part}", **fields)) for part in ("title", "why"))
    return Section(title, why)


def finding(
    level: Level,
    message: Phrase,
    photos: Sequence[str] = (),
    points: Sequence[str] = (),
    values: dict[str, float] | None = None,
    *,
    kind: str = "",
) -> Finding:
    """Return a finding; its default kind is the second part of its message code."""
    kind = kind or message.code.split(".")[1]
    return Finding(kind, level, str(message), list(photos), list(points), values or {}, message)


def note_all(section: Section, kind: str, level: Level, messages: Sequence[Message | Phrase | str]) -> None:
    for each in messages:
        own = each if isinstance(each, Phrase) else getattr(each, "phrase", None)
        section.findings.append(Finding(kind, level, str(each), phrase=own))


def note_verdict(section: Section, verdict: Verdict) -> None:
    """Insert the verdict at the top of a section without grave findings."""
    if (verdict.exit or verdict.warning) and not any(each.level == "grave" for each in section.findings):
        level: Level = "grave" if verdict.exit else "look"
        section.findings.insert(0, Finding(verdict.code, level, verdict.headline))


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
