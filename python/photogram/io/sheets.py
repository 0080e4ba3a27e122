"""Sheets of Excel as text (extra `excel`), and limits of zip archives."""

from __future__ import annotations

import io
import lzma
import math
import struct
import zipfile
import zlib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from photogram.errors import InputError
from photogram.words import phrase

LARGEST = 1 << 29  # Largest size (bytes) of an unpacked workbook; larger ones are attacks
MAX_RATIO, SMALL = 250, 1 << 26  # Members above SMALL bytes have at most this ratio of sizes
UNPACKABLE = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, RuntimeError, EOFError, struct.error)
_NEEDS_OPENPYXL = phrase("error.package", what="an Excel workbook", package="openpyxl", extra="excel")


def check_unpacked_size(path: Path, members: Collection[zipfile.ZipInfo]) -> None:
    """Reject archive members with suspicious unpacked sizes.

    No member is unpacked beyond its header.
    """
    packed = sum(member.compress_size for member in members)
    size = sum(member.file_size for member in members)
    if size > max(SMALL, MAX_RATIO * packed):
        fields = {"names": [member.filename for member in members], "packed": packed, "size": size}
        raise InputError(phrase("file.expands", ratio=MAX_RATIO, **fields), file=path)


def sheet_text(path: Path) -> str:
    """Return the first sheet of a workbook as lines with tabs."""
    try:
        import openpyxl
    except ImportError:
        raise InputError(_NEEDS_OPENPYXL, file=path) from None
    try:
        with zipfile.ZipFile(path) as archive:
            check_unpacked_size(path, archive.infolist())
            if sum(each.file_size for each in archive.infolist()) > LARGEST:
                raise InputError(phrase("file.unpacked", most=LARGEST >> 20), file=path)
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        try:
            rows = list(book.worksheets[0].iter_rows(values_only=True))
        finally:
            book.close()
    except InputError:
        raise
    except OSError as error:
        raise InputError(phrase("error.read", reason=error.strerror or str(error)), file=path) from None
    except Exception as error:  # A damaged archive may raise any exception
        reason = f"{type(error).__name__}: {error}"
        raise InputError(phrase("file.workbook", reason=reason), file=path) from None
    width = max((k + 1 for row in rows for k, cell in enumerate(row) if cell is not None), default=0)
    return "".join("\t".join(_cell(cell) for cell in row[:width]) + "\n" for row in rows)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
        return str(int(value))  # Names that are numbers
    text = " ".join(str(value).split())
    return f'"{text.replace(chr(34), chr(34) * 2)}"' if '"' in text else text


def workbook(tables: Mapping[str, Mapping[str, Sequence[Any]]], notes: Mapping[str, str]) -> bytes:
    """Return tables as a workbook, with notes in a last sheet.

    Headers are in the first row; text is never a formula.
    """
    try:
        import openpyxl
        from openpyxl.cell import WriteOnlyCell
    except ImportError:
        raise InputError(_NEEDS_OPENPYXL) from None
    book = openpyxl.Workbook(write_only=True)

    def cell(sheet: Any, value: Any) -> Any:
        if isinstance(value, str):
            text = WriteOnlyCell(sheet, "")
            text.value, text.data_type = value, "s"
            return text
        return None if value is None or (isinstance(value, float) and not math.isfinite(value)) else value

    for name, columns in {**tables, "notes": {"table": list(notes), "note": list(notes.values())}}.items():
        sheet = book.create_sheet(name)
        sheet.append(list(columns))
        lists = [own.tolist() if hasattr(own, "tolist") else list(own) for own in columns.values()]
        for row in zip(*lists, strict=True):
            sheet.append([cell(sheet, value) for value in row])
    buffer = io.BytesIO()
    book.save(buffer)
    return buffer.getvalue()
