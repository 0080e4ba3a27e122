"""Put the numbers that commands compute into the pages of the documentation.

    python docs/regenerate.py [--check] [PAGE ...]

Blocks between these marks and `<!-- end -->` are made anew, of all pages unless some are named:

* `<!-- numbers: NAME -->`: what the function of this name returns;
* `<!-- printed: COMMAND -->`: lines of what a command prints, as many as there are, or a table;
* `<!-- quote: PATH -->`: a file of the repository;
* `<!-- quote: PATH | LINE -->`: what begins with the line and ends with the next bracket that closes where it
  is indented;
* `<!-- quote: PAGE | LANGUAGE -->`: the first block of code in this language.

`<!-- measured: COMMAND -->` marks what takes hours or depends on the machine. It is not made anew; that the
command is there, and that it knows the words of the block, is checked. docs/walk.py walks through tutorials.
A figure in a sentence that follows from such a block has it behind itself: `1.9<!-- 1.946 -->`, or a sum of
products, `63<!-- 5 * 12.70 -->`. It must be its rounding, and what it comes from must stand on the page.
With --check, nothing is written, and the exit code says whether a page is out of date.
"""

from __future__ import annotations

import difflib
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import calibration_numbers
import certificate_numbers
import comparator_numbers
import redundancy_figure
import statement_numbers
import stellar_numbers
import tests_numbers

DOCS = Path(__file__).parent
BLOCKS: dict[str, Mapping[str, Callable[[], list[str] | None]]] = {
    "certificates.md": certificate_numbers.BLOCKS,
    "comparator.md": comparator_numbers.BLOCKS,
    "redundancy.md": redundancy_figure.BLOCKS,
    "self-calibration.md": calibration_numbers.BLOCKS,
    "statement.md": statement_numbers.BLOCKS,
    "stellar-camera.md": stellar_numbers.BLOCKS,
    "tests.md": tests_numbers.BLOCKS,
}
PAGES = sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md"))
WRITTEN = {"performance.md": "benches/peers/compare.py"}
"""Pages that a program writes as a whole when it measures."""
BLOCK = re.compile(r"(<!-- numbers: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
QUOTE = re.compile(r"(<!-- quote: (\S+)(?: \| (.*?))? -->\n).*?(<!-- end -->)", re.DOTALL)
PRINTED = re.compile(r"(<!-- printed: (.+?) -->\n(?:```text\n)?)(.*?)((?:```\n)?<!-- end -->)", re.DOTALL)
MEASURED = re.compile(r"<!-- measured: (.+?) -->\n(.*?)<!-- end -->", re.DOTALL)
MARKED = re.compile(
    r"<!-- (?:numbers|printed|measured|quote): .*?<!-- end -->|<!-- (\w+) -->.*?<!-- (?:/|end of )\1 -->",
    re.DOTALL,
)
FIGURES = re.compile(r"```text\n.*?```|(?:^\|[^\n]*\n){3,}", re.DOTALL | re.MULTILINE)
"""What may hold figures: what was printed, and tables."""
IN_SENTENCE = re.compile(r"(\d[\d,]*(?:\.\d+)?)<!-- ([-+*/() \d.,]*\d[-+*/() \d.,]*) -->")
NUMBER = re.compile(r"\d[\d,]*(?:\.\d+)?")
SHOWN = re.compile(
    r"<!-- (?:numbers|printed|measured): .*?<!-- end -->|^```console\n.*?^```$", re.DOTALL | re.MULTILINE
)
"""Blocks whose figures are checked, those of docs/walk.py among them."""
LANGUAGES = {".rs": "rust", ".py": "python", ".toml": "toml"}


def quoted(path: Path, first: str | None) -> list[str]:
    """Return the lines of a file, or of the part of it that begins with a line, whatever its indentation."""
    lines = path.read_text(encoding="utf-8").splitlines()
    if first is None:
        return lines
    if path.suffix == ".md":
        start = lines.index(f"```{first}") + 1
        return lines[start : lines.index("```", start)]
    start = next(number for number, line in enumerate(lines) if line.strip() == first)
    margin = len(lines[start]) - len(lines[start].lstrip())
    end = next(
        number for number in range(start + 1, len(lines)) if re.match(rf" {{{margin}}}[)}}\]]", lines[number])
    )
    return [line[margin:] for line in lines[start : end + 1]]


@cache
def told(command: str) -> list[str]:
    """Return the lines that a command prints."""
    environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "200"}
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "examples").symlink_to(DOCS.parent / "examples")
        ran = subprocess.run(
            command, shell=True, cwd=folder, env=environment, capture_output=True, text=True, check=True
        )
    return [line.rstrip() for line in ran.stdout.splitlines()]


