"""Elements of a document: verdict, and sections with tables, plots and facts.

Programs create documents from their results without HTML; `show.html`, `show.pdf` and `show.forms` format
documents.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.show import quantity
from photogram.words import Phrase, Words, words_of

if TYPE_CHECKING:
    from photogram.show.sketch.plot import Plot

Tone = Literal["", "good", "look", "bad"]
"""Meaning of a colour; the text always has the same meaning."""

MOST_DECIMALS = 12  # Maximum number of decimals of a fixed-point column
LEAST_PROBABILITY = 1e-99  # Smaller probabilities are reported as below


@dataclass(frozen=True)
class Column:
    head: str
    cells: Sequence[str]
    unit: str = ""
    text: bool = False  # Whether the column contains texts, aligned left
    marked: Sequence[bool] = ()  # Mask of marked cells; empty: none
    link: quantity.Link | None = None  # Target of the cells on a page

    @property
    def toned(self) -> list[tuple[str, Tone]]:
        return [(cell, "look" if mark else "") for cell, mark in zip_longest(self.cells, self.marked)]


@dataclass(frozen=True)
class Table:
    """A formatted table; `note` describes missing rows."""

    title: str
    columns: Sequence[Column]
    note: str = ""


@dataclass(frozen=True)
class Fact:
    """A named value: `value` is printed unchanged, `note` explains it."""

    name: str
    value: str
    unit: str = ""
    note: str = ""
    tone: Tone = ""

    @classmethod
    def of(
        cls,
        name: str,
        value: float | Sequence[float] | Floats | None,
        unit: str = "",
        note: str = "",
        tone: Tone = "",
        *,
        decimals: int | None = None,
        figures: int = 0,
    ) -> Fact:
        """Return a fact of numbers, with decimals, with significant figures, or as given."""
        numbers = [] if value is None else np.ravel(value).tolist()
        given = decimals is None and not figures
        texts = [f"{each:.10g}" if given else number_text(each, decimals, figures) for each in numbers]
        return cls(name, ", ".join(texts) or "undefined", unit, note, tone)


@dataclass(frozen=True)
class Facts:
    """Named values, one per line."""

    caption: str
    facts: Sequence[Fact]


@dataclass(frozen=True)
class Drawing:
    """A plot; renderers draw it, and omit it if there are no data."""

    name: str  # Unique on the page; prefix of the identifiers of its parts
    title: str  # Short name and subject
    caption: str
    sketch: Callable[[], Plot | None]
    markup: str = ""  # The drawn plot


@dataclass(frozen=True)
class Layers:
    """Alternatives shown one at a time; all on paper and without scripts."""

    name: str
    parts: Sequence[Drawing | Table | quantity.Table]


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Remarks:
    """Sentences, one per line; long lists are collapsed."""

    sentences: Sequence[str]
    most: int = 12


Part = Table | quantity.Table | Facts | Drawing | Layers | Text | Remarks
Members = Mapping[str, object] | Callable[[], Mapping[str, object]]


@dataclass(frozen=True)
class Section:
    """A section; renderers omit empty parts and sections. An annex starts on a new sheet."""

    key: str
    title: str
    parts: Sequence[Part]
    intro: str = ""
    annex: bool = False

    @classmethod
    def of(cls, table: quantity.Table) -> Section:
        return cls(table.key, table.title, [table], table.about)


@dataclass(frozen=True)
class Judgement:
    """The verdict at the top of a page: whether the result can be used."""

    mark: str  # Few words
    # First sentence, further sentences
    headline: str
    lines: Sequence[str] = ()
    tone: Tone = ""
    on: str = ""  # Subject, if a page has several judgements


@dataclass(frozen=True)
class Document:
    """Content of a result for people and programs: its report, and its JSON document."""

    # Kind of the document, and title of the job
    what: str
    title: str
    judgements: Sequence[Judgement] = ()  # One per adjusted object
    advice: Sequence[Phrase | str] = ()  # Next steps
    highlights: Sequence[Fact] = ()  # Key figures
    sections: Sequence[Section] = ()
    # Members of JSON in addition to tables; a function creates large ones if they are needed
    members: Members = field(default_factory=dict)
    details: Sequence[Section] = ()  # Sections that pages omit
    phases: Mapping[str, float] = field(default_factory=dict)  # Seconds in phases of the engine
    head: Sequence[Fact] = ()  # Client, author
    first: str = "Verdict"  # Name of the link to the top
    words: Words = field(default_factory=partial(words_of, "en"))  # The language

    def with_sections(self, *more: Section) -> Document:
        return replace(self, sections=[*self.sections, *more])

    def with_members(self, more: Callable[[], Mapping[str, object]]) -> Document:
        return replace(self, members=lambda: {**self.all_members(), **more()})

    def all_members(self) -> dict[str, Any]:
        return {**(self.members() if callable(self.members) else self.members)}

    def tables(self, *, layers: bool = False) -> list[quantity.Table]:
        """Return the tables of all sections and details, with those in layers on request."""
        return [part for part in self.parts(layers=layers) if isinstance(part, quantity.Table)]

    def drawings(self) -> list[Drawing]:
        return [part for part in self.parts(layers=True) if isinstance(part, Drawing)]

    def plots(self) -> dict[str, Plot | None]:
        """Return the plots of the drawings by name; None if there are no data."""
        return {each.name.removeprefix("picture-"): each.sketch() for each in self.drawings()}

    def parts(self, *, layers: bool = False) -> list[Part]:
        """Return parts of sections and details; on request parts of layers."""
        parts = [part for section in (*self.sections, *self.details) for part in section.parts]
        return without_layers(parts) if layers else parts

    def table(self, key: str) -> quantity.Table:
        """Return the table with a key, the first of several layers."""
        return next(table for table in self.tables(layers=True) if table.key == key)


def without_layers(parts: Sequence[Part]) -> list[Part]:
    return [one for part in parts for one in (part.parts if isinstance(part, Layers) else [part])]


def about(code: str, **fields: Any) -> str:
    """Return the explanation of a section, table or fact with a code."""
    return words_of("en")(f"about.{code}", **fields)


def conventions(group: str, **fields: Any) -> dict[str, str]:
    """Return units or conventions of the members of a JSON document, by their names."""
    return words_of("en").below(f"member.{group}.", **fields)


def layered(what: str, title: str, documents: Sequence[Document], **more: Any) -> Document:
    """Return one document of several with the same tables as layers.

    Layers, verdicts and highlights have the titles of their documents; `more` are further fields.
    """
    sections, titles = [], [document.title for document in documents]
    for tables in zip(*(document.tables() for document in documents), strict=True):
        layers = [replace(table, title=name) for table, name in zip(tables, titles, strict=True)]
        key, about = tables[0].key, tables[0].about
        sections.append(Section(key, tables[0].title, [Layers(f"{key}-layers", layers)], about))
    return Document(
        what,
        title,
        judgements=[replace(one, on=part.title) for part in documents for one in part.judgements],
        advice=list(dict.fromkeys(sentence for part in documents for sentence in part.advice)),
        highlights=[
            replace(fact, name=f"{fact.name}, {part.title}") for part in documents for fact in part.highlights
        ],
        sections=sections,
        **more,
    )


def number_text(value: float | str | None, decimals: int | None, figures: int = 4) -> str:
    """Return a value with decimals or figures; integers and texts unchanged."""
    if value is None or isinstance(value, str | int):
        return "" if value is None else f"{value}"
    return significant(value, figures) if decimals is None else fixed(value, decimals)


def fixed(value: float, decimals: int) -> str:
    """Return a fixed-point number, zero unsigned; long ones with an exponent."""
    return f"{value:z.{decimals}f}" if abs(value) < 1e15 else significant(value)


def significant(value: float, figures: int = 4) -> str:
    """Return a number with significant figures, without an exponent if readable."""
    if not math.isfinite(value):
        return "–" if math.isnan(value) else "∞" if value > 0 else "-∞"
    if value == 0:
        return "0"
    size = abs(value)
    if 1e-4 <= size < 1e7:
        decimals = max(figures - 1 - math.floor(math.log10(size)), 0)
        return f"{value:.{decimals}f}"
    return f"{value:.{figures - 1}e}"


def probability_written(value: float) -> str:
    """Return a probability with two figures; `< 1e-99` if below that."""
    return f"{value:.2g}" if not value < LEAST_PROBABILITY else f"< {LEAST_PROBABILITY:g}"


def decimals_of(
    deviations: Floats, *, smallest: bool = False, unknown: int = 4, most: int = MOST_DECIMALS
) -> int:
    """Return the decimals of values with these standard deviations.

    The smallest or the median deviation has two significant figures. `unknown` is returned if none is known,
    `most` is the maximum.
    """
    known = np.asarray(deviations, dtype=float)
    known = known[np.isfinite(known) & (known > 0)]
    if not known.size:
        return unknown
    decisive = float(known.min() if smallest else np.median(known))
    return int(np.clip(1 - math.floor(math.log10(decisive)), 0, most))
