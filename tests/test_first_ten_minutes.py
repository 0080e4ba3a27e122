"""docs/first-ten-minutes.md does what it says, word by word."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "first-ten-minutes.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE, re.DOTALL)


def steps():
    """Return what a reader does: commands with the lines that are shown below them, and scripts to save."""
    found = []
    for language, text in BLOCKS:
        if language == "python":
            found.append(("first.py", text))
        elif language == "console":
            for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, _, shown = part.partition("\n")
                found.append((command, shown.splitlines()))
    return found


def agree(shown, told):
    """Return whether lines are what was told, `...` standing for any number of lines."""
    pattern = "".join("(?:.*\n)*" if line == "..." else re.escape(line) + "\n" for line in shown)
    return re.fullmatch(pattern, told) is not None


def test_every_step_of_the_page(tmp_path):
    place = Path(sys.executable).parent
    environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "200", "PYTHONPATH": ""}
    environment["PATH"] = f"{place}{os.pathsep}{os.environ['PATH']}"
    ran = 0
    for command, shown in steps():
        if command == "first.py":
            (tmp_path / command).write_text(shown)
            continue
        done = subprocess.run(
            command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert agree(shown, done.stdout), f"{command}\n{done.stdout}\n{done.stderr}"
        ran += 1
    assert ran == 9
    assert (tmp_path / "snooped" / "report.html").is_file()


def test_the_page_installs_what_it_runs():
    [install] = [text for language, text in BLOCKS if language == "sh"]
    assert install.strip() == "pip install '.[report]'"
    assert "pip install ." in (ROOT / "README.md").read_text(encoding="utf-8")
