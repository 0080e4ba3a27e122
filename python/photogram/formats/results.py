"""Results that were written as data: read again as results, or as projects to go on with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.errors import InputError
from photogram.formats.format import Format, Wishes
from photogram.formats.project import DatumName, Options, Project
from photogram.results.block_files import KIND as BLOCK
from photogram.results.result import Result
from photogram.results.result_files import SUMMARY, read_summary
from photogram.results.saved_block import read_block_result
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.collection.result import AdjustedCollection

__all__ = ["FORMAT", "TITLE", "is_result", "read_result"]

TITLE = "result as data (Parquet)"


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
    from photogram.collection.result_files import KIND as COLLECTION
    from photogram.collection.saved_result import read_collection_result

    readers: Mapping[str, Callable[[Path, Mapping[str, Any]], Result | AdjustedCollection]] = {
        BLOCK: read_block_result,
        COLLECTION: read_collection_result,
    }
    folder = Path(directory)
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


def is_result(path: Path) -> bool:
    """Return whether a folder has a result."""
    return path.is_dir() and (path / SUMMARY).is_file() and (path / "state.parquet").is_file()


def _project(path: Path, wishes: Wishes) -> Project:
    """Read the block of a result, where its adjustment has ended, with the options that it had."""
    del wishes
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
        title=TITLE,
        sizes=(None,) * count,
        pixel_mm=(None,) * count,
        starts=np.array(result.point_positions),
        frame=result.block.frame,
        options=Options(
            datum=datums.get(result.datum.kind),
            loss=None if result.loss is None else losses[result.loss[0]],
            unit_variance=variances.get(result.unit_variance, "constrained"),
        ),
        features={} if result.features is None else result.features.definitions,
    )


FORMAT = Format(name="results", title=TITLE, recognises=is_result, read=_project)

check_arguments(globals(), ["read_result"])
