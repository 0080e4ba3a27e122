"""The figures of docs/reliability.md: each section is what a command of the repository prints.

    python docs/reliability_numbers.py [SECTION ...]

Sections are written between their marks; without names all but the long run of the fuzzer are made anew.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.fuzz.page import machine, write_section  # noqa: E402  # found only now

PAGE = Path(__file__).with_name("reliability.md")
COMMANDS: dict[str, list[str]] = {
    "growth": [sys.executable, "-m", "tests.fuzz.growth"],
    "fuzz": [sys.executable, "-m", "tests.fuzz", "--inputs", "1000000", "--seed", "14"],
    "blocks": [sys.executable, "-m", "tests.fuzz.dense", "--blocks", "8000", "--seed", "12"],
    "nist": ["cargo", "test", "--release", "--package", "photocore", "--test", "nist", "--", "--nocapture"],
    "stars": [sys.executable, "benches/star_nights.py", "120"],
}
OWN = ("fuzz", "blocks", "growth")
"""Commands that write their section themselves."""
LONG = ("fuzz",)
"""Made anew only when named."""


def make(section: str) -> None:
    """Run the command of a section and write what it prints.

    Raises
    ------
    CalledProcessError
        The command fails.
    """
    command = COMMANDS[section]
    if section in OWN:
        subprocess.run([*command, "--page", str(PAGE)], cwd=ROOT, check=True)
        return
    ended = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    lines = ended.stdout.splitlines()
    if section == "nist":  # cargo's own lines are not meant
        lines = [line for line in lines if line.startswith("|")]
    if section == "stars":  # a night a line
        lines = [f"* {line}" for line in lines]
    write_section(PAGE, section, [f"On {machine()}.", "", *(line.rstrip() for line in lines)])


if __name__ == "__main__":
    for name in sys.argv[1:] or [each for each in COMMANDS if each not in LONG]:
        make(name)
