"""The pages as a reader has them: built strictly, served on this machine, opened in a browser."""

import functools
import os
import re
import subprocess
import sys
import threading
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from test_formulas import PAGES, written

import browser as browsers

ROOT = Path(__file__).parents[2]
BUILDERS = ("material", "math_core", "mkdocs", "mkdocstrings")
HIDDEN = """
    [...document.querySelectorAll('article *')]
      .filter(one => ['hidden', 'clip'].includes(getComputedStyle(one).overflowX)
                     && one.clientWidth > 1 && one.scrollWidth > one.clientWidth + 1)
      .map(one => one.textContent.slice(0, 60))
"""
"""What is cut off at the right, and cannot be scrolled to."""
OUTSIDE = """
    [...document.querySelectorAll('article :is(p, li, pre, table, img, svg, math, h1, h2, h3)')]
      .filter(one => {
        for (let each = one.parentElement; each; each = each.parentElement)
          if (['auto', 'scroll'].includes(getComputedStyle(each).overflowX)) return false;
        return one.getBoundingClientRect().right > innerWidth + 1;
      })
      .map(one => one.textContent.slice(0, 60))
"""
"""What goes beyond the right edge."""


SCROLLED = """
    [...document.querySelectorAll('article pre > code')]
      .filter(one => one.scrollWidth > one.clientWidth + 1)
      .map(one => one.textContent.slice(0, 60))
"""
"""Code whose lines are cut off until one scrolls."""
HEADLESS = """
    [...document.querySelectorAll('article table thead tr')]
      .filter(row => row.textContent.trim())
      .filter(row => [...row.cells].slice(1).some(cell => !cell.textContent.trim()))
      .map(row => row.textContent)
"""
"""Columns without a heading, but for the first, in tables that have headings."""


class Quiet(SimpleHTTPRequestHandler):
    """Serves files, and does not tell."""

    def log_message(self, *_):
        """Say nothing."""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the pages as `./dev docs` does: a warning is an error."""
    missing = [name for name in BUILDERS if find_spec(name) is None]
    if missing or os.name == "nt":
        pytest.skip(f"what builds the pages is not there: {', '.join(missing) or 'bash'}")
    place = tmp_path_factory.mktemp("site")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    built = subprocess.run(
        ["./dev", "docs", str(place)],
        cwd=ROOT,
        env={**os.environ, "PATH": path, "PYTHONPATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stderr
    return place


@pytest.fixture(scope="module")
def address(site):
    """Serve the pages on this machine: the search reads its index, which no browser allows from a disk."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(site)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    thread.join()
    server.server_close()


def shown(page: str) -> str:
    """Return the address of a page below that of the site."""
    return "" if page == "index.md" else f"{page.removesuffix('.md')}/"


class Names(HTMLParser):
    """What links can lead to in a page, and where its own links lead."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.links = set(), []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        """Take names and links."""
        named = dict(attributes)
        self.ids |= {named[each] for each in ("id", "name") if named.get(each)}
        self.links += [named[each] for each in ("href", "src") if named.get(each)]


def test_all_links_lead_somewhere(site):
    pages = {path: Names(path.read_text(encoding="utf-8")) for path in site.rglob("index.html")}
    dead, count = [], 0
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                assert parts.scheme in ("https", "data", "mailto"), link
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            name = unquote(parts.fragment)
            count += 1
            if not target.is_file() or (name and name not in pages[target].ids):
                dead.append(f"{path.relative_to(site)}: {link}")
    assert dead == []
    assert len(pages) == len(PAGES)
    assert count > 50 * len(pages)


@pytest.mark.parametrize("page", PAGES)
def test_a_page_is_whole(page, address, site, browser):
    with browser.opened(address + shown(page)) as opened:
        assert opened.locator("article h1").count() >= 1
        broken = opened.locator("img").evaluate_all(
            "all => all.filter(one => !one.complete || !one.naturalWidth).map(one => one.src)"
        )
        assert broken == []
        formulas = opened.locator("math").evaluate_all(
            "all => all.map(one => one.getBoundingClientRect().width)"
        )
        assert len(formulas) == len(written(page))
        assert all(width > 2 for width in formulas)
        if formulas:
            assert opened.evaluate("document.fonts.check('1em \"photogram math\"')")
        text = opened.locator("article").inner_text()
        assert re.findall(r"\\\(|\$\w+\$|:(?:func|meth|class|mod|attr|exc):", text) == []
        assert opened.evaluate(SCROLLED) == []
        assert opened.evaluate(HEADLESS) == []
        for width in browsers.WIDTHS:
            opened.set_viewport_size({"width": width, "height": 1000})
            assert opened.evaluate("document.documentElement.scrollWidth") <= width
            assert opened.evaluate(OUTSIDE) == []
            assert opened.evaluate(HIDDEN) == []


def test_the_search_finds_a_word(address, browser):
    with browser.opened(address) as opened:
        opened.locator("input.md-search__input").click()
        opened.keyboard.type("boresight", delay=10)
        found = opened.locator(".md-search-result__link")
        found.first.wait_for()
        assert "matching document" in opened.locator(".md-search-result__meta").inner_text()
        named = [urlsplit(each).path for each in found.evaluate_all("all => all.map(one => one.href)")]
        assert "/observations/" in named
        found.nth(named.index("/observations/")).click()
        opened.wait_for_url(re.compile("/observations/"))
        assert "boresight" in opened.locator("article").inner_text()


def test_the_figures_of_a_page_are_copied_and_its_parts_are_listed(address, browser):
    with browser.opened(address + shown("first-ten-minutes.md")) as opened:
        parts = opened.locator(".md-sidebar--secondary a.md-nav__link").all_inner_texts()
        headings = opened.locator("article h2").all_inner_texts()
        assert [each.strip() for each in parts] == [each.rstrip("¶").strip() for each in headings]
        assert opened.locator("button[data-md-type=copy], .md-code__button").count() > 0


def test_pages_are_read_without_a_script(address, browser):
    with browser.opened(address + shown("datum.md"), script=False) as opened:
        assert opened.locator("article").inner_text().count("covariance") > 5
        assert opened.locator("math").count() == len(written("datum.md"))
