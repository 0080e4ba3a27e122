"""The table `fiducials` of plain projects: places of marks by camera, and their covariances beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.arrays import is_covariance
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.film.marks import by_side
from photogram.io.delimited import ColumnTable, read_columns
from photogram.messages import listed, quoted

__all__ = ["read_table"]

SD_PLACE = 0.002
_NUMBERS = ("x", "y", "sd_x", "sd_y")
_COLUMNS = ("camera", "fiducial", *_NUMBERS, "use")


def read_table(path: Path, camera: str | None) -> dict[str, Any]:
    """Return the fields of a certificate from a table `camera, fiducial, x, y, sd_x, sd_y, use`.

    Marks with `use` off are left out, and remarked on. A table `covariances` beside it (`kind, name, first,
    second, covariance`; kind `fiducials`) takes the place of the standard deviations of what it names.

    Raises
    ------
    InputError
        The file cannot be read, lacks a column, has other ones, or several cameras of which none is chosen.
    """
    table = read_columns(path, known=_COLUMNS, numbers=_NUMBERS)
    table.require("camera", "fiducial", "x", "y")
    if unknown := [each for each in table.columns if each not in _COLUMNS]:
        raise table.head.error(f"there is no column {listed(unknown)}, but {', '.join(_COLUMNS)}")
    rows, name = _rows_of(table, camera)
    marks = [by_side(each) for each in table.texts("fiducial")]
    on = [row for row in rows if _used(table, row)]
    xy = table.vectors(("x", "y"))
    table.check_given(xy, ("x", "y"))
    sd = table.vectors(("sd_x", "sd_y"), SD_PLACE)
    names = [marks[row] for row in on]
    for row in on:
        if names.count(marks[row]) > 1:
            raise table.error(row, f"the mark {marks[row]} is there twice")
        if not (sd[row] > 0).all():
            raise table.error(row, "column sd_x or sd_y: is not positive")
    fields = [f"{mark}.{axis}" for mark in names for axis in "xy"]
    typed = {f"{marks[row]}.{axis}": table.texts(axis)[row] for row in on for axis in "xy"}
    left = [marks[row] for row in rows if row not in on]
    return {
        "name": name,
        "places": {marks[row]: tuple(xy[row].tolist()) for row in on},
        "covariance": _covariance(path.with_name("covariances.csv"), name, fields, sd[on].ravel()),
        "typed": typed,
        "file": path,
        "remarks": (f"marks that are off: {listed(left)}",) if left else (),
    }


def _rows_of(table: ColumnTable, camera: str | None) -> tuple[list[int], str]:
    cameras = table.names("camera")
    if camera is None and len(cameras.names) > 1:
        raise InputError(f"has marks of {listed(cameras.names)}: choose one", file=table.path)
    name = cameras.names[0] if camera is None and cameras.names else camera
    if name is None or name not in cameras.names:
        there = listed(cameras.names) or "none"
        raise InputError(
            f"has no marks of the camera {quoted(str(name))}: there are {there}", file=table.path
        )
    return np.flatnonzero(cameras.rows == cameras.names.index(name)).tolist(), name


def _used(table: ColumnTable, row: int) -> bool:
    word = table.texts("use")[row].lower()
    if word not in ("", "on", "off"):
        raise table.error(row, f"column use: {quoted(word)} is neither on nor off")
    return word != "off"


def _covariance(path: Path, camera: str, fields: list[str], sd: Floats) -> Floats:
    """Return the matrix of coordinates in mm^2: that of the table beside, or standard deviations."""
    found = np.diag(sd**2)
    if not path.exists():
        return found
    table = read_columns(path, known=("kind", "name"), numbers=("covariance",))
    table.require("kind", "name", "first", "second", "covariance")
    texts = {column: table.texts(column) for column in ("kind", "name", "first", "second")}
    values = table.numbers("covariance")
    for row, kind in enumerate(texts["kind"]):
        if kind != "fiducials" or texts["name"][row] != camera:
            continue
        pair = [texts[column][row] for column in ("first", "second")]
        for word in pair:
            if word not in fields:
                raise table.error(row, f"there is no coordinate {quoted(word)} of {camera}")
        if np.isnan(values[row]):
            raise table.error(row, "column covariance: is empty")
        i, j = (fields.index(word) for word in pair)
        found[i, j] = found[j, i] = values[row]
    if not is_covariance(found, singular=True):
        raise InputError(f"the covariances of the marks of {camera} are no covariance matrix", file=path)
    return found
