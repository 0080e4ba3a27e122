"""Ways to damage an input: mostly its values, so that most inputs are still read and computed with."""

from __future__ import annotations

import bz2
import gzip
import math
import re
import zlib
from collections.abc import Callable
from random import Random

from .projects import Files
from .structures import as_a_whole, damages_of, resealed

__all__ = ["damaged"]

# Possessive: cells of 140,000 digits would be tried in all ways to divide them.
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d++\.?+\d*+|\.\d++)(?:[EeDd][-+]?\d++)?+(?![\w.])")
_PACKERS = {b"BZh": (bz2.decompress, bz2.compress), b"\x1f\x8b": (gzip.decompress, gzip.compress)}
UNITS = (1000.0, 0.001, 0.3048, math.pi / 180, 180 / math.pi, 1 / 3600, 200 / math.pi, 1e6, 1e-6, 10.0, 0.1)
EXTREME = (
    0.0,
    1e300,
    -1e300,
    1e-300,
    5e-324,
    1.7976931348623157e308,
    1e154,
    1e16,
    -1e16,
    1e-16,
    1e8,
    -1e8,
    1.0,
)
HUGE_COUNTS = ("0", "-1", "1", "2", "255", "65536", "2147483648", "9007199254740993", "9223372036854775808")
HUGE_COUNTS += ("18446744073709551616", "99999999999999999999", "1" + "0" * 400, "9" * 5000)
SPOILT = (
    "nan",
    "-nan",
    "inf",
    "-inf",
    "1e999",
    "-1e999",
    "",
    "-",
    "+",
    ".",
    "1.2.3",
    "--5",
    "5 5",
    "1,5",
    "0x1F",
)
SPOILT += (
    "1_0",
    "\u0661\u0662",
    "\u00b2",
    "\u2212" + "1.5",
    "\uff11",
    "1D5",
    "1.5+2",
    "12A",
    "true",
    "None",
    "\0",
)
SPOILT += (
    "\ud83d\ude00".encode("utf-16", "surrogatepass").decode("utf-16"),
    "\udcff",
    "a\tb",
    '"',
    "'",
    "[",
    "{",
)


def changed(rng: Random, text: str) -> str:
    """Return a number near or far from another one, written without regard to columns."""
    kind = rng.random()
    whole = text.lstrip("+-").isdigit()
    if whole and kind < 0.3:
        return str(int(text[:18]) + rng.choice((-2, -1, 1, 2, 10)))
    try:
        value = float(text.upper().replace("D", "E"))
    except ValueError:
        return rng.choice(SPOILT)
    if kind < 0.55:
        value += (abs(value) or 1.0) * rng.gauss(0.0, 10.0 ** rng.uniform(-6, 0))
    elif kind < 0.67:
        value *= 10.0 ** rng.randint(-12, 12)
    elif kind < 0.78:
        value = -value
    elif kind < 0.87:
        value *= rng.choice(UNITS)
    elif kind < 0.95:
        value = rng.choice(EXTREME)
    elif kind < 0.98:
        return rng.choice(HUGE_COUNTS)
    else:
        return rng.choice(SPOILT)
    return str(int(value)) if whole and abs(value) < 1e18 else repr(value)


def fitted(text: str, width: int) -> str:
    """Write a number in a column of some width: with fewer digits, else cut."""
    if len(text) <= width:
        return text.rjust(width)
    try:
        value = float(text)
    except ValueError:
        return text[:width]
    for digits in range(width, 0, -1):
        if len(shorter := f"{value:.{digits}g}") <= width:
            return shorter.rjust(width)
    return text[:width]


