"""Every row of the specification has a test, and the page that says which is current."""

import giant_coverage

TO_COME = (
    # Sections and rows whose tests are not here yet.
    "3",
    "8",
    "10",
    "11",
    "12",
    "13",
    ("6", "points on more than N4 photographs keep the first N4 images"),
    ("9", "summary: count and rms of standard deviations, unheld components only"),
    ("14", "8 units of the corrections are printed"),
    ("14", "12 sorting of names"),
    ("14", "17 refractive index of water: parameter"),
    ("14", "18 heights of the refraction model in metres, also in feet jobs"),
    ("14", "20 rms and counts of unheld components only"),
    ("14", "23 first N4 images in the order of the frames"),
    ("14", "28 pages of the iterations"),
    ("14", "31 N2 counts unique points"),
    ("15", "six-photo bandwidth"),
)


def test_no_row_lacks_a_test():
    lacking = [row for row in giant_coverage.untested() if row[0] not in TO_COME and row not in TO_COME]
    assert lacking == []


def test_every_mark_is_a_row():
    assert [mark for mark in giant_coverage.unlisted() if mark.section not in TO_COME] == []


def test_tests_are_named_after_their_sections():
    by_test = {}
    for mark in giant_coverage.marks():
        by_test.setdefault((mark.file, mark.test), []).append(mark.section)
    for (file, test), sections in by_test.items():
        if set(sections) & set(TO_COME):
            continue
        prefixes = tuple(f"test_section_{section.replace('.', '_')}_" for section in sections)
        assert test.startswith(prefixes), f"{file}::{test} shows section {' and '.join(sections)}"


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
        "| 1 | a | `test_x.py::test_section_1_x` |",
        "| 1 | c\\|d |  |",
        "| 2 | b | `test_x.py::test_section_1_x` |",
        "| 2.1 | \\*\\*e |  |",
    ]
