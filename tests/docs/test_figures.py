"""Every figure on every page is what its command prints, or says by what command it was measured."""

from pathlib import Path

import pytest
import regenerate

ROOT = Path(__file__).parents[2]
CHECKED_ELSEWHERE = {
    "comparator.md": "tests/comparator/test_comparator_cli.py",
    "extending.md": "tests/test_extending.py",
    "pictures.md": "tests/test_plots.py",
    "stellar-camera.md": "tests/stellar/test_plain.py",
    "tests.md": "tests/test_tests_page.py",
}
DEFINED = {
    "cameras.md": "| convention | centre of the first pixel",
    "command-line.md": "| code | meaning",
    "stellar-camera.md": "| card 3 | option",
}
"""Tables of figures that nothing computes."""


def made(page):
    """Return whether a page has blocks that are made by commands."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return any(mark.search(text) for mark in (regenerate.BLOCK, regenerate.PRINTED, regenerate.QUOTE))


@pytest.mark.parametrize("page", [page for page in regenerate.PAGES if made(page)])
def test_the_blocks_of_a_page_are_what_their_commands_print(page):
    if page in CHECKED_ELSEWHERE:
        assert f'"{page}"' in (ROOT / CHECKED_ELSEWHERE[page]).read_text(encoding="utf-8")
        return
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    assert regenerate.regenerated(text, regenerate.BLOCKS.get(page, {})) == text


@pytest.mark.parametrize("page", [page for page in regenerate.PAGES if page not in regenerate.WRITTEN])
def test_no_figures_stand_alone(page):
    alone = [
        block for block in regenerate.unmarked_figures(page) if not block.startswith(DEFINED.get(page, "-"))
    ]
    assert alone == []


@pytest.mark.parametrize("page", regenerate.PAGES)
def test_what_was_measured_names_a_program_that_knows_its_words(page):
    assert regenerate.strange_words(page) == []


def test_pages_that_a_program_writes_name_it():
    for page, program in regenerate.WRITTEN.items():
        assert (ROOT / program).is_file()
        assert f"`python {program} " in (ROOT / "docs" / page).read_text(encoding="utf-8")


def test_a_figure_that_is_not_what_its_command_prints_is_made_anew():
    page = "<!-- printed: echo first; echo sum 4 -->\n```text\n{}\n```\n<!-- end -->\n".format
    assert regenerate.regenerated(page("sum 3"), {}) == page("sum 4")
    assert regenerate.regenerated(page("first"), {}) == page("first")


def test_figures_are_seen_where_they_stand(tmp_path, monkeypatch):
    monkeypatch.setattr(regenerate, "DOCS", tmp_path)
    table = "| photos | s |\n|---|---|\n| 100 | 0.5 |\n"
    (tmp_path / "a.md").write_text(f"# A\n\n{table}")
    assert len(regenerate.unmarked_figures("a.md")) == 1
    (tmp_path / "a.md").write_text(f"# A\n\n<!-- measured: python benches/none.py -->\n{table}<!-- end -->\n")
    assert regenerate.unmarked_figures("a.md") == []
    assert regenerate.strange_words("a.md") == ["a.md: no program in 'python benches/none.py'"]


def test_the_picture_of_redundancy_is_what_its_command_draws():
    import redundancy_figure
    import walk

    drawn = redundancy_figure.svg(redundancy_figure.draw)
    assert walk.alike((ROOT / "docs" / "redundancy.svg").read_text(encoding="utf-8"), drawn)


def test_redundancy_numbers_of_rays_are_those_of_theory():
    import redundancy_figure

    shares = redundancy_figure.shares()
    # Of three images in a row the middle one has 2/3 along the base, the others 1/6: the median is theirs.
    assert shares[2][0] < 0.01
    assert 0.1 < shares[3][0] < 0.25
    assert shares[2][1] < shares[3][1] < shares[4][1] < shares[5][1]


def test_the_pictures_of_results_are_what_their_command_draws():
    import pictures_figures
    import walk

    for name, drawn in pictures_figures.pictures().items():
        shown = (ROOT / "docs" / "pictures" / f"{name}.svg").read_text(encoding="utf-8")
        assert walk.alike(shown, drawn), f"{name}: run python docs/pictures_figures.py"


SENTENCES = {
    "absolute-orientation.md": 1,
    "blunders.md": 1,
    "giant-check.md": 4,
    "tutorials/aerial-block.md": 4,
    "tutorials/archive.md": 2,
    "tutorials/calibration.md": 4,
    "tutorials/drone.md": 3,
    "tutorials/metrology.md": 5,
    "tutorials/rolling-shutter.md": 6,
    "tutorials/stars.md": 2,
    "tutorials/statement.md": 3,
    "tutorials/vision.md": 3,
}
"""At the least so many figures of the sentences of a page say from which of its blocks they come."""


@pytest.mark.parametrize("page", regenerate.PAGES)
def test_figures_in_sentences_follow_from_the_blocks_of_their_page(page):
    count, wrong = regenerate.figures_in_sentences(page)
    assert wrong == []
    assert count >= SENTENCES.get(page, 0)


def test_a_sentence_that_does_not_follow_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(regenerate, "DOCS", tmp_path)
    page = "<!-- printed: echo 1.946 200 -->\n```text\n1.946 200\n```\n<!-- end -->\nIt is {}\n"
    for sentence, right in (
        ("1.9<!-- 1.946 --> m", True),
        ("1.8<!-- 1.946 --> m", False),
        ("2.0<!-- 1.957 --> m", False),
        ("5.8<!-- 3 * 1.946 -->", True),
        ("9,000<!-- 200 * 46 -->", True),
        ("200<!-- 200 -->", True),
    ):
        (tmp_path / "a.md").write_text(page.format(sentence))
        count, wrong = regenerate.figures_in_sentences("a.md")
        assert count == 1
        assert (wrong == []) is right, wrong
