"""The table of images."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.formats.images import from_tables, in_unit
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.photos import Photos
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import Tables, indices_of
from photogram.io.delimited import ColumnTable
from photogram.lazy_dataclasses import dataclass, replace

_SD = ("sd", "sd_column", "sd_row", "sd_x", "sd_y")


@dataclass(frozen=True)
class Images:
    """The table of images, as it is written; `left` are those that it leaves out of photos there are."""

    table: ColumnTable
    photos: Indices
    points: Indices
    point_names: list[str]
    xy: Floats
    sd: Floats | None
    left: Images | None = None


def read_images(tables: Tables, photos: Photos) -> Images:
    """Read the table of images; errors as of :func:`read`."""
    table = tables.read("images")
    assert table is not None
    xs, ys = ("column", "row") if "column" in table else ("x", "y")
    table.require(xs, ys)
    places = {name: row for row, name in enumerate(photos.names)}
    rows = indices_of(table, "photo", places | dict.fromkeys(photos.unused, len(places)), "photo")
    names = table.names("point")
    xy = table.given((xs, ys))
    _check_twice(table, rows, names.rows, len(names.names))
    keep = table.flags("use") & (rows < len(places)) if "use" in table or photos.unused else None
    sd = _image_sd(tables, table)
    if keep is None:
        return Images(table, rows, names.rows, names.names, xy, sd)
    left = int(np.count_nonzero(~keep))
    if left:
        tables.tell(f"{left} images are not used", table.path)
    whole = Images(table, rows, names.rows, names.names, xy, sd)
    return replace(_some(whole, keep), left=_some(whole, ~keep & (rows < len(places))))


def _some(images: Images, which: Bools) -> Images:
    """Return some images, and the names of their points alone."""
    seen, points = np.unique(images.points[which], return_inverse=True)
    return Images(
        images.table,
        images.photos[which],
        points.reshape(-1),
        [images.point_names[row] for row in seen.tolist()],
        images.xy[which],
        None if images.sd is None else images.sd[which],
    )


def _check_twice(table: ColumnTable, photos: Indices, points: Indices, count: int) -> None:
    pairs = photos * count + points
    if (np.diff(pairs) > 0).all():
        return
    order = np.argsort(pairs, kind="stable")
    again = np.flatnonzero(np.diff(pairs[order]) == 0)
    if again.size:
        first, second = sorted(order[again[0] : again[0] + 2].tolist())
        raise table.error(
            second, f"the point has an image on this photo already, in record {table.records[first]}"
        )


def _image_sd(tables: Tables, table: ColumnTable) -> Floats | None:
    pairs = (_SD[1:3], _SD[3:])
    own = [name for pair in pairs if pair[0] in table or pair[1] in table for name in pair]
    if "correlation" in table and table.numbers("correlation", 0.0).any():
        raise table.head.error("column correlation: images with correlated coordinates cannot be adjusted")
    found = np.ones((table.count, 2))
    if sd_is_given(tables, table):
        found = tables.deviations(table, "images", own[:2] or ["sd_x", "sd_y"])
    elif "level" not in table:
        return None
    if "level" in table and not own and "sd" not in table:
        found = found * 2.0 ** table.numbers("level", 0.0)[:, np.newaxis]
    bad = np.argwhere(~((found > 0) & np.isfinite(found)))
    if len(bad):
        row = int(bad[0][0])
        why = "is empty" if np.isnan(found[row]).any() else f"{found[row].min():g} is not positive and finite"
        raise table.error(row, f"standard deviation {why}")
    return found


def sd_is_given(tables: Tables, table: ColumnTable) -> bool:
    """Return whether standard deviations of images are given, in the table or for all; levels are ratios."""
    return "images" in tables.settings.sd or any(name in table for name in _SD)


def image_coordinates(
    settings: Settings, images: Images, cameras: Cameras, photo_cameras: Indices, scanned: Bools
) -> tuple[Floats, Floats | None]:
    """Return image coordinates and standard deviations in the unit and along the axes of the cameras.

    Those of line scanners are samples and lines, whatever the unit of images: their deviations are in this.
    Those of scanned films are readings, as they are.
    """
    sd = images.sd if images.sd is None or settings.image != "um" else images.sd * 1e-3
    pixels = settings.image == "px" and settings.image_y == "down"
    found = in_unit(settings, images.xy, pixels=pixels).copy()
    of_images = photo_cameras[images.photos]
    for row, camera in enumerate(cameras.cameras):
        own = of_images == row
        if cameras.lines[row] is not None:
            found[own] = in_unit(settings, images.xy[own], pixels=True)
        else:
            found[own] = from_tables(settings, camera, cameras.sizes[row], found[own])
    own = scanned[images.photos]
    found[own] = images.xy[own] * (1e-3 if settings.image == "um" else 1.0)
    return found, sd
