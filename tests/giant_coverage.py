"""Which test shows which row of the specification of GIANT: a page made from the marks of the tests.

`python tests/giant_coverage.py` writes `docs/giant-coverage.md`. The tests are read, not run.
"""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

TESTS = Path(__file__).parent
PAGE = TESTS.parent / "docs" / "giant-coverage.md"
ROWS = TESTS / "data" / "giant" / "specification_rows.json"

HEAD = """# Tested features of GIANT

This page lists every row of the specification of GIANT, with the tests of this row. It is for users who
replace GIANT by photogram. `python tests/giant_coverage.py` writes it from the marks of the tests;
`pytest -k test_section_2_2` runs the tests of section 2.2.
"""


@dataclass(frozen=True)
class Mark:
    """One mark `giant(section, feature)` of a test."""

    section: str
    feature: str
    file: str
    test: str


def rows() -> dict[str, list[str]]:
    """Return the features of every section."""
    listed: dict[str, list[str]] = json.loads(ROWS.read_text(encoding="utf-8"))
    return listed


def marks() -> list[Mark]:
    """Return the marks of all tests, in the order of files and lines."""
    return [mark for path in sorted(TESTS.rglob("test_*.py")) for mark in _marks_of(path)]


def _marks_of(path: Path) -> Iterator[Mark]:
    text = path.read_text(encoding="utf-8")
    # Parsing takes long: most files have no mark.
    tree = ast.parse(text if "giant" in text else "")
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            # Decorators, and the marks of single parameters inside them.
            for call in (inner for decorator in node.decorator_list for inner in ast.walk(decorator)):
                if isinstance(call, ast.Call) and ast.unparse(call.func) == "pytest.mark.giant":
                    section, feature = (ast.literal_eval(argument) for argument in call.args)
                    yield Mark(section, feature, path.relative_to(TESTS).as_posix(), node.name)


def untested() -> list[tuple[str, str]]:
    """Return the rows without a test."""
    shown = {(mark.section, mark.feature) for mark in marks()}
    return [
        (section, feature)
        for section, features in rows().items()
        for feature in features
        if (section, feature) not in shown
    ]


def unlisted() -> list[Mark]:
    """Return the marks whose section and feature are no row."""
    listed = {(section, feature) for section, features in rows().items() for feature in features}
    return [mark for mark in marks() if (mark.section, mark.feature) not in listed]


def page() -> str:
    """Return the text of the page: the rows in their order, then what tests say besides."""
    shown: dict[tuple[str, str], list[str]] = {}
    for section, features in rows().items():
        shown |= {(section, feature): [] for feature in features}
    for mark in marks():
        tests = shown.setdefault((mark.section, mark.feature), [])
        test = f"`{mark.file}::`<wbr>`{mark.test}`"
        if test not in tests:
            tests.append(test)
    order = sorted(shown, key=lambda row: [int(part) for part in row[0].split(".")])
    lines = [HEAD, "| section | feature | test |", "|---|---|---|"]
    lines += [f"| {row[0]} | {_cell(row[1])} | {'<br>'.join(shown[row])} |" for row in order]
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
