"""Every row of the specification has a test, and the page that says which is current."""

import re

import giant_coverage


def test_no_row_lacks_a_test():
    assert giant_coverage.untested() == []


def test_every_mark_is_a_row():
    assert giant_coverage.unlisted() == []


def test_tests_are_named_after_their_sections():
    by_test = {}
    for mark in giant_coverage.marks():
        by_test.setdefault((mark.file, mark.test), []).append(mark.section)
    for (file, test), sections in by_test.items():
        prefixes = tuple(f"test_section_{section.replace('.', '_')}_" for section in sections)
        assert test.startswith(prefixes), f"{file}::{test} shows section {' and '.join(sections)}"


def test_what_is_named_after_a_section_shows_a_row_of_it():
    shown = {(mark.file, mark.test) for mark in giant_coverage.marks()}
    named = {
        (path.relative_to(giant_coverage.TESTS).as_posix(), test)
        for path in giant_coverage.TESTS.rglob("test_*.py")
        for test in re.findall(r"^def (test_section_\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert named == shown


def test_the_page_is_current():
    assert giant_coverage.PAGE.read_text(encoding="utf-8") == giant_coverage.page(), (
        "run python tests/giant_coverage.py"
    )


def test_marks_are_found_at_functions_and_at_parameters(tmp_path, monkeypatch):
    (tmp_path / "test_x.py").write_text(
        '@pytest.mark.giant("1", "a")\n'
        '@pytest.mark.parametrize("x", [pytest.param(1, marks=pytest.mark.giant("2", "b"))])\n'
        "def test_section_1_x(x): ...\n"
        "def test_unmarked(): ...\n"
    )
    (tmp_path / "rows.json").write_text('{"1": ["a", "c|d"], "2.1": ["**e"]}')
    monkeypatch.setattr(giant_coverage, "TESTS", tmp_path)
    monkeypatch.setattr(giant_coverage, "ROWS", tmp_path / "rows.json")
    assert [(mark.section, mark.feature) for mark in giant_coverage.marks()] == [("1", "a"), ("2", "b")]
    assert giant_coverage.untested() == [("1", "c|d"), ("2.1", "**e")]
    assert [mark.section for mark in giant_coverage.unlisted()] == ["2"]
    assert giant_coverage.page().splitlines()[-4:] == [
        "| 1 | a | `test_x.py::`<wbr>`test_section_1_x` |",
        "| 1 | c\\|d |  |",
        "| 2 | b | `test_x.py::`<wbr>`test_section_1_x` |",
        "| 2.1 | \\*\\*e |  |",
    ]
