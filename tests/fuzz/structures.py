"""Damage to trees, binary records and tables, and to files as a whole: links, names, encodings."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Callable
from io import BytesIO
from random import Random
from typing import Any

from photogram.io.seals import seal

from .projects import Files

__all__ = ["as_a_whole", "damages_of", "resealed"]

ENCODINGS = ("utf-16", "utf-16-be", "utf-32", "utf-8-sig", "latin-1", "cp1252", "utf-7", "cp037", "punycode")
DECLARED = (*ENCODINGS, "idna", "rot13", "zlib_codec", "base64", "undefined", "none", "ascii", "x" * 300, "")
LINKS = ("", ".", "..", "nowhere", "in", "/dev/null", "/proc/self/mem", "../in", "loop/loop", "x" * 300)
NAMES = (
    "a\nb",
    " ",
    "-x",
    "a\tb",
    "\u202ename",
    "images.csv.csv",
    "name\udcff",
    "x" * 200,
    "COMMON",
    "project.toml",
)
WRONG: tuple[Any, ...] = (
    [],
    {},
    None,
    "",
    "a\nb",
    True,
    -1,
    0,
    1.5,
    1e308,
    2**63,
    [[]],
    {"a": 1},
    "\u0000",
    ["x"],
)


def damages_of(rng: Random, name: str, content: bytes, changed: Callable[[Random, str], str]) -> bytes | None:
    """Return a file of a known structure with a damage; None where it is better damaged as text.

    Parameters
    ----------
    rng
        Draws.
    name, content
        The file.
    changed
        Gives another number for one.
    """
    if content.startswith(b"PAR1"):
        return _table(rng, content, changed)
    if name.endswith(".bin"):
        return _records(rng, content, changed)
    if name.endswith(".json") and rng.random() < 0.35:
        return _tree(rng, content, changed)
    if name.endswith(".xml") and rng.random() < 0.1:
        return _document(rng, content)
    return None


def as_a_whole(rng: Random, files: Files) -> Files:
    """Return an input one of whose files is a link, has another name or another encoding, or is not there."""
    result = dict(files)
    name = rng.choice(list(result))
    content = result.pop(name)
    kind = rng.randrange(4)
    if kind == 0:
        others = [each.rsplit("/", 1)[-1] for each in result]
        result[name] = rng.choice((*LINKS, name.rsplit("/", 1)[-1], *others)) or "nowhere"
    elif kind == 1:
        folder, mark, _ = name.rpartition("/")
        result.setdefault(folder + mark + rng.choice(NAMES).replace("\udcff", "\u00ff"), content)
    elif kind == 2 and isinstance(content, bytes):
        text = content.decode("utf-8", "replace")
        result[name] = text.encode(rng.choice(ENCODINGS), "replace")
    return result


def resealed(files: Files) -> Files:
    """Return a folder of results whose checksums are those of its tables: damage comes further that way."""
    try:
        document = json.loads(files["summary.json"])
        for name in document["tables"]:
            document["tables"][name] = hashlib.sha256(files[f"{name}.parquet"]).hexdigest()  # type: ignore[arg-type]
        document["sha256"] = seal(document)
        return {**files, "summary.json": json.dumps(document).encode("utf-8", "replace")}
    except (ValueError, LookupError, TypeError, AttributeError):
        return files


def _tree(rng: Random, content: bytes, changed: Callable[[Random, str], str]) -> bytes | None:
    """Change, exchange, remove or add a value anywhere in a document of JSON."""
    try:
        tree = json.loads(content)
    except (ValueError, RecursionError):
        return None
    places: list[tuple[Any, Any]] = []

    def walk(value: Any) -> None:
        keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
        for key in list(keys):
            places.append((value, key))
            walk(value[key])

    walk(tree)
    if not places:
        return json.dumps(rng.choice(WRONG)).encode()
    holder, key = rng.choice(places)
    kind, value = rng.random(), holder[key]
    if kind < 0.5 and isinstance(value, int | float) and not isinstance(value, bool):
        try:
            holder[key] = float(changed(rng, repr(value)))
        except ValueError:
            holder[key] = rng.choice(WRONG)
    elif kind < 0.7:
        holder[key] = rng.choice(WRONG)
    elif kind < 0.8:
        del holder[key]
    elif kind < 0.9:
        other, beside = rng.choice(places)
        if beside in other if isinstance(other, dict) else beside < len(other):
            holder[key] = other[beside] if other[beside] is not holder and other is not value else None
    elif isinstance(holder, dict):
        holder[f"{key}\n" if rng.random() < 0.5 else str(rng.choice(NAMES)).replace("\udcff", "")] = value
    else:
        holder.extend([value] * rng.choice((1, 2, 1000)))
    try:
        return json.dumps(tree).encode("utf-8", "replace")
    except (ValueError, RecursionError):  # a tree that holds itself
        return content


def _records(rng: Random, content: bytes, changed: Callable[[Random, str], str]) -> bytes:
    """Change a number or a count of a binary file, mostly where one stands."""
    if len(content) < 16:
        return content + rng.randbytes(8)
    data = bytearray(content)
    kind, at = rng.randrange(6), 4 * rng.randrange(len(content) // 4 - 2)
    if kind <= 2:
        number = struct.unpack_from("<d", data, at)[0]
        try:
            struct.pack_into("<d", data, at, float(changed(rng, repr(number))))
        except (ValueError, OverflowError):
            struct.pack_into("<d", data, at, rng.choice((float("nan"), float("inf"), 0.0, -1e300)))
    elif kind == 3:
        counts = (0, 1, 2, 255, 2**16, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1)
        struct.pack_into("<Q", data, rng.choice((0, at)), rng.choice(counts))
    elif kind == 4:
        struct.pack_into("<i", data, at, rng.choice((0, -1, 1, 2, 7, 999, 2**31 - 1, -(2**31))))
    else:
        length = rng.choice((1, 4, 8, 24, 60))
        data[at : at + rng.choice((0, length))] = data[at : at + length] * rng.choice((0, 1, 2))
    return bytes(data)


def _table(rng: Random, content: bytes, changed: Callable[[Random, str], str]) -> bytes:
    """Change a table of Parquet: a cell, a column, its type or name, its rows."""
    import pyarrow
    import pyarrow.parquet

    try:
        table = pyarrow.parquet.read_table(BytesIO(content))
    except (OSError, pyarrow.ArrowException):
        return content
    names = table.column_names
    if not names:
        return content
    name, kind = rng.choice(names), rng.random()
    place, rows = names.index(name), table.num_rows
    if kind < 0.75 and rows:
        cells = table.column(name).to_pylist()
        cells = _cells(rng, cells, changed)
        table = table.set_column(place, name, _array(pyarrow, cells))
    elif kind < 0.8:
        table = table.drop_columns([name])
    elif kind < 0.85:
        renamed = [*names]
        renamed[place] = rng.choice((*names, name.upper(), "", "a\nb", name + "x"))
        table = table.rename_columns(renamed)
    elif kind < 0.9:
        wrong = rng.choice(([None], ["x"], [1.5], [True], [[1.0, 2.0]], [b"\xff"], [2**40], [{"a": 1}]))
        table = table.set_column(place, name, pyarrow.array(wrong * rows))
    elif kind < 0.95:
        table = table.slice(rng.randrange(rows + 1), rng.randrange(rows + 1))
    else:
        table = pyarrow.concat_tables([table, table.slice(0, rng.randrange(rows + 1))])
    sink = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(table, sink)
    return sink.getvalue().to_pybytes()


def _cells(rng: Random, cells: list[Any], changed: Callable[[Random, str], str]) -> list[Any]:
    """Return cells of which one is another: a number near or far, a name of another row, nothing."""
    row = rng.randrange(len(cells))
    cell = cells[row]
    if isinstance(cell, float | int) and not isinstance(cell, bool):
        try:
            number = float(changed(rng, repr(cell)))
        except ValueError:
            number = float("nan")
        whole = isinstance(cell, int) and number == number and abs(number) < 2**62
        cells[row] = int(number) if whole else number
    elif isinstance(cell, list) and cell:
        cells[row] = _cells(rng, cell, changed)
    else:
        cells[row] = rng.choice((cells[rng.randrange(len(cells))], None, "", "a\nb", "x" * 5000))
    return cells


def _array(pyarrow: Any, cells: list[Any]) -> Any:
    lists = cells and isinstance(cells[0], list)
    try:
        found = pyarrow.array(cells)
        if lists:
            return found.cast(pyarrow.list_(found.type.value_type, len(cells[0])))
        return found
    except (pyarrow.ArrowException, OverflowError, TypeError):
        return pyarrow.array([None if each is None else str(each) for each in cells])


def _document(rng: Random, content: bytes) -> bytes:
    """Declare another encoding of XML, or entities; pack it well or badly."""
    kind, body = rng.randrange(4), content.split(b"?>", 1)[-1]
    if kind == 0:
        return f'<?xml version="1.0" encoding="{rng.choice(DECLARED)}"?>'.encode() + body
    if kind == 1:
        return b'<!DOCTYPE a [<!ENTITY b "c">]>' + body
    if kind == 2:
        return content.replace(b">", b"><![CDATA[" + rng.randbytes(4) + b"]]>", 1 + rng.randrange(3))
    import zipfile

    sink = BytesIO()
    with zipfile.ZipFile(sink, "w", rng.choice((0, 8, 12, 14))) as archive:
        archive.writestr(rng.choice(("doc.xml", "a.xml", "doc.txt")), content)
        if rng.random() < 0.2:
            archive.writestr("b.xml", content)
    data = bytearray(sink.getvalue())
    if rng.random() < 0.7:
        data[rng.randrange(len(data))] ^= rng.randrange(1, 256)
    return bytes(data)
