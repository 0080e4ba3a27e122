"""A page as a PDF document on A4; what makes it is the extra `photogram[pdf]`, and matplotlib for pictures.

The first sections stand on the first page as far as they go; sections that are annexes begin on pages of
their own. Equal pages give equal bytes.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any
from xml.sax.saxutils import escape

from photogram.errors import InputError
from photogram.show.page import (
    Cell,
    Column,
    Drawing,
    Facts,
    Judgement,
    Layers,
    Page,
    Part,
    Remarks,
    Section,
    Table,
    Text,
)

__all__ = ["page_pdf"]

MARGIN = 48.0
"""Points at all sides of a sheet."""
FONT, BOLD = "DejaVuSans", "DejaVuSans-Bold"
INK, SOFT, RULE = "#17212b", "#55626e", "#d6dce1"
TONES = {"good": "#00694a", "look": "#8a5200", "bad": "#a3201a", "": INK}
HIGHEST = 300.0
"""Points of a picture."""


def page_pdf(page: Page, *, author: str = "") -> bytes:
    """Return a page as a PDF document.

    Raises
    ------
    InputError
        reportlab, or matplotlib, which has the fonts, is missing: `pip install 'photogram[pdf]'`.
    """
    try:
        from reportlab.lib.pagesizes import A4
        from reportlab.platypus import BaseDocTemplate, Frame, PageTemplate
    except ModuleNotFoundError:
        raise InputError("a PDF needs reportlab: pip install 'photogram[pdf]'") from None
    _fonts()
    content = io.BytesIO()
    document = BaseDocTemplate(
        content,
        pagesize=A4,
        title=page.title or page.what,
        author=author,
        subject=page.what,
        lang=page.language,
        creator="photogram",
        invariant=1,
        pageCompression=1,
    )
    width, height = A4[0] - 2 * MARGIN, A4[1] - 2 * MARGIN
    frame = Frame(MARGIN, MARGIN, width, height, 0, 0, 0, 0, id="sheet")
    document.addPageTemplates(PageTemplate("sheet", [frame], onPage=_foot(page)))
    document.build(list(_Flow(page, width).story()), canvasmaker=_numbered())
    return content.getvalue()


@cache
def _fonts() -> None:
    """Make the fonts known that matplotlib brings along: they have all letters of the languages."""
    from pathlib import Path

    import matplotlib as mpl
    from reportlab.pdfbase.pdfmetrics import registerFont, registerFontFamily
    from reportlab.pdfbase.ttfonts import TTFont

    folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
    for name in (FONT, BOLD):
        registerFont(TTFont(name, folder / f"{name}.ttf"))
    registerFontFamily(FONT, normal=FONT, bold=BOLD, italic=FONT, boldItalic=BOLD)


def _foot(page: Page) -> Any:
    def draw(canvas: Any, document: Any) -> None:
        canvas.saveState()
        canvas.setFont(FONT, 7)
        canvas.setFillColor(SOFT)
        canvas.drawString(MARGIN, MARGIN / 2, f"{page.what} – {page.title}" if page.title else page.what)
        canvas.restoreState()

    return draw


def _numbered() -> Any:
    """Return a canvas that knows how many pages there are when it numbers them."""
    from reportlab.pdfgen.canvas import Canvas

    class Numbered(Canvas):  # type: ignore[misc]
        def __init__(self, *given: Any, **more: Any) -> None:
            super().__init__(*given, **more)
            self._sheets: list[dict[str, Any]] = []

        def showPage(self) -> None:  # noqa: N802
            self._sheets.append(dict(self.__dict__))
            self._startPage()

        def save(self) -> None:
            for sheet in self._sheets:
                self.__dict__.update(sheet)
                self.setFont(FONT, 7)
                self.setFillColor(SOFT)
                self.drawRightString(
                    self._pagesize[0] - MARGIN, MARGIN / 2, f"{self._pageNumber} / {len(self._sheets)}"
                )
                super().showPage()
            super().save()

    return Numbered


class _Flow:
    """The page as what flows over sheets."""

    def __init__(self, page: Page, width: float) -> None:
        from reportlab.lib.styles import ParagraphStyle

        self._page, self._width = page, width

        def style(size: float, **more: Any) -> Any:
            given = {"fontName": FONT, "fontSize": size, "leading": 1.32 * size, "textColor": INK, **more}
            return ParagraphStyle(f"{size}{sorted(more.items())}", **given)

        self._title = style(15, fontName=BOLD, spaceAfter=4)
        self._what = style(9, textColor=SOFT)
        self._head = style(10.5, fontName=BOLD, spaceBefore=8, spaceAfter=3)
        self._caption = style(8, fontName=BOLD, spaceBefore=4, spaceAfter=2)
        self._body = style(8.2, spaceAfter=2)
        self._small = style(7, textColor=SOFT, spaceAfter=3)
        self._mark = {tone: style(9, fontName=BOLD, textColor=colour) for tone, colour in TONES.items()}
        self._headline = style(10.5, fontName=BOLD, spaceAfter=3)
        self._cell, self._cell_right = style(6.9), style(6.9, alignment=2)
        self._cell_head, self._head_right = style(6.9, fontName=BOLD), style(6.9, fontName=BOLD, alignment=2)

    def story(self) -> Iterator[Any]:
        """Return everything, one after the other."""
        from reportlab.platypus import PageBreak, Paragraph, Spacer

        page = self._page
        if page.title:
            yield Paragraph(escape(page.what), self._what)
        yield Paragraph(escape(page.title or page.what), self._title)
        if page.head:
            yield self._facts(Facts("", page.head))
        yield Spacer(1, 5)
        for each in page.judgements:
            yield from self._judgement(each)
        for sentence in page.advice:
            yield Paragraph(f"• {escape(sentence)}", self._body)
        for section in page.sections:
            if section.annex:
                yield PageBreak()
            yield from self._section(section)

    def _judgement(self, judgement: Judgement) -> Iterator[Any]:
        from reportlab.platypus import Paragraph
        from reportlab.platypus import Table as Grid

        lines = [
            Paragraph(escape(f"{judgement.mark} {judgement.on}".strip()), self._mark[judgement.tone]),
            Paragraph(escape(judgement.headline), self._headline),
            *(Paragraph(escape(line), self._body) for line in judgement.lines),
        ]
        grid = Grid([[line] for line in lines], colWidths=[self._width])
        grid.setStyle(
            [
                ("LINEBEFORE", (0, 0), (0, -1), 2.5, TONES[judgement.tone]),
                ("LEFTPADDING", (0, 0), (-1, -1), 8),
                ("TOPPADDING", (0, 0), (-1, -1), 0),
                ("BOTTOMPADDING", (0, 0), (-1, -1), 1),
            ]
        )
        yield grid

    def _section(self, section: Section) -> Iterator[Any]:
        from reportlab.platypus import Paragraph

        if not section.parts:
            return
        yield _Heading(escape(section.title), self._head, section.id)
        if section.intro:
            yield Paragraph(escape(section.intro), self._small)
        for part in section.parts:
            yield from self._part(part, section.title)

    def _part(self, part: Part, within: str) -> Iterator[Any]:
        from reportlab.platypus import Paragraph, Spacer

        if isinstance(part, Table):
            yield from self._table(part, within)
        elif isinstance(part, Facts):
            if part.caption and part.caption != within:
                yield Paragraph(escape(part.caption), self._caption)
            yield self._facts(part)
        elif isinstance(part, Drawing):
            yield from self._drawing(part)
        elif isinstance(part, Layers):
            for each in part.parts:
                yield from self._part(each, within)
        elif isinstance(part, Text):
            yield Paragraph(escape(part.text), self._body)
        elif isinstance(part, Remarks):
            for sentence in part.sentences:
                yield Paragraph(f"• {escape(sentence)}", self._body)
        yield Spacer(1, 3)

    def _drawing(self, drawing: Drawing) -> Iterator[Any]:
        from reportlab.platypus import Paragraph

        from photogram.show.style import styled
        from photogram.show.vectors import FigureFlowable

        with styled():
            figure = drawing.draw()
        if figure is not None:
            yield FigureFlowable(figure, self._width, HIGHEST)
            yield Paragraph(escape(drawing.caption), self._small)

    def _facts(self, facts: Facts) -> Any:
        from reportlab.platypus import Paragraph
        from reportlab.platypus import Table as Grid

        rows = [
            [
                Paragraph(escape(each.name), self._cell),
                Paragraph(escape(" ".join(filter(None, (each.value, each.unit, each.note)))), self._cell),
            ]
            for each in facts.facts
        ]
        grid = Grid(rows, colWidths=[0.25 * self._width, 0.75 * self._width])
        grid.setStyle([("LINEABOVE", (0, 0), (-1, -1), 0.4, RULE), *_CLOSE])
        return grid

    def _table(self, table: Table, within: str) -> Iterator[Any]:
        from reportlab.platypus import LongTable, Paragraph

        if table.caption != within:
            yield Paragraph(escape(table.caption), self._caption)
        if table.note:
            yield Paragraph(escape(table.note), self._small)
        heads = [
            Paragraph(
                escape(each.head) + (f"<br/>{escape(each.unit)}" if each.unit else ""),
                self._cell_head if each.text else self._head_right,
            )
            for each in table.columns
        ]
        rows = [[self._written(column, cell) for column, cell in row] for row in table.cells()]
        grid = LongTable([heads, *rows], colWidths=self._widths(table), repeatRows=1)
        grid.setStyle(
            [("LINEBELOW", (0, 0), (-1, 0), 0.8, INK), ("LINEBELOW", (0, 1), (-1, -1), 0.3, RULE), *_CLOSE]
        )
        yield grid

    def _written(self, column: Column, cell: Cell) -> Any:
        from reportlab.platypus import Paragraph

        text = escape(column.written(cell.value))
        coloured = f'<font color="{TONES[cell.tone]}">{text}</font>' if cell.tone else text
        return Paragraph(coloured, self._cell if column.text else self._cell_right)

    def _widths(self, table: Table) -> list[float]:
        """Return widths of columns by what stands in them; together as wide as the sheet, at the most."""
        from reportlab.pdfbase.pdfmetrics import stringWidth

        size = self._cell.fontSize
        wide = []
        for k, column in enumerate(table.columns):
            words = [word for text in (column.head, column.unit) for word in text.split()]
            cells = [column.written(cell.value) for row in table.cells() for cell in [row[k][1]]]
            longest = max((stringWidth(text, FONT, size) for text in cells), default=0.0)
            head = max((stringWidth(word, BOLD, size) for word in words), default=0.0)
            wide.append(max(min(longest, 0.5 * self._width), head) + 9.0)
        total = sum(wide)
        return [each * self._width / total for each in wide] if total > self._width else wide


_CLOSE: Sequence[tuple[Any, ...]] = (
    ("VALIGN", (0, 0), (-1, -1), "TOP"),
    ("LEFTPADDING", (0, 0), (-1, -1), 2),
    ("RIGHTPADDING", (0, 0), (-1, -1), 4),
    ("TOPPADDING", (0, 0), (-1, -1), 1),
    ("BOTTOMPADDING", (0, 0), (-1, -1), 1.5),
)


def _Heading(text: str, style: Any, key: str) -> Any:  # noqa: N802
    """Return a heading that stands among the bookmarks, too."""
    from reportlab.platypus import Paragraph

    class Heading(Paragraph):  # type: ignore[misc]
        def draw(self) -> None:
            self.canv.bookmarkPage(key)
            self.canv.addOutlineEntry(self.getPlainText(), key, 0, closed=False)
            super().draw()

    return Heading(text, style)
