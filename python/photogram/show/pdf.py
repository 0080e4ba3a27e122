"""A page as a PDF document on A4; what makes it is the extra `photogram[pdf]`, and matplotlib for pictures.

The first sections stand on the first page as far as they go; sections that are annexes begin on pages of
their own; tables have letters as small as it takes for them to go on a sheet. Equal pages give equal bytes.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import matplotlib as mpl
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase.pdfmetrics import registerFont, registerFontFamily, stringWidth
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Frame, LongTable, PageBreak, PageTemplate, Paragraph, Spacer
from reportlab.platypus import Table as Grid

from photogram.show import quantity
from photogram.show.cells import written
from photogram.show.page import Document, Drawing, Facts, Judgement, Layers, Remarks, Section, Table, Text
from photogram.show.style import styled
from photogram.show.vectors import FigureFlowable

FONT, BOLD = "DejaVuSans", "DejaVuSans-Bold"
INK, SOFT, RULE = "#17212b", "#55626e", "#d6dce1"
TONES = {"good": "#00694a", "look": "#8a5200", "bad": "#a3201a", "": INK}
SIZES = (6.9, 6.4, 5.9, 5.4, 5.0)
"""Points of the letters."""
PADDING = 7.0
"""Points beside what stands in a cell."""
CLOSE: Sequence[tuple[Any, ...]] = (
    ("VALIGN", (0, 0), (-1, -1), "TOP"),
    ("LEFTPADDING", (0, 0), (-1, -1), 2),
    ("RIGHTPADDING", (0, 0), (-1, -1), 4),
    ("TOPPADDING", (0, 0), (-1, -1), 1),
    ("BOTTOMPADDING", (0, 0), (-1, -1), 1.5),
)
MARGIN = 44.0
"""Points at all sides of a sheet."""
HIGHEST, FRONT = 300.0, 215.0
"""Points of a picture, and of one before the annexes."""


def page_pdf(page: Document, *, author: str = "") -> bytes:
    """Return a page as a PDF document."""
    _fonts(Path(mpl.get_data_path()) / "fonts" / "ttf")
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
    document.build(list(_Flow(page, width).story()), canvasmaker=_Numbered)
    return content.getvalue()


@cache
def _fonts(folder: Path) -> None:
    """Make the fonts known that matplotlib brings along: they have all letters of the languages."""
    for name in (FONT, BOLD):
        registerFont(TTFont(name, folder / f"{name}.ttf"))
    registerFontFamily(FONT, normal=FONT, bold=BOLD, italic=FONT, boldItalic=BOLD)


def _foot(page: Document) -> Any:
    def draw(canvas: Any, document: Any) -> None:
        canvas.saveState()
        canvas.setFont(FONT, 7)
        canvas.setFillColor(SOFT)
        canvas.drawString(MARGIN, MARGIN / 2, f"{page.what} – {page.title}" if page.title else page.what)
        canvas.restoreState()

    return draw


class _Numbered(Canvas):  # type: ignore[misc]
    """A canvas that knows how many pages there are when it numbers them."""

    def __init__(self, *given: Any, **more: Any) -> None:
        super().__init__(*given, **more)
        self._sheets: list[dict[str, Any]] = []

    def showPage(self) -> None:  # noqa: N802
        """Keep the page until all are there."""
        self._sheets.append(dict(self.__dict__))
        self._startPage()

    def save(self) -> None:
        """Write the pages with their numbers."""
        for sheet in self._sheets:
            self.__dict__.update(sheet)
            self.setFont(FONT, 7)
            self.setFillColor(SOFT)
            number = f"{self._pageNumber} / {len(self._sheets)}"
            self.drawRightString(self._pagesize[0] - MARGIN, MARGIN / 2, number)
            super().showPage()
        super().save()


def _heading(text: str, style: Any, key: str) -> Paragraph:
    """Return a heading that stands among the bookmarks, too."""

    class Heading(Paragraph):  # type: ignore[misc]
        def draw(self) -> None:
            self.canv.bookmarkPage(key)
            self.canv.addOutlineEntry(self.getPlainText(), key, 0, closed=False)
            super().draw()

    return Heading(text, style)


class _Flow:
    """The page as what flows over sheets."""

    def __init__(self, page: Document, width: float) -> None:
        self._page, self._width, self._front = page, width, True

        def style(size: float, **more: Any) -> Any:
            given = {"fontName": FONT, "fontSize": size, "leading": 1.28 * size, "textColor": INK, **more}
            return ParagraphStyle(f"{size}{sorted(more.items())}", **given)

        self._title = style(15, fontName=BOLD, spaceAfter=4)
        self._what = style(9, textColor=SOFT)
        self._head = style(10.5, fontName=BOLD, spaceBefore=8, spaceAfter=3)
        self._caption = style(8, fontName=BOLD, spaceBefore=4, spaceAfter=2)
        self._body = style(8, spaceAfter=1)
        self._small = style(6.8, textColor=SOFT, spaceAfter=2)
        self._line = style(7)
        self._mark = {tone: style(9, fontName=BOLD, textColor=colour) for tone, colour in TONES.items()}
        self._headline = style(10.5, fontName=BOLD, spaceAfter=3)
        self._cell = style(6.9)

    def story(self) -> Iterator[Any]:
        """Return everything, one after the other."""
        page = self._page
        if page.title:
            yield Paragraph(escape(page.what), self._what)
        yield Paragraph(escape(page.title or page.what), self._title)
        if page.head:
            told = " · ".join(f"{each.name}: {each.value}" for each in page.head)
            yield Paragraph(escape(told), self._body)
        yield Spacer(1, 5)
        for each in page.judgements:
            yield from self._judgement(each)
        for sentence in page.advice:
            yield Paragraph(f"• {escape(sentence)}", self._body)
        for section in page.sections:
            self._front = self._front and not section.annex
            if section.annex and section.parts:
                yield PageBreak()
            yield from self._section(section)

    def _judgement(self, judgement: Judgement) -> Iterator[Any]:
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
        parts = [part for part in section.parts if not isinstance(part, quantity.Table) or part.visible]
        if not parts:
            return
        if section.title:
            yield _heading(escape(section.title), self._head, section.key)
        if section.intro:
            yield Paragraph(escape(section.intro), self._small)
        if self._front and [type(part) for part in section.parts] == [Remarks, Drawing]:
            yield self._beside(*section.parts)
            return
        for part in parts:
            yield from self._part(part, section.title)

    def _beside(self, told: Any, drawing: Any) -> Any:
        """Return sentences with a picture at their side: the first sheet is to hold both."""
        whole = self._width
        columns = (0.52 * whole, 0.48 * whole)
        cells = []
        for part, self._width in zip((told, drawing), (columns[0] - 10, columns[1]), strict=True):
            cells.append(list(self._part(part, "")))
        self._width = whole
        grid = Grid([cells], colWidths=columns)
        nothing = [(f"{side}PADDING", (0, 0), (-1, -1), 0) for side in ("LEFT", "TOP", "BOTTOM")]
        grid.setStyle([("VALIGN", (0, 0), (-1, -1), "TOP"), *nothing])
        return grid

    def _part(self, part: Any, within: str) -> Iterator[Any]:
        part = written(part)
        if isinstance(part, Table):
            yield from self._table(part, within)
        elif isinstance(part, Facts):
            if part.caption and part.caption != within:
                yield Paragraph(escape(part.caption), self._caption)
            if part.facts:
                yield self._facts(part)
        elif isinstance(part, Drawing):
            yield from self._drawing(part)
        elif isinstance(part, Layers):
            for each in part.parts:
                yield from self._part(each, within)
        elif isinstance(part, Text):
            yield Paragraph(escape(part.text), self._line)
        elif isinstance(part, Remarks):
            for sentence in part.sentences:
                yield Paragraph(f"• {escape(sentence)}", self._line)
        yield Spacer(1, 2)

    def _drawing(self, drawing: Drawing) -> Iterator[Any]:
        with styled():
            figure = drawing.draw()
        if figure is not None:
            yield FigureFlowable(figure, self._width, FRONT if self._front else HIGHEST)
            yield Paragraph(escape(drawing.caption), self._small)

    def _facts(self, facts: Facts) -> Any:
        rows = [
            [
                Paragraph(escape(each.name), self._cell),
                Paragraph(escape(" ".join(filter(None, (each.value, each.unit, each.note)))), self._cell),
            ]
            for each in facts.facts
        ]
        grid = Grid(rows, colWidths=[0.25 * self._width, 0.75 * self._width])
        grid.setStyle([("LINEABOVE", (0, 0), (-1, -1), 0.4, RULE), *CLOSE])
        return grid

    def _table(self, table: Table, within: str) -> Iterator[Any]:
        if table.caption != within:
            yield Paragraph(escape(table.caption), self._caption)
        if table.note:
            yield Paragraph(escape(table.note), self._small)
        yield _grid(table, self._width)


def _grid(table: Table, width: float) -> Any:
    """Return a table that flows over sheets, no wider than there is room; its head is on each of them."""
    size, widths = _fitted(table, width)

    def style(name: str, font: str, alignment: int) -> Any:
        given = {"fontName": font, "fontSize": size, "leading": 1.28 * size, "textColor": INK}
        return ParagraphStyle(name, alignment=alignment, **given)

    cells = {text: style("cell", FONT, 0 if text else 2) for text in (True, False)}
    heads = {text: style("head", BOLD, 0 if text else 2) for text in (True, False)}
    first = [
        Paragraph(escape(each.head) + (f"<br/>{escape(each.unit)}" if each.unit else ""), heads[each.text])
        for each in table.columns
    ]
    rows = []
    for row in table.cells():
        written = [(column, cell, escape(column.written(cell.value))) for column, cell in row]
        rows.append(
            [
                Paragraph(f'<font color="{TONES[cell.tone]}">{text}</font>', cells[column.text])
                for column, cell, text in written
            ]
        )
    found = LongTable([first, *rows], colWidths=widths, repeatRows=1, hAlign="LEFT")
    lines = (("LINEBELOW", (0, 0), (-1, 0), 0.8, INK), ("LINEBELOW", (0, 1), (-1, -1), 0.3, RULE))
    found.setStyle([*lines, *CLOSE])
    return found


def _fitted(table: Table, width: float) -> tuple[float, list[float]]:
    """Return the size of letters, and widths of columns: names give way first, down to their longest word."""
    for size in SIZES:
        wide, least = _widths(table, size, width)
        if sum(least) <= width:
            break
    over = sum(wide) - width
    if over <= 0:
        return size, wide
    slack = [max(each - small, 0.0) for each, small in zip(wide, least, strict=True)]
    given = min(1.0, over / sum(slack)) if sum(slack) > 0 else 0.0
    found = [each - given * own for each, own in zip(wide, slack, strict=True)]
    return size, [each * min(1.0, width / sum(found)) for each in found]


def _widths(table: Table, size: float, width: float) -> tuple[list[float], list[float]]:
    """Return how wide columns would be, and how wide they have to be at the least."""
    rows = [[column.written(cell.value) for column, cell in row] for row in table.cells()]
    wide, least = [], []
    for k, column in enumerate(table.columns):
        heads = [word for text in (column.head, column.unit) for word in text.split()]
        head = max((stringWidth(word, BOLD, size) for word in heads), default=0.0)
        texts = [row[k] for row in rows]
        longest = max((stringWidth(text, FONT, size) for text in texts), default=0.0)
        words = [word for text in texts for word in text.split()] if column.text else texts
        word = max((stringWidth(each, FONT, size) for each in words), default=0.0)
        wide.append(max(min(longest, 0.5 * width), head) + PADDING)
        least.append(max(min(word, 0.5 * width), head) + PADDING)
    return wide, least
