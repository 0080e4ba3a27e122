"""The limits of zip archives, by which packed bombs are rejected before they are unpacked."""

from __future__ import annotations

import lzma
import struct
import zipfile
import zlib
from collections.abc import Collection
from pathlib import Path

from photogram.errors import InputError
from photogram.words import phrase

MAX_RATIO, SMALL = 250, 1 << 26  # Members above SMALL bytes have at most this ratio of sizes

UNPACKABLE = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, RuntimeError, EOFError, struct.error)


def check_unpacked_size(path: Path, members: Collection[zipfile.ZipInfo]) -> None:
    """Reject members of an archive whose headers announce many times the bytes that they are packed into.

    No member is unpacked beyond its header.
    """
    packed = sum(member.compress_size for member in members)
    size = sum(member.file_size for member in members)
    if size > max(SMALL, MAX_RATIO * packed):
        fields = {"names": [member.filename for member in members], "packed": packed, "size": size}
        raise InputError(phrase("file.expands", ratio=MAX_RATIO, **fields), file=path)
