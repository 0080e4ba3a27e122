"""The findings of a check, in sections."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Literal

from photogram.arguments.types import Bools
from photogram.lazy_dataclasses import dataclass, field
from photogram.show.page import Fact, Facts, Part, Text
from photogram.statistics.verdict import Verdict

if TYPE_CHECKING:
    from photogram.network.block import Block
    from photogram.statistics.likelihood import Judged

__all__ = [
    "Explained",
    "Finding",
    "Level",
    "Section",
    "Words",
    "note",
    "note_all",
    "note_verdict",
    "small_unit",
]

Level = Literal["grave", "look"]


def small_unit(unit: str) -> tuple[str, float]:
    """Return the unit in which errors of images are told, and how many of it a unit of images has."""
    return ("um", 1000.0) if unit == "mm" else (unit, 1.0)


class Words:
    """Words for any block; a program with words of its own has a class above this one.

    Attributes
    ----------
    sense
        What tells the sense of the angles.
    order
        What gives the order of the photos.
    usual_um
        Between which standard deviations of image coordinates are usual, micrometres; None where nothing is.
    bandwidth
        Whether the bandwidths of the normal equations in that order are of interest.
    iterations
        Whether every iteration is one of the key numbers, as in Appendix H of the guide.
    """

    sense: str = "`photo_to_ground`"
    order: str = "the photos"
    usual_um: tuple[float, float] | None = None
    bandwidth: bool = False
    iterations: bool = False

    def unhold(self, kept: Bools) -> str:
        """Return what is done about a control point of which only some components are to be held."""
        axes = [name for name, held in zip(("first", "second", "third"), kept.tolist(), strict=True) if held]
        if not axes:
            return "hold nothing of it"
        return f"hold its {' and '.join(axes)} coordinate{'s' if len(axes) > 1 else ''} only"

    def values(self, kept: Bools) -> dict[str, float]:
        """Return further figures of such a finding."""
        del kept
        return {}


@dataclass(frozen=True)
class Explained:
    """What is wrong with the control, or the observed positions, as a whole."""

    kind: str  # In a word or two
    text: str  # In a sentence
    judged: Judged  # How sure it is
    change: Callable[[Block], Block]  # Makes of the block what was meant


@dataclass(frozen=True)
class Finding:
    """One thing found.

    Attributes
    ----------
    kind
        What it is, in a word or two with hyphens: `gross-error`, `control-misfit`.
    level
        `grave` makes results wrong or impossible; `look` deserves a look.
    text
        The finding in a sentence, with what to do.
    photos, points
        Identifiers of the photos and points concerned.
    values
        Its figures, the unit in the name.
    """

    kind: str
    level: Level
    text: str
    photos: list[str] = field(default_factory=list)
    points: list[str] = field(default_factory=list)
    values: dict[str, float] = field(default_factory=dict)


@dataclass
class Section:
    """A part of the check: its title, the reason for it, sentences and tables, and findings."""

    title: str
    why: str
    parts: list[Part] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def remark(self, sentence: str) -> None:
        """Add a sentence."""
        self.parts.append(Text(f"{sentence[:1].upper()}{sentence[1:].removesuffix('.')}."))

    def figure(self, name: str, value: object) -> None:
        """Add a figure with its unit."""
        fact = Fact(f"{name[:1].upper()}{name[1:]}", str(value))
        if self.parts and isinstance(self.parts[-1], Facts):
            self.parts[-1] = Facts("", [*self.parts[-1].facts, fact])
        else:
            self.parts.append(Facts("", [fact]))


def note(
    section: Section,
    kind: str,
    level: Level,
    text: str,
    photos: Sequence[str] = (),
    points: Sequence[str] = (),
    values: dict[str, float] | None = None,
) -> None:
    """Add a finding to a section; see :class:`Finding`."""
    section.findings.append(Finding(kind, level, text, list(photos), list(points), values or {}))


def note_all(section: Section, kind: str, level: Level, sentences: Iterable[object]) -> None:
    """Add sentences to a section, a finding each."""
    section.findings += [Finding(kind, level, str(each)) for each in sentences]


def note_verdict(section: Section, verdict: Verdict) -> None:
    """Put what a verdict has to say on top of a section that has nothing grave."""
    if (verdict.exit or verdict.warning) and not any(each.level == "grave" for each in section.findings):
        level: Level = "grave" if verdict.exit else "look"
        section.findings.insert(0, Finding(verdict.code, level, verdict.headline))
