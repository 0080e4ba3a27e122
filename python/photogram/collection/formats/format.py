"""What a format of collections is: how its files begin, and how they are read and written."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from photogram.collection.collection import Collection
from photogram.lazy_dataclasses import dataclass


@dataclass(frozen=True)
class Format:
    """A format of collections.

    Attributes
    ----------
    name
        As functions take it.
    title
        As people are told what a file is.
    suffix
        Of files that are written.
    begins
        Whether a file that begins with this, after unpacking, is meant for one.
    read
        Takes the path, for messages, and the content in pieces that end where a word does, unpacked. Raises
        `InputError` with file, line and what stands there.
    to_bytes
        A collection in the format.
    camera
        The model of cameras that the format can hold.
    """

    name: str
    title: str
    suffix: str
    begins: Callable[[bytes], bool]
    read: Callable[[Path, Iterator[bytes]], Collection]
    to_bytes: Callable[[Collection], bytes]
    camera: str = "bal"
