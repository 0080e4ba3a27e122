"""Files of results: tables, the adjusted project, and saved results as results or projects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from photogram.adjustment.options import AdjustOptions, DatumName
from photogram.arguments.objects import path_of
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.format import FORMATS
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.io.csv_text import csv_text
from photogram.io.sheets import workbook
from photogram.network.film_reduction import is_scanned
from photogram.results.features import Features, deviation_quantities, quantity_columns
from photogram.results.result import Result
from photogram.results.result_files import SUMMARY, read_summary
from photogram.results.tables import TABLE_FILES, TABLES
from photogram.show.quantity import frame, unit_comments
from photogram.words import Phrase, phrase

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


_TABLES = {"photos": "photo", "points": "point", "images": "image", **TABLE_FILES}
"""File and kind of each table."""


def adjusted(project: Project, result: Result) -> Project:
    """Return a project with adjusted parameters; observations are unchanged."""
    starts = np.where(np.isfinite(result.point_positions), result.point_positions, project.starts)
    return project.replace(block=result.restarted(), starts=starts, lacks=())


def project_files(project: Project, result: Result) -> tuple[dict[str, bytes], list[Phrase]]:
    """Return the tables of a result, the adjusted project in its own format and as tables, and remarks."""
    from photogram.formats import FORMATS, to_files

    after, files, remarks = adjusted(project, result), dict(table_files(result)), []
    own = next((name for name, each in FORMATS.items() if each.title == project.title), "plain")
    for name in dict.fromkeys(("plain", own)):
        folder = "adjusted" if name == "plain" else f"adjusted-{name}"
        form = FORMATS[name]
        made = {}
        try:
            made = dict(to_files(after, name)) if form.write is not None else {}
        except InputError as error:
            if name == own == "plain" and not is_scanned(after.block):
                raise
            remarks.append(phrase("command.not-written", format=form.title, error=error))
        if name != "plain" and form.results is not None:
            made |= form.results(after, result)
        files |= {f"{folder}/{file}": content for file, content in made.items()}
    return files, remarks


def table_files(result: Result) -> Mapping[str, bytes]:
    """Return the tables of a result as CSV by file name, without empty tables."""
    files = {}
    for file, kind in _TABLES.items():
        table = TABLES[kind](result)
        columns = frame(table)
        if len(next(iter(columns.values()))):
            files[f"{file}.csv"] = csv_text(columns, unit_comments(table))
    if result.films:
        files["refined.csv"] = _refined(result)
    if np.isfinite(result.photo_cofactors).any():
        names = ("x", "y", "z", "omega", "phi", "kappa")
        files["photo_covariances.csv"] = _packed(
            "photo", result.block.photo_ids, result.photo_covariances, names, result
        )
        used = [name for name, there in zip(result.block.point_ids, result.used_points, strict=True) if there]
        files["point_covariances.csv"] = _packed(
            "point", used, result.point_covariances[result.used_points], names[:3], result
        )
    return files


def feature_files(features: Features) -> Mapping[str, bytes]:
    """Return the tables of features as CSV by file name."""
    tables = {
        "features.csv": frame(quantity_columns(features)),
        "feature_deviations.csv": frame(deviation_quantities(features)),
    }
    return {name: csv_text(columns) for name, columns in tables.items() if columns["feature"]}


def excel_file(result: Result) -> bytes:
    """Return the tables of a result as a workbook, with units in `notes`."""
    tables = {file: TABLES[kind](result) for file, kind in _TABLES.items()}
    sheets = {file: frame(table) for file, table in tables.items()}
    filled = {file: columns for file, columns in sheets.items() if len(next(iter(columns.values())))}
    notes = {file: "; ".join(unit_comments(tables[file])) for file in filled}
    return workbook(filled, {file: note for file, note in notes.items() if note})


def _refined(result: Result) -> bytes:
    """Return film observations in the camera frame, for programs without film models."""
    (xy, sd), block = result.refined, result.block
    known = np.flatnonzero(np.isfinite(xy).all(axis=1))
    return csv_text(
        {
            "photo": [block.photo_ids[row] for row in block.image_photos[known].tolist()],
            "point": [block.point_ids[row] for row in block.image_points[known].tolist()],
            **dict(zip(("x", "y"), xy[known].T, strict=True)),
            **dict(zip(("sd_x", "sd_y"), sd[known].T, strict=True)),
        },
        [
            "mm in the frame of the marks, x right and y up on the positive; the lens is not taken out",
            "sd: of the readings; what images of a film, a scanner and a camera have in common is left out",
        ],
    )


def _packed(
    kind: str, names: list[str], covariances: Floats, order: tuple[str, ...], result: Result
) -> bytes:
    """Return lower triangles row by row, one matrix per line."""
    pairs = [(i, j) for i in range(len(order)) for j in range(i + 1)]
    columns: dict[str, Any] = {kind: names}
    columns |= {f"c_{order[i]}_{order[j]}": covariances[:, i, j] for i, j in pairs}
    unit = result.block.linear_unit
    return csv_text(
        columns,
        [
            f"covariances, scaled by the variance of unit weight {result.covariance_scale!r};"
            f" datum: {result.datum}",
            f"units: {unit} for {', '.join(order[:3])}"
            + ("" if len(order) == 3 else f", rad for {', '.join(order[3:])}"),
        ],
    )
