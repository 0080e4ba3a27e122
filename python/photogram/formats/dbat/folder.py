"""Folders of DBAT's tables, and tables of measurements that PhotoModeler exports."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.errors import InputError
from photogram.formats.dbat.content import Content, Sensor, sensors_of_table
from photogram.formats.dbat.script import read_camera_file
from photogram.formats.dbat.tables import take_images, take_photos, take_points, take_poses, titled
from photogram.formats.format import Wishes
from photogram.formats.plain.cameras import read_cameras
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import Tables
from photogram.formats.xml_stream import root_of
from photogram.io.files import read_beginning, read_lines
from photogram.io.places import Place
from photogram.io.rows import cells
from photogram.messages import Message

IMAGES, PHOTOS, POSES, CONTROL = "markpts.txt", "images.txt", "stations.txt", "control.txt"
MEASURED, COMPUTED = "-2dpts.txt", "-3dpts.txt"
_HEADER = "object point id,photo #,"
_FREE = 10
"""Lines in which a header is looked for."""


def is_folder(path: Path) -> bool:
    """Whether a folder has DBAT's tables."""
    return (path / IMAGES).is_file() and (path / PHOTOS).is_file()


def is_measurements(path: Path) -> bool:
    """Whether a file is a table of measurements of PhotoModeler."""
    try:
        begin = read_beginning(path).lower()
    except InputError:
        return False
    return any(line.startswith(_HEADER) for line in begin.splitlines()[:_FREE])


def _sensors(path: Path, wishes: Wishes, messages: list[Message]) -> dict[str, Sensor]:
    """Return cameras: of a table that a user gives, else of a file of cameras in the folder."""
    if wishes.cameras is not None:
        table = read_cameras(Tables(Settings(path, tables={"cameras": wishes.cameras}, image="mm"), messages))
        return sensors_of_table(table.cameras, table.sizes, table.pixel_mm, wishes.cameras)
    folder = path if path.is_dir() else path.parent
    files = [each for each in sorted(folder.glob("*.xml")) if "dbat_camera_version" in root_of(each)[1]]
    if len(files) != 1:
        raise InputError(
            "has no cameras: --camera FILE gives them, columns camera, c, width, height and pixel_mm in mm",
            file=path,
        )
    return read_camera_file(files[0], messages)


def read_folder(path: Path, wishes: Wishes) -> Content:
    """Read `images.txt`, `markpts.txt`, and `stations.txt` and `control.txt` where they are there."""
    content = Content(path, "tables of DBAT")
    content.sensors = _sensors(path, wishes, content.messages)
    take_photos(titled(path / PHOTOS), content)
    if (path / POSES).is_file():
        take_poses(titled(path / POSES), content)
    if (path / CONTROL).is_file():
        take_points(titled(path / CONTROL), content, wishes.sd.get("control"))
    take_images(titled(path / IMAGES), content)
    return content


def read_measurements(path: Path, wishes: Wishes) -> Content:
    """Read `NAME-2dpts.txt`, with the positions of `NAME-3dpts.txt` to begin with where it lies beside."""
    content = Content(path, "PhotoModeler measurements")
    content.sensors = _sensors(path, wishes, content.messages)
    if len(content.sensors) > 1:
        raise InputError(f"does not say which of {len(content.sensors)} cameras took a photo", file=path)
    camera = next(iter(content.sensors))
    pixels = []
    for place, own in _cells(path, _HEADER, 4):
        point, photo = (place.whole(cell, highest=2**53) for cell in own[:2])
        content.photos[photo], content.cameras[photo] = str(photo), camera
        content.image_photos.append(photo)
        content.image_points.append(point)
        pixels.append([place.number(cell) for cell in own[2:4]])
    content.photos = dict(sorted(content.photos.items()))
    content.pixels = np.array(pixels).reshape(-1, 2)
    content.image_sd = np.full_like(content.pixels, np.nan)
    beside = path.with_name(path.name.removesuffix(MEASURED) + COMPUTED)
    if path.name.endswith(MEASURED) and beside.is_file():
        for place, own in _cells(beside, "id,name,photos (used),", 6):
            position = np.array([place.number(cell) for cell in own[3:6]])
            content.starts[place.whole(own[0], highest=2**53)] = position
    return content


def _cells(path: Path, header: str, least: int) -> list[tuple[Place, list[str]]]:
    """Return the rows below a header, which stands after some free lines."""
    lines = read_lines(path)
    first = next((k for k, line in enumerate(lines[:_FREE]) if line.lower().startswith(header)), None)
    if first is None:
        raise InputError(f"has no header {header!r} in its first {_FREE} lines", file=path)
    found = []
    for record, line in enumerate(lines[first + 1 :], first + 2):
        if not line.strip():
            continue
        place = Place(path, record, line)
        own = cells(place)
        if len(own) < least:
            raise place.error(f"has {len(own)} cells; {least} are the least")
        found.append((place, own))
    return found
