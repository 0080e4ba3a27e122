"""Text files with words in lines, as in PATB and BINGO."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.files import read_lines
from photogram.io.places import Place
from photogram.words import phrase

END = "-99"  # Word that ends a photo or a file


class Card:
    def __init__(self, place: Place) -> None:
        self.place = place
        self.words = (place.text or "").split()

    def number(self, index: int, what: str) -> float:
        """Return a word as a number."""
        if index >= len(self.words):
            raise self.place.error(phrase("format.end", name=what))
        return self.place.number(self.words[index], what)

    def numbers(self, first: int, names: str) -> Floats:
        """Return some words as numbers, by their names."""
        return np.array([self.number(first + k, name) for k, name in enumerate(names.split())])

    @property
    def ends(self) -> bool:
        """Whether the line is an end mark: -99, alone or with zeros."""
        return self.words[:1] == [END] and not any(word.strip("0.") for word in self.words[1:])


def filled_lines(path: Path) -> Iterator[Place]:
    """Yield the lines of a file that are neither empty nor comments (`# ...`)."""
    for record, line in enumerate(read_lines(path), 1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield Place(path, record, line)


def cards(path: Path) -> Iterator[Card]:
    """Yield the lines of a file except comments (`C ...`)."""
    for record, line in enumerate(read_lines(path), 1):
        words = line.split()
        if words and words[0] in ("C", "#"):
            continue
        yield Card(Place(path, record, line))


def one_file(path: Path, suffix: str) -> Path | None:
    """Return the only file of a suffix in a folder, in any case; None without."""
    found = [each for each in sorted(path.iterdir()) if each.suffix.lower() == suffix and each.is_file()]
    if len(found) > 1:
        names = [file.name for file in found]
        raise InputError(phrase("format.several", name=suffix, names=names), file=path)
    return found[0] if found else None


def file_of(path: Path, suffix: str) -> Path:
    """Return a file, or the only file of a suffix in a folder."""
    if (found := one_file(path, suffix) if path.is_dir() else path) is None:
        raise InputError(phrase("format.files", name=f"*{suffix}"), file=path)
    return found
