"""A page as one HTML file that needs nothing else; what makes it is the extra `photogram[report]`."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from photogram import _photocore
from photogram.show import quantity
from photogram.show.cells import written
from photogram.show.page import Cell, Column, Document, Drawing, Layers, Part, Picture, Section, Table

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

LONG = 16  # Characters; longer words may be broken


def page_html(page: Document) -> bytes:
    """Return a page as an HTML file (UTF-8) that needs no network and no other file.

    It takes jinja2 (`pip install 'photogram[report]'`).
    """
    environment = _environment()
    sections = [drawn for section in page.sections if (drawn := _drawn(section)).parts]
    known = {
        cell.id
        for section in sections
        for part in section.parts
        for table in (part.parts if isinstance(part, Layers) else (part,))
        if isinstance(table, Table)
        for row in table.rows
        for cell in row
        if isinstance(cell, Cell) and cell.id
    }
    text = environment.get_template("report.html").render(
        page=replace(page, title=re.sub(r"\s*\.{4,}\s*", " – ", page.title)),
        sections=sections,
        version=_photocore.__version__,
        attributes=_attributes,
        content=lambda column, cell: _content(column, cell, known),
        style=_source("style.css"),
        script=_source("script.js"),
    )
    return text.encode("utf-8", errors="replace")


@cache
def _environment() -> Environment:
    from jinja2 import BaseLoader, Environment, StrictUndefined

    class Packaged(BaseLoader):
        """Templates as they lie in the package, also in one that is zipped."""

        def get_source(self, environment: Environment, template: str) -> tuple[str, None, None]:
            return _text(template), None, None

    environment = Environment(
        loader=Packaged(),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["coded"] = _coded
    environment.filters["zip"] = zip
    return environment


def _text(name: str) -> str:
    return files("photogram.show").joinpath("templates", name).read_text(encoding="utf-8")


def _source(name: str) -> Markup:
    from markupsafe import Markup

    return Markup(_text(name))


def _coded(text: str) -> Markup:
    """Set what stands between grave accents as code."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text))))


def _attributes(column: Column, cell: Cell) -> Markup:
    from markupsafe import Markup, escape

    long = column.text and any(len(word) > LONG for word in str(cell.value).split())
    classes = " ".join(filter(None, ("text" if column.text else "", "long" if long else "", cell.tone)))
    number = cell.value if isinstance(cell.value, float) and column.decimals is None else cell.sorts
    known = number is not None and math.isfinite(number)
    named = {"class": classes, "id": cell.id, "data-value": f"{number:.9g}" if known else ""}
    return Markup("".join(f' {name}="{escape(text)}"' for name, text in named.items() if text))


def _content(column: Column, cell: Cell, known: set[str]) -> Markup:
    from markupsafe import Markup, escape

    text = escape(column.written(cell.value))
    return Markup('<a href="#{}">{}</a>').format(cell.goes_to, text) if cell.goes_to in known else text


def _drawn(section: Section) -> Section:
    parts: list[Part] = []
    for part in section.visible:
        if isinstance(part, Drawing):
            parts += [found] if (found := inlined(part)) else []
        elif isinstance(part, Layers):
            layers = [inlined(each) if isinstance(each, Drawing) else written(each) for each in part.parts]
            own = [each for each in layers if each is not None]
            parts += own if len(own) < 2 else [Layers(part.name, own)]
        elif not isinstance(part, quantity.Table) or part.visible:
            parts.append(written(part))
    return replace(section, parts=parts)


def inlined(drawing: Drawing) -> Picture | None:
    """Draw a picture; None where it has nothing to show."""
    from photogram.show.sketch.svg import svg_of

    sketch = drawing.sketch()
    markup = svg_of(sketch, drawing.name, drawing.title) if sketch is not None else ""
    return Picture(drawing.name, drawing.title, drawing.caption, markup) if markup else None
