"""The tutorials do what they say, word by word, and their pictures are those that their commands draw."""

from pathlib import Path

import pytest
import walk

ROOT = Path(__file__).parents[2]
COMMANDS = {
    "gallery.md": 10,
    "index.md": 1,
    "tutorials/aerial-block.md": 6,
    "tutorials/archive.md": 18,
    "tutorials/calibration.md": 8,
    "tutorials/drone.md": 7,
    "tutorials/metrology.md": 5,
    "tutorials/planetary.md": 11,
    "tutorials/rolling-shutter.md": 14,
    "tutorials/stars.md": 13,
    "tutorials/statement.md": 8,
    "tutorials/vision.md": 6,
}
"""Of each page; a page of which nothing is found would pass unseen."""


def test_all_tutorials_are_walked():
    assert set(walk.PAGES) == {"first-ten-minutes.md", *COMMANDS}


@pytest.mark.parametrize("page", COMMANDS)
def test_every_step_of_the_page(page, tmp_path):
    done = walk.walked(page, tmp_path)
    wrong = [f"{step.command}\n{step.told}{step.remarks}" for step in done if not step.agrees]
    assert not wrong, "\n".join(wrong)
    assert len(done) == COMMANDS[page]
    for made, place in walk.pictures(page).items():
        assert place.stat().st_size < 300_000
        drawn = walk.rounded((tmp_path / made).read_text(encoding="utf-8"))
        assert walk.alike(place.read_text(encoding="utf-8"), drawn), f"{made}: run python docs/walk.py {page}"


@pytest.mark.parametrize("page", walk.TUTORIALS)
def test_a_tutorial_has_pictures_and_ends_in_a_decision(page):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    assert len(walk.pictures(page)) >= 2
    [*_, last] = text.split("\n## ")
    assert last.startswith("Can I use it?")
    assert "\n$ " in last


def test_lines_that_are_left_out_and_lines_that_have_changed():
    step = walk.Step("run", ["first", "...", "sum 3"], told="first\nsecond\nsum 3\n")
    assert step.agrees
    step.told = "first\nsecond\nsum 4\n"
    assert not step.agrees
    assert step.refreshed() == ["first", "...", "sum 4"]


def test_drawings_are_alike_where_they_have_the_same_marks():
    assert walk.alike('<path d="M 1 2"/><text>a</text>', '<text>b</text><path d="M 3 4"/>')
    assert not walk.alike('<path d="M 1 2"/>', '<path d="M 1 2"/><path d="M 1 2"/>')


def test_the_first_page_leads_to_every_other():
    hubs = ("index.md", "formats.md", "reference.md")
    first = "".join((ROOT / "docs" / page).read_text(encoding="utf-8") for page in hubs)
    pages = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert {page for page in pages if f"({page}" not in first} == {"index.md"}
