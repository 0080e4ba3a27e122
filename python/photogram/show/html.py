"""A page as one HTML file that needs nothing else; what makes it is the extra `photogram[report]`.

Pictures of few things stand in it as vectors, those of many as dots.
"""

from __future__ import annotations

import base64
import io
import math
import re
from dataclasses import replace
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from photogram import _photocore
from photogram.show.page import Cell, Column, Drawing, Layers, Page, Part, Picture, Section, Table

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

LONG = 16
"""Characters of a word that a table may break; shorter ones give the least width of their column."""


def page_html(page: Page) -> bytes:
    """Return a page as an HTML file (UTF-8) that needs no network and no other file.

    It takes jinja2, and matplotlib for drawings that are no sketches (`pip install 'photogram[report]'`).
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
    from markupsafe import Markup

    long = column.text and any(len(word) > LONG for word in str(cell.value).split())
    classes = " ".join(filter(None, ("text" if column.text else "", "long" if long else "", cell.tone)))
    found = Markup(' class="{}"').format(classes) if classes else Markup()
    if cell.id:
        found += Markup(' id="{}"').format(cell.id)
    number = cell.value if isinstance(cell.value, float) and column.decimals is None else cell.sorts
    if number is not None and math.isfinite(number):
        found += Markup(' data-value="{}"').format(f"{number:.9g}")
    return found


def _content(column: Column, cell: Cell, known: set[str]) -> Markup:
    from markupsafe import Markup, escape

    text = escape(column.written(cell.value))
    return Markup('<a href="#{}">{}</a>').format(cell.goes_to, text) if cell.goes_to in known else text


def _drawn(section: Section) -> Section:
    """Return a section with its pictures drawn, without those that have nothing to show."""
    parts: list[Part] = []
    for part in section.parts:
        if isinstance(part, Drawing):
            parts += [found] if (found := inlined(part)) else []
        elif isinstance(part, Layers):
            layers = [inlined(each) if isinstance(each, Drawing) else each for each in part.parts]
            own = [each for each in layers if each is not None]
            parts += own if len(own) < 2 else [Layers(part.name, own)]
        else:
            parts.append(part)
    return replace(section, parts=parts)


LARGEST = 600_000
"""Bytes of a picture of vectors at most: one that has more after all becomes dots."""
DPI = 170
"""Dots an inch of the others: sharp on paper and on fine screens."""


def inlined(drawing: Drawing) -> Picture | None:
    """Draw a picture; None where it has nothing to show.

    One that is no sketch needs matplotlib, of `photogram[report]`.
    """
    if drawing.figure is not None:
        markup = _of_figure(drawing)
    else:
        from photogram.show.sketch.svg import svg_of

        sketch = drawing.sketch() if drawing.sketch is not None else None
        markup = svg_of(sketch, drawing.name, drawing.title) if sketch is not None else ""
    return Picture(drawing.name, drawing.title, drawing.caption, markup) if markup else None


def _of_figure(drawing: Drawing) -> str:
    """Return a figure of matplotlib as an element of a page; nothing where it has nothing to show."""
    from photogram.show.style import styled

    # Ticks are made when a figure is saved; identifiers are the same in every run.
    with styled({"svg.hashsalt": drawing.name}):
        from matplotlib.backends.backend_svg import FigureCanvasSVG

        figure = drawing.draw()
        if figure is None:
            return ""
        width, height = figure.get_size_inches()
        content = io.StringIO()
        canvas: Any = FigureCanvasSVG(figure)  # without types; savefig would draw all of it twice
        canvas.print_svg(content, metadata={"Date": None, "Creator": None})
        markup = _embedded(content.getvalue(), drawing, width)
        if len(markup) > LARGEST:
            dots = io.BytesIO()
            figure.savefig(dots, format="png", dpi=DPI, metadata={"Software": None})
            data = base64.b64encode(dots.getvalue()).decode()
            markup = (
                f'<img src="data:image/png;base64,{data}" alt="{_quoted(drawing.title)}"'
                f' width="{96 * width:.0f}" height="{96 * height:.0f}">'
            )
    return markup


def _embedded(text: str, drawing: Drawing, width: float) -> str:
    """Return an SVG file as an element of a page: without prologue, with identifiers of its own."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, count=1, flags=re.DOTALL)
    head, body = text.split(">", 1)
    [box] = re.findall(r'viewBox="[^"]*"', head)
    prefix = f"{drawing.name}-"
    body = re.sub(r'\bid="([^"]+)"', rf'id="{prefix}\1"', body)
    body = re.sub(r'((?:xlink:)?href=")#', rf"\1#{prefix}", body)
    body = re.sub(r"url\(#", f"url(#{prefix}", body)
    label = f'role="img" aria-label="{_quoted(drawing.title)}"'
    return f'<svg {box} {label} xmlns:xlink="http://www.w3.org/1999/xlink" width="{96 * width:.0f}">{body}'


def _quoted(text: str) -> str:
    from markupsafe import escape

    return str(escape(text))
