"""Scripts and folders of DBAT: cameras, tables with their columns, unknowns."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

from photogram.adjustment.options import AdjustOptions
from photogram.errors import InputError
from photogram.formats.dbat.tables import (
    DbatBuilder,
    is_export,
    read_export,
    sensor_of,
    take_images,
    take_photos,
    take_points,
    take_poses,
    titled,
    untitled,
)
from photogram.formats.plain.cameras import read_cameras
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import Tables
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.formats.xml_stream import Element, read_stream, root_of
from photogram.io.column_table import ColumnTable
from photogram.io.files import read_beginning
from photogram.io.places import at_place, image_size, one_word, positive
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.words import phrase

TITLE = "DBAT script"
PLAIN, AFFINE = 1, 3  # Models: Brown's terms of measured coordinates; the same after an affinity
_TERMS = ("K1", "K2", "K3"), ("P1", "P2")
_GROUPS = {
    "cc": ("c",),
    "pp": ("xp", "yp"),
    "px": ("xp",),
    "py": ("yp",),
    "aspect": ("b1",),
    "skew": ("b2",),
    "K": ("K1", "K2", "K3"),
    "P": ("P1", "P2"),
    **{name: (name,) for name in ("K1", "K2", "K3", "P1", "P2")},
}
"""Camera parameters by the words of `set_bundle_estimate_params`."""


def read_script(path: Path, options: ReadOptions) -> DbatBuilder:
    root = read_stream(path, {}, "document")
    given = root.need("input")
    content = DbatBuilder(path, TITLE)
    base = _path(given, path.parent, given.attributes.get("base_dir") or "$HERE")
    cameras = given.need("cameras")
    if (file := cameras.child("file")) is not None:
        cameras = read_stream(_path(file, base, file.text.strip()), {}, "document").need("cameras")
    _cameras(cameras, content)
    for _, table in _tables(given.need("images"), base):
        take_photos(table, content)
    eo = given.child("prior_eo")
    for element, table in [] if eo is None else _tables(eo, base):
        take_poses(table, content, element.attributes.get("units", "degrees"))
    for name in ("ctrl_pts", "check_pts"):
        points = given.child(name)
        if points is not None:
            for _, table in _tables(points, base):
                given_sd, wanted = options.sd.get("control"), _filter(points)
                take_points(table, content, given_sd, check=name == "check_pts", wanted=wanted)
    for element, table in _tables(given.need("image_pts"), base):
        word = element.attributes.get("sxy")
        sd = math.nan if word is None else element.place.number(word.strip(), "sxy")
        take_images(table, content, sd if word is None else positive(element, "sxy", sd))
    if (operations := root.child("operations")) is not None:
        _estimates(operations, content)
        for each in _operations(operations, "set_datum"):
            if each.text.strip() == "depend":  # One fixed photo, and a coordinate for scale
                word = each.attributes.get("ref_cam", "1")
                number = each.place.whole(word, "ref_cam")
                if number not in content.poses:
                    raise each.error(phrase("format.undefined", what="photo with a pose", name=word))
                content.held.add(number)
                content.options = AdjustOptions(datum="minimum")
    return content


def _path(element: Element, base: Path, word: str) -> Path:
    """Return a path in a folder, without $HERE, the folder of the script."""
    if not word:
        raise element.error(phrase("format.member", name="file"))
    own = word.replace("\\", "/")
    if own.startswith("$HERE"):
        own = own.removeprefix("$HERE").removeprefix("/")
    if own.startswith("$") or not own.isprintable():
        raise element.error(phrase("dbat.path", value=word))
    return base / own


def _tables(parent: Element, base: Path) -> Iterator[tuple[Element, ColumnTable]]:
    """Yield the tables of an element, with the elements that name them."""
    files = list(parent.all("file"))
    if not files:
        raise parent.error(phrase("format.member", name="file"))
    for each in files:
        columns = each.attributes.get("format", "")
        if not columns:
            raise each.error(phrase("format.member", name="format"))
        yield each, untitled(_path(each, base, each.text.strip()), columns.split(","))


def _filter(points: Element) -> Callable[[int], bool]:
    found = points.child("filter")
    if found is None:
        return lambda _: True
    numbers = {found.place.whole(word.strip()) for word in found.attributes.get("id", "").split(",")}
    how = one_word(found, "filter", found.text.strip(), ("keep", "remove"))
    return lambda number: (number in numbers) == (how == "keep")


def _operations(operations: Element, name: str) -> Iterator[Element]:
    """Yield the operations of a name, without enclosing element in older scripts."""
    for each in (operations, *operations.all("operation")):
        yield from each.all(name)


def _estimates(operations: Element, content: DbatBuilder) -> None:
    """Read the free parameters of cameras: `all`, then exceptions."""
    for each in _operations(operations, "set_bundle_estimate_params"):
        interior = each.child("io")
        if interior is None:
            continue
        words = {child.name: child for child in interior.children}
        for word in ("all", *(name for name in words if name != "all")):
            if word not in words:
                continue
            if word != "all":
                one_word(words[word], "parameter", word, _GROUPS)
            names = {own for group in _GROUPS.values() for own in group} if word == "all" else _GROUPS[word]
            value = words[word].text.strip().lower()
            if value == "true":
                content.free |= set(names)
            elif value == "false":
                content.free -= set(names)
            else:
                remark = phrase("dbat.estimate", name=word, value=value)
                content.messages.append(Message(remark, content.path, words[word].line))


def _cameras(parent: Element, content: DbatBuilder) -> None:
    """Add the cameras of an element by number; the first is 1."""
    for row, each in enumerate(parent.all("camera"), 1):
        number = each.word("id", str(row))
        with at_place(each):
            content.camera(*_sensor(each, number, content.messages), key=number, place=each)
    if not content.cameras:
        raise parent.error(phrase("format.missing", what="a camera"))


def _sensor(element: Element, number: str, messages: list[Message]) -> tuple[Camera, Size, float]:
    one_word(element, "unit", element.word("unit", "mm"), ["mm"])
    width, height = element.need("image").numbers(2, ",")
    size = image_size(element.need("image"), width, height)
    sides = _sides(element, size)
    model = element.whole("model") if element.child("model") else PLAIN
    terms: dict[str, float] = {}
    for letter, names in zip("KP", _TERMS, strict=True):
        if (own := element.child(letter)) is not None:
            words = own.text.replace(",", " ").split()
            if len(words) > len(names):
                raise own.error(phrase("format.count", n=len(words), required=f"at most {len(names)}"))
            terms |= {name: own.place.number(word) for name, word in zip(names, words, strict=False)}
    skew = element.number("skew", 0.0)
    if any(terms.values()) or skew or sides[0] != sides[1]:
        one_word(element.child("model") or element, "model", str(model), [str(PLAIN), str(AFFINE)])
    if model == PLAIN and skew:
        raise element.need("skew").error(phrase("dbat.skew", model=PLAIN, skew=skew, other=AFFINE))
    nominal = element.word("cc", "focal") == "focal"
    if nominal:
        messages.append(Message(phrase("dbat.focal", camera=element.word("name", "camera")), element.file))
    c = positive(element, "the principal distance", element.number("focal" if nominal else "cc"))
    px, py = _principal_point(element, size, sides, terms, messages)
    name = element.word("name") or f"camera {number}"
    return sensor_of(name, size, sides, (c, px, py), terms, skew)


def _sides(element: Element, size: Size) -> tuple[float, float]:
    """Return width and height of a pixel; `aspect` defines the width if present."""
    sensor = element.need("sensor")
    first, comma, second = (word.strip() for word in sensor.text.partition(","))
    if not comma:
        raise sensor.error(phrase("dbat.sensor", value=sensor.text))
    down = sensor.place.number(second) / size[1]
    aspect = element.word("aspect", "1" if first == "auto" else "auto")
    own = element.child("aspect") or sensor
    if aspect == "auto" and first == "auto":
        raise sensor.error(phrase("dbat.sensor", value=sensor.text))
    across = sensor.place.number(first) / size[0] if aspect == "auto" else own.place.number(aspect) * down
    if not (1e-5 < down < 1 and 1e-5 < across < 1):
        raise sensor.error(phrase("dbat.pixels", across=across, down=down))
    return across, down


def _principal_point(
    element: Element, size: Size, sides: tuple[float, float], terms: dict[str, float], messages: list[Message]
) -> tuple[float, float]:
    middle = size[0] / 2 * sides[0], size[1] / 2 * sides[1]
    if element.word("pp", "default") == "default":
        messages.append(Message(phrase("dbat.middle", camera=element.word("name", "camera")), element.file))
        return middle
    px, py = element.need("pp").numbers(2, ",").tolist()
    if py < 0:
        # Before version 0.9, DBAT wrote y up, and the terms with the other sign.
        if any(terms.values()):
            raise element.need("pp").error(phrase("dbat.old"))
        py = -py
    if not (math.hypot(px - middle[0], py - middle[1]) < max(middle)):
        place = {"px": px, "py": py, "mx": middle[0], "my": middle[1]}
        raise element.need("pp").error(phrase("dbat.outside", **place))
    return px, py


IMAGES, PHOTOS, POSES, CONTROL = "markpts.txt", "images.txt", "stations.txt", "control.txt"
MEASURED, COMPUTED = "-2dpts.txt", "-3dpts.txt"
_HEADER = "object point id,photo #,"
_FREE = 10  # Number of lines that are searched for a header


def is_measurements(path: Path) -> bool:
    try:
        begin = read_beginning(path).lower()
    except InputError:
        return False
    return any(line.startswith(_HEADER) for line in begin.splitlines()[:_FREE])


def _with_sensors(path: Path, title: str, options: ReadOptions) -> DbatBuilder:
    """Return a block with the cameras of the user's table, otherwise of a file in the folder."""
    content = DbatBuilder(path, title)
    if options.cameras is not None:
        settings = Settings(path, tables={"cameras": options.cameras}, image="mm")
        for camera, size, pixel, *_ in read_cameras(Tables(settings, content.messages)).rows:
            if size is None or pixel is None or camera.image_y != "up":
                raise InputError(phrase("dbat.camera", camera=camera.title), file=options.cameras)
            content.camera(camera, size, pixel)
        return content
    folder = path if path.is_dir() else path.parent
    files = [each for each in sorted(folder.glob("*.xml")) if "dbat_camera_version" in root_of(each)[1]]
    if len(files) != 1:
        raise InputError(phrase("format.cameras"), file=path)
    _cameras(read_stream(files[0], {}, "document").need("cameras"), content)
    return content


