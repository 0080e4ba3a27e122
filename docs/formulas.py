"""Set the formulas of the pages as MathML while mkdocs builds them: no script runs, nothing is fetched.

Formulas are written in LaTeX, as code hosts read it: `$r_i$` in a sentence, a fenced block ```` ```math ````
by itself. `pymdownx.arithmatex` finds them; here they become MathML. One that cannot be set is a warning,
which ends a strict build. The letters are those of formulas.woff2.
"""

from __future__ import annotations

import logging
import re
from html import escape, unescape
from itertools import zip_longest
from typing import Any
from xml.etree import ElementTree

from math_core import LatexError, LatexToMathML

FORMULA = re.compile(r'<(span|div) class="arithmatex">(.*?)</\1>', re.DOTALL)
LINES = re.compile(r'(<div class="language-text highlight")(>.*?</div>)', re.DOTALL)
NAMED = re.compile(r"&(?!amp;|lt;|gt;|quot;)[a-zA-Z]+;")
MARKS = re.compile(r"\\[(\[](.*)\\[)\]]", re.DOTALL)
LETTER, SIGN, SCRIPT, PADDING = 0.52, 1.3, 0.7, 0.35
"""Widths in em: of a letter, of a sign with the room around it; the size of indices; beside cells."""
log = logging.getLogger("mkdocs.plugins.formulas")


def width(element: ElementTree.Element) -> float:
    """Return about how wide a formula is, em: what the pages make a little smaller on a narrow screen."""
    parts = [width(part) for part in element]
    match element.tag:
        case "mtable":
            rows = [[width(cell) + 2.0 * PADDING for cell in row] for row in element]
            return sum(max(column) for column in zip_longest(*rows, fillvalue=0.0))
        case "mfrac":
            return max(parts) + 0.2
        case "msub" | "msup":
            return parts[0] + SCRIPT * parts[1]
        case "msubsup" | "munderover":
            return parts[0] + SCRIPT * max(parts[1:])
        case "mspace":
            return float(element.get("width", "0em").removesuffix("em"))
        case "msqrt":
            return sum(parts) + 0.8
        case "mo":
            text = (element.text or "").strip()
            return SIGN if text in set("=+−≤≥<>×·→←") else LETTER * len(text)
    return sum(parts) + LETTER * len((element.text or "").strip())


def as_mathml(latex: str, displayed: bool) -> str:
    """Return a formula as MathML, which the search does not read. LatexError where it cannot be set."""
    made = LatexToMathML(fancy_error=False).convert_with_local_state(latex, displaystyle=displayed)
    made = NAMED.sub(lambda name: unescape(name[0]), made)
    marked = made.replace("<math", f'<math data-search-exclude="" aria-label="{escape(latex)}"', 1)
    if not displayed:
        return marked
    return f'<div class="formula" style="--width: {width(ElementTree.fromstring(made)):.0f}">{marked}</div>'


def measured(lines: re.Match[str]) -> str:
    """Return a block of text with the number of characters of its longest line, for narrow screens."""
    text = unescape(re.sub(r"<[^>]*>", "", lines[2][1:]))
    return f'{lines[1]} style="--characters: {max(map(len, text.splitlines()), default=1)}"{lines[2]}'


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Set all formulas of a page."""

    def formula(match: re.Match[str]) -> str:
        marked = MARKS.search(unescape(match[2]))
        assert marked is not None, match[0]
        try:
            return as_mathml(marked[1].strip(), displayed=match[1] == "div")
        except LatexError as error:
            log.warning("%s: a formula cannot be set: %s: %s", page.file.src_uri, marked[1].strip(), error)
            return match[0]

    return LINES.sub(measured, FORMULA.sub(formula, html))
