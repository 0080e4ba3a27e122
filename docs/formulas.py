"""Set the formulas of the pages as MathML while mkdocs builds them: no script runs, nothing is fetched.

Formulas are written in LaTeX, as code hosts read it: `$r_i$` in a sentence, a fenced block ```` ```math ````
by itself. `pymdownx.arithmatex` finds them; here they become MathML. One that cannot be set is a warning,
which ends a strict build. The letters are those of formulas.woff2.
"""

from __future__ import annotations

import logging
import re
from html import unescape
from itertools import zip_longest
from typing import Any
from xml.etree import ElementTree

from math_core import LatexError, LatexToMathML

FORMULA = re.compile(r'<(span|div) class="arithmatex">(.*?)</\1>', re.DOTALL)
LINES = re.compile(r'(<div class="language-(\w+) highlight")(>.*?</div>)', re.DOTALL)
NAMED = re.compile(r"&(?!amp;|lt;|gt;|quot;)[a-zA-Z]+;")
CODE = re.compile(r"(?<=<code>)[^<]+(?=</code>)")
LONG_WORD = re.compile(r"[^\s<>&]{17,}")
BREAK = re.compile(r"(?<=[_/:,=(])(?=[A-Za-z])|(?<=\w)(?=\.[A-Za-z])")
OPTION = re.compile(r"(?<![^\s>])--?[a-z][\w-]*(?![^<]*>)")
ROW = re.compile(r'<span class="go">(?=.*\S  +\S.*\S  +\S)(.{1,138})</span>')
SENTENCE = re.compile(r"(?<=\n|>)(?!.*\S  +\S.*\S  +\S)(?=.*\S \S)[^\n<>]{60,}(?=\n)")
MARKS = re.compile(r"\\[(\[](.*)\\[)\]]", re.DOTALL)
PRIMES = ("′", "″", "‴")
STRUT = {"height": "0.8em", "depth": "0.2em"}
"""What keeps the sign of a root, which is a line high at the least, from hanging below its line."""
LETTER, SIGN, SCRIPT, PADDING = 0.52, 1.3, 0.7, 0.35
"""Widths in em: of a letter, of a sign with the room around it; the size of indices; beside cells."""
WRAPPED = 116
"""Characters of a line of a terminal above which it is wrapped."""
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


def _row(*parts: ElementTree.Element) -> ElementTree.Element:
    """Return one part, or a row of several."""
    if len(parts) == 1:
        return parts[0]
    row = ElementTree.Element("mrow")
    row.extend(parts)
    return row


def _unraised(element: ElementTree.Element) -> ElementTree.Element:
    """Return a letter with primes, which are raised by themselves, before what else stands above it."""
    if element.tag not in ("msup", "msubsup"):
        return element
    *below, above = element
    signs = list(above) if above.tag == "mrow" else [above]
    primes = [sign for sign in signs if sign.tag == "mo" and sign.text in PRIMES]
    if not primes or primes != signs[: len(primes)]:
        return element
    for prime in primes:
        prime.attrib.update(lspace="0", rspace="0")
    if len(below) == 2:
        made = ElementTree.Element("msub")
        made.extend(below)
        below = [made]
    base, rest = _row(*below, *primes), signs[len(primes) :]
    if not rest:
        return base
    raised = ElementTree.Element("msup")
    raised.extend([base, _row(*rest)])
    return raised


def _mended(element: ElementTree.Element) -> ElementTree.Element:
    """Return a formula with roots and primes as print has them."""
    element[:] = [_mended(part) for part in element]
    if element.tag == "msqrt":
        element.append(ElementTree.Element("mspace", STRUT))
    return _unraised(element)


def as_mathml(latex: str, displayed: bool) -> str:
    """Return a formula as MathML, which the search does not read. LatexError where it cannot be set."""
    made = LatexToMathML(fancy_error=False).convert_with_local_state(latex, displaystyle=displayed)
    formula = _mended(ElementTree.fromstring(NAMED.sub(lambda name: unescape(name[0]), made)))
    formula.attrib.update({"data-search-exclude": "", "aria-label": latex})
    marked = ElementTree.tostring(formula, encoding="unicode")
    if not displayed:
        return marked
    return f'<div class="formula" style="--width: {width(formula):.0f}">{marked}</div>'


def _text(html: str) -> str:
    """Return the text of a line of HTML."""
    return unescape(re.sub(r"<[^>]*>", "", html))


def unbroken(html: str) -> str:
    """Return code whose options, such as `--example`, are not divided at the end of a line."""
    return OPTION.sub(r'<span class="option">\g<0></span>', html)


def divisible(code: str) -> str:
    """Return code whose long words can be divided after underscores and other signs."""
    return LONG_WORD.sub(lambda word: BREAK.sub("<wbr>", word[0]), code)


def measured(lines: re.Match[str]) -> str:
    """Return a block of code with the number of characters of its longest line, by which it has its size.

    Commands and sentences that are longer than a line of the page are wrapped. Rows of tables are not.
    """
    content = lines[3]
    if lines[2] in ("console", "sh"):
        content = unbroken(ROW.sub(r'<span class="go row">\1</span>', content))
    if lines[2] == "text":
        content = SENTENCE.sub(r'<span class="sentence">\g<0></span>', content)
    rows, sentences = [1], [1]
    for line in content.removeprefix(">").splitlines():
        length = len(_text(line))
        long = lines[2] == "console" and length > WRAPPED and "go row" not in line
        if long or 'class="sentence"' in line:
            sentences.append(length if length <= WRAPPED else 1)
        else:
            rows.append(length)
    style = f"--characters: {max(rows + sentences)}; --rows: {max(rows)}"
    return f'{lines[1]} style="{style}"{content}'


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Set all formulas of a page, and the sizes and line breaks of its code."""

    def formula(match: re.Match[str]) -> str:
        marked = MARKS.search(unescape(match[2]))
        assert marked is not None, match[0]
        try:
            return as_mathml(marked[1].strip(), displayed=match[1] == "div")
        except LatexError as error:
            log.warning("%s: a formula cannot be set: %s: %s", page.file.src_uri, marked[1].strip(), error)
            return match[0]

    return CODE.sub(
        lambda code: unbroken(divisible(code[0])), LINES.sub(measured, FORMULA.sub(formula, html))
    )
