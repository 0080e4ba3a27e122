"""Reports for the browser: opened in one, read without a script, on paper, and with what a block may lack."""

import re
import sys
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import browser as browsers
import photogram
from photogram import InnerConstraints, adjust, simulate, snoop
from photogram.show.html import page_html
from photogram.show.page import Document, Section
from photogram.show.quantity import Axis, Quantity, Table
from photogram.words import words_of

EXAMPLES = str(Path(photogram.__file__).parent / "examples")
NETWORK = ["Verdict", "Plan of the network", "Size and fit", "Image residuals", "Redundancy", "Tests"]
NETWORK += ["Worst observations", "Photos", "Points", "Iterations", "Reproducibility"]
COMMANDS = {
    "adjust --example": (
        "example-adjusted",
        [*NETWORK, "Control points", "Check points", "Other observations", "Cameras"],
    ),
    "adjust --example --self-calibrate f,k1 --snoop": (
        "example-adjusted",
        ["Verdict", "What was taken out", "Cameras", "Reproducibility"],
    ),
    "giant --example": ("galveston-adjusted", [*NETWORK, "Control points", "Observed photos", "Remarks"]),
    "giant --example --components kind --snoop --out out": ("out", ["Weights", "What was taken out"]),
    "giant --example --components kind": (
        "galveston-adjusted",
        ["Variance components", "Plan of the network"],
    ),
    "collection --example --out out": ("out", [*NETWORK, "Cameras"]),
    "plan --out out": (
        "out",
        ["Plan of the network", "Side by side", "Size", "New points", "Photos", "Control"],
    ),
    "check --example": ("example-checked", ["Verdict", "Plan of the network", "Reproducibility"]),
    "giant check --example": ("galveston-checked", ["Verdict", "Findings", "Key numbers"]),
    "absolute-orientation --example --out out": (
        "out",
        ["Residuals in plan", "Parameters", "Control", "Tests", "Transformed points", "Iterations"],
    ),
    "comparator --example": (
        "comparator-calibrated",
        ["Where the errors come from", "Pictures", "Linear parameters", "Polynomials", "Cases", "Tests"],
    ),
    "stellar-camera --example": (
        "plate-calibrated",
        ["Stars and residuals", "Size and fit", "Parameters", "Worst observations", "Distortion"],
    ),
    "stellar-camera exposures --example": (
        "night-calibrated",
        ["Stars and residuals", "Camera", "Exposures", "Lens", "Worst observations", "Tests"],
    ),
    "perspective-center --example --out out": (
        "out",
        ["Residuals and distortion", "Perspective centre and attitude", "Points", "Iterations"],
    ),
}
"""Commands, where their report goes, and sections that it has."""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a function that runs a command once, and gives the place of its report."""
    from typer.testing import CliRunner

    from photogram.cli import app

    done = {}

    def make(command):
        if command not in done:
            place = tmp_path_factory.mktemp("report")
            with pytest.MonkeyPatch.context() as patch:
                patch.chdir(place)
                result = CliRunner().invoke(app, command.replace("EXAMPLES", EXAMPLES).split())
            assert result.exit_code in (0, 4), result.output
            done[command] = place / COMMANDS[command][0] / "report.html", result.output
        return done[command]

    return make


@pytest.mark.parametrize("command", COMMANDS)
def test_a_browser_opens_the_report_without_complaint_and_finds_its_sections(made, browser, command):
    path, _ = made(command)
    with browser.opened(path) as page:
        titles = page.locator("main h2").all_inner_texts()
        listed = page.locator("nav a").all_inner_texts()
        links = page.locator("nav a").evaluate_all("all => all.map(one => one.hash.slice(1))")
        assert all(page.locator(f"#{link}").count() == 1 for link in links)
        every = page.evaluate("[...document.querySelectorAll('[id]')].map(one => one.id)")
        dead = page.evaluate(
            "[...document.querySelectorAll('main a[href^=\"#\"]')]"
            ".filter(one => !document.getElementById(one.hash.slice(1))).length"
        )
    assert set(COMMANDS[command][1]) <= set(listed)
    assert set(listed) - {"Verdict"} <= set(titles)
    assert len(set(every)) == len(every)
    assert dead == 0


@pytest.mark.parametrize("command", COMMANDS)
def test_there_are_sentences_and_tables_and_no_text_of_a_printer(made, command):
    text = made(command)[0].read_text()
    assert "<pre" not in text
    shown = re.sub(r"<(script|style).*?</\1>", "", text, flags=re.DOTALL)
    words = re.findall(r">([^<>]+)<", shown)
    title = re.search(r"<h1>([^<]*)", text)[1].partition(" – ")[0]  # it is the user's
    loud = [each for each in words if re.search(r"\b[A-Z]{4,} [A-Z]{3,}\b", each) and title not in each]
    assert loud == []


@pytest.mark.parametrize("width", browsers.WIDTHS)
@pytest.mark.parametrize("command", COMMANDS)
def test_nothing_is_wider_than_the_screen(made, browser, command, width):
    path, _ = made(command)
    with browser.opened(path, width) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("command", COMMANDS)
def test_nothing_is_wider_than_paper_and_all_layers_are_on_it(made, browser, command):
    path, _ = made(command)
    with browser.opened(path, browsers.NARROW_PAPER) as page:
        page.emulate_media(media="print")
        wide = page.evaluate(
            "[...document.querySelectorAll('main table, main figure, main dl')]"
            ".filter(one => one.getBoundingClientRect().right > innerWidth + 1)"
            ".map(one => one.textContent.slice(0, 60))"
        )
        assert wide == []
        assert page.locator(".layer").evaluate_all("all => all.every(one => one.offsetHeight > 0)")
        assert not page.locator("nav").is_visible()


def test_the_report_is_read_without_a_script(made, browser):
    path, _ = made("giant --example")
    with browser.opened(path, script=False) as page:
        assert page.locator(".switch").count() == 0
        assert page.locator(".layer").count() > 2
        assert all(each.is_visible() for each in page.locator(".layer").all())


def test_tables_are_sorted_by_their_heads_and_back(made, browser):
    path, _ = made("adjust --example")
    with browser.opened(path) as page:
        table = page.locator("#points table").first
        head = table.locator("th", has_text="sd Z")
        column = head.evaluate("one => one.cellIndex")

        def values():
            cells = table.locator(f"tbody td:nth-child({column + 1})").all_inner_texts()
            return [float(each) for each in cells]

        before = values()
        assert before != sorted(before)
        head.locator("button").click()
        assert head.get_attribute("aria-sort") == "descending"
        assert values() == sorted(before, reverse=True)
        head.locator("button").click()
        assert values() == sorted(before)
        name = table.locator("th").first
        name.locator("button").click()
        assert name.get_attribute("aria-sort") == "ascending"
        assert head.get_attribute("aria-sort") is None


@pytest.mark.parametrize("language", ["en", "de"])
def test_angles_bounds_and_decimal_commas_are_sorted_as_numbers(browser, tmp_path, language):
    angles = np.radians([[-1.5], [2.25], [0.001], [-0.5], [np.nan]])
    columns = [
        Quantity(angles, (Axis.turned("phi", "dms"),), "value", head="Angle", decimals=2),
        Quantity(np.array([0.5, 1e-120, 1e-7, 0.04, 1.0]), kind="probability", head="p"),
    ]
    table = Section.of(Table("t", "Table", columns))
    (tmp_path / "a.html").write_bytes(
        page_html(Document("A", "B", sections=[table], words=words_of(language)))
    )
    with browser.opened(tmp_path / "a.html") as page:
        for column, expected in (("Angle", [1, 2, 3, 0, 4]), ("p", [4, 0, 3, 2, 1])):
            cells = page.locator(f"tbody td:nth-child({1 + (column == 'p')})")
            before = cells.all_inner_texts()
            page.locator("th", has_text=column).locator("button").click()
            assert cells.all_inner_texts() == [before[row] for row in expected]
            page.reload()


def test_one_layer_is_shown_at_a_time(made, browser):
    path, _ = made("giant --example")
    with browser.opened(path) as page:
        group = page.locator("#photos-layers")
        tabs, layers = group.locator("[role=tab]"), group.locator(".layer")
        assert tabs.all_inner_texts() == ["Positions", "Attitudes", "Fit of images"]
        for chosen in (0, 2, 1):
            tabs.nth(chosen).click()
            assert [each.is_visible() for each in layers.all()] == [k == chosen for k in range(3)]
            assert tabs.nth(chosen).get_attribute("aria-selected") == "true"


def test_a_link_leads_to_its_row_also_in_a_layer_that_was_not_shown(made, browser):
    path, _ = made("giant --example")
    with browser.opened(path) as page:
        page.locator("#photos-layers [role=tab]").nth(1).click()
        link = page.locator("#worst a[href^='#photo-']").first
        target = link.get_attribute("href").removeprefix("#")
        link.click()
        # The layer is shown when the browser tells of the new address, which is after the click.
        page.locator(f"[id='{target}']").wait_for(state="visible")


class Tables(HTMLParser):
    """The tables of a page: a list of rows of texts for each caption."""

    def __init__(self, text):
        super().__init__()
        self.tables, self._cell = [], None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        """Begin a table, a row or a cell."""
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th", "caption"):
            self._cell = ""

    def handle_endtag(self, tag):
        """Keep what a cell has."""
        if tag in ("td", "th"):
            self.tables[-1][-1].append(self._cell.strip())
        elif tag == "caption":
            self.tables[-1].append([self._cell.strip()])
        if tag in ("td", "th", "caption"):
            self._cell = None

    def handle_data(self, data):
        """Take the text of a cell."""
        if self._cell is not None:
            self._cell += data

    def of(self, caption):
        """Return head and rows of the first table whose caption begins so."""
        [head, *rows] = next(rows for [first], *rows in self.tables if first.startswith(caption))
        return head, rows


def section(text, name):
    """Return the markup of a section."""
    [found] = re.findall(rf'<section id="{name}">.*?</section>', text, re.DOTALL)
    return found


def test_figures_of_the_page_are_those_of_the_result():
    result = adjust(simulate(strips=2, photos_per_strip=3, points_per_photo=20, check_points=6, seed=4).block)
    text = result.to_html().decode()
    head, rows = Tables(section(text, "check-points")).of("Check points one by one")
    table = result.check_table().set_index("point")
    assert len(rows) == 3 * len(table)
    difference, sd = head.index("Adjusted - given m"), head.index("sd adjusted m")
    for row in rows:
        assert float(row[difference]) == pytest.approx(
            table.loc[row[0], f"d_{row[1]}"], abs=0.06 * float(row[sd])
        )
        assert float(row[sd]) == pytest.approx(table.loc[row[0], f"sd_{row[1]}"], rel=6e-3)
    _, rows = Tables(section(text, "iterations")).of("Iterations")
    assert [int(row[0]) for row in rows] == list(range(1, len(result.iterations) + 1))
    last = result.iterations[-1].weighted_sum_of_squares
    assert float(rows[-1][1]) == pytest.approx(last, rel=1e-6)
    head, rows = Tables(section(text, "worst")).of("Worst observations")
    value = head.index("Test value w")
    largest = np.nanmax(np.abs(np.where(result.redundancy > 0.01, result.standardized, np.nan)))
    assert max(abs(float(row[value])) for row in rows) == pytest.approx(largest, abs=6e-3)
    assert result.verdict.headline.split(" (")[0] in text


def test_text_of_the_user_is_text():
    block = simulate(strips=1, photos_per_strip=3, points_per_photo=20, seed=4).block
    names = [f"<b>{name}</b>&" for name in block.photo_ids]
    text = adjust(block.replace(title="<script>alert(1)</script>", photo_ids=names)).to_html().decode()
    assert text.count("<script>") == 1
    assert "&lt;script&gt;alert(1)" in text
    assert "<b>0101</b>" not in text
    assert "&lt;b&gt;0101&lt;/b&gt;&amp;" in text


SMALL = {"strips": 2, "photos_per_strip": 3, "points_per_photo": 20}
UNUSUAL = {
    "no covariances": lambda: adjust(simulate(**SMALL, seed=1).block, covariance=False),
    "a robust loss": lambda: adjust(simulate(**SMALL, seed=1, blunders=3).block, loss="huber"),
    "a free network": lambda: adjust(
        simulate(**SMALL, seed=1, control="none").block, datum=InnerConstraints()
    ),
    "gross errors": lambda: adjust(simulate(**SMALL, seed=1, blunders=8, blunder_size=2.0).block),
    "snooped": lambda: snoop(simulate(**SMALL, seed=1, blunders=3).block),
    "unit variance one": lambda: adjust(simulate(**SMALL, seed=1).block, unit_variance="unity"),
    "fixed photos": lambda: adjust(simulate(**SMALL, seed=1).block.with_fixed_photos()),
}


@pytest.mark.parametrize("name", UNUSUAL)
def test_unusual_results_have_a_page(name, browser, tmp_path):
    (tmp_path / "report.html").write_bytes(UNUSUAL[name]().to_html())
    with browser.opened(tmp_path / "report.html") as page:
        assert page.locator("section").count() > 5
        assert "nan" not in page.locator("main").inner_text().lower().split()


def test_large_blocks_have_the_worst_only_and_say_so():
    block = simulate(strips=6, photos_per_strip=40, points_per_photo=12, image_sd=0.01, seed=2).block
    result = adjust(block)
    text = result.to_html().decode()
    _, rows = Tables(section(text, "photos")).of("Positions")
    assert 50 < len(rows) < 200
    assert re.search(rf"{len(rows)} of {len(block.photo_ids)}: those that other tables name", text)
    named = {row[1] for row in Tables(section(text, "worst")).of("Worst observations")[1]} - {""}
    assert named <= {row[0] for row in rows}
    assert len(text) < 3_000_000


def options(text):
    """Return the options of a run and their values, in the last section of its page."""
    return re.findall("<dt>(--[^<]*)</dt><dd>([^<]*)</dd>", text)


def test_the_last_section_says_how_the_page_came_about(made):
    path, output = made("giant --example")
    text = section(path.read_text(), "reproducibility")
    _, files = Tables(text).of("Input files")
    assert {row[0].rpartition("/")[2] for row in files} == {"COMMON", "CAMERAS", "IMAGES", "FRAMES", "GROUND"}
    assert all(re.fullmatch("[0-9a-f]{64}", row[2]) for row in files)
    assert "photogram giant" in text
    assert options(text) == [("--example", "True")]
    assert output.splitlines()[-1].endswith("galveston-adjusted/report.html")


def test_the_report_goes_where_it_is_asked_for_or_nowhere(run, tmp_path):
    assert run("collection", "--example", "--html", "a.html").exit_code == 0
    assert run("giant", "--example", "--html", "b.html", "--out", "o").exit_code == 0
    assert run("giant", "--example", "--no-html", "--out", "p").exit_code == 0
    refused = run("giant", "--example", "--no-html", "--html", "c.html")
    assert refused.exit_code == 2
    assert {each.name for each in tmp_path.iterdir()} == {"a.html", "b.html", "o", "p"}
    assert not (tmp_path / "o" / "report.html").exists()
    assert not (tmp_path / "p" / "report.html").exists()


def test_without_the_extra_there_is_a_remark_and_an_error_only_where_it_was_asked_for(
    run, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "contourpy", None)
    done = run("comparator", "--example")
    assert done.exit_code == 0
    assert "report.html is not written; run pip install 'photogram[report]'" in done.stderr
    assert "report.html" not in done.stdout
    asked = run("comparator", "--example", "--html", "report.html", "--out", "o")
    assert asked.exit_code == 1
    assert "contourpy is required; run pip install 'photogram[report]'" in asked.stderr
    assert not (tmp_path / "o").exists()


def test_the_run_of_a_job_lists_options_that_are_not_their_defaults(made):
    text = section(made("adjust --example --self-calibrate f,k1 --snoop")[0].read_text(), "reproducibility")
    assert options(text) == [("--example", "True"), ("--self-calibrate", "f,k1"), ("--snoop", "True")]


def test_on_a_phone_the_verdict_stands_before_the_links_and_pictures_keep_their_size():
    style = files("photogram.show").joinpath("templates/style.css").read_text()
    narrow = re.search(r"@media \(max-width: 66rem\) \{\n(.*?)\n\}", style, re.DOTALL)[1]
    order = dict(re.findall(r"(header, #verdict|main > \*|nav) \{ order: (\d)", narrow))
    assert order["header, #verdict"] < order["nav"] < order["main > *"]
    assert re.search(
        r"max-width: 44rem\) \{ figure \{ overflow-x: auto; \} figure svg, .*width: 44rem", style
    )
