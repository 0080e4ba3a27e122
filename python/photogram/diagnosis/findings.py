"""What a check finds: findings in sections, as text and as a JSON document."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from photogram import _photocore
from photogram.arguments.types import Bools
from photogram.io import json
from photogram.lazy_dataclasses import asdict, dataclass, field
from photogram.show.lines import padded
from photogram.show.methods import Paged
from photogram.show.sections import composed, headline
from photogram.show.summary import Brief, Rows
from photogram.statistics.verdict import EXIT_NOT_CONVERGED, Verdict

if TYPE_CHECKING:
    from photogram.network.block import Block
    from photogram.results.result import Result
    from photogram.statistics.likelihood import Judged

__all__ = [
    "Diagnosis",
    "Explained",
    "Figure",
    "Finding",
    "Level",
    "Listing",
    "Names",
    "Part",
    "Section",
    "Words",
    "note",
    "note_all",
    "note_verdict",
    "small_unit",
]

Level = Literal["grave", "look"]
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
NAMES_ON_A_LINE = 4
SHOWN = 40
"""Findings of one level that a section of the text shows at most; the JSON document has all."""


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


@dataclass(frozen=True)
class Figure:
    """A figure with its name.

    Attributes
    ----------
    name, value
        The value with its unit.
    """

    name: str
    value: str

    def lines(self) -> list[str]:
        """Return it as text."""
        return [f"{self.name:<50}{self.value}"]


@dataclass(frozen=True)
class Listing:
    """A small table."""

    # Heads with their units, and how values stand in text, as for `format`: `>12.2f`
    columns: Sequence[tuple[str, str]]
    rows: Sequence[Sequence[str | float]]  # The values

    def lines(self) -> list[str]:
        """Return it as text."""
        heads = "".join(format(head, re.sub(r"\.\d+f", "", layout)) for head, layout in self.columns)
        layouts = [layout for _, layout in self.columns]
        return [heads, *("".join(map(format, row, layouts)) for row in self.rows)]


@dataclass(frozen=True)
class Names:
    """Names below a heading of the 1987 program.

    Attributes
    ----------
    heading
        In capital letters, as it was printed.
    names
        Of photos or points.
    above
        What was printed above the first of them.
    """

    heading: str
    names: Sequence[str]
    above: str = ""

    def lines(self) -> list[str]:
        """Return them as text."""
        cells = padded(self.names, 10)
        return [
            *([self.above] if self.above else []),
            self.heading,
            *(
                "  " + "".join(cells[first : first + NAMES_ON_A_LINE]).rstrip()
                for first in range(0, len(cells), NAMES_ON_A_LINE)
            ),
        ]


Part: TypeAlias = str | Figure | Listing | Names


@dataclass
class Section:
    """One part of the check.

    Attributes
    ----------
    title
        Its heading.
    why
        A sentence on why one looks.
    parts
        Sentences, figures and small tables.
    findings
        What was found.
    """

    title: str
    why: str
    parts: list[Part] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    @property
    def lines(self) -> list[str]:
        """Figures and tables as text."""
        return [line for part in self.parts for line in ([part] if isinstance(part, str) else part.lines())]

    def figure(self, name: str, value: object) -> None:
        """Add a figure with its unit."""
        self.parts.append(Figure(name, str(value)))

    def text(self) -> list[str]:
        """Return the section as lines, the grave findings first."""
        shown: list[str] = []
        for level, mark in (("grave", "GRAVE "), ("look", "look  ")):
            of_level = [finding.text for finding in self.findings if finding.level == level]
            shown += [mark + text for text in of_level[:SHOWN]]
            if len(of_level) > SHOWN:
                shown.append(f"{mark}and {len(of_level) - SHOWN} more")
        return [self.why, *self.lines, *(shown or ["nothing found"])]


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


@dataclass(repr=False)
class Diagnosis(Paged, Brief):
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
            headline=headline,
            exit=exit_code,
            warning=bool(grave or look),
            lines=tuple(each.text for each in [*grave[1:], *look]),
            next=_CORRECT if grave else (*_LOOK, *_ADJUST) if look else _ADJUST,
            tests=tests,
            hints=hints,
        )

    def report(self) -> str:
        """Return the check as text."""
        grave, look = len(self.grave), len(self.findings) - len(self.grave)
        head = f"{headline('check', self.title)}\n{grave} grave, {look} to look at"
        sections = [(section.title, section.text()) for section in self.sections]
        return composed(head, [("What to do next", list(self.verdict.next)), *sections])

    def to_json(self) -> bytes:
        """Return the findings as a JSON document (UTF-8); `docs/giant-check.md` lists its members."""
        document: dict[str, Any] = {
            "program": f"photogram {_photocore.__version__}",
            "title": self.title,
            "grave": len(self.grave),
            "verdict": self.verdict.document(),
            "sections": [
                {
                    "title": section.title,
                    "why": section.why,
                    "lines": section.lines,
                    "findings": [asdict(finding) for finding in section.findings],
                }
                for section in self.sections
            ],
        }
        return json.to_json(document)
