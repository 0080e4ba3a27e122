"""A browser without a window; tests are skipped, visibly, where there is none."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urljoin

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
WIDTHS = (1440, 390)
"""Pixels of a screen on a desk, and of one in a hand."""
NARROW_PAPER = 688
"""Pixels between the margins of A4: 182 mm."""


def executable():
    """Return the browser of the system, None where it has none."""
    return next((found for name in BROWSERS if (found := shutil.which(name))), None)


class Browser:
    """Opens reports and pages, and collects what the browser complains about."""

    def __init__(self, chromium):
        self.chromium = chromium

    @contextmanager
    def opened(self, place: Path | str, width: int = WIDTHS[0], *, script: bool = True) -> Iterator:
        """Open a file, or a page of a server; there must be no complaint, and nothing asked of elsewhere."""
        served = isinstance(place, str)
        address = place if served else place.resolve().as_uri()
        own = ("data:", urljoin(address, "/") if served else "file:")
        context = self.chromium.new_context(
            viewport={"width": width, "height": 1000}, java_script_enabled=script, offline=not served
        )
        page = context.new_page()
        complaints, elsewhere = [], []
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))

        def answer(route):
            if route.request.url.startswith(own):
                route.continue_()
            else:
                elsewhere.append(route.request.url)
                route.abort()

        page.route("**/*", answer)
        page.goto(address)
        try:
            yield page
        finally:
            context.close()
        assert not elsewhere
        assert not complaints


@contextmanager
def running() -> Iterator[Browser]:
    """Start the browser, or skip."""
    sync = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    program = executable()
    if program is None:
        pytest.skip("there is no Chromium")
    with sync.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        try:
            yield Browser(chromium)
        finally:
            chromium.close()
