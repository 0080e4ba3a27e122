"""Cameras of moving photos: rolling shutters, and line sensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.images import from_tables, in_unit, to_tables
from photogram.formats.plain.tables import Tables, columns_of_records, made
from photogram.formats.project import Size
from photogram.io.column_table import ColumnTable
from photogram.io.numbers import scaled
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.moving_photos import Direction, LineSensor, Shutter
from photogram.network.trajectories import Readout
from photogram.words import phrase

LINE = "line"  # The model of a line sensor with the lens `brown`
OF_LINES = ("x0", "y0", "s0")  # Columns of a line sensor that some models have as parameters
Exposure = Shutter | LineSensor | None


def line_sensors(tables: Tables, table: ColumnTable) -> list[LineSensor | None]:
    """Return the line sensor of each row of a camera table; None for frame cameras."""
    unit = 1e-3 if tables.settings.image == "um" else 1.0
    pitches = scaled(table.vectors(("pitch_x", "pitch_y")), unit)
    places = scaled(table.vectors(("x0", "y0"), 0.0), unit)
    middles = table.numbers("s0")
    middles = np.where(np.isnan(middles), table.numbers("width") / 2, middles)
    found: list[LineSensor | None] = []
    for row, model in enumerate(table.texts("model")):
        pitch = np.nan_to_num(pitches[row])
        if np.isnan(pitches[row]).all():
            if model.lower() == LINE:
                raise table.cell_error(row, "pitch_x", "error.empty")
            found.append(None)
            continue
        if not pitch.any():
            raise table.cell_error(row, "pitch_x, pitch_y", "plain.pitch")
        if math.isnan(middles[row]):
            raise table.cell_error(row, "s0", "plain.s0")
        x0, y0 = places[row].tolist()
        found.append(LineSensor((float(pitch[0]), float(pitch[1])), float(middles[row]), x0, y0))
    return found


def shutters(
    tables: Tables, table: ColumnTable, cameras: Sequence[Camera], sizes: Sequence[Size | None]
) -> list[Shutter | None]:
    """Return the rolling shutter of each row of a camera table; None without."""
    directions = tables.words("cameras", "readout_direction")
    edges = _edges(tables, table, cameras, sizes, directions)
    values, deviations = table.numbers("readout"), table.numbers("sd_readout", 0.0, infinite=True)
    found: list[Shutter | None] = []
    for row, (word, name) in enumerate(
        zip(table.texts("readout_direction"), table.texts("shutter"), strict=True)
    ):
        if math.isnan(values[row]):
            if word or name or deviations[row]:
                raise table.cell_error(row, "readout", "error.empty")
            found.append(None)
            continue
        if np.isnan(edges[row]).any():
            raise table.error(row, phrase("plain.picture-edges"))
        title, value, sd = name or cameras[row].name, float(values[row]), float(deviations[row])
        readout = tables.shared.one(table, row, "shutter", Readout, title, value=value, sd=sd)
        found.append(made(table, row, Shutter, readout, tuple(edges[row].tolist()), directions[row]))
    return found


def _edges(
    tables: Tables,
    table: ColumnTable,
    cameras: Sequence[Camera],
    sizes: Sequence[Size | None],
    directions: Sequence[Direction],
) -> Floats:
    """Return (rows, 2) readout limits in camera coordinates; NaN if unknown."""
    settings = tables.settings
    pixels = settings.image == "px"
    given = table.vectors(("readout_begin", "readout_end"))
    given = in_unit(settings, given, pixels=pixels and settings.image_y == "down")
    extents = table.vectors(("width", "height"))
    if not pixels:
        extents *= table.numbers("pixel_mm")[:, np.newaxis]
    found = np.full((table.count, 2), np.nan)
    for row, (camera, direction) in enumerate(zip(cameras, directions, strict=True)):
        if np.isnan(given[row]).all():
            found[row] = picture_edges(camera, direction, extents[row])
            continue
        there = np.column_stack([given[row], given[row]])
        placed = made(table, row, from_tables, settings, camera, sizes[row], there)
        found[row] = placed[:, _counted(direction)]
    return found


def _counted(direction: str) -> int:
    """Return the index of the image coordinate along the readout direction."""
    return 1 if direction in ("down", "up") else 0


def picture_edges(camera: Camera, direction: str, extent: Floats) -> Floats:
    """Return (2,) first and last image coordinate of an image along a direction.

    `extent` is (2,) width and height in the unit of the camera; NaN if unknown. Pixels that count down begin
    at the corner, all others at the centre.
    """
    axis = _counted(direction)
    length = float(extent[axis])
    if camera.unit == "px" and camera.image_y == "down":
        edges = [0.0, length]
    else:
        edges = [-length / 2, length / 2]
        if axis == 1 and camera.image_y == "up":
            edges.reverse()
    return np.array(edges[::-1] if direction in ("up", "left") else edges)


def of_cameras(block: Block, cameras: Sequence[Camera], which: Sequence[int]) -> list[Exposure]:
    """Return the shutter or line sensor of each camera of a block; None without."""
    of_photos = {each.photo: each for each in block.timed}
    found: dict[int, Exposure] = {}
    for photo, row in zip(block.photo_ids, which, strict=True):
        timed = of_photos.get(photo)
        own = None if timed is None else timed.shutter if timed.line_sensor is None else timed.line_sensor
        if found.setdefault(row, own) != own:
            raise InputError(phrase("plain.several-exposures", camera=cameras[row].title))
    return [found.get(row) for row in range(len(cameras))]


def exposure_columns(
    cameras: Sequence[Camera],
    exposures: Sequence[Exposure],
    sizes: Sequence[Size | None],
    pixel_mm: Sequence[float | None],
    image_y: str,
) -> dict[str, Any]:
    """Return the columns of shutters and line sensors of a camera table."""
    rows = list[dict[str, Any]]()
    for camera, own, size, pixel in zip(cameras, exposures, sizes, pixel_mm, strict=True):
        cells = dict[str, Any]()
        if isinstance(own, LineSensor):
            if not own.is_straight:
                raise InputError(phrase("plain.bent-line", camera=camera.title))
            cells = {name: float(getattr(own, name)) for name in OF_LINES}
            cells |= zip(("pitch_x", "pitch_y"), map(float, own.pitch), strict=True)
        elif own is not None and isinstance(readout := own.readout, Readout):
            cells = {"readout": readout.value, "sd_readout": float(readout.deviations[0])}
            cells |= {"readout_direction": own.direction}
            if edges := _edges_written(own, camera, size, pixel, image_y):
                cells |= zip(("readout_begin", "readout_end"), edges, strict=True)
            cells["shutter"] = readout.name
        rows.append(cells)
    if all(
        each.get("shutter", camera.name) == camera.name for each, camera in zip(rows, cameras, strict=True)
    ):
        rows = [{name: cell for name, cell in each.items() if name != "shutter"} for each in rows]
    return columns_of_records(rows)


def _edges_written(
    shutter: Shutter, camera: Camera, size: Size | None, pixel_mm: float | None, image_y: str
) -> tuple[float, float] | None:
    """Return readout limits of a table; None if size and direction suffice."""
    if size is not None:
        unit = 1.0 if camera.unit == "px" else pixel_mm or math.nan
        usual = picture_edges(camera, shutter.direction, np.array(size) * unit)
        if tuple(usual.tolist()) == tuple(shutter.edges):
            return None
    own = np.array(shutter.edges, dtype=float)
    there = to_tables(image_y, camera, size, np.column_stack([own, own]))[:, _counted(shutter.direction)]
    return float(there[0]), float(there[1])