class Text:
    """A file as lines, with what damages it."""

    def __init__(self, content: bytes, columns: bool, rng: Random) -> None:
        self.lines = content.decode("utf-8", "surrogateescape").split("\n")
        self.columns = columns
        self.rng = rng

    def content(self) -> bytes:
        """Return the file as bytes."""
        return "\n".join(self.lines).encode("utf-8", "surrogatepass").replace(b"\xed\xb3\xbf", b"\xff")

    def at(self) -> int:
        """Pick a line."""
        return self.rng.randrange(len(self.lines))

    def spans(self, line: int) -> list[tuple[int, int]]:
        """Return where the numbers of a line stand; in columns, with the blanks before them."""
        found = []
        for match in NUMBER.finditer(self.lines[line]):
            start, end = match.span()
            if self.columns:
                while start > 1 and self.lines[line][start - 1] == " " == self.lines[line][start - 2]:
                    start -= 1
            found.append((start, end))
        return found

    def put(self, line: int, span: tuple[int, int], text: str) -> None:
        """Put a text where a number stood."""
        start, end = span
        if self.columns:
            text = fitted(text, end - start)
        self.lines[line] = self.lines[line][:start] + text + self.lines[line][end:]

    def number(self) -> None:
        """Change one number."""
        for _ in range(8):
            line = self.at()
            if spans := self.spans(line):
                span = self.rng.choice(spans)
                self.put(line, span, changed(self.rng, self.lines[line][span[0] : span[1]].strip()))
                return

    def column(self) -> None:
        """Change a column of numbers: another unit or sign, all alike, exchanged rows, noise."""
        line = self.at()
        own = self.spans(line)
        if not own:
            return
        place = self.rng.randrange(len(own))
        rows = [k for k in range(len(self.lines)) if len(self.spans(k)) == len(own)]
        texts = [self.lines[k][slice(*self.spans(k)[place])].strip() for k in rows]
        kind = self.rng.randrange(5)
        if kind == 0:
            factor = self.rng.choice((-1.0, *UNITS))
            texts = [_times(text, factor) for text in texts]
        elif kind == 1:
            texts = [self.rng.choice(texts)] * len(texts)
        elif kind == 2:
            self.rng.shuffle(texts)
        elif kind == 3:
            texts = [changed(self.rng, texts[0])] * len(texts)
        else:
            texts = [_plus(self.rng, text) for text in texts]
        for row, text in zip(rows, texts, strict=True):
            self.put(row, self.spans(row)[place], text)

    def exchange(self) -> None:
        """Exchange two numbers, of one line or of two."""
        first = self.at()
        second = first if self.rng.random() < 0.5 else self.at()
        one, other = self.spans(first), self.spans(second)
        if not one or not other:
            return
        a, b = self.rng.choice(one), self.rng.choice(other)
        if first == second and a[0] > b[0]:
            a, b = b, a
        if first == second and a != b:
            left, right = self.lines[first][slice(*a)], self.lines[first][slice(*b)]
            self.put(first, b, left.strip())
            self.put(first, a, right.strip())
        elif first != second:
            left, right = self.lines[first][slice(*a)], self.lines[second][slice(*b)]
            self.put(first, a, right.strip())
            self.put(second, b, left.strip())

    def line(self) -> None:
        """Delete, repeat, move, cut or blank a line."""
        at, kind = self.at(), self.rng.randrange(6)
        if kind == 0 and len(self.lines) > 1:
            del self.lines[at]
        elif kind == 1:
            self.lines.insert(at, self.lines[at])
        elif kind == 2:
            other = self.at()
            self.lines[at], self.lines[other] = self.lines[other], self.lines[at]
        elif kind == 3:
            self.lines[at] = self.lines[at][: self.rng.randrange(len(self.lines[at]) + 1)]
        elif kind == 4:
            self.lines[at] = " " * self.rng.randrange(90)
        else:
            self.lines.insert(at, self.lines[self.at()])

    def name(self) -> None:
        """Change a word: that of another line, other letters, a long or strange one."""
        at, other = self.at(), self.at()
        words = re.split(r"([\s,=]+)", self.lines[at])
        place = self.rng.randrange(0, len(words), 2)
        own, others = words[place], re.split(r"[\s,=]+", self.lines[other])
        choices = (self.rng.choice(others), own.lower(), own[::-1], own + "x", "", self.rng.choice(SPOILT))
        words[place] = self.rng.choice(choices)
        self.lines[at] = "".join(words)

    def spoil(self) -> None:
        """Put what is no number where one stood, or a character anywhere."""
        line = self.at()
        if (spans := self.spans(line)) and self.rng.random() < 0.6:
            self.put(line, self.rng.choice(spans), self.rng.choice((*SPOILT, *HUGE_COUNTS)))
            return
        text = self.lines[line]
        column = self.rng.randrange(len(text) + 1)
        self.lines[line] = text[:column] + self.rng.choice(SPOILT) + text[column + self.rng.randrange(2) :]

    def grown(self) -> None:
        """Make something very long or deep."""
        line, kind, long = self.at(), self.rng.randrange(6), self.rng.choice((200, 3000, 140_000))
        if kind == 0:
            self.lines[line] += "," * long
        elif kind == 1:
            self.lines[line] += " " * long
        elif kind == 2:
            self.lines[line] = self.lines[line].replace(",", "," + "9" * long, 1)
        elif kind == 3:
            self.lines.insert(line, "a = " + "[" * min(long, 3000))
        elif kind == 4:
            self.lines[line] = re.sub(r"\d+", "9" * long, self.lines[line], count=1)
        else:
            self.lines[line] += self.rng.choice(("[" * 3000, "{" * 3000, '"' * 3000, "\n" * 3000))

    def all_lines(self) -> None:
        """Do to the file as a whole what editors and transfers do."""
        kind = self.rng.randrange(6)
        text = "\n".join(self.lines)
        if kind == 0:
            text = text.replace("\n", "\r\n")
        elif kind == 1:
            text = text[: self.rng.randrange(len(text) + 1)]
        elif kind == 2:
            text += text
        elif kind == 3:
            text = "\ufeff" + text + "\x1a"
        elif kind == 4:
            text = text.upper()
        else:
            lines = self.lines[1:]
            self.rng.shuffle(lines)
            text = "\n".join([*self.lines[:1], *lines])
        self.lines = text.split("\n")


