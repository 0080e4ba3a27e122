"""Formulas of the pages: all can be set, and what cannot be set ends a strict build."""

from __future__ import annotations

import logging
import re
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import formulas
import pytest

DOCS = Path(__file__).parents[2] / "docs"

PAGES = [path.relative_to(DOCS).as_posix() for path in sorted(DOCS.rglob("*.md"))]
CODE = re.compile(r"<!--.*?-->|^ *```(?!math)[^\n]*\n.*?^ *```|`[^`\n]+`", re.DOTALL | re.MULTILINE)
DISPLAYED = re.compile(r"^ *```math\n(.*?)^ *```$", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"(?<![\\$])\$(?! )([^$\n]+?)(?<! )\$(?!\d)")
PAGE = SimpleNamespace(file=SimpleNamespace(src_uri="page.md"))


def written(page: str) -> list[tuple[str, bool]]:
    """Return the formulas of a page, and whether each stands by itself."""
    text = (DOCS / page).read_text(encoding="utf-8")
    inline = INLINE.findall(CODE.sub("", DISPLAYED.sub("", text)))
    return [(latex, True) for latex in DISPLAYED.findall(text)] + [(latex, False) for latex in inline]


@pytest.mark.parametrize("page", PAGES)
def test_all_formulas_of_a_page_can_be_set(page):
    for latex, displayed in written(page):
        ElementTree.fromstring(formulas.as_mathml(latex.strip(), displayed))


def test_the_concepts_have_formulas():
    counts = {page: len(written(page)) for page in PAGES}
    wanted = ("adjustment", "blunders", "cameras", "conventions", "datum", "refraction", "tests", "weights")
    assert all(counts[f"{name}.md"] > 8 for name in wanted), counts


@pytest.mark.parametrize("page", PAGES)
def test_no_formula_stands_as_code(page):
    text = re.sub(r"```.*?```", "", (DOCS / page).read_text(encoding="utf-8"), flags=re.DOTALL)
    formulas_as_code = [
        code
        for code in re.findall(r"`([^`\n]+)`", text)
        if re.search(r"\^-?\d|\bsqrt\(|\w'(?: |\))|~[a-z]\b", code) and "import" not in code
    ]
    assert formulas_as_code == []


@pytest.mark.parametrize("page", [page for page in PAGES if page != "giant-coverage.md"])
def test_no_formula_stands_in_plain_letters(page):
    text = CODE.sub("", DISPLAYED.sub("", (DOCS / page).read_text(encoding="utf-8")))
    text = INLINE.sub("", re.sub(r"^```.*?^```|\]\([^)]*\)", "", text, flags=re.DOTALL | re.MULTILINE))
    plain = r"\b[A-Za-z]{1,2}_[A-Za-z0-9]{1,2}\b|\b(?:Omega|sigma|theta)_\w+|\b(?:exp|ln|sqrt)\(|\^-?\d|[⁻ᵀ]"
    assert re.findall(rf".{{0,30}}(?:{plain}).{{0,20}}", text) == []


def test_roots_and_primes_are_as_print_has_them():
    assert formulas.as_mathml(r"\sqrt{r}", False).count("<mspace") == 1
    assert "<msup><mi>" not in formulas.as_mathml("x'", False)
    row = '<mrow><mi>x</mi><mo lspace="0" rspace="0">′</mo></mrow>'
    assert f"<msup>{row}<mn>4</mn></msup>" in formulas.as_mathml("x'^4", False)
    below = '<msub><mi>x</mi><mi>i</mi></msub><mo lspace="0" rspace="0">″</mo>'
    assert below in formulas.as_mathml("x_i''", False)


def test_a_formula_becomes_mathml_and_a_sign_of_dollars_does_not():
    html = '<p><span class="arithmatex">\\(w = v / \\sqrt{r} &lt; 3\\)</span></p>'
    made = formulas.on_page_content(html, PAGE)
    assert "<msqrt><mi>r</mi><mspace" in made
    assert "data-search-exclude" in made
    assert 'aria-label="w = v / \\sqrt{r} &lt; 3"' in made
    assert formulas.on_page_content("<p>5 $ and 6 $</p>", PAGE) == "<p>5 $ and 6 $</p>"


def test_a_formula_that_cannot_be_set_is_a_warning_of_the_build(caplog):
    html = '<div class="arithmatex">\\[\\frac{a}{\\]</div>'
    with caplog.at_level(logging.WARNING, "mkdocs"):
        formulas.on_page_content(html, PAGE)
    [record] = caplog.records
    assert record.name.startswith("mkdocs.")
    assert "page.md: a formula cannot be set" in record.message


def test_widths_are_those_of_the_widest_line():
    narrow, wide = (
        formulas.width(
            ElementTree.fromstring(re.sub(r"<div[^>]*>|</div>", "", formulas.as_mathml(each, True)))
        )
        for each in ("a = b", r"\begin{aligned} a &= b \\ c &= d + e + f + g + h \end{aligned}")
    )
    assert 1.5 < narrow < 3.5
    assert 8.0 < wide < 14.0


def test_long_lines_of_figures_are_measured():
    html = '<div class="language-text highlight"><pre><code>ab\n<a>cdef</a>\n</code></pre></div>'
    made = formulas.on_page_content(html, PAGE)
    assert 'class="language-text highlight" style="--characters: 4; --rows: 4"' in made


def test_sentences_are_wrapped_and_rows_of_tables_are_not():
    def block(language, line):
        html = f'<div class="language-{language} highlight"><pre><code>{line}\n</code></pre></div>'
        return formulas.on_page_content(html, PAGE)

    sentence, row = "a sentence " * 12, "name   1.234   " * 8
    assert '<span class="sentence">' in block("text", sentence)
    assert "--characters: 1;" in block("text", sentence)
    assert '<span class="sentence">' not in block("text", row)
    assert f"--characters: {len(row)};" in block("text", row)
    assert '<span class="go row">' in block("console", f'<span class="go">{row}</span>')
    assert '<span class="go">' in block("console", f'<span class="go">{sentence}</span>')


def test_options_are_not_divided_and_long_words_are():
    made = formulas.on_page_content("<code>adjust --plots a_long_name_of_a_table.csv</code>", PAGE)
    assert '<span class="option">--plots</span>' in made
    assert "a_<wbr>long_<wbr>name_<wbr>of_<wbr>a_<wbr>table<wbr>.csv" in made
