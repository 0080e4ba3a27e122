"""Saved results: read as results, or as projects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from photogram.adjustment.options import AdjustOptions, DatumName
from photogram.arguments.objects import path_of
from photogram.errors import InputError
from photogram.formats.format import FORMATS
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.results.result import Result
from photogram.results.result_files import SUMMARY, read_summary
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.collection.result import AdjustedCollection

__all__ = ["read_project", "read_result"]


def read_result(directory: str | PathLike[str]) -> Result | AdjustedCollection:
    """Read a result from the files of `to_parquet` or `--parquet DIR`.

    Values, residuals and redundancy numbers are identical to the last bit, covariances up to rounding
    (2e-16). Other output, such as the log of data snooping, is not included.

    Parameters
    ----------
    directory
        The folder.

    Raises
    ------
    InputError
        If files are missing, damaged, of another version, or contradict each other.
    ModuleNotFoundError
        If pyarrow is not installed.
    """
    from photogram.collection.result_files import KIND as COLLECTION
    from photogram.collection.saved_result import read_collection_result
    from photogram.results.block_files import KIND as BLOCK
    from photogram.results.saved_block import read_block_result

    readers: Mapping[str, Callable[[Path, Mapping[str, Any]], Result | AdjustedCollection]] = {
        BLOCK: read_block_result,
        COLLECTION: read_collection_result,
    }
    folder = path_of("directory", directory)
    document = read_summary(folder)
    kind = document["kind"]
    if kind not in readers:
        raise InputError(
            phrase("format.unknown", what="kind of the result", value=str(kind), names=list(readers)),
            file=folder / SUMMARY,
        )
    try:
        return readers[kind](folder, document)
    except InputError:
        raise
    except (LookupError, TypeError, ValueError) as error:
        raise InputError(phrase("results.contradiction", reason=str(error)), file=folder / SUMMARY) from None


def read_project(path: Path, options: ReadOptions) -> Project:
    """Read the adjusted block of a result, with its adjustment settings."""
    del options
    result = read_result(path)
    if not isinstance(result, Result):
        raise InputError(phrase("results.collection"), file=path)
    datums: dict[str, DatumName] = {"inner constraints": "inner", "minimum constraints": "minimum"}
    losses: dict[str, Literal["huber", "cauchy"]] = {"huber": "huber", "cauchy": "cauchy"}
    variances: dict[str, Literal["unity", "redundancy"]] = {"unity": "unity", "redundancy": "redundancy"}
    count = len(result.block.cameras)
    return Project(
        block=result.restarted(),
        path=path,
        title=FORMATS["results"].title,
        sizes=(None,) * count,
        pixel_mm=(None,) * count,
        starts=np.array(result.point_positions),
        frame=result.block.frame,
        options=AdjustOptions(
            datum=datums.get(result.datum.kind),
            loss=None if result.loss is None else losses[result.loss[0]],
            unit_variance=variances.get(result.unit_variance, "constrained"),
        ),
        features={} if result.features is None else result.features.definitions,
    )
