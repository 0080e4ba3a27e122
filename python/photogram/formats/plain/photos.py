"""The tables of photos and of images."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.arrays import repeated_pairs
from photogram.arguments.types import Bools, Floats, Indices
from photogram.formats.images import from_tables, in_unit
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.schema import ANGLES, AXES, ROTATIONS, SD_AXES, deviation_columns
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import Tables, Transform, indices_of, made_of_rows
from photogram.io.column_table import ColumnTable
from photogram.io.numbers import scaled
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.observations import Attitude, Observation, Observations
from photogram.words import phrase

_OF_IMAGES = ("sd", "sd_column", "sd_row", "sd_x", "sd_y")


@dataclass(frozen=True)
class Photos:
    """The used rows of the table of photos in the project frame, and the names of unused photos."""

    table: ColumnTable
    names: list[str]
    cameras: list[int]
    taken: list[str]
    centres: Floats
    matrices: Floats
    position_sd: Floats
    attitude_sd: Floats
    groups: list[str]
    times: Floats
    unused: frozenset[str]
    observed: list[Observation | Observations[Any]]


def read_photos(tables: Tables, transform: Transform, cameras: Cameras) -> Photos:
    """Read the table of photos; raises the errors of :func:`read`."""
    table = tables.read("photos")
    assert table is not None  # The table of images names photos, too
    everything, use = table.names_once("photo"), table.flags("use")
    unused = frozenset(name for name, used in zip(everything, use.tolist(), strict=True) if not used)
    if unused:
        table = table.some(np.flatnonzero(use).tolist())
        tables.remark("plain.unused-photos", table.path, n=len(unused))
    centres = table.vectors(AXES)
    flown = np.array([bool(each) for each in table.texts("trajectory")], dtype=bool)
    sd = tables.deviations(table, "photos", SD_AXES, math.inf)
    sd[flown] = table.vectors(SD_AXES, math.inf, infinite=True)[flown]
    weighted = np.isfinite(sd) & np.isnan(centres)
    if weighted.any():
        row, axis = np.argwhere(weighted)[0].tolist()
        raise table.cell_error(row, f"sd_{AXES[axis]}", "plain.sd-alone", value=AXES[axis])
    if "photos" in tables.settings.crs and np.isfinite(sd).any():
        raise table.head.error(phrase("plain.sd-with-crs"))
    centres, _ = transform.positions("photos", centres, None, table)
    matrices = tables.matrices(table)
    attitude_sd, observed = _attitude_weights(tables, table, matrices)
    for row in np.flatnonzero(flown).tolist():
        if np.isfinite([*sd[row], *attitude_sd[row]]).any() or row in observed:
            raise table.error(row, phrase("plain.sd-on-trajectory"))
    which = cameras_of(table, [each.name for each in cameras.cameras])
    return Photos(
        table,
        table.texts("photo"),
        which,
        [cameras.cameras[row].name for row in which],
        centres,
        matrices,
        sd,
        attitude_sd,
        table.texts("group"),
        table.numbers("time"),
        unused,
        list(made_of_rows(table, Attitude, observed)),
    )


def cameras_of(table: ColumnTable, names: Sequence[str]) -> list[int]:
    """Return the index of the camera of each row; a single camera needs no name."""
    only = names[0] if len(names) == 1 else ""
    if "camera" not in table and not only:
        raise table.head.error(phrase("plain.which-camera", count=len(names)))
    places = {name: row for row, name in enumerate(names)}
    texts = table.texts("camera", only)
    if (row := next((row for row, name in enumerate(texts) if name not in places), None)) is not None:
        raise table.unknown_error(row, "camera", "camera", texts[row], places)
    return [places[name] for name in texts]


def _attitude_weights(
    tables: Tables, table: ColumnTable, matrices: Floats
) -> tuple[Floats, dict[int, dict[str, Any]]]:
    """Return attitude standard deviations, and arguments of other attitude observations by row."""
    settings = tables.settings
    own, steps = deviation_columns(ANGLES[settings.attitude]), deviation_columns(ROTATIONS)
    free = np.full((table.count, 3), np.inf)
    columns = steps if any(each in table for each in steps) else own
    if not any(each in table for each in columns):
        return free, {}
    sd = tables.angles(table, columns, math.inf, infinite=True)
    if (sd < 0).any():
        row = int(np.argwhere(sd < 0)[0][0])
        raise table.error(row, phrase("plain.negative-angle-sd", value=float(sd[row].min())))
    unknown = np.isfinite(sd).any(axis=1) & np.isnan(matrices).any(axis=(1, 2))
    if unknown.any():
        raise table.error(int(np.flatnonzero(unknown)[0]), phrase("plain.no-angles"))
    plain = settings.attitude == "omega_phi_kappa" and settings.photo == "y_up"
    if plain and columns is own:
        return sd, {}
    observed: dict[int, dict[str, Any]] = {}
    fixed = free.copy()
    names = table.texts("photo")
    for row in np.flatnonzero(np.isfinite(sd).any(axis=1)).tolist():
        if not sd[row].any():
            fixed[row] = 0.0
        elif columns is steps and np.isfinite(sd[row]).all():
            observed[row] = {"photo": names[row], "attitude": matrices[row], "sd": sd[row]}
        else:
            fields = {"attitude": settings.attitude, "columns": list(steps)}
            raise table.error(row, phrase("plain.attitude-sd", **fields))
    return fixed, observed


@dataclass(frozen=True)
class Images:
    """The table of images; `left` are the omitted observations of existing photos.

    `sd_given` is True if the table or the settings contain standard deviations; levels are ratios. `used` are
    the rows of the table without omitted observations; None: all.
    """

    sd_given: bool
    photos: Indices
    points: Indices
    point_names: list[str]
    xy: Floats
    sd: Floats | None
    left: Images | None = None
    used: Bools | None = None


def read_images(tables: Tables, photos: Photos) -> Images:
    """Read the table of images; raises the errors of :func:`read`."""
    table = tables.read("images")
    assert table is not None
    return images_of(tables, table, photos)


def images_of(tables: Tables, table: ColumnTable, photos: Photos) -> Images:
    """Return the image observations of the table of images, or of a batch."""
    if "camera" in table and "photos" in tables.settings.tables:
        tables.remark("plain.camera-column", table.path)
    xs, ys = ("column", "row") if "column" in table else ("x", "y")
    table.require(xs, ys)
    places = {name: row for row, name in enumerate(photos.names)}
    rows = indices_of(table, "photo", places | dict.fromkeys(photos.unused, len(places)), "photo")
    names = table.names("point")
    xy = table.given((xs, ys))
    again = repeated_pairs(rows, names.rows, len(names.names))
    if again.size:
        second = int(again[0])
        first = int(np.flatnonzero((rows == rows[second]) & (names.rows == names.rows[second]))[0])
        raise table.error(second, phrase("plain.image-twice", record=table.records[first]))
    keep = table.flags("use") & (rows < len(places)) if "use" in table or photos.unused else None
    given = "images" in tables.settings.sd or any(name in table for name in _OF_IMAGES)
    sd = _image_sd(tables, table, given=given)
    whole = Images(given, rows, names.rows, names.names, xy, sd)
    if keep is None:
        return whole
    if left := int(np.count_nonzero(~keep)):
        tables.remark("plain.unused-images", table.path, n=left)
    return replace(_some(whole, keep), left=_some(whole, ~keep & (rows < len(places))), used=keep)


def _some(images: Images, which: Bools) -> Images:
    """Return selected image observations, and the names of their points only."""
    seen, points = np.unique(images.points[which], return_inverse=True)
    return Images(
        images.sd_given,
        images.photos[which],
        points.reshape(-1),
        [images.point_names[row] for row in seen.tolist()],
        images.xy[which],
        None if images.sd is None else images.sd[which],
    )


def _image_sd(tables: Tables, table: ColumnTable, *, given: bool) -> Floats | None:
    pairs = (_OF_IMAGES[1:3], _OF_IMAGES[3:])
    own = [name for pair in pairs if pair[0] in table or pair[1] in table for name in pair]
    if "correlation" in table and table.numbers("correlation", 0.0).any():
        raise table.head.error(phrase("plain.correlation"))
    if given:
        found = tables.deviations(table, "images", own[:2] or ["sd_x", "sd_y"])
    elif "level" in table:
        found = np.ones((table.count, 2))
    else:
        return None
    if "level" in table and not own and "sd" not in table:
        found = found * 2.0 ** table.numbers("level", 0.0)[:, np.newaxis]
    bad = np.argwhere(~((found > 0) & np.isfinite(found)))
    if len(bad):
        row = int(bad[0][0])
        raise table.error(row, phrase("plain.image-sd", value=found[row].tolist()))
    return found


def image_coordinates(
    settings: Settings, images: Images, cameras: Cameras, photo_cameras: Indices, scanned: Bools
) -> tuple[Floats, Floats | None]:
    """Return image coordinates and standard deviations of the cameras.

    Line scanners have samples and lines, with standard deviations in the unit of images. Readings of scanned
    films are unchanged.
    """
    sd = images.sd if images.sd is None or settings.image != "um" else scaled(images.sd, 1e-3)
    pixels = settings.image == "px" and settings.image_y == "down"
    plain = in_unit(settings, images.xy, pixels=pixels)

    def converted(row: int, measured: Floats, own: Floats) -> Floats:
        if cameras.lines[row] is not None:
            return in_unit(settings, measured, pixels=True)
        return from_tables(settings, cameras.cameras[row], cameras.sizes[row], own)

    if len(cameras.cameras) == 1 and not scanned.any():
        return converted(0, images.xy, plain), sd
    found = plain.copy()
    of_images = photo_cameras[images.photos]
    for row in range(len(cameras.cameras)):
        own = of_images == row
        found[own] = converted(row, images.xy[own], plain[own])
    own = scanned[images.photos]
    found[own] = scaled(images.xy[own], 1e-3 if settings.image == "um" else 1.0)
    return found, sd
