"""Control lists of OpenSfM: `gcp_list.txt`, `ground_control_points.json`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from photogram.formats.cards import filled_lines
from photogram.formats.project import Project
from photogram.io.column_table import ColumnTable
from photogram.io.files import read_lines
from photogram.io.json import read_json
from photogram.io.numbers import finite_number
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.words import phrase

WGS84 = "EPSG:4979"
SYSTEMS = ("WGS84", "EPSG:", "+PROJ=")  # First words of a list, in capital letters
_UTM = re.compile(r"WGS84\s+UTM\s+(\d{1,2})\s*([NS])", re.IGNORECASE)
DIFFER = 1e-6
_IMAGES = ("photo", "point", "column", "row")


@dataclass(frozen=True)
class ControlList:
    """Control points in a coordinate system, and their image observations."""

    control: ColumnTable  # A table `point, x, y, z`
    images: ColumnTable  # A table `photo, point, column, row`, pixels from the corner
    crs: str  # System of the control
    messages: list[Message]  # Remarks


def read_control_list(path: Path, project: Project) -> ControlList | None:
    """Read a list of control points with image observations; return None for a table."""
    if path.suffix.lower() == ".json":
        return _of_json(path, project)
    first = next((line.strip() for line in read_lines(path) if line.strip()), "")
    if first.upper().startswith(SYSTEMS):
        return _of_text(path)
    return None


def system_of(line: str, place: Place) -> str:
    """Return the system in the first line of a list, e.g. `WGS84 UTM 32N`."""
    if line.upper() == "WGS84":
        return WGS84
    if line.upper().startswith(("EPSG:", "+PROJ=")):
        return line
    match = _UTM.fullmatch(line)
    if match is None or not 1 <= int(match[1]) <= 60:
        raise place.error(phrase("format.crs"))
    return f"EPSG:{32600 + int(match[1]) + (100 if match[2].upper() == 'S' else 0)}"


def _of_text(path: Path) -> ControlList:
    head, *rest = filled_lines(path)
    crs = system_of((head.text or "").strip(), head)
    points: dict[str, tuple[str, str, str]] = {}
    places: dict[str, int] = {}
    by_position: dict[tuple[str, str, str], str] = {}
    images: list[tuple[str, ...]] = []
    records: list[int] = []
    for place in rest:
        words = (place.text or "").split()
        if len(words) < 6:
            raise place.error(phrase("format.words", n=len(words), required="x y z column row image [name]"))
        for word in (*words[:2], *words[3:5], *(() if words[2].lower() == "nan" else words[2:3])):
            place.number(word)
        position = (words[0], words[1], "" if words[2].lower() == "nan" else words[2])
        name = (
            words[6]
            if len(words) > 6
            else by_position.setdefault(position, f"control {len(by_position) + 1}")
        )
        if points.setdefault(name, position) != position and _apart(points[name], position):
            raise place.error(phrase("control-list.position", point=name, record=places[name]))
        places.setdefault(name, place.record or 0)
        # Pixels count from the centre of the first pixel.
        corner = (repr(finite_number(word) + 0.5) for word in words[3:5])
        images.append((words[5], name, *corner))
        records.append(place.record or 0)
    if not points:
        raise head.error(phrase("format.missing", what="points"))
    control = _table(
        head, ("point", *"xyz"), [(name, *own) for name, own in points.items()], [*places.values()]
    )
    return ControlList(control, _table(head, _IMAGES, images, records), crs, [])


def _apart(one: tuple[str, str, str], other: tuple[str, str, str]) -> bool:
    return any(
        (a == "") != (b == "") or (a and abs(float(a) - float(b)) > DIFFER)
        for a, b in zip(one, other, strict=True)
    )


def _of_json(path: Path, project: Project) -> ControlList:
    block = project.block
    sizes = {
        name: project.sizes[int(row)]
        for name, row in zip(
            block.photo_ids, block.photo_cameras if block.photo_cameras is not None else (), strict=False
        )
    }
    points: dict[str, tuple[str, str, str]] = {}
    images: list[tuple[str, ...]] = []
    messages = []
    for each in read_json(path)["points"]:
        name = each["id"].text()
        if "position" in each:
            position = each["position"]
            height = repr(position["altitude"].number()) if "altitude" in position else ""
            own = (repr(position["longitude"].number()), repr(position["latitude"].number()), height)
            if points.setdefault(name, own) != own:
                raise each.error(phrase("format.repeated", what="control point", name=name))
        for image in each.get("observations", []):
            shot = image["shot_id"].text()
            size = sizes.get(shot)
            if "projection" not in image or size is None:
                messages.append(Message(phrase("control-list.omitted", point=name, photo=shot), path))
                continue
            x, y = image["projection"].numbers(2)
            scale = max(size)
            images.append((shot, name, repr(size[0] / 2 + scale * x), repr(size[1] / 2 + scale * y)))
    head = Place(path)
    if not points:
        raise head.error(phrase("format.missing", what="points with a position"))
    control = _table(
        head, ("point", *"xyz"), [(name, *own) for name, own in points.items()], [1] * len(points)
    )
    return ControlList(control, _table(head, _IMAGES, images, [1] * len(images)), WGS84, messages)


def _table(
    head: Place, columns: Sequence[str], rows: Sequence[tuple[str, ...]], records: Sequence[int]
) -> ColumnTable:
    """Return rows of cells as the table of a file."""
    assert head.file is not None
    cells = {name: [row[k] for row in rows] for k, name in enumerate(columns)}
    return ColumnTable(head.file, head, tuple(columns), len(rows), cells, records)
