"""Walk through pages that are tutorials: run what they tell to run, word by word, and compare what is shown.

    python docs/walk.py [--check] [PAGE ...]

In blocks `console`, a line after `$` is a command, run in one empty folder beside a link to `examples`; below
it stands what it prints, `...` standing for any number of lines. A block with a title, `python title="NAME"`,
is saved under this name before the next command. `<!-- picture: FILE -->` before an image, which may be a
link, says which file of the commands it is. Without --check, lines that have changed and pictures are put
into the pages.
"""

from __future__ import annotations

import difflib
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parent
TUTORIALS = tuple(f"tutorials/{path.name}" for path in sorted((DOCS / "tutorials").glob("*.md")))
PAGES = ("index.md", "first-ten-minutes.md", *TUTORIALS, "gallery.md")
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
PICTURE = re.compile(r"<!-- picture: (\S+) -->\n\[?!\[[^\]]*\]\(([^)]+)\)")
MARKS = re.compile(r"<(path|use|text|image)\b")


@dataclass
class Step:
    """A command, the lines that the page shows below it, and what it has printed."""

    command: str
    shown: list[str]
    told: str = ""
    remarks: str = ""

    @property
    def agrees(self) -> bool:
        """Whether the page shows what was printed."""
        pattern = "".join("(?:.*\n)*" if line == "..." else re.escape(line) + "\n" for line in self.shown)
        return re.fullmatch(pattern, self.told) is not None

    def refreshed(self) -> list[str]:
        """Return the lines to show: all, or where some are left out the most similar to those shown now."""
        told = self.told.splitlines()
        if "..." not in self.shown:
            return told
        return [
            line if line in ("...", *told) else (difflib.get_close_matches(line, told, 1, 0.3) or [line])[0]
            for line in self.shown
        ]


def steps(text: str) -> list[Step | tuple[str, str]]:
    """Return what a reader does: commands, and files to save (name and text)."""
    found: list[Step | tuple[str, str]] = []
    for language, title, content in BLOCK.findall(text):
        if title:
            found.append((title, content))
        elif language == "console":
            for part in re.split(r"^\$ ", content, flags=re.MULTILINE)[1:]:
                command, _, shown = part.partition("\n")
                found.append(Step(command, shown.splitlines()))
    return found


def walked(page: str, folder: Path) -> list[Step]:
    """Do what a page says in an empty folder; return the commands with what they printed."""
    environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "200", "PYTHONPATH": ""}
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    (folder / "examples").symlink_to(DOCS.parent / "examples")
    done = []
    for step in steps((DOCS / page).read_text(encoding="utf-8")):
        if not isinstance(step, Step):
            (folder / step[0]).write_text(step[1], encoding="utf-8")
            continue
        ran = subprocess.run(
            step.command,
            shell=True,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        step.told, step.remarks = ran.stdout, ran.stderr
        done.append(step)
    return done


def pictures(page: str) -> dict[str, Path]:
    """Return the pictures of a page: the file that the commands make, and where the page has it."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return {made: (DOCS / page).parent / shown for made, shown in PICTURE.findall(text)}


def rounded(svg: str) -> str:
    """Return a drawing with hundredths of a point, which nobody sees: a third of the size."""
    marks = re.sub(
        r"<[^>]*>", lambda mark: re.sub(r"-?\d+\.\d{3,}", lambda each: f"{float(each[0]):.2f}", mark[0]), svg
    )
    return "\n".join(line.rstrip() for line in marks.splitlines()) + "\n"


def alike(one: str, other: str) -> bool:
    """Return whether two drawings have the same marks; versions of matplotlib place them differently."""
    return sorted(MARKS.findall(one)) == sorted(MARKS.findall(other))


def walk(page: str, *, check: bool) -> list[str]:
    """Walk through a page; return what disagrees. Without `check` put it right."""
    wrong = []
    path = DOCS / page
    with tempfile.TemporaryDirectory() as folder:
        text = path.read_text(encoding="utf-8")
        for step in walked(page, Path(folder)):
            if step.agrees:
                continue
            wrong.append(f"{page}: $ {step.command}\n{step.told}{step.remarks}")
            if not check:
                before, after = (
                    "".join(f"{line}\n" for line in each) for each in (step.shown, step.refreshed())
                )
                text = text.replace(f"$ {step.command}\n{before}", f"$ {step.command}\n{after}")
        for made, place in pictures(page).items():
            drawn = rounded((Path(folder) / made).read_text(encoding="utf-8"))
            if not (place.exists() and alike(place.read_text(encoding="utf-8"), drawn)):
                wrong.append(f"{page}: {made}")
                if not check:
                    place.parent.mkdir(parents=True, exist_ok=True)
                    place.write_text(drawn, encoding="utf-8")
        if not check:
            path.write_text(text, encoding="utf-8")
    return wrong


def main(arguments: list[str]) -> int:
    """Walk through pages; return the exit code."""
    check = "--check" in arguments
    wrong = [
        each
        for page in [name for name in arguments if name != "--check"] or PAGES
        for each in walk(page, check=check)
    ]
    print(*wrong, sep="\n", end="\n" if wrong else "", file=sys.stderr)
    return int(check and bool(wrong))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
