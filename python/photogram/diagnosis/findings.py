"""The findings of a check, in sections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from photogram.arguments.types import Bools
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.show.page import Fact, Facts, Part, Text
from photogram.statistics.verdict import Verdict
from photogram.words import Phrase, phrase

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
    """Add a finding for each message."""
    for each in messages:
        own = each if isinstance(each, Phrase) else getattr(each, "phrase", None)
        section.findings.append(Finding(kind, level, str(each), phrase=own))


def note_verdict(section: Section, verdict: Verdict) -> None:
    """Insert the verdict at the top of a section without grave findings."""
    if (verdict.exit or verdict.warning) and not any(each.level == "grave" for each in section.findings):
        level: Level = "grave" if verdict.exit else "look"
        section.findings.insert(0, Finding(verdict.code, level, verdict.headline))
