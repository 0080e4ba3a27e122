"""The tables of photos and of images, and scans joined from two parts.

`seam_column` or `seam_row` of a photo is the seam. Readings beyond it, images and marks, belong to a second
photo, `NAME half 2`, which is mounted on the first. Other modules do not process seams.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from photogram.arguments.arrays import repeated_pairs
from photogram.arguments.types import Bools, Floats, Indices
from photogram.formats.images import by_camera, from_tables, in_unit
from photogram.formats.plain.cameras import Cameras
from photogram.formats.plain.schema import ANGLES, AXES, ROTATIONS, SD_AXES, deviation_columns
from photogram.formats.plain.tables import Tables, Transform, check_rows, indices_of, made_of_rows
from photogram.io.column_table import ColumnTable
from photogram.io.numbers import scaled
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.moving_photos import Mount, Timed
from photogram.network.observations import Attitude, Observation, Observations
from photogram.network.unknowns import Sensor
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
    unused: frozenset[str]
    observed: list[Observation | Observations[Any]]

    @cached_property
    def rows(self) -> dict[str, int]:
        """Rows by name."""
        return {name: row for row, name in enumerate(self.names)}


def read_photos(tables: Tables, transform: Transform, cameras: Cameras) -> Photos:
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
    if wrong := np.argwhere(np.isfinite(sd) & np.isnan(centres)).tolist():
        row, axis = wrong[0]
        raise table.cell_error(row, SD_AXES[axis], "plain.sd-alone", value=AXES[axis])
    if "photos" in tables.settings.crs and np.isfinite(sd).any():
        raise table.head.error(phrase("plain.sd-with-crs"))
    centres, _ = transform.positions("photos", centres, None, table)
    matrices = tables.matrices(table)
    attitude_sd, observed = _attitude_weights(tables, table, matrices)
    for row in np.flatnonzero(flown).tolist():
        if np.isfinite([*sd[row], *attitude_sd[row]]).any() or row in observed:
            raise table.error(row, phrase("plain.sd-on-trajectory"))
    names = [each.camera.name for each in cameras.rows]
    which = cameras_of(table, names)
    return Photos(
        table,
        table.texts("photo"),
        which,
        [names[row] for row in which],
        centres,
        matrices,
        sd,
        attitude_sd,
        unused,
        list(made_of_rows(table, Attitude, observed)),
    )


def cameras_of(table: ColumnTable, names: Sequence[str]) -> list[int]:
    """Return the index of the camera of each row; a single camera needs no name."""
    only = names[0] if len(names) == 1 else ""
    if "camera" not in table and not only:
        raise table.head.error(phrase("plain.which-camera", count=len(names)))
    texts, places = table.texts("camera", only), {name: row for row, name in enumerate(names)}
    if wrong := [row for row, name in enumerate(texts) if name not in places]:
        raise table.unknown_error(wrong[0], "camera", "camera", texts[wrong[0]], places)
    return [places[name] for name in texts]


def spread_over_photos(cameras: Cameras, photos: Photos) -> tuple[Cameras, list[int]]:
    """Create separate cameras for photos or groups as in the table."""
    if all(each.for_each == "all" for each in cameras.rows):
        return cameras, photos.cameras
    places: dict[tuple[int, str], int] = {}
    of_photos, groups = [], photos.table.texts("group")
    for row, photo, group in zip(photos.cameras, photos.names, groups, strict=True):
        own = {"all": "", "photo": photo}.get(cameras.rows[row].for_each, group)
        of_photos.append(places.setdefault((row, own), len(places)))
    rows = []
    for row, own in places:
        camera = cameras.rows[row].camera
        camera = camera.replace(name=f"{camera.name}/{own}") if own else camera
        rows.append(cameras.rows[row]._replace(camera=camera))
    return cameras._replace(rows=rows), of_photos


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
    if wrong := np.flatnonzero((sd < 0).any(axis=1)).tolist():
        raise table.error(wrong[0], phrase("plain.negative-angle-sd", value=float(sd[wrong[0]].min())))
    unknown = np.isfinite(sd).any(axis=1) & np.isnan(matrices).any(axis=(1, 2))
    check_rows(table, unknown, phrase("plain.no-angles"))
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


def images_of(tables: Tables, table: ColumnTable, photos: Photos) -> Images:
    """Return the image observations of the table of images, or of a batch."""
    if "camera" in table and "photos" in tables.settings.tables:
        tables.remark("plain.camera-column", table.path)
    xs, ys = ("column", "row") if "column" in table else ("x", "y")
    table.require(xs, ys)
    count = len(photos.names)
    rows = indices_of(table, "photo", photos.rows | dict.fromkeys(photos.unused, count), "photo")
    names = table.names("point")
    xy = table.given((xs, ys))
    again = repeated_pairs(rows, names.rows, len(names.names))
    if again.size:
        second = int(again[0])
        first = int(np.flatnonzero((rows == rows[second]) & (names.rows == names.rows[second]))[0])
        raise table.error(second, phrase("plain.image-twice", record=table.records[first]))
    keep = table.flags("use") & (rows < count) if "use" in table or photos.unused else None
    given = "images" in tables.settings.sd or any(name in table for name in _OF_IMAGES)
    sd = _image_sd(tables, table, given=given)
    whole = Images(given, rows, names.rows, names.names, xy, sd)
    if keep is None:
        return whole
    if left := int(np.count_nonzero(~keep)):
        tables.remark("plain.unused-images", table.path, n=left)
    return replace(_some(whole, keep), left=_some(whole, ~keep & (rows < count)), used=keep)


def _some(images: Images, which: Bools) -> Images:
    """Return selected image observations, and the names of their points only."""
    seen, points = np.unique(images.points[which], return_inverse=True)
    names = [images.point_names[row] for row in seen.tolist()]
    sd = None if images.sd is None else images.sd[which]
    return Images(images.sd_given, images.photos[which], points.reshape(-1), names, images.xy[which], sd)


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
    if wrong := np.flatnonzero(~((found > 0) & np.isfinite(found)).all(axis=1)).tolist():
        raise table.error(wrong[0], phrase("plain.image-sd", value=found[wrong[0]].tolist()))
    return found


@dataclass(frozen=True)
class ImageSource:
    """The table of images of a project, and what its conversion requires."""

    tables: Tables
    photos: Photos
    cameras: Cameras
    of_photos: Indices  # Rows of the cameras of photos
    scanned: Bools  # Whether photos are scanned

    def converted(self, images: Images) -> tuple[Floats, Floats | None]:
        """Return image coordinates and standard deviations of the cameras.

        Line scanners have samples and lines, with standard deviations in the unit of images. Readings of
        scanned films are unchanged.
        """
        settings, cameras = self.tables.settings, self.cameras.rows
        sd = images.sd if images.sd is None or settings.image != "um" else scaled(images.sd, 1e-3)
        pixels = settings.image == "px" and settings.image_y == "down"

        def convert(row: int, xy: Floats) -> Floats:
            if cameras[row].line is not None:
                return in_unit(settings, xy, pixels=True)
            return from_tables(settings, *cameras[row][:2], in_unit(settings, xy, pixels=pixels))

        if len(cameras) == 1 and not self.scanned.any():
            return convert(0, images.xy), sd
        of_films = self.scanned[images.photos]
        found = by_camera(images.xy, np.where(of_films, -1, self.of_photos[images.photos]), convert)
        found[of_films] = scaled(found[of_films], 1e-3 if settings.image == "um" else 1.0)
        return found, sd


_LINES = ("column", "row")


class Seam(NamedTuple):
    half: str  # Photo name of the second half
    line: str  # `column` or `row`, and the coordinate at which the second half begins
    at: float


Seams = Mapping[str, Seam]  # By photo name


def with_seams(tables: Tables) -> tuple[Tables, Seams]:
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
    """Return a table in which readings beyond a seam belong to the second half, which is another photo."""
    if name == "photos":
        return _with_halves(table, seams)
    if name not in ("images", "fiducial_images"):
        return table
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
        if isinstance(own := cells[name], np.ndarray):
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
