"""The outcome of a check: its findings, in sections, and its verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from photogram.arguments.types import Bools
from photogram.lazy_dataclasses import asdict, dataclass, field
from photogram.messages import Message, counted, listed
from photogram.plots.accessor import drawings
from photogram.results.result import Result
from photogram.show import page, quantity
from photogram.show.judgement import judged, verdict_table
from photogram.show.methods import Documented
from photogram.show.page import Document, Fact, Facts, Part, Text
from photogram.show.quantity import Quantity, records
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


LEVELS = {"grave": "grave", "look": "to look at"}
MAX_NAMES = 6  # photos and points that a row names
MAX_FINDINGS = 200  # rows of the table of findings


def check_document(title: str, verdict: Verdict, parts: Sequence[Section], result: Result | None) -> Document:
    findings = [(finding, part.title) for part in parts for finding in part.findings]
    grave = sum(finding.level == "grave" for finding, _ in findings)
    look = len(findings) - grave
    texts = {str(finding.text) for finding, _ in findings}
    lines = [line for line in verdict.lines if str(line) not in texts]  # the table has the findings
    plan = [] if result is None else [drawings(result)["network"]]
    about = (
        "Grave findings make results wrong or impossible. Look at the others. The check corrects a mistake"
        " in memory before its next step, so that each mistake is reported once. The files are unchanged."
    )
    tests = "The tests of the adjustment without the observations that the check rejects."
    return Document(
        what="Check of a network before its adjustment",
        title=title,
        judgements=[replace(judged(verdict), lines=[*map(str, lines)])],
        advice=verdict.next,
        highlights=[
            Fact("Grave", f"{grave}", tone="bad" if grave else ""),
            Fact("To look at", f"{look}", tone="look" if look else ""),
        ],
        sections=[
            page.Section("findings", "Findings", [_findings_table(findings)] if findings else [], about),
            page.Section("network", "Plan of the network", plan),
            *(_section(number, section) for number, section in enumerate(parts)),
            page.Section("tests", "Tests", [verdict_table(verdict)] if verdict.tests else [], tests),
        ],
        members={
            "title": title,
            "grave": grave,
            "verdict": verdict.document(),
            "sections": [_members(section) for section in parts],
        },
    )


def _members(section: Section) -> dict[str, object]:
    parts = section.parts
    return {
        "title": section.title,
        "why": section.why,
        "facts": [asdict(fact) for part in parts if isinstance(part, Facts) for fact in part.facts],
        "tables": [
            {"title": part.title, "rows": records(part.columns)}
            for part in parts
            if isinstance(part, quantity.Table)
        ],
        "findings": [_finding_members(finding) for finding in section.findings],
    }


def _finding_members(finding: Finding) -> dict[str, object]:
    members = asdict(replace(finding, phrase=None))
    del members["phrase"]
    code, fields = (finding.phrase.code, finding.phrase.fields) if finding.phrase else ("", {})
    return members | {"code": code, "fields": fields}


def _section(number: int, section: Section) -> page.Section:
    count = len(section.findings)
    end = Text(f"{counted(count, 'finding')} of this part: see the table of findings.")
    parts = [*section.parts, end if count else Text("Nothing found.")]
    return page.Section(f"part-{number}", section.title, parts, section.why)


def _findings_table(findings: Sequence[tuple[Finding, str]]) -> quantity.Table:
    """Return the table of findings with section titles, grave findings first."""
    ordered = sorted(findings, key=lambda row: row[0].level != "grave")
    shown = [finding for finding, _ in ordered[:MAX_FINDINGS]]
    texts = {
        "Level": [LEVELS[each.level] for each in shown],
        "Finding": [each.text for each in shown],
        "Photos and points": [listed([*each.photos, *each.points], MAX_NAMES) for each in shown],
        "Part": [title for _, title in ordered[:MAX_FINDINGS]],
    }
    columns = [Quantity(values, kind="name", head=head) for head, values in texts.items()]
    columns[0] = replace(columns[0], marked=np.array([each.level == "grave" for each in shown]))
    rest = len(ordered) - len(shown)
    return quantity.Table("", "Findings", columns, f"The JSON document has {rest} more." if rest else "")
