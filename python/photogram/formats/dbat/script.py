"""Scripts of DBAT: which tables there are, what their columns are, what is unknown."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

from photogram.formats.dbat.cameras import sensors_of_cameras
from photogram.formats.dbat.content import Content, Sensor
from photogram.formats.dbat.tables import take_images, take_photos, take_points, take_poses, untitled
from photogram.formats.format import Wishes
from photogram.formats.project import Options
from photogram.formats.xml_stream import Element, read_stream
from photogram.io.delimited import ColumnTable
from photogram.messages import Message, quoted

__all__ = ["TITLE", "read_camera_file", "read_script"]

TITLE = "DBAT script"
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
"""Parameters of a camera by the words of `set_bundle_estimate_params`."""


def read_script(path: Path, wishes: Wishes) -> Content:
    """Read a script with the tables that it names.

    Raises
    ------
    InputError
        A script or table at fault, files that are not there.
    """
    root = read_stream(path, {}, "document")
    given = root.need("input")
    content = Content(path, TITLE)
    base = _folder(given, "base_dir", path.parent)
    cameras = given.need("cameras")
    file = cameras.child("file")
    content.sensors = (
        sensors_of_cameras(cameras, content.messages)
        if file is None
        else read_camera_file(_path(file, base), content.messages)
    )
    for _, table in _tables(given.need("images"), base):
        take_photos(table, content)
    eo = given.child("prior_eo")
    for element, table in [] if eo is None else _tables(eo, base):
        take_poses(table, content, element.attributes.get("units", "degrees"))
    sd = wishes.sd.get("control")
    for name in ("ctrl_pts", "check_pts"):
        points = given.child(name)
        if points is not None:
            for _, table in _tables(points, base):
                take_points(table, content, sd, check=name == "check_pts", wanted=_filter(points))
    for element, table in _tables(given.need("image_pts"), base):
        take_images(table, content, _deviation(element))
    if (operations := root.child("operations")) is not None:
        _estimates(operations, content)
        _datum(operations, content)
    return content


def read_camera_file(path: Path, messages: list[Message]) -> dict[str, Sensor]:
    """Read a file of cameras."""
    return sensors_of_cameras(read_stream(path, {}, "document").need("cameras"), messages)


def _folder(element: Element, attribute: str, here: Path) -> Path:
    """Return the folder that an attribute names; $HERE is that of the script."""
    return here / _known(element, element.attributes.get(attribute, "$HERE"))


def _path(element: Element, base: Path) -> Path:
    word = element.text.strip()
    if not word:
        raise element.error("names no file")
    return base / _known(element, word)


def _known(element: Element, word: str) -> str:
    """Return a path without $HERE; other places are not known."""
    own = (
        word.replace("\\", "/").removeprefix("$HERE").removeprefix("/") if word.startswith("$HERE") else word
    )
    if own.startswith("$") or not own.isprintable():
        raise element.error(f"{quoted(word)}: only $HERE and paths are known here")
    return own.replace("\\", "/")


def _tables(parent: Element, base: Path) -> Iterator[tuple[Element, ColumnTable]]:
    """Yield the tables that an element names, with the elements that do."""
    files = list(parent.all("file"))
    if not files:
        raise parent.error("names no file")
    for each in files:
        columns = each.attributes.get("format", "")
        if not columns:
            raise each.error("does not say what its columns are (format)")
        yield each, untitled(_path(each, base), columns.split(","))


def _filter(points: Element) -> Callable[[int], bool]:
    """Return which points a filter leaves."""
    found = points.child("filter")
    if found is None:
        return lambda _: True
    numbers = {found.place.whole(word.strip()) for word in found.attributes.get("id", "").split(",")}
    how = found.text.strip()
    if how not in ("keep", "remove"):
        raise found.error(f"{quoted(how)} is neither keep nor remove")
    return lambda number: (number in numbers) == (how == "keep")


def _deviation(element: Element) -> float:
    word = element.attributes.get("sxy")
    if word is None:
        return math.nan
    value = element.place.number(word.strip(), "sxy")
    if not value > 0:
        raise element.error(f"sxy: {value:g} is no standard deviation")
    return value


def _operations(operations: Element, name: str) -> Iterator[Element]:
    """Yield the operations of a name, which older scripts have without an element around them."""
    for each in (operations, *operations.all("operation")):
        yield from each.all(name)


def _estimates(operations: Element, content: Content) -> None:
    """Take which parameters of cameras are unknown: `all`, then what differs from it."""
    for each in _operations(operations, "set_bundle_estimate_params"):
        interior = each.child("io")
        if interior is None:
            continue
        words = {child.name: child for child in interior.children}
        for word in ("all", *(name for name in words if name != "all")):
            if word not in words:
                continue
            if word not in _GROUPS and word != "all":
                raise words[word].error(f"there is no parameter {word}: {', '.join(_GROUPS)}")
            names = {own for group in _GROUPS.values() for own in group} if word == "all" else _GROUPS[word]
            value = words[word].text.strip().lower()
            if value == "true":
                content.free |= set(names)
            elif value == "false":
                content.free -= set(names)
            else:
                content.messages.append(
                    Message(f"io {word}: {quoted(value)} is not read: held", content.path, words[word].line)
                )


def _datum(operations: Element, content: Content) -> None:
    """Take the datum `depend`: a photo is held, and the scale by one more coordinate."""
    for each in _operations(operations, "set_datum"):
        if each.text.strip() != "depend":
            continue
        word = each.attributes.get("ref_cam", "1")
        number = each.place.whole(word, "ref_cam")
        if number not in content.poses:
            raise each.error(f"there is no photo {number} with a pose")
        content.held.add(number)
        content.options = Options(datum="minimum")
