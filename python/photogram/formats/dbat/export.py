"""The export file of PhotoModeler, `NAME-pmexport.txt`.

Lines 1 to 5 are a title; tolerance, iterations and image size; nine standard deviations; the camera
`c px py width height K1 K2 K3 P1 P2` in mm, and its standard deviations. Then six lines for each photo,
control, points and observations follow, with an empty line after each list. Later lines are not read.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.cards import Card
from photogram.formats.dbat.tables import DbatBuilder, sensor_of
from photogram.formats.project import Size
from photogram.formats.read_options import ReadOptions
from photogram.io.files import read_beginning, read_lines
from photogram.io.places import Place, at_place, image_size
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera
from photogram.words import Phrase, option_sd, phrase

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


class _Lines:
    """A reader of consecutive lines of the file."""

    def __init__(self, path: Path) -> None:
        self.path, self._lines, self._next = path, read_lines(path), 0

    def take(self, what: str) -> Card:
        if self._next >= len(self._lines):
            raise InputError(phrase("format.end", name=what), file=self.path, record=self._next)
        self._next += 1
        return Card(Place(self.path, self._next, self._lines[self._next - 1]))

    def until_empty(self) -> Iterator[Card]:
        """Yield lines up to an empty line or the end."""
        while self._next < len(self._lines):
            card = self.take("")
            if not card.words:
                return
            yield card


def read_export(path: Path, options: ReadOptions) -> DbatBuilder:
    """Read an export file."""
    lines = _Lines(path)
    content = DbatBuilder(path, TITLE)
    lines.take("the title")
    size = _size(lines.take("tolerance and iterations"))
    lines.take("nine standard deviations")
    default = lines.take("the camera")
    lines.take("standard deviations of the camera")
    cameras = _Cameras(content, default, size)
    for card in lines.until_empty():
        _photo(card, lines, cameras)
    _control(lines, content, options)
    for card in lines.until_empty():
        content.start(_number(card, 0), card.numbers(1, "X Y Z"), card.place)
    _measurements(lines, content)
    return content


def _number(card: Card, index: int) -> int:
    if index >= len(card.words):
        raise card.place.error(phrase("format.end", name="the number of a photo or point"))
    return card.place.whole(card.words[index], highest=2**53)


def _size(card: Card) -> Size:
    if len(card.words) < 4:
        raise card.place.error(phrase("dbat.size"))
    return image_size(card.place, _number(card, 2), _number(card, 3))


def _sensor(card: Card, first: int, name: str, size: Size) -> tuple[Camera, Size, float]:
    c, px, py, width, height, *terms = card.numbers(first, _CAMERA).tolist()
    sides = width / size[0], height / size[1]
    if not (c > 0 and min(sides) > 1e-5 and max(sides) < 1 and 0.5 < sides[0] / sides[1] < 2):
        raise card.place.error(phrase("dbat.distance", c=c, across=sides[0], down=sides[1]))
    with at_place(card.place):
        named = dict(zip(("K1", "K2", "K3", "P1", "P2"), terms, strict=True))
        return sensor_of(name, size, sides, (c, px, py), named)


class _Cameras:
    """The camera of the header, and different cameras of photos."""

    def __init__(self, content: DbatBuilder, head: Card, size: Size) -> None:
        self.content, self.head, self.size = content, head, size
        self.common = _sensor(head, 0, "camera", size)
        self.others: dict[tuple[str, ...], str] = {}

    def name_of(self, number: int, card: Card) -> str:
        """Return the name of a photo's camera: usually the one of the header, rounded."""
        given, own = self.head.numbers(0, _CAMERA), card.numbers(1, _CAMERA)
        words = tuple(card.words[1:11])
        last = [10.0 ** -len(word.partition(".")[2].lower().partition("e")[0]) for word in words]
        if (np.abs(given - own) <= np.array(last)).all():
            if "camera" not in self.content.camera_rows:
                self.content.camera(*self.common, key="camera")
            return "camera"
        if words not in self.others:
            name = self.others[words] = f"camera of photo {number}"
            self.content.camera(*_sensor(card, 1, name, self.size), key=name)
            remark = phrase("dbat.other-camera", photo=number, values=" ".join(words))
            self.content.messages.append(Message(remark, card.place.file))
        return self.others[words]


def _photo(head: Card, lines: _Lines, cameras: _Cameras) -> None:
    number, content = _number(head, 0), cameras.content
    if number in content.photo_rows:
        raise head.place.error(phrase("format.repeated", what="photo", name=str(number)))
    pose, _, _, camera, _ = (lines.take(f"the {what} of photo {number}") for what in _PHOTO)
    for card in (pose, camera):
        if _number(card, 0) != number:
            raise card.place.error(phrase("dbat.photo", number=number, other=card.words[0]))
    file = (head.place.text or "").split(None, 1)[1] if len(head.words) > 1 else ""
    content.numbered_photo(number, file, cameras.name_of(number, camera), head.place)
    angles = np.radians(pose.numbers(4, "kappa phi omega"))[np.newaxis, ::-1]
    content.pose(number, pose.numbers(1, "X Y Z"), Attitudes.of("omega_phi_kappa", angles).matrices[0])


def _control(lines: _Lines, content: DbatBuilder, options: ReadOptions) -> None:
    given, negative = options.sd.get("control"), 0
    for card in lines.until_empty():
        number, position = _number(card, 0), card.numbers(1, "X Y Z")
        sd: Floats = card.numbers(4, "sx sy sz") if given is None else np.broadcast_to(given, 3)
        if (sd < 0).all():
            content.check(number, position, place=card.place)
            negative += 1
        else:
            content.control(number, position, np.where(sd < 0, np.inf, sd), card.place)
    if negative:
        fields = {"number": negative, "option": option_sd("control")}
        content.lacks.append(Phrase("read.negative", fields))
    if content.controls:
        content.messages.append(Message(phrase("dbat.control"), content.path))


def _measurements(lines: _Lines, content: DbatBuilder) -> None:
    for card in lines.until_empty():
        sd = card.numbers(4, "sx sy") if len(card.words) >= 6 else np.full(2, np.nan)
        (x, y), sd = card.numbers(2, "x y").tolist(), np.where(sd > 0, sd, np.nan)
        content.image(_number(card, 0), _number(card, 1), x, y, card.place, sd=sd)
