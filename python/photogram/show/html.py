"""A page as one self-contained HTML file."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import replace
from html import escape
from importlib.resources import files
from itertools import repeat

from photogram import _photocore
from photogram.show import page as parts
from photogram.show.forms import formatted
from photogram.show.page import Column, Document, Drawing, Fact, Facts, Judgement, Section, Table, about
from photogram.show.sketch.svg import element, svg_of
from photogram.words import Words

LONG = 16  # Characters; longer words may be broken


def page_html(page: Document) -> bytes:
    """Return a page as self-contained HTML (UTF-8)."""
    page = formatted(replace(page, details=()), inlined)
    tables = (part for part in page.parts(layers=True) if isinstance(part, Table))
    links = [each.link for table in tables for each in table.columns if each.link and each.link.here]
    known = {target for link in links for target in link.targets}
    places = [("verdict", page.first), *((each.key, each.title) for each in page.sections if each.title)]
    heading = element("h3", escape(page.words("page.advice")))
    steps = _list("ol", (_coded(str(sentence)) for sentence in page.advice))
    text = _file("report.html").format(
        language=page.words.language,
        version=_photocore.__version__,
        style=_file("style.css"),
        contents=escape(page.words("page.contents")),
        links=_list("ol", (element("a", escape(title), href=f"#{key}") for key, title in places)),
        title=escape(page.title or page.what),
        what=element("p", escape(page.what), class_="what") if page.title else "",
        head=_facts("facts", page.head),
        judgements="".join(map(_judgement, page.judgements)),
        advice=element("div", heading + steps, class_="advice") if steps else "",
        highlights=_facts("highlights", page.highlights, "b"),
        sections="\n".join(_section(each, known, page.words) for each in page.sections),
        script=_file("script.js"),
    )
    return text.encode("utf-8", errors="replace")


def reproducibility(
    phases: Mapping[str, float], run: Sequence[Fact] = (), more: Sequence[parts.Part] = ()
) -> Section:
    """Return the last section: versions, the `run` of a command, and seconds in phases of the engine."""
    made = [Fact("photogram", _photocore.__version__), Fact("Python", platform.python_version()), *run]
    times = [Fact.of(phase, seconds, "s", decimals=3) for phase, seconds in phases.items()]
    whole = [Facts("Made by", made), *more, Facts("Time spent in the adjustment", times)]
    return Section("reproducibility", "Reproducibility", whole, about("reproducibility"))


def _file(name: str) -> str:
    """Return a template without indentation and lines of comments."""
    content = files("photogram.show").joinpath("templates", name).read_text(encoding="utf-8")
    return re.sub(r"^ *(//.*\n)?", "", content, flags=re.MULTILINE)


def _list(name: str, items: Iterable[str], **attributes: str) -> str:
    lines = "".join(f"<li>{item}</li>\n" for item in items)
    return element(name, f"\n{lines}", **attributes) if lines else ""


def _coded(text: str) -> str:
    """Format text between grave accents as code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def _unit(unit: str) -> str:
    return " " + element("span", escape(unit), class_="unit") if unit else ""


def _facts(kind: str, facts: Iterable[Fact], value: str = "", caption: str = "") -> str:
    """Return named values; `value` is an element for the values."""
    lines = []
    for fact in facts:
        text, note = escape(fact.value), element("small", escape(fact.note)) if fact.note else ""
        content = f"{element(value, text) if value else text}{_unit(fact.unit)}{note}"
        name = element("dt", escape(fact.name))
        lines.append(element("div", name + element("dd", content), class_=fact.tone) + "\n")
    return element("dl", f"{caption}\n{''.join(lines)}", class_=kind) if lines else ""


def _judgement(one: Judgement) -> str:
    on = " " + element("span", escape(one.on)) if one.on else ""
    mark = element("p", escape(one.mark) + on, class_="mark")
    lines = _list("ul", map(escape, one.lines))
    return element("div", mark + element("h2", escape(one.headline)) + lines, class_=f"verdict {one.tone}")


def _section(section: Section, known: Set[str], words: Words) -> str:
    title = element("h2", escape(section.title)) if section.title else ""
    intro = element("p", escape(section.intro), class_="intro") if section.intro else ""
    content = [title, intro, *(_part(part, section.title, known, words) for part in section.parts)]
    return element("section", "\n".join(content), id=section.key, class_="annex" * section.annex)


def _part(part: parts.Part, within: str, known: Set[str], words: Words) -> str:
    """Return a part; `again` marks the title of its section."""
    match part:
        case Table():
            return _table(part, within, known)
        case Facts():
            again = " again" * (part.caption == within)
            caption = element("div", escape(part.caption), class_=f"caption{again}")
            return _facts("facts", part.facts, caption=caption)
        case Drawing():
            caption = element("figcaption", escape(part.caption))
            return element("figure", f"\n{part.markup}\n{caption}", id=part.name)
        case parts.Layers():
            layers = (
                f'<div class="layer" data-title="{escape(one.title)}">{_part(one, "", known, words)}</div>'
                for one in part.parts
            )
            return element("div", "\n".join(layers), class_="layers", id=part.name)
        case parts.Text():
            return element("p", _coded(part.text))
        case parts.Remarks():
            shown, hidden = part.sentences[: part.most], part.sentences[part.most :]
            first, others = (_list("ul", map(escape, each), class_="remarks") for each in (shown, hidden))
            summary = element("summary", escape(words("page.more", count=len(hidden))))
            return first + (element("details", summary + others) if hidden else "")
    raise TypeError(f"a page does not show {type(part).__name__}")


def _table(table: Table, within: str, known: Set[str]) -> str:
    columns, again = table.columns, "again" * (table.title == within)
    note = " " + element("small", escape(table.note)) if table.note else ""
    caption = element("caption", element("span", escape(table.title)) + note, class_=again)
    heads = (
        element("th", escape(each.head) + _unit(each.unit), scope="col", class_="text" * each.text)
        for each in columns
    )
    rows = zip(*(_cells(column, known) for column in columns), strict=True)
    body = "".join(f"<tr>{''.join(row)}</tr>\n" for row in rows)
    content = f"{caption}\n<thead><tr>{''.join(heads)}</tr></thead>\n<tbody>\n{body}</tbody>"
    return f'<div class="table" tabindex="0">\n<table>\n{content}\n</table>\n</div>'


def _cells(column: Column, known: Set[str]) -> Iterable[str]:
    if not (column.text or column.marked):
        return [f"<td>{escape(text)}</td>" for text in column.cells]  # Most cells
    targets = column.link.targets if column.link else repeat("")
    here = column.link is not None and column.link.here
    cells = []
    for (text, tone), target in zip(column.toned, targets, strict=False):
        long = column.text and any(len(word) > LONG for word in text.split())
        kinds = " ".join(filter(None, ("text" * column.text, "long" * long, tone)))
        linked = target in known and not here
        content = element("a", escape(text), href=f"#{target}") if linked else escape(text)
        cells.append(element("td", content, class_=kinds, id=target * here))
    return cells


def inlined(drawing: Drawing) -> Drawing | None:
    """Draw a plot; return None if it is empty."""
    sketch = drawing.sketch()
    markup = svg_of(sketch, drawing.name, drawing.title) if sketch is not None else ""
    return replace(drawing, markup=markup) if markup else None
