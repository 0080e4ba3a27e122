"""Put the numbers that commands compute into the pages of the documentation.

    python docs/regenerate.py [--check] [PAGE ...]

Blocks between `<!-- numbers: NAME -->` and `<!-- end -->` are made anew, of all pages unless some are named.
So are quotes of files of the repository: `<!-- quote: PATH -->` of all of one, `<!-- quote: PATH | LINE -->`
of what begins with the line and ends with the next bracket that closes where it is indented.
With --check, nothing is written, and the exit code says whether a page is out of date.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import calibration_numbers
import comparator_numbers
import stellar_numbers
import tests_numbers

DOCS = Path(__file__).parent
PAGES: dict[str, Mapping[str, Callable[[], list[str]]]] = {
    "comparator.md": comparator_numbers.BLOCKS,
    "extending.md": {},
    "pictures.md": {},
    "self-calibration.md": calibration_numbers.BLOCKS,
    "stellar-camera.md": stellar_numbers.BLOCKS,
    "tests.md": tests_numbers.BLOCKS,
}
BLOCK = re.compile(r"(<!-- numbers: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
QUOTE = re.compile(r"(<!-- quote: (\S+)(?: \| (.*?))? -->\n).*?(<!-- end -->)", re.DOTALL)
LANGUAGES = {".rs": "rust", ".py": "python"}


def quoted(path: Path, first: str | None) -> list[str]:
    """Return the lines of a file, or of the part of it that begins with a line, whatever its indentation."""
    lines = path.read_text(encoding="utf-8").splitlines()
    if first is None:
        return lines
    start = next(number for number, line in enumerate(lines) if line.strip() == first)
    margin = len(lines[start]) - len(lines[start].lstrip())
    end = next(
        number for number in range(start + 1, len(lines)) if re.match(rf" {{{margin}}}[)}}\]]", lines[number])
    )
    return [line[margin:] for line in lines[start : end + 1]]


def regenerated(page: str, blocks: Mapping[str, Callable[[], list[str]]]) -> str:
    """Return a page with all blocks made anew."""

    def block(match: re.Match[str]) -> str:
        lines = [line.rstrip() for line in blocks[match[2]]()]
        return "\n".join([f"{match[1]}```text", *lines, "```", match[3]])

    def quote(match: re.Match[str]) -> str:
        path = DOCS.parent / match[2]
        return "\n".join([f"{match[1]}```{LANGUAGES[path.suffix]}", *quoted(path, match[3]), "```", match[4]])

    return QUOTE.sub(quote, BLOCK.sub(block, page))


def main(arguments: list[str]) -> int:
    """Regenerate or check pages; return the exit code."""
    check = "--check" in arguments
    stale = []
    for name in [each for each in arguments if each != "--check"] or PAGES:
        path = DOCS / name
        page = path.read_text(encoding="utf-8")
        made = regenerated(page, PAGES[name])
        if made != page:
            stale.append(name)
            if not check:
                path.write_text(made, encoding="utf-8")
    if check and stale:
        print(f"out of date: {', '.join(stale)}; run python docs/regenerate.py", file=sys.stderr)
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
