"""Tables of a page as tables of reportlab, in letters as small as it takes for them to go on a sheet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.sax.saxutils import escape

from photogram.show.page import Table

__all__ = ["BOLD", "CLOSE", "FONT", "INK", "RULE", "SOFT", "TONES", "grid"]

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


def grid(table: Table, width: float) -> Any:
    """Return a table that flows over sheets, no wider than there is room; its head is on each of them."""
    from reportlab.lib.styles import ParagraphStyle
    from reportlab.platypus import LongTable, Paragraph

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
    from reportlab.pdfbase.pdfmetrics import stringWidth

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
