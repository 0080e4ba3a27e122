"""Streaming XML reader that processes and discards named elements.

The parser is expat. lxml needs 0.7 of its time for BlocksExchange, but doubles the size of an installation.
"""

from __future__ import annotations

import xml.parsers.expat
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError, message_of
from photogram.io.files import reading
from photogram.io.numbers import finite_number, whole_number
from photogram.io.places import Place
from photogram.io.sheets import UNPACKABLE, check_unpacked_size
from photogram.lazy_dataclasses import dataclass, field
from photogram.words import Phrase, phrase

SUFFIXES = (".xml", ".psz")  # Suffixes of documents, and of archives with a document
PIECE = 1 << 16
DEEPEST = 200
LONGEST = 1 << 20  # Largest size of tags and texts: the parser restarts a long tag with every piece
MOST = 1_000_000
"""Largest number of unprocessed elements; 64 characters of their text count as another."""
CHARACTERS = 64
_UNREADABLE = (*UNPACKABLE, ValueError, LookupError)
"""Errors of archives, and of documents in unknown or unsupported encodings."""


@dataclass
class Element:
    name: str
    attributes: Mapping[str, str]
    file: Path
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    @property
    def place(self) -> Place:
        """Location of the element."""
        return Place(self.file, self.line, f"<{self.name}> {self.text.strip()}"[:120])

    def error(self, message: str | Phrase) -> InputError:
        """Return an error that names the line."""
        return self.place.error(message)

    def child(self, name: str) -> Element | None:
        return next((each for each in self.children if each.name == name), None)

    def all(self, name: str) -> Iterator[Element]:
        return (each for each in self.children if each.name == name)

    def need(self, name: str) -> Element:
        """Return the first child of a name, which is required."""
        found = self.child(name)
        if found is None:
            raise self.error(phrase("format.member", name=name))
        return found

    def word(self, name: str, default: str = "") -> str:
        found = self.child(name)
        return default if found is None else found.text.strip()

    @property
    def value(self) -> float:
        """The text as a finite number."""
        return self._number(self.text.strip())

    def _number(self, text: str) -> float:
        # There may be millions of numbers: at_place for each takes a tenth of the time of a document.
        try:
            return finite_number(text)
        except ValueError as error:
            raise self.error(message_of(error)) from None

    def number(self, name: str, default: float | None = None) -> float:
        """Return the number of a child."""
        found = self.child(name)
        if found is None and default is not None:
            return default
        return self.need(name).value

    def whole(self, name: str) -> int:
        """Return the whole number of a child."""
        found = self.need(name)
        try:
            return whole_number(found.text.strip(), highest=2**53)
        except ValueError as error:
            raise found.error(message_of(error)) from None

    def attribute(self, name: str, default: float | None = None) -> float:
        if name not in self.attributes:
            if default is not None:
                return default
            raise self.error(phrase("format.member", name=name))
        return self._number(self.attributes[name])

    def numbers(self, count: int, separator: str | None = None) -> Floats:
        """Return the text as a number of numbers, between blanks or a separator."""
        words = [word.strip() for word in self.text.split(separator)]
        if len(words) != count:
            raise self.error(phrase("format.count", n=len(words), required=count))
        return np.array([self._number(word) for word in words])


@contextmanager
def _opened(path: Path) -> Iterator[IO[bytes]]:
    """Open a file, or the document in a zip archive: `doc.xml`, or the only one."""
    if not zipfile.is_zipfile(path):
        with path.open("rb") as file:
            yield file
        return
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if name.lower().endswith(".xml")]
        name = "doc.xml" if "doc.xml" in names else names[0] if len(names) == 1 else None
        if name is None:
            raise InputError(phrase("xml.archive", n=len(names)), file=path)
        check_unpacked_size(path, [archive.getinfo(name)])
        with archive.open(name) as packed:
            yield packed


def root_of(path: Path) -> tuple[str, Mapping[str, str]]:
    """Return name and attributes of the root; empty if not XML."""
    found: list[tuple[str, Mapping[str, str]]] = []
    parser = xml.parsers.expat.ParserCreate()
    parser.StartElementHandler = lambda name, attributes: found.append((name, attributes))
    try:
        with _opened(path) as file:
            parser.Parse(file.read(PIECE), False)
    except (OSError, InputError, xml.parsers.expat.ExpatError, *_UNREADABLE):
        pass
    return found[0] if found else ("", {})


def read_stream(path: Path, take: Mapping[str, Callable[[Element], Any]], root: str) -> Element:
    """Read a file; return its root without the processed elements."""
    stack: list[Element] = []
    before: list[int] = []
    kept = 0
    first: list[Element] = []
    parser = xml.parsers.expat.ParserCreate()
    parser.buffer_text = True

    def keep(element: Element, more: int) -> None:
        nonlocal kept
        kept += more
        if kept > MOST:
            raise element.error(phrase("xml.elements", most=MOST))

    def start(name: str, attributes: dict[str, str]) -> None:
        element = Element(name, attributes, path, parser.CurrentLineNumber)
        if not stack and name != root:
            raise element.error(phrase("xml.root", name=root, value=name))
        if len(stack) >= DEEPEST:
            raise element.error(phrase("xml.depth", most=DEEPEST))
        first[:] = first or [element]
        before.append(kept)
        keep(element, 1 + sum(map(len, attributes.values())) // CHARACTERS)
        stack.append(element)

    def end(name: str) -> None:
        nonlocal kept
        element, outside = stack.pop(), before.pop()
        if name in take:
            kept = outside
            take[name](element)
        elif stack:
            stack[-1].children.append(element)

    def text(data: str) -> None:
        element = stack[-1]
        if len(element.text) > LONGEST:
            raise element.error(phrase("xml.text", most=LONGEST))
        keep(element, len(data) // CHARACTERS)
        element.text += data

    def declares(*_: Any) -> None:
        raise Place(path, parser.CurrentLineNumber).error(phrase("xml.entities"))

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.EntityDeclHandler = text, declares
    try:
        with reading(path), _opened(path) as file:
            fed = 0
            while piece := file.read(PIECE):
                parser.Parse(piece, False)
                fed += len(piece)
                if fed - parser.CurrentByteIndex > LONGEST:
                    raise Place(path, parser.CurrentLineNumber).error(phrase("xml.tag", most=LONGEST))
            parser.Parse(b"", True)
    except UNPACKABLE as error:
        raise InputError(phrase("xml.packed", reason=str(error)), file=path) from None
    except xml.parsers.expat.ExpatError as error:
        fields = {"reason": xml.parsers.expat.ErrorString(error.code), "column": error.offset + 1}
        raise Place(path, error.lineno).error(phrase("xml.syntax", **fields)) from None
    except (ValueError, LookupError) as error:
        if isinstance(error, InputError):
            raise
        place = Place(path, parser.CurrentLineNumber)
        raise place.error(phrase("xml.syntax", reason=str(error), column=1)) from None
    return first[0]