def window(shown: list[str], lines: list[str]) -> list[str]:
    """Return the lines among those printed, as many as are shown, that are most like these."""
    length = min(len(shown), len(lines))
    starts = [start for start in range(len(lines) - length + 1) if lines[start : start + length] == shown]
    if starts:
        return shown

    def likeness(start: int) -> float:
        return difflib.SequenceMatcher(None, shown, lines[start : start + length]).ratio() + 1e-3 * (
            difflib.SequenceMatcher(
                None, "\n".join(shown), "\n".join(lines[start : start + length])
            ).quick_ratio()
        )

    best = max(range(len(lines) - length + 1), key=likeness)
    return lines[best : best + length]


def strange_words(page: str) -> list[str]:
    """Return words of what was measured that the program does not know, and programs that are not there."""
    found = []
    for command, block in MEASURED.findall((DOCS / page).read_text(encoding="utf-8")):
        program = re.search(r"(benches/\S+|examples/\S+)", command)
        if program is None or not (DOCS.parent / program[1]).is_file():
            found.append(f"{page}: no program in {command!r}")
            continue
        path = DOCS.parent / program[1]
        beside = "\n".join(each.read_text(encoding="utf-8") for each in path.parent.glob("*.py"))
        known = set(re.findall(r"[a-z]{4,}", beside.lower()))
        printed = re.sub(r"`[^`]*`", "", "\n".join(FIGURES.findall(block)))
        words = set(re.findall(r"\b[a-z]{4,}\b", printed.removeprefix("```text").lower()))
        found += [f"{page}: {path.name} does not know {word!r}" for word in sorted(words - known - {"text"})]
    return found


def unmarked_figures(page: str) -> list[str]:
    """Return blocks and tables that consist of figures and of which nothing says where they come from."""
    text = MARKED.sub("", (DOCS / page).read_text(encoding="utf-8"))
    return [block.partition("\n\n")[0] for block in FIGURES.findall(text) if _of_figures(block)]


def figures_in_sentences(page: str) -> tuple[int, list[str]]:
    """Return how many figures in sentences say what they come from, and those that do not follow from it."""
    text = (DOCS / page).read_text(encoding="utf-8")
    there = set(NUMBER.findall("\n".join(SHOWN.findall(text))))
    wrong = []
    marked = IN_SENTENCE.findall(text)
    for shown, source in marked:
        wrong += [
            f"{page}: {shown} comes from {number}, which is not shown"
            for number in NUMBER.findall(source)
            if len(number) > 2 and number not in there
        ]
        value = float(eval(source.replace(",", ""), {"__builtins__": {}}))  # IN_SENTENCE: figures and signs
        if not _rounds_to(value, shown):
            wrong.append(f"{page}: {shown} is not {source}")
    return len(marked), wrong


def _rounds_to(value: float, shown: str) -> bool:
    """Return whether a figure is a value, rounded to its last digit; thousands may be round."""
    whole, _, decimals = shown.replace(",", "").partition(".")
    zeros = len(whole) - len(whole.rstrip("0")) if not decimals and len(whole) > 3 else 0
    return abs(value - float(shown.replace(",", ""))) <= 0.5000001 * 10.0 ** (zeros - len(decimals))


def _of_figures(block: str) -> bool:
    """Return whether nearly half of the cells of a table, or any line of a text, are figures."""
    if block.startswith("```"):
        return bool(re.search(r"\d", block))
    cells = [cell.strip() for row in block.splitlines()[2:] for cell in row.strip("|").split("|")]
    figures = [cell for cell in cells if re.search(r"\d", cell) and not re.search(r"[a-z]{4,}|[`$]", cell)]
    return len(figures) > 0.45 * len(cells)


def regenerated(page: str, blocks: Mapping[str, Callable[[], list[str] | None]]) -> str:
    """Return a page with all blocks made anew."""

    def block(match: re.Match[str]) -> str:
        lines = blocks[match[2]]()
        if lines is None:
            print(f"{match[2]}: its data are not here, so the block stays", file=sys.stderr)
            return match[0]
        return "\n".join([f"{match[1]}```text", *(line.rstrip() for line in lines), "```", match[3]])

    def quote(match: re.Match[str]) -> str:
        path = DOCS.parent / match[2]
        language = LANGUAGES.get(path.suffix, match[3])
        return "\n".join([f"{match[1]}```{language}", *quoted(path, match[3]), "```", match[4]])

    def printed(match: re.Match[str]) -> str:
        lines = window(match[3].splitlines(), told(match[2]))
        return match[1] + "".join(f"{line}\n" for line in lines) + match[4]

    return PRINTED.sub(printed, QUOTE.sub(quote, BLOCK.sub(block, page)))


def main(arguments: list[str]) -> int:
    """Regenerate or check pages; return the exit code."""
    check = "--check" in arguments
    stale = []
    for name in [each for each in arguments if each != "--check"] or PAGES:
        path = DOCS / name
        page = path.read_text(encoding="utf-8")
        made = regenerated(page, BLOCKS.get(name, {}))
        if made != page:
            stale.append(name)
            if not check:
                path.write_text(made, encoding="utf-8")
    if check and stale:
        print(f"out of date: {', '.join(stale)}; run python docs/regenerate.py", file=sys.stderr)
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