def _times(text: str, factor: float) -> str:
    try:
        return repr(round(float(text) * factor, 9))
    except ValueError:
        return text


def _plus(rng: Random, text: str) -> str:
    try:
        value = float(text)
    except ValueError:
        return text
    return repr(round(value + rng.gauss(0.0, 1e-2) * (abs(value) or 1.0), 6))


TEXT_DAMAGES: tuple[tuple[Callable[[Text], None], int], ...] = (
    (Text.number, 70),
    (Text.column, 10),
    (Text.exchange, 10),
    (Text.line, 9),
    (Text.name, 6),
    (Text.spoil, 5),
    (Text.grown, 1),
    (Text.all_lines, 3),
)
_KINDS, _WEIGHTS = zip(*TEXT_DAMAGES, strict=True)
FIXED_COLUMNS = frozenset(
    {"COMMON", "CAMERAS", "IMAGES", "FRAMES", "GROUND", "deck.txt", "input.deck", "grid.deck"}
)
"""Files whose numbers stand in columns; those of other names are kept in columns half of the time."""


def damaged(rng: Random, files: Files) -> Files:
    """Return a copy of an input with one damage or several, at one file or more."""
    result = dict(files)
    for _ in range(1 + (rng.random() < 0.4) + (rng.random() < 0.2) * rng.randrange(6)):
        name = rng.choice(list(result))
        content = result[name]
        if isinstance(content, str):
            continue
        if rng.random() < 0.04:
            result[name] = _bytes_damaged(rng, content)
        else:
            structured = damages_of(rng, name, content, changed)
            result[name] = _text_damaged(rng, name, content) if structured is None else structured
    if rng.random() < 0.02:
        result = as_a_whole(rng, result)
    return resealed(result) if "summary.json" in result and rng.random() < 0.7 else result


def _text_damaged(rng: Random, name: str, content: bytes) -> bytes:
    unpack = next((pair for mark, pair in _PACKERS.items() if content.startswith(mark)), None)
    if unpack:
        try:
            content = unpack[0](content)
        except (OSError, EOFError, ValueError, zlib.error):
            return content
    text = Text(content, name in FIXED_COLUMNS, rng)
    rng.choices(_KINDS, _WEIGHTS)[0](text)
    content = text.content()
    return unpack[1](content) if unpack else content


def _bytes_damaged(rng: Random, content: bytes) -> bytes:
    """Damage a file as bytes, packed or not."""
    kind, at = rng.randrange(5), rng.randrange(len(content) + 1)
    if kind == 0:
        return content[:at]
    if kind == 1:
        return content[:at] + rng.randbytes(1) + content[at + 1 :]
    if kind == 2:
        return content[:at] + rng.randbytes(rng.randrange(20)) + content[at:]
    if kind == 3:
        return b""
    return content.decode("latin-1").encode("utf-16")
