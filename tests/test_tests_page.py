"""The page of tests: its figures are those of the command."""

import re
import subprocess
import sys
from pathlib import Path

from photogram.statistics.verdict import RULES

ROOT = Path(__file__).parents[1]


def test_the_figures_of_the_page_are_those_of_the_command():
    command = [sys.executable, str(ROOT / "docs" / "regenerate.py"), "--check", "tests.md"]
    assert subprocess.run(command, check=False).returncode == 0


def test_the_table_of_the_verdict_has_every_code():
    page = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    table, *_ = page[page.index("| code in JSON |") :].split("\n\n")
    cells = re.findall(r"^\| (`.*?`) \|", table, re.MULTILINE)
    assert {code for each in cells for code in re.findall("`([^`]*)`", each)} == {rule.code for rule in RULES}
