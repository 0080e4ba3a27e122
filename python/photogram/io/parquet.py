"""Parquet files with unit and description in each field.

pyarrow is an extra (`pip install 'photogram[parquet]'`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from photogram.arguments.types import Indices
from photogram.errors import InputError
from photogram.io.column_table import NameColumn
from photogram.lazy_dataclasses import dataclass
from photogram.messages import missing_columns
from photogram.words import phrase

if TYPE_CHECKING:
    import pyarrow

ROWS = 2**17  # Rows per row group
LEVEL = 1  # Compression level of zstd: higher levels hardly reduce measured numbers


@dataclass(frozen=True, eq=False)
class Column:
    name: str  # Without blanks
    values: Any  # (rows,) an array or names, or (rows, k) an array: k numbers in each row
    unit: str = ""  # `m`, `rad`, `px`, `m2` ...; `1` for plain numbers; empty without unit
    description: str = ""  # One line
    order: tuple[str, ...] = ()  # Names of the k numbers


@dataclass(frozen=True, eq=False)
class Sheet:
    """A table that was read: arrays of numbers, and columns of names.

    A missing column, or one of another type, is an :class:`InputError`.
    """

    path: Path  # The file
    columns: Mapping[str, Any]  # By name

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self.columns.values()), ()))

    def column(self, name: str) -> Any:
        """Return a column."""
        if name not in self.columns:
            raise InputError(missing_columns([name], list(self.columns)), file=self.path)
        return self.columns[name]

    def names(self, name: str) -> NameColumn:
        """Return a column of names."""
        values = self.column(name)
        if not isinstance(values, NameColumn):
            raise InputError(phrase("cells.column-kind", column=name, kind="names"), file=self.path)
        return values

    def numbers(self, name: str, columns: int = 0) -> Any:
        """Return a column of numbers: (rows,), or (rows, columns)."""
        values = self.column(name)
        kind = values.dtype.kind if isinstance(values, np.ndarray) else ""
        width = values.shape[1] if kind and values.ndim == 2 else 0
        fits = width == columns if columns >= 0 else width > 0 and width % columns == 0
        if kind not in tuple("iuf") or not fits:
            raise InputError(phrase("cells.column-kind", column=name, kind="numbers"), file=self.path)
        return values


def parquet_content(columns: Sequence[Column], about: Mapping[str, str]) -> Callable[[BinaryIO], None]:
    """Return a function that writes columns and metadata to an open file."""
    import pyarrow
    from pyarrow import PythonFile, parquet, types  # Import is slow

    arrays, fields = [_array(each.values) for each in columns], []
    for each, array in zip(columns, arrays, strict=True):
        texts = {"unit": each.unit, "description": each.description, "order": " ".join(each.order)}
        metadata = {key: text for key, text in texts.items() if text}
        fields.append(pyarrow.field(each.name, array.type, metadata=metadata))
    table = pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(fields, metadata=dict(about)))
    repeated = [each.name for each in columns if isinstance(each.values, NameColumn)]
    few = [name for name in repeated if types.is_dictionary(table.schema.field(name).type)]

    def write(file: BinaryIO) -> None:
        # Measured numbers are rarely equal: a dictionary of them takes ten times as long.
        parquet.write_table(
            table,
            PythonFile(file, "w"),
            compression="zstd",
            compression_level=LEVEL,
            row_group_size=ROWS,
            use_dictionary=few,
            write_page_checksum=True,
        )

    return write


def read_sheet(path: Path) -> Sheet:
    """Read a table."""
    import pyarrow.parquet

    try:
        table = pyarrow.parquet.read_table(path, page_checksum_verification=True)
    except (OSError, pyarrow.ArrowException) as error:
        reason = str(error).split("\n")[0]
        raise InputError(phrase("error.parse", format="Parquet", reason=reason), file=path) from None
    return Sheet(path, {name: _values(path, name, table.column(name)) for name in table.column_names})


def coded(column: pyarrow.ChunkedArray) -> tuple[list[str], Indices]:
    """Return names of a text column, and the index of each row (-1: empty)."""
    import pyarrow

    whole = column.unify_dictionaries().combine_chunks()
    # A batch may have all names of its file.
    if not pyarrow.types.is_dictionary(whole.type) or len(whole.dictionary) > len(whole):
        whole = whole.cast(pyarrow.string()).dictionary_encode()
    rows = whole.indices.fill_null(-1).to_numpy(zero_copy_only=False).astype(np.int64)
    return whole.dictionary.to_pylist(), rows


def packed(matrices: np.ndarray) -> np.ndarray:
    """Return (n, k (k + 1) / 2) lower triangles of (n, k, k) matrices by row."""
    rows, columns = np.tril_indices(matrices.shape[1])
    return np.ascontiguousarray(matrices[:, rows, columns])


def unpacked(triangles: np.ndarray) -> np.ndarray:
    """Return (n, k, k) symmetric matrices from their lower triangles."""
    k = round(((8 * triangles.shape[1] + 1) ** 0.5 - 1) / 2)
    rows, columns = np.tril_indices(k)
    matrices = np.empty((len(triangles), k, k))
    matrices[:, rows, columns] = matrices[:, columns, rows] = triangles
    return matrices


def _array(values: Any) -> pyarrow.Array:
    import pyarrow

    if isinstance(values, NameColumn):
        names = pyarrow.array(values.names, pyarrow.string())
        rows = pyarrow.array(values.rows.astype(np.int32))
        # A large dictionary would be repeated in every group of rows.
        few = len(values.names) <= ROWS
        return pyarrow.DictionaryArray.from_arrays(rows, names) if few else names.take(rows)
    if isinstance(values, np.ndarray) and values.ndim == 2:
        flat = pyarrow.array(np.ascontiguousarray(values).ravel())
        return pyarrow.FixedSizeListArray.from_arrays(flat, values.shape[1])
    if isinstance(values, np.ndarray) and values.dtype.kind != "O":
        return pyarrow.array(np.ascontiguousarray(values))
    texts = all(isinstance(each, str) for each in values)
    return pyarrow.array(list(values), pyarrow.string() if texts else None)


def _values(path: Path, name: str, column: pyarrow.ChunkedArray) -> Any:
    import pyarrow

    whole = column.combine_chunks()
    kind = column.type
    if pyarrow.types.is_dictionary(kind) or pyarrow.types.is_string(kind):
        return NameColumn(*coded(column))
    if whole.null_count:
        raise InputError(phrase("error.column", column=name, message=phrase("error.empty")), file=path)
    if pyarrow.types.is_fixed_size_list(kind):
        return whole.flatten().to_numpy(zero_copy_only=False).reshape(len(whole), kind.list_size)
    return whole.to_numpy(zero_copy_only=False)
