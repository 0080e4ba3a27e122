"""The project of an adjusted block, and the tables of its result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.project import Project
from photogram.io.csv_text import csv_text
from photogram.io.sheets import workbook
from photogram.network.film_reduction import is_scanned
from photogram.results.features import Features, deviation_quantities, quantity_columns
from photogram.results.result import Result
from photogram.results.tables import TABLES
from photogram.show.quantity import frame, unit_comments
from photogram.words import Phrase, phrase

_TABLES = {
    "photos": "photo",
    "points": "point",
    "images": "image",
    "control": "control",
    "check_points": "check",
    "stations": "station",
    "observations": "observation",
    "cameras": "camera",
    "unknowns": "unknown",
    "features": "feature",
    "feature_deviations": "deviation",
}
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
