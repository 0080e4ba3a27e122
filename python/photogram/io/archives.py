"""The limits of zip archives, by which packed bombs are rejected before they are unpacked."""

from __future__ import annotations

import lzma
import struct
import zipfile
import zlib
from collections.abc import Collection
from pathlib import Path

from photogram.errors import InputError
from photogram.messages import listed

MAX_RATIO, SMALL = 250, 1 << 26
"""Members of more bytes than the second are no larger than so many times their packed selves."""

UNPACKABLE = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, RuntimeError, EOFError, struct.error)
"""The errors of archives that are damaged, or packed in other ways."""


def check_unpacked_size(path: Path, members: Collection[zipfile.ZipInfo]) -> None:
    """Reject members of an archive whose headers announce many times the bytes that they are packed into.

    No member is unpacked beyond its header.
    """
    packed = sum(each.compress_size for each in members)
    size = sum(each.file_size for each in members)
    if size > max(SMALL, MAX_RATIO * packed):
        names = listed([each.filename for each in members], 3)
        raise InputError(
            f"holds {names}, which would grow from {packed} to {size} bytes; at most {MAX_RATIO} times are"
            " read: save the data without compression",
            file=path,
        )