def read_folder(path: Path, options: ReadOptions) -> DbatBuilder:
    """Read `images.txt`, `markpts.txt`, optionally `stations.txt`, `control.txt`."""
    content = _with_sensors(path, "tables of DBAT", options)
    take_photos(titled(path / PHOTOS), content)
    if (path / POSES).is_file():
        take_poses(titled(path / POSES), content)
    if (path / CONTROL).is_file():
        take_points(titled(path / CONTROL), content, options.sd.get("control"))
    take_images(titled(path / IMAGES), content)
    return content


def read_measurements(path: Path, options: ReadOptions) -> DbatBuilder:
    """Read `NAME-2dpts.txt`, with initial positions of `NAME-3dpts.txt`."""
    content = _with_sensors(path, "PhotoModeler measurements", options)
    camera, *others = content.camera_rows
    if others:
        raise InputError(phrase("format.camera-column", n=len(content.cameras)), file=path)
    table = titled(path)
    table.require("im")
    for photo in sorted(set(table.wholes("im").tolist())):
        content.numbered_photo(photo, str(photo), camera, content.place)
    take_images(table, content)
    beside = path.with_name(path.name.removesuffix(MEASURED) + COMPUTED)
    if path.name.endswith(MEASURED) and beside.is_file():
        table = titled(beside)
        table.require("id", "x", "y", "z")
        numbers, starts = table.wholes("id").tolist(), table.given(("x", "y", "z"))
        for row, number in enumerate(numbers):
            content.start(number, starts[row], table.at(row))
    return content


