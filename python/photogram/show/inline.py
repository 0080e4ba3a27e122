"""Pictures as they stand in a page: few things as vectors, many as dots."""

from __future__ import annotations

import base64
import io
import re
from typing import Any

from photogram.show.page import Drawing, Picture

__all__ = ["inlined"]

LARGEST = 600_000
"""Bytes of a picture of vectors at most: one that has more after all becomes dots."""
DPI = 170
"""Dots an inch of the others: sharp on paper and on fine screens."""


def inlined(drawing: Drawing) -> Picture | None:
    """Draw a picture; None where it has nothing to show.

    Raises
    ------
    ModuleNotFoundError
        matplotlib is missing: `pip install 'photogram[report]'`.
    """
    from photogram.show.style import styled

    # Ticks are made when a figure is saved; identifiers are the same in every run.
    with styled({"svg.hashsalt": drawing.name}):
        from matplotlib.backends.backend_svg import FigureCanvasSVG

        figure = drawing.draw()
        if figure is None:
            return None
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
    return Picture(drawing.name, drawing.title, drawing.caption, markup)


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
