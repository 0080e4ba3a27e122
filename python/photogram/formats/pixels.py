"""Tables of measured pixels: photo, point, column, row."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.columns import PLAIN, in_units
from photogram.formats.format import FORMATS
from photogram.formats.images import by_camera, from_corner, to_corner
from photogram.formats.models import known_cameras
from photogram.formats.plain.cameras import read_cameras
from photogram.formats.plain.photos import cameras_of
from photogram.formats.plain.schema import column_units
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import Tables, check_rows, columns_of
from photogram.formats.plain.writing import camera_table
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.io.column_table import ColumnTable
from photogram.io.csv_text import csv_text
from photogram.io.delimited import read_columns, read_head
from photogram.io.places import positive
from photogram.messages import Message
from photogram.words import Phrase, phrase

FILE = "images.csv"
CAMERAS = "cameras.csv"
_NEEDED = ("photo", "point", "column", "row")
_NUMBERS = {"column", "row", "sd", "sd_column", "sd_row"}
_KNOWN = (*_NEEDED, "sd", "sd_column", "sd_row", "camera", "use")


def pixel_table(path: Path, messages: list[Message] | None = None) -> ColumnTable:
    """Read a table of image observations with any usual headings."""
    table = read_columns(path, known=_NEEDED, numbers=_NUMBERS, spelling=partial(PLAIN.spelled, _KNOWN))
    table.require(*_NEEDED)
    return in_units(table, column_units("images"), "images", [] if messages is None else messages)


def corner_of(table: ColumnTable, pixel_origin: str | None) -> Floats:
    """Return (rows, 2) columns and rows from the upper-left corner."""
    found = table.given(_NEEDED[2:])
    return found + 0.5 if pixel_origin == "center" else found


def has_pixels(path: Path) -> bool:
    spelling = partial(PLAIN.spelled, _KNOWN)
    try:
        return set(_NEEDED) <= set(spelling(read_head(path, _NEEDED, spelling)))
    except InputError:
        return False


def read(path: Path, options: ReadOptions) -> Project:
    """Read a table; cameras are in `--camera FILE`, selected by a column `camera`."""
    if options.cameras is None:
        raise InputError(phrase("format.cameras"), file=path)
    block = BlockBuilder(path, FORMATS["pixels"].title)
    messages = block.messages
    table = pixel_table(path, messages)
    cameras = read_cameras(Tables(Settings(path, tables={"cameras": options.cameras}), messages))
    for own in cameras.rows:
        block.camera(own.camera, own.size, own.pixel_mm)
    photos, points = table.names("photo"), table.names("point")
    which = np.array(cameras_of(table, [each.name for each in block.cameras]), dtype=np.int64)
    of_photo = np.zeros(len(photos.names), dtype=np.int64)
    of_photo[photos.rows] = which
    check_rows(table, of_photo[photos.rows] != which, phrase("pixels.camera"))
    corner = corner_of(table, options.pixel_origin)
    if options.pixel_origin != "center" and (corner < 0).any() and (corner >= -0.5).all():
        messages.append(Message.of("pixels.origin"))
    xy = by_camera(corner, which, lambda row, own: from_corner(block.cameras[row], block.sizes[row], own))
    keep = table.flags("use")
    if not keep.all():
        messages.append(Message.of("pixels.unused", path, n=int(np.count_nonzero(~keep))))
    sd = _sd(table, options)
    block.photos(photos.names, of_photo)
    block.points(points.names)
    block.images(photos.rows[keep], points.rows[keep], xy[keep], None if sd is None else sd[keep])
    block.lacks.append(Phrase("read.oriented", {"option": Phrase("option.control")}))
    return block.project()


def _sd(table: ColumnTable, options: ReadOptions) -> Floats | None:
    default = options.sd.get("images", (1.0,))[0]
    if not {"sd", "sd_column"} & set(table.columns):
        return None
    common = table.numbers("sd", default)
    found = table.vectors(("sd_column", "sd_row"))
    found = np.where(np.isnan(found), common[:, np.newaxis], found)
    if wrong := np.flatnonzero(~(found > 0).all(axis=1)).tolist():
        positive(table.at(wrong[0]), "the standard deviation", float(found[wrong[0]].min()))
    return found


def write(project: Project) -> Mapping[str, bytes]:
    """Return the table of observations, and the table of cameras."""
    block = project.block
    cameras, which = known_cameras(block)
    owners = [cameras[row].name for row in which]
    photos, names = np.array(block.photo_ids, dtype=object), np.array(owners, dtype=object)
    columns = {
        "photo": photos[block.image_photos],
        "point": np.array(block.point_ids, dtype=object)[block.image_points],
        **columns_of(("column", "row"), to_corner(project)),
        **columns_of(("sd_column", "sd_row"), block.image_sd),
        "camera": names[block.image_photos],
    }
    return {
        FILE: csv_text(columns, ["pixels from the upper-left corner: the middle of the first is 0.5, 0.5"]),
        CAMERAS: csv_text(camera_table(project, cameras)),
    }


def cannot_hold(_: Project) -> list[Phrase]:
    return [phrase("lost.all-but-images")]