_EXPORTS = "*-pmexport.txt"
_Read = Callable[[Path, ReadOptions], DbatBuilder]


def _is_script(path: Path) -> bool:
    root, attributes = root_of(path)
    return root == "document" and "dbat_script_version" in attributes


def _located(path: Path) -> tuple[Path, _Read | None]:
    """Return the file with a project, and its reader: the only script or export file of a folder, or it."""
    if path.is_dir():
        scripts = [each for each in sorted(path.glob("*.xml")) if _is_script(each)]
        for files, read in ((scripts, read_script), (sorted(path.glob(_EXPORTS)), read_export)):
            if len(files) == 1:
                return files[0], read
        is_complete = (path / IMAGES).is_file() and (path / PHOTOS).is_file()
        return path, read_folder if is_complete else None
    kinds = {_is_script: read_script, is_export: read_export, is_measurements: read_measurements}
    return path, next((read for is_of, read in kinds.items() if is_of(path)), None)


def recognises(path: Path) -> bool:
    """Return whether a path is a script, an export or tables."""
    return _located(path)[1] is not None


def read(path: Path, options: ReadOptions) -> Project:
    """Read an export file or tables of PhotoModeler, a DBAT script or its tables."""
    path, take = _located(path)
    if take is None:
        # The error of the reader describes the missing part best.
        take = read_folder if path.is_dir() else read_script if path.suffix.lower() == ".xml" else read_export
    return take(path, options).dbat_project(options)
