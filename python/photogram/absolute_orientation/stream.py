"""Part II: transformation of model points from file to file, in chunks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from photogram.absolute_orientation.document import point_rows
from photogram.absolute_orientation.similarity import Similarity
from photogram.absolute_orientation.stations import MODEL_COLUMNS, MODEL_SD_COLUMNS, header
from photogram.arguments.arrays import number
from photogram.arguments.objects import path_of
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.delimited import LONGEST_RECORD, cells
from photogram.io.files import reading
from photogram.io.json import CLOSED
from photogram.io.numbers import finite_number
from photogram.io.places import Place
from photogram.io.writing import OutputSet
from photogram.lazy_dataclasses import dataclass
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    import pandas as pd


CHUNK = 100_000  # Points transformed at a time
OUTPUT = b"id,X,Y,Z,sd_X,sd_Y,sd_Z\n"


@dataclass(frozen=True)
class Document:
    """A JSON document to which the points are written as well."""

    path: Path  # Its path
    head: bytes  # The document up to its first point
    first: bytes = b""  # Points before the points of the file


def transform_file(
    similarity: Similarity,
    source: Path,
    target: Path,
    *,
    decimals: int = 6,
    point_sd: float = 0.0,
    document: Document | None = None,
    outputs: OutputSet | None = None,
    progress: Callable[[int], None] | None = None,
) -> int:
    """Transform the points of a file to another file with standard deviations.

    `source` is a CSV file with the columns `id`, `x`, `y`, `z` and optionally `sd_x`, `sd_y`, `sd_z`, or
    lines `x y z number` without a header (part II of TB 19). `target` has the columns `id`, `X`, `Y`, `Z`,
    `sd_X`, `sd_Y`, `sd_Z`; the last three are empty if the covariance of the similarity is unknown. Files are
    written completely or not at all.

    Parameters
    ----------
    similarity
        The similarity.
    source, target
        The files.
    decimals
        Number of decimals of coordinates; standard deviations have one more.
    point_sd
        Standard deviation of each coordinate of a point in model units, if not in the file.
    document
        A JSON document to write the points into as well, with their full covariances.
    outputs
        Set of output files to which the files belong; default: a new set.
    progress
        Called after each chunk with the number of transformed points; an exception stops the work.

    Returns
    -------
    The number of points.

    Raises
    ------
    InputError
        If an output is the input, or both are one file; if the file cannot be read, has other columns, lacks
        points, or a field is not a number. The message contains file, record and text.
    OSError
        If a file cannot be written.
    """
    number("point_sd", point_sd, "not-negative")
    source, target = path_of("source", source), path_of("target", target)
    done = 0
    with OutputSet([source]) if outputs is None else nullcontext(outputs) as files:
        out = files.open(target)
        json = files.open(document.path) if document else None
        out.write(OUTPUT)
        if document and json:
            json.write(document.head + document.first)
        separator = b"," if document and document.first else b""
        for ids, points, sd in _chunks(source):
            positions, covariances = similarity.transform(points, point_sd if sd is None else sd)
            beyond = np.flatnonzero(~np.isfinite(positions).all(axis=1))
            if beyond.size:
                raise InputError(phrase("orientation.transformed", point=ids[beyond[0]]), file=source)
            out.write(_lines(ids, positions, covariances, decimals))
            if json:
                json.write(separator + point_rows(ids, positions, covariances))
                separator = b","
            done += len(ids)
            if progress:
                progress(done)
        if not done:
            raise InputError(phrase("orientation.empty"), file=source)
        if json:
            json.write(CLOSED)
    return done


def decimals_for(deviation: float) -> int:
    """Return the decimals for a thousandth of a standard deviation."""
    if not deviation > 0:
        return 6
    return int(np.clip(np.ceil(3 - np.log10(deviation)), 0, 15))


def _lines(ids: list[str], positions: Floats, covariances: Floats, decimals: int) -> bytes:
    """Return the lines of a chunk; orjson writes numbers far faster than pandas."""
    # Rounding can cause a negative variance.
    sd = np.sqrt(np.maximum(np.diagonal(covariances, axis1=1, axis2=2), 0.0))
    known = bool(np.isfinite(sd).all())
    values: list[Floats] = [np.round(positions, decimals)]
    if known:
        values.append(np.asarray(np.round(sd, decimals + 1), dtype=np.float64))
    text = orjson.dumps(np.ascontiguousarray(np.hstack(values)), option=orjson.OPT_SERIALIZE_NUMPY)
    rows = text[2:-2].split(b"],[")
    end = b"\n" if known else b",,,\n"
    return b"".join([b"%b,%b%b" % (name, row, end) for name, row in zip(_cells(ids), rows, strict=True)])


def _cells(ids: list[str]) -> list[bytes]:
    """Return identifiers as fields, quoted if necessary."""
    joined = "\n".join(ids)
    if "," in joined or '"' in joined:
        quote = '"'
        return [
            f'"{name.replace(quote, quote * 2)}"'.encode() if set(name) & {",", quote} else name.encode()
            for name in ids
        ]
    return joined.encode().split(b"\n")


def _chunks(source: Path) -> Iterator[tuple[list[str], Floats, Floats | None]]:
    """Yield identifiers, coordinates and standard deviations (or None) by chunk."""
    import pandas as pd  # takes long to import

    names, options = _layout(source)
    weighted = "sd_x" in names
    columns = [*MODEL_COLUMNS, *(MODEL_SD_COLUMNS if weighted else ())]
    types: dict[str, Any] = {**dict.fromkeys(names, str), **dict.fromkeys(columns, np.float64)}
    try:
        with pd.read_csv(
            source,
            dtype=types,
            chunksize=CHUNK,
            keep_default_na=False,
            **options,
        ) as reader:
            for table in reader:
                yield _checked(table, weighted)
    except (ValueError, UnicodeDecodeError, pd.errors.ParserError) as error:
        if isinstance(error, InputError):
            raise
        text = next((each for each in error.args if isinstance(each, Phrase)), phrase("orientation.not-read"))
        raise _fault(source, names) or InputError(text, file=source) from None


def _layout(source: Path) -> tuple[list[str], dict[str, Any]]:
    """Return the columns of a file of points, and options for pandas."""
    with reading(source), source.open(encoding="utf-8-sig", errors="replace") as file:
        # Lines longer than a record are not read to their end.
        lines = iter(lambda: file.readline(LONGEST_RECORD + 1), "")
        number, first = next(((k, line) for k, line in enumerate(lines, 1) if line.strip()), (0, ""))
    place = Place(source, number, first.rstrip("\r\n"))
    names = header(place)
    if "x" not in names:
        if not first:
            raise InputError(phrase("orientation.empty"), file=source)
        separator = "," if "," in first else r"\s+"
        return [*MODEL_COLUMNS, "id"], {"names": [*MODEL_COLUMNS, "id"], "header": None, "sep": separator}
    if repeated := [name for name, count in Counter(names).items() if count > 1]:
        raise place.error(phrase("orientation.column-repeated", column=repeated[0]))
    wanted = {"id", *MODEL_COLUMNS, *(MODEL_SD_COLUMNS if set(names) & set(MODEL_SD_COLUMNS) else ())}
    missing = sorted(wanted - set(names))
    if missing:
        raise place.error(phrase("orientation.missing-columns", names=missing[:1]))
    return names, {"names": names, "header": 0}


def _checked(table: pd.DataFrame, weighted: bool) -> tuple[list[str], Floats, Floats | None]:
    import pandas as pd  # takes long to import

    points = table[list(MODEL_COLUMNS)].to_numpy()
    sd = table[list(MODEL_SD_COLUMNS)].to_numpy() if weighted else None
    # pandas uses the first column as index if rows have one field more than the header.
    if not isinstance(table.index, pd.RangeIndex):
        raise ValueError(phrase("orientation.too-many-fields"))
    if any("\n" in name or "\r" in name for name in table["id"]):
        raise ValueError(phrase("orientation.line-in-id"))
    if not np.isfinite(points).all() or (sd is not None and not (sd >= 0).all()):
        raise ValueError(phrase("orientation.values"))
    return table["id"].tolist(), points, sd


def _fault(source: Path, names: list[str]) -> InputError | None:
    """Return the error of the first unreadable record (slow); None without any."""
    numeric = [name for name in names if name in (*MODEL_COLUMNS, *MODEL_SD_COLUMNS)]
    with source.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        seen_header = names[-1] == "id" and names[0] == "x"
        for number, raw in enumerate(file, 1):
            place = Place(source, number, raw.rstrip("\r\n"))
            line = place.text or ""
            if not line.strip():
                continue
            if not seen_header:
                seen_header = True
                continue
            try:
                found = cells(place) if "," in line else line.split()
            except InputError as error:
                return error
            if len(found) != len(names):
                return place.error(phrase("orientation.fields", n=len(names), value=len(found)))
            fields = dict(zip(names, found, strict=True))
            for name in numeric:
                if not _readable(fields[name], name):
                    code = "orientation.cell-sd" if name in MODEL_SD_COLUMNS else "orientation.cell"
                    return place.error(phrase(code, column=name, value=fields[name]))
    return None


def _readable(text: str, name: str) -> bool:
    try:
        value = finite_number(text)
    except ValueError:
        return False
    return name in MODEL_COLUMNS or value >= 0
