"""Results that were written as data, read again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from photogram.arguments.annotations import check_arguments
from photogram.collection.adjusted import AdjustedCollection
from photogram.collection.saved import KIND as COLLECTION
from photogram.collection.saved import read_collection_result
from photogram.errors import InputError
from photogram.results.result import Result
from photogram.results.saved import SUMMARY, read_summary
from photogram.results.saved_block import KIND as BLOCK
from photogram.results.saved_block import read_block_result

__all__ = ["read_result"]

_READERS: Mapping[str, Callable[[Path, Mapping[str, Any]], Result | AdjustedCollection]] = {
    BLOCK: read_block_result,
    COLLECTION: read_collection_result,
}


def read_result(directory: str | PathLike[str]) -> Result | AdjustedCollection:
    """Read a result that `to_parquet` or `--parquet DIR` has written: it does all that it did before.

    Values, residuals and redundancy numbers are the same to the last bit, covariances but for rounding
    (2e-16). What a program wrote beside, such as what snooping took out, does not come back.

    Parameters
    ----------
    directory
        The folder.

    Raises
    ------
    InputError
        Files that are missing, damaged, of another version or contradict each other.
    ModuleNotFoundError
        pyarrow is not installed.
    """
    folder = Path(directory)
    document = read_summary(folder)
    kind = document["kind"]
    if kind not in _READERS:
        raise InputError(f"keeps a result of a kind that is not known: {kind!r}", file=folder / SUMMARY)
    return _READERS[kind](folder, document)


check_arguments(globals(), __all__)
