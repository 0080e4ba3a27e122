"""Scans joined from two parts: two films with one pose.

`seam_column` or `seam_row` of a photo is the seam. Readings beyond it, images and marks, belong to a second
photo, `NAME half 2`, which is mounted on the first. Other modules do not process seams.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from photogram.formats.plain.tables import Tables
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.moving_photos import Timed
from photogram.network.rigs import Mount
from photogram.network.unknowns import Sensor
from photogram.words import phrase

_LINES = ("column", "row")


@dataclass(frozen=True)
class Seam:
    """The line at which a scan was joined."""

    half: str  # Photo name of the second half
    line: str  # `column` or `row`, and the coordinate at which the second half begins
    at: float


Seams = Mapping[str, Seam]  # By photo name


def with_seams(tables: Tables) -> tuple[Tables, Seams]:
    """Return tables with divided scans, and the seams."""
    table = tables.read("photos")
    found: dict[str, Seam] = {}
    if table is None or not any(f"seam_{line}" in table for line in _LINES):
        return tables, found
    places = table.vectors([f"seam_{line}" for line in _LINES])
    names, films = table.texts("photo"), table.texts("film")
    for row in np.flatnonzero(np.isfinite(places).any(axis=1)).tolist():
        if np.isfinite(places[row]).all():
            raise table.error(row, phrase("error.exclusive", first="seam_column", second="seam_row"))
        if not films[row]:
            raise table.error(row, phrase("plain.seam-without-film", photo=names[row]))
        axis = int(np.isnan(places[row, 0]))
        found[names[row]] = Seam(f"{names[row]} half 2", _LINES[axis], float(places[row, axis]))
    parsed = {name: own for name, own in tables.parsed.items() if name != "photos"}
    return replace(tables, parsed=parsed, change=partial(_divided, found)), found


def _divided(seams: Seams, name: str, table: ColumnTable) -> ColumnTable:
    """Return a table in which readings beyond a seam belong to the second half."""
    if name in ("images", "fiducial_images"):
        return _parted(table, seams)
    return _with_halves(table, seams) if name == "photos" else table


def _parted(table: ColumnTable, seams: Seams) -> ColumnTable:
    """Return readings, with the photo of the second half beyond a seam."""
    texts = table.texts("photo")
    lines = {line: table.numbers(line) for line in _LINES}
    for row, photo in enumerate(texts):
        if (seam := seams.get(photo)) is None:
            continue
        place = lines[seam.line][row]
        if np.isnan(place):
            raise table.cell_error(row, seam.line, "error.empty")
        texts[row] = seam.half if place >= seam.at else photo
    return table.with_texts("photo", texts)


def _with_halves(table: ColumnTable, seams: Seams) -> ColumnTable:
    """Return the table of photos with a row without pose for each second half."""
    texts = table.texts("photo")
    more = [row for row, name in enumerate(texts) if name in seams]
    halves, count = [seams[texts[row]].half for row in more], table.count
    found = table.some([*range(count), *more]).with_texts("photo", [*texts, *halves])
    cells = dict(found.cells)
    for name in (each for each in table.columns if each.startswith("sd_")):
        if isinstance(own := found.cells[name], np.ndarray):
            cells[name] = np.where(np.arange(found.count) < count, own, np.nan)
        else:
            cells[name] = [*table.texts(name), *[""] * len(more)]
    return replace(found, cells=cells)


def mounted_halves(
    seams: Seams, mounts: Sequence[Mount], timed: Sequence[Timed], photos: Sequence[str]
) -> list[Mount]:
    """Return mounts including second halves; on a trajectory both halves are on it."""
    if not seams:
        return [*mounts]
    on_frames = {each.photo: each for each in mounts}
    placed = {each.photo for each in timed}
    joined = Sensor("joined scans", np.zeros(3), np.eye(3), 0.0)
    found = [*mounts]
    for photo, seam in seams.items():
        if seam.half in photos and photo not in placed:
            own = on_frames.get(photo)
            found.append(Mount(seam.half, photo, joined) if own is None else replace(own, photo=seam.half))
    return found
