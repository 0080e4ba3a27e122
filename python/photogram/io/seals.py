"""Checksums (SHA-256) that reject changed or exchanged files."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import orjson

from photogram.errors import InputError
from photogram.io.files import reading
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

SEAL = "sha256"  # The member of a document that contains its own checksum
LISTED = 200  # Maximum number of listed input files


@dataclass(frozen=True)
class InputFile:
    path: Path
    size: int
    sha256: str


def input_files(paths: Iterable[Path]) -> tuple[list[InputFile], int]:
    """Return at most `LISTED` files with sizes and SHA-256, and the rest's number."""
    every = [each for each in dict.fromkeys(paths) if each.is_file()]
    found = [InputFile(path, path.stat().st_size, checksum(path)) for path in every[:LISTED]]
    return found, len(every) - len(found)


def checksum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def seal(document: Mapping[str, Any]) -> str:
    """Return the checksum of a JSON document, without its own checksum member."""
    content = {name: each for name, each in document.items() if name != SEAL}
    return hashlib.sha256(orjson.dumps(content)).hexdigest()


def check_sealed(document: Mapping[str, Any], path: Path) -> None:
    """Reject a document that differs from the sealed one."""
    if document.get(SEAL) != seal(document):
        raise InputError(phrase("file.changed"), file=path)


def check_seal(path: Path, expected: object, of: str) -> None:
    """Reject a file whose checksum differs from the one that the file `of` states."""
    with reading(path):
        found = checksum(path)
    if found != expected:
        raise InputError(phrase("file.other", file=of), file=path)


def recorded(
    seals: dict[str, str], name: str, content: Callable[[BinaryIO], object]
) -> Callable[[BinaryIO], None]:
    """Return a function that writes a content and then adds its checksum to `seals`."""

    def write(file: Any) -> None:
        content(file)
        file.seek(0)
        seals[name] = hashlib.file_digest(file, "sha256").hexdigest()

    return write
