"""Documents as PDF on A4, typeset by Typst (`pip install 'photogram[pdf]'`).

Equal documents result in equal bytes.
"""

from __future__ import annotations

import json
import re
from functools import partial
from importlib.resources import files
from typing import Any

import typst

from photogram.lazy_dataclasses import fields, replace
from photogram.show.forms import formatted
from photogram.show.html import inlined
from photogram.show.page import Column, Document, Drawing, Table
from photogram.show.sketch.layout import width
from photogram.show.sketch.svg import LETTERS

FONTS = ("Libertinus Serif", "New Computer Modern Math", "DejaVu Sans Mono")
"""Fonts included in the library; for other letters it uses fonts of the machine."""

OMITTED = ("members", "phases", "words", "sketch", "cells", "marked", "link")  # Fields that pages do not show
LONGEST = 30  # Longest word that is not broken, characters


def page_pdf(page: Document, *, author: str = "") -> bytes:
    """Return a document as tagged PDF with bookmarks and embedded fonts.

    `author` is a property of the file.
    """
    titled = formatted(replace(page, title=page.title or page.what, details=()), inlined)
    footer = f"{page.what} – {titled.title}" if page.title else page.what
    texts = {
        "advice_heading": page.words("page.advice"),
        "numbers": page.words("page.numbers", number="{number}", total="{total}"),
        "language": page.words.language,
    }
    record = _record(titled) | {"author": author or [], "footer": footer, "fonts": FONTS, "longest": LONGEST}
    data = json.dumps(record | texts, default=_record, ensure_ascii=False)
    data = data.encode(errors="replace").decode()  # Names of files may contain bytes that are not UTF-8.
    template = files("photogram.show").joinpath("templates", "page.typ").read_bytes()
    content: bytes = typst.compile(template, sys_inputs={"document": data})
    return content


def _record(part: Any) -> Any:
    """Return the fields of a part of a document."""
    names = (each.name for each in fields(part) if each.name not in OMITTED)
    record: dict[str, Any] = {name: getattr(part, name) for name in names} | {"kind": type(part).__name__}
    if isinstance(part, Drawing):
        # Width and height follow from the view box.
        record["markup"] = re.sub('^(<svg[^>]*) width="[^"]*"', r"\1", part.markup).replace(LETTERS, FONTS[0])
    elif isinstance(part, Table):
        record["rows"] = [*zip(*(column.toned for column in part.columns), strict=True)]
    elif isinstance(part, Column):
        size, words = partial(width, size=1.0), " ".join(part.cells).split() if part.text else part.cells
        record["heads"] = [*part.head.split(), *part.unit.split()]
        record["widest"] = max(part.cells, key=size, default="")
        record["word"] = max((word[:LONGEST] for word in words), key=size, default="")
    return record
