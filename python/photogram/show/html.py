"""A page as one self-contained HTML file, with the extra `photogram[report]`."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from photogram import _photocore
from photogram.show.cells import formatted
from photogram.show.page import Cell, Column, Document, Drawing, Table

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

LONG = 16  # Characters; longer words may be broken
NUMBER = re.compile(r"-?\d+(\.\d+)?(e[-+]\d+)?")  # Numbers that the script of a page can read


def page_html(page: Document) -> bytes:
    """Return a page as self-contained HTML (UTF-8).

    It requires jinja2 (`pip install 'photogram[report]'`).
    """
    page = formatted(replace(page, title=re.sub(r"\s*\.{4,}\s*", " – ", page.title)), inlined)
    tables = (part for part in page.parts(layers=True) if isinstance(part, Table))
    text = (
        _environment()
        .get_template("report.html")
        .render(
            page=page,
            known={cell.id for table in tables for row in table.rows for cell in row if cell.id},
            version=_photocore.__version__,
            attributes=_attributes,
        )
    )
    return text.encode("utf-8", errors="replace")


@cache
def _environment() -> Environment:
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    templates = files("photogram.show") / "templates"
    environment = Environment(
        # Templates of a package, also if it is zipped
        loader=FunctionLoader(lambda name: (templates / name).read_text(encoding="utf-8")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["coded"] = _coded
    return environment


def _coded(text: str) -> Markup:
    """Format text between grave accents as code."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text))))


def _attributes(column: Column, cell: Cell) -> dict[str, str]:
    long = column.text and any(len(word) > LONG for word in cell.text.split())
    # Columns are sorted by these numbers if the texts of cells are not numbers.
    sorts = cell.number is not None and math.isfinite(cell.number) and not NUMBER.fullmatch(cell.text)
    return {
        "class": " ".join(filter(None, ("text" if column.text else "", "long" if long else "", cell.tone))),
        "id": cell.id,
        "data-value": f"{cell.number:.9g}" if sorts else "",
    }


def inlined(drawing: Drawing) -> Drawing | None:
    """Draw a plot; return None if it is empty."""
    from photogram.show.sketch.svg import svg_of

    sketch = drawing.sketch()
    markup = svg_of(sketch, drawing.name, drawing.title) if sketch is not None else ""
    return replace(drawing, markup=markup) if markup else None
