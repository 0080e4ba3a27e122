"""Contents of PhotoModeler and DBAT files, their tables, and their conversion to a project.

Pixels count from the upper-left corner, columns to the right and rows down. Cameras are backward in
millimetres, y up: (column h - px, py - row h) plus the distortion terms is -c u/w. A project counts from the
image centre, in square pixels of the height of a row. An affinity contains the difference along columns.
Tables have commas, `#` comments, and columns by comment or script.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from pathlib import Path

import numpy as np

from photogram.adjustment.options import AdjustOptions
from photogram.arguments.types import Floats
from photogram.formats.builder import BlockBuilder
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import NAMELESS, read_columns, read_rows
from photogram.io.numbers import whole_number
from photogram.io.places import Failing, at_place, one_word, positive
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera
from photogram.words import Phrase, option_sd, phrase


def sensor_of(
    name: str,
    size: Size,
    sides: tuple[float, float],
    principal: tuple[float, float, float],
    terms: dict[str, float],
    skew: float = 0.0,
) -> tuple[Camera, Size, float]:
    """Return a camera from parameters of PhotoModeler and DBAT in millimetres, with size and side of pixels.

    `sides` are width and height of a pixel; `principal` is c, and the principal point from the upper-left
    corner, to the right and down; `terms` are K1, K2, K3, P1, P2.
    """
    across, down = sides
    c, px, py = principal
    affinity = across / down - 1
    width, height = size
    parameters = {
        "c": -c,
        "xp": px / (1 + affinity) - width / 2 * down,
        "yp": height / 2 * down - py,
        "b1": affinity,
        "b2": skew,
        **terms,
    }
    return Camera("brown", parameters, name=name), size, down


class DbatBuilder(BlockBuilder):
    """A block of the files; keys of photos and points are numbers."""

    def __init__(self, path: Path, title: str) -> None:
        super().__init__(path, title)
        self.paths: list[str] = []  # Files of photos

        # Photos with fixed poses, and free parameters of cameras
        self.held: set[int] = set()
        self.free: set[str] = set()
        self.options = AdjustOptions()

    def numbered_photo(self, number: int, path: str, camera: Hashable, place: Failing) -> None:
        """Add a photo with its file."""
        self.photo(number, camera, place)
        self.paths.append(path)

    def dbat_project(self, options: ReadOptions) -> Project:
        """Return the project; user-defined standard deviations are in pixels."""
        if not self.image_keys:
            raise self.place.error(phrase("format.missing", what="image observations"))
        photos, points, pixels = self.image_rows()
        cameras = np.array(self.photo_cameras)[photos]
        side = np.array(self.pixel_mm, dtype=float)[cameras, np.newaxis]
        sd = side * np.broadcast_to(options.sd.get("images", np.array(self.image_sd)), pixels.shape)
        if (missing := np.isnan(sd)).any():
            sd = np.where(missing, side, sd)
            fields = {"number": 1.0, "unit": "pixel", "option": option_sd("images")}
            self.lacks.append(Phrase("read.images", fields))
        # Millimetres from the image centre, y up
        middles = np.array(self.sizes)[cameras] / 2
        xy = (pixels - middles) * side * [1, -1]
        self.images(photos, points, xy, sd)
        held = [[0.0 if number in self.held else np.inf] * 3 for number in self.photo_rows]
        self.position_sd = self.attitude_sd = held
        if self.free:
            self.cameras = [each.replace(sd=dict.fromkeys(self.free, np.inf)) for each in self.cameras]
        self.photo_ids = self._names()
        return self.project(options=self.options).replace(sd_taken=True)

    def _names(self) -> list[str]:
        """Return unique names of photos: file names, with folders if necessary."""
        whole = [name.replace("\\", "/").strip() for name in self.paths]
        short = [name.rpartition("/")[2] for name in whole]
        for names in (short, whole):
            if all(names) and len(set(names)) == len(names):
                return names
        self.messages.append(Message(phrase("dbat.names", names=sorted(set(short)))))
        return self.photo_ids


_KNOWN = {
    "object point id": "id",
    "photo #": "im",
    "image": "im",
    "photo": "im",
    "frame": "im",
    "point": "id",
    "name": "label",
    "camera": "cam",
    "sigmax": "sx",
    "sigmay": "sy",
    "sigmaz": "sz",
}
_COLUMNS = ("id", "im", "cam", "path", "label", "x", "y", "z", "omega", "phi", "kappa")
_DEVIATIONS = ("sx", "sy", "sz", "sxy", "sxyz")
_NUMBERS = frozenset({"x", "y", "z", "omega", "phi", "kappa", *_DEVIATIONS})
_RADIANS = {"degrees": math.pi / 180, "deg": math.pi / 180, "radians": 1.0, "rad": 1.0, "gon": math.pi / 200}


def _spelled(columns: Sequence[str]) -> list[str]:
    own = [column.partition("(")[0].strip() for column in columns]
    return [_KNOWN.get(column, column) for column in own]


def titled(path: Path) -> ColumnTable:
    """Read a table with a header in a comment, `# id, image, x, y`."""
    table = read_columns(path, known=(*_COLUMNS, *_DEVIATIONS), numbers=_NUMBERS, spelling=_spelled)
    return table.renamed({NAMELESS: "id"}) if NAMELESS in table and "id" not in table else table


def untitled(path: Path, columns: Sequence[str]) -> ColumnTable:
    """Read a table whose columns are defined by a script."""
    return read_rows(path, _spelled([column.strip().lower() for column in columns]), numbers=_NUMBERS)


def whole_numbers(table: ColumnTable, column: str) -> list[int]:
    """Return a column of integers."""
    found, known = [], dict[str, int]()
    for row, text in enumerate(table.texts(column)):
        if text not in known:
            with at_place(table.at(row), column):
                known[text] = whole_number(text, highest=2**53)
        found.append(known[text])
    return found


def take_photos(table: ColumnTable, content: DbatBuilder) -> None:
    """Add photos: numbers, paths and cameras; without camera column the only camera."""
    table.require("id", "path")
    known = list(map(str, content.camera_rows))
    if "cam" not in table and len(known) > 1:
        raise table.head.error(phrase("format.camera-column", n=len(known)))
    cameras = table.texts("cam", known[0] if len(known) == 1 else "")
    rows = zip(whole_numbers(table, "id"), table.texts("path"), cameras, strict=True)
    for row, (number, path, camera) in enumerate(rows):
        content.numbered_photo(number, path, camera, table.at(row))


def take_poses(table: ColumnTable, content: DbatBuilder, unit: str = "degrees") -> None:
    """Add centres and angles omega, phi, kappa."""
    one_word(table.head, "unit of angles", unit, _RADIANS)
    table.require("id", "x", "y", "z", "omega", "phi", "kappa")
    angles = table.given(("omega", "phi", "kappa")) * _RADIANS[unit]
    matrices = Attitudes.of("omega_phi_kappa", angles).matrices
    poses = zip(whole_numbers(table, "id"), table.given(("x", "y", "z")), matrices, strict=True)
    for row, (number, centre, matrix) in enumerate(poses):
        if number not in content.photo_rows:
            raise table.error(row, phrase("format.undefined", what="photo", name=str(number)))
        content.pose(number, centre, matrix, table.at(row))


def take_points(
    table: ColumnTable,
    content: DbatBuilder,
    sd: Sequence[float] | None,
    *,
    check: bool = False,
    wanted: Callable[[int], bool] = lambda _: True,
) -> None:
    """Add control or check points; `sd` replaces their standard deviations."""
    table.require("id", "x", "y", "z")
    numbers, positions = whole_numbers(table, "id"), table.given(("x", "y", "z"))
    deviations = _deviations(table, ("sx", "sy", "sz"), "sxyz")
    if sd is not None:
        deviations = np.broadcast_to(sd, deviations.shape)
    elif np.isnan(deviations).all() and not check:
        fields = {"file": table.path.name, "option": option_sd("control")}
        content.lacks.append(Phrase("read.held", fields))
    for row, number in enumerate(numbers):
        if wanted(number):
            if check:
                content.check(number, positions[row], deviations[row], table.at(row))
            else:
                content.control(number, positions[row], np.nan_to_num(deviations[row]), table.at(row))


def _deviations(table: ColumnTable, columns: Sequence[str], common: str) -> Floats:
    """Return (rows, k) standard deviations; NaN without."""
    whole = table.numbers(common) if common in table else np.full(table.count, math.nan)
    flat = table.numbers("sxy") if "sxy" in table else whole
    defaults = (flat, flat, whole)
    own = [table.numbers(column) for column in columns]
    found = np.column_stack(
        [np.where(np.isnan(each), default, each) for each, default in zip(own, defaults, strict=False)]
    )
    if (found < 0).any():
        raise table.error(int(np.argwhere(found < 0)[0][0]), phrase("format.negative"))
    return found


def take_images(table: ColumnTable, content: DbatBuilder, sd: float = math.nan) -> None:
    """Add observations; `sd` is their default standard deviation, pixels."""
    table.require("id", "im", "x", "y")
    own = _deviations(table, ("sx", "sy"), "sxy")
    own = np.where(np.isnan(own), sd, own)
    for row in np.argwhere(own == 0)[:, 0].tolist():
        positive(table.at(row), "the standard deviation", 0)
    photos, points = whole_numbers(table, "im"), whole_numbers(table, "id")
    rows = zip(photos, points, table.given(("x", "y")).tolist(), own, strict=True)
    for row, (photo, point, (x, y), deviations) in enumerate(rows):
        content.image(photo, point, x, y, table.at(row), sd=deviations)
