"""Exports of PhotoModeler, tables of DBAT, and the conversion of their contents to a project.

Pixels count from the upper-left corner, columns to the right and rows down. Cameras are backward in
millimetres, y up: (column h - px, py - row h) plus the distortion terms is -c u/w. A project counts from the
image centre, in square pixels of the height of a row. An affinity contains the difference along columns.
Tables have commas, `#` comments, and columns by comment or script.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from itertools import takewhile
from pathlib import Path

import numpy as np

from photogram.adjustment.options import AdjustOptions
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.cards import Card
from photogram.formats.plain.tables import check_rows
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import NAMELESS, read_columns, read_rows
from photogram.io.files import read_beginning, read_lines
from photogram.io.places import Failing, Place, at_place, image_size, one_word, positive
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
        self.position_sd = [[0.0 if number in self.held else np.inf] * 3 for number in self.photo_rows]
        self.attitude_sd = self.position_sd
        if self.free:
            self.cameras = [each.replace(sd=dict.fromkeys(self.free, np.inf)) for each in self.cameras]
        # Unique names: file names, with folders if necessary
        whole = [name.replace("\\", "/").strip() for name in self.paths]
        short = [name.rpartition("/")[2] for name in whole]
        unique = (names for names in (short, whole) if all(names) and len(set(names)) == len(names))
        if names := next(unique, None):
            self.photo_ids = names
        else:
            self.messages.append(Message(phrase("dbat.names", names=sorted(set(short)))))
        return self.project(options=self.options).replace(sd_taken=True)


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


def take_photos(table: ColumnTable, content: DbatBuilder) -> None:
    """Add photos: numbers, paths and cameras; without camera column the only camera."""
    table.require("id", "path")
    known = list(map(str, content.camera_rows))
    if "cam" not in table and len(known) > 1:
        raise table.head.error(phrase("format.camera-column", n=len(known)))
    cameras = table.texts("cam", known[0] if len(known) == 1 else "")
    rows = zip(table.wholes("id").tolist(), table.texts("path"), cameras, strict=True)
    for row, (number, path, camera) in enumerate(rows):
        content.numbered_photo(number, path, camera, table.at(row))


def take_poses(table: ColumnTable, content: DbatBuilder, unit: str = "degrees") -> None:
    one_word(table.head, "unit of angles", unit, _RADIANS)
    table.require("id", "x", "y", "z", "omega", "phi", "kappa")
    angles = table.given(("omega", "phi", "kappa")) * _RADIANS[unit]
    matrices = Attitudes.of("omega_phi_kappa", angles).matrices
    poses = zip(table.wholes("id").tolist(), table.given(("x", "y", "z")), matrices, strict=True)
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
    numbers, positions = table.wholes("id").tolist(), table.given(("x", "y", "z"))
    deviations = _deviations(table, ("sx", "sy", "sz"), "sxyz")
    if sd is not None:
        deviations = np.broadcast_to(sd, deviations.shape)
    elif np.isnan(deviations).all() and not check:
        fields = {"file": table.path.name, "option": option_sd("control")}
        content.lacks.append(Phrase("read.held", fields))
    for row, number in enumerate(numbers):
        if wanted(number):
            own = deviations[row] if check else np.nan_to_num(deviations[row])
            content.control(number, positions[row], own, table.at(row), check=check)


def _deviations(table: ColumnTable, columns: Sequence[str], common: str) -> Floats:
    """Return (rows, k) standard deviations; NaN without."""
    whole, given = table.numbers(common), table.vectors(columns)
    flat = table.numbers("sxy") if "sxy" in table else whole
    defaults = np.column_stack((flat, flat, whole))[:, : len(columns)]
    found = np.where(np.isnan(given), defaults, given)
    check_rows(table, (found < 0).any(axis=1), phrase("format.negative"))
    return found


def take_images(table: ColumnTable, content: DbatBuilder, sd: float = math.nan) -> None:
    """Add observations; `sd` is their default standard deviation, pixels."""
    table.require("id", "im", "x", "y")
    own = _deviations(table, ("sx", "sy"), "sxy")
    own = np.where(np.isnan(own), sd, own)
    for row in np.argwhere(own == 0)[:, 0].tolist():
        positive(table.at(row), "the standard deviation", 0)
    photos, points, xy = table.wholes("im").tolist(), table.wholes("id").tolist(), table.given(("x", "y"))
    for row, (photo, point, (x, y)) in enumerate(zip(photos, points, xy.tolist(), strict=True)):
        content.image(photo, point, x, y, table.at(row), sd=own[row])


TITLE = "PhotoModeler export"
_HEAD = (2, 9, 10, 10)  # Minimum number of values in lines 2 to 5
_PHOTO = ("centre and angles", "standard deviations", "covariances", "camera", "standard deviations of it")
_CAMERA = "c px py width height K1 K2 K3 P1 P2"


def is_export(path: Path) -> bool:
    """Return whether a file begins as an export: a title, and four lines of numbers."""
    try:
        lines = read_beginning(path).splitlines()
    except InputError:
        return False
    if len(lines) < 5 or "," in "".join(lines[1:5]):
        return False
    try:
        counts = [len([float(word) for word in line.split()]) for line in lines[1:5]]
    except ValueError:
        return False
    return counts[0] in (2, 4) and all(n >= least for n, least in zip(counts, _HEAD, strict=True))


def read_export(path: Path, options: ReadOptions) -> DbatBuilder:
    """Read an export file, `NAME-pmexport.txt`.

    Lines 1 to 5 are a title; tolerance, iterations and image size; nine standard deviations; the camera
    `c px py width height K1 K2 K3 P1 P2` in mm, and its standard deviations. Then six lines for each photo,
    control, points and observations follow, with an empty line after each list. Later lines are not read.
    """
    cards = [Card(Place(path, record, line)) for record, line in enumerate(read_lines(path), 1)]
    lines, content = iter(cards), DbatBuilder(path, TITLE)

    def take(what: str) -> Card:
        if (card := next(lines, None)) is None:
            raise InputError(phrase("format.end", name=what), file=path, record=len(cards))
        return card

    def until_empty() -> Iterator[Card]:
        return takewhile(lambda card: bool(card.words), lines)

    take("the title")
    card = take("tolerance and iterations")
    if len(card.words) < 4:
        raise card.place.error(phrase("dbat.size"))
    size = image_size(card.place, _number(card, 2), _number(card, 3))
    take("nine standard deviations")
    default = take("the camera")
    take("standard deviations of the camera")
    common = default, _sensor(default, 0, "camera", size)
    for head in until_empty():
        number = _number(head, 0)
        if number in content.photo_rows:
            raise head.place.error(phrase("format.repeated", what="photo", name=str(number)))
        pose, _, _, camera, _ = (take(f"the {what} of photo {number}") for what in _PHOTO)
        for card in (pose, camera):
            if _number(card, 0) != number:
                raise card.place.error(phrase("dbat.photo", number=number, other=card.words[0]))
        file = (head.place.text or "").split(None, 1)[1] if len(head.words) > 1 else ""
        content.numbered_photo(number, file, _camera_of(camera, number, content, *common), head.place)
        angles = np.radians(pose.numbers(4, "kappa phi omega"))[np.newaxis, ::-1]
        content.pose(number, pose.numbers(1, "X Y Z"), Attitudes.of("omega_phi_kappa", angles).matrices[0])
    _control(until_empty(), content, options)
    for card in until_empty():
        content.start(_number(card, 0), card.numbers(1, "X Y Z"), card.place)
    for card in until_empty():
        sd = card.numbers(4, "sx sy") if len(card.words) >= 6 else np.full(2, np.nan)
        (x, y), sd = card.numbers(2, "x y").tolist(), np.where(sd > 0, sd, np.nan)
        content.image(_number(card, 0), _number(card, 1), x, y, card.place, sd=sd)
    return content


def _number(card: Card, index: int) -> int:
    if index >= len(card.words):
        raise card.place.error(phrase("format.end", name="the number of a photo or point"))
    return card.place.whole(card.words[index], highest=2**53)


def _sensor(card: Card, first: int, name: str, size: Size) -> tuple[Camera, Size, float]:
    c, px, py, width, height, *terms = card.numbers(first, _CAMERA).tolist()
    sides = width / size[0], height / size[1]
    if not (c > 0 and min(sides) > 1e-5 and max(sides) < 1 and 0.5 < sides[0] / sides[1] < 2):
        raise card.place.error(phrase("dbat.distance", c=c, across=sides[0], down=sides[1]))
    with at_place(card.place):
        named = dict(zip(("K1", "K2", "K3", "P1", "P2"), terms, strict=True))
        return sensor_of(name, size, sides, (c, px, py), named)


def _camera_of(
    card: Card, number: int, content: DbatBuilder, head: Card, common: tuple[Camera, Size, float]
) -> Hashable:
    """Add the camera of a photo, usually the one of the header, rounded; return its key."""
    words, difference = tuple(card.words[1:11]), np.abs(head.numbers(0, _CAMERA) - card.numbers(1, _CAMERA))
    last = [10.0 ** -len(word.partition(".")[2].lower().partition("e")[0]) for word in words]
    if (difference <= np.array(last)).all():
        if "camera" not in content.camera_rows:
            content.camera(*common, key="camera")
        return "camera"
    if words not in content.camera_rows:
        content.camera(*_sensor(card, 1, f"camera of photo {number}", common[1]), key=words)
        remark = phrase("dbat.other-camera", photo=number, values=" ".join(words))
        content.messages.append(Message(remark, card.place.file))
    return words


def _control(cards: Iterable[Card], content: DbatBuilder, options: ReadOptions) -> None:
    given, negative = options.sd.get("control"), 0
    for card in cards:
        number, position = _number(card, 0), card.numbers(1, "X Y Z")
        sd: Floats = card.numbers(4, "sx sy sz") if given is None else np.broadcast_to(given, 3)
        if (sd < 0).all():
            content.control(number, position, np.nan, card.place, check=True)
            negative += 1
        else:
            content.control(number, position, np.where(sd < 0, np.inf, sd), card.place)
    if negative:
        fields = {"number": negative, "option": option_sd("control")}
        content.lacks.append(Phrase("read.negative", fields))
    if content.controls:
        content.messages.append(Message(phrase("dbat.control"), content.path))
