"""Control lists of OpenSfM, and detection of control in another system than the photos."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.cards import filled_lines
from photogram.formats.columns import heading_of
from photogram.formats.crs import utm_system, utm_zone
from photogram.formats.models import intersected
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import Transform
from photogram.formats.project import Project
from photogram.io.column_table import ColumnTable
from photogram.io.files import read_lines
from photogram.io.json import read_json
from photogram.io.numbers import finite_number
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.observations import Position
from photogram.network.point_sets import similarity
from photogram.words import Phrase, phrase

WGS84 = "EPSG:4979"
SYSTEMS = ("WGS84", "EPSG:", "+PROJ=")  # First words of a list, in capital letters
_UTM = re.compile(r"WGS84\s+UTM\s+(\d{1,2})\s*([NS])", re.IGNORECASE)
DIFFER = 1e-6
_POINTS, _IMAGES = ("point", "x", "y", "z"), ("photo", "point", "column", "row")


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
    return utm_system(int(match[1]), south=match[2].upper() == "S")


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
        height = "" if words[2].lower() == "nan" else words[2]
        for word in (*words[:2], *words[3:5], *([height] if height else [])):
            place.number(word)
        position = (words[0], words[1], height)
        named = words[6:7] or [by_position.setdefault(position, f"control {len(by_position) + 1}")]
        name = named[0]
        pairs = zip(points.setdefault(name, position), position, strict=True)
        if any((a == "") != (b == "") or (a and abs(float(a) - float(b)) > DIFFER) for a, b in pairs):
            raise place.error(phrase("control-list.position", point=name, record=places[name]))
        places.setdefault(name, place.record or 0)
        # Pixels count from the centre of the first pixel.
        corner = (repr(finite_number(word) + 0.5) for word in words[3:5])
        images.append((words[5], name, *corner))
        records.append(place.record or 0)
    if not points:
        raise head.error(phrase("format.missing", what="points"))
    control = _table(head, _POINTS, [(name, *own) for name, own in points.items()], [*places.values()])
    return ControlList(control, _table(head, _IMAGES, images, records), crs, [])


def _of_json(path: Path, project: Project) -> ControlList:
    cameras = [] if project.block.photo_cameras is None else project.block.photo_cameras.tolist()
    pairs = zip(project.block.photo_ids, cameras, strict=False)
    sizes = {name: project.sizes[row] for name, row in pairs}
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
    control = _table(head, _POINTS, [(name, *own) for name, own in points.items()], [1] * len(points))
    return ControlList(control, _table(head, _IMAGES, images, [1] * len(images)), WGS84, messages)


def _table(
    head: Place, columns: Sequence[str], rows: Sequence[tuple[str, ...]], records: Sequence[int]
) -> ColumnTable:
    assert head.file is not None
    cells = {name: [row[k] for row in rows] for k, name in enumerate(columns)}
    return ColumnTable(head.file, head, tuple(columns), len(rows), cells, records)


BETTER = 10.0  # Ratio of misfits that a correction must reach to be reported
FITS = 0.2  # Misfit, relative to the extent of control, below which control agrees with initial values
FAR = 100.0  # Distance of photos from control, in extents, that indicates different systems
ZONE = 1e6
_AXES, _SWAPPED = [0, 1, 2], [1, 0, 2]

Exchange = tuple[Phrase, str, Callable[[Floats], Floats]]


def check_systems(
    project: Project, settings: Settings, table: ColumnTable, points: Indices, values: Floats, *, free: bool
) -> list[Message]:
    """Reject control that fits only after a correction, or is far away.

    `points`: (k,) points of the project; `values`: (k, 3) their coordinates in the table;
    `free`: whether a similarity may transform the model of the project onto control.

    Returns a remark if photos are below flat control, since control does not determine the side.
    """
    known = np.isfinite(values).all(axis=1)
    points, values = points[known], values[known]
    block = project.block
    if block.geographic or not len(points):
        return []
    model = intersected(project, points)
    seen = np.isfinite(model).all(axis=1)
    posed = np.isfinite(block.photo_positions).all(axis=1)
    gnss = [np.asarray(each.position) for each in block.observations.of_type(Position)]
    stations = np.vstack([block.photo_positions[posed], *(each[np.newaxis] for each in gnss)])
    firm = np.count_nonzero(seen) > 2
    if not firm and (free or not len(stations)):
        return []

    def misfit(own: Settings, xyz: Floats) -> tuple[float, float]:
        """Return misfit and extent of control; infinite without transformation."""
        try:
            placed, _ = Transform(own, []).positions("control", xyz, None, table)
        except InputError:
            return np.inf, 0.0
        extent = float(np.sqrt(np.mean((placed - placed.mean(axis=0)) ** 2)))
        if firm and free:
            return similarity(model[seen], placed[seen])[3], extent
        if firm:
            return float(np.sqrt(np.mean((model[seen] - placed[seen]) ** 2))), extent
        return float(np.linalg.norm(placed.mean(axis=0) - stations.mean(axis=0))), extent

    as_is, extent = misfit(settings, values)
    reach = extent + (float(np.ptp(stations, axis=0).max()) if len(stations) else 0.0)
    if as_is <= (FITS * extent if firm else FAR * reach):
        if free and len(stations) and settings.crs.get("control", "") == "":
            below, above = (
                _from_below(stations, model[seen], values[seen][:, order]) for order in (_AXES, _SWAPPED)
            )
            if below and not above:
                return [Message(phrase("control-system.below", option=_swap(table)), table.path)]
        return []
    exchanges = _exchanges(table, values, free=free) if firm else ()
    tried = [(misfit(settings, change(values))[0], what, option) for what, option, change in exchanges]
    for crs in _systems(project, settings):
        apart, _ = misfit(replace(settings, crs={"control": crs}), values)
        tried.append((apart, phrase("control-system.crs", crs=crs), f"--control-crs {crs}"))
    best, what, option = min(tried, key=lambda trial: trial[0], default=(np.inf, Phrase(""), ""))
    if firm:
        extent = max(extent, float(np.std(model[seen], axis=0).max()))
    if best < as_is / BETTER and (not firm or best < extent):
        fields = {"factor": as_is / best, "what": what, "option": option}
        raise table.head.error(phrase("control-system.exchange", **fields))
    if not free and as_is > FAR * reach:
        fields = {"distance": as_is, "unit": block.linear_unit, "extent": reach}
        raise table.head.error(phrase("control-system.far", **fields))
    return []


def _swap(table: ColumnTable) -> str:
    return f"--columns x={heading_of(table, 'y')},y={heading_of(table, 'x')}"


def _from_below(stations: Floats, model: Floats, placed: Floats) -> bool:
    """Return whether control is above the transformed stations."""
    scale, turn, shift, misfit = similarity(model, placed)
    heights = (scale * stations @ turn.T + shift)[:, 2]
    return bool(np.isfinite(misfit) and (heights < placed[:, 2].min()).all())


def _exchanges(table: ColumnTable, values: Floats, *, free: bool) -> Iterator[Exchange]:
    """Yield corrections of control with their remedies."""
    x, y, z = (heading_of(table, axis) for axis in "xyz")
    yield phrase("control-system.swapped"), _swap(table), lambda xyz: xyz[:, _SWAPPED]
    feet = phrase("control-system.unit", name=z, unit="ft")
    yield feet, f"--columns z={z}[ft]", partial(np.multiply, (1.0, 1.0, 0.3048))
    if free:
        return
    for column, name, sign in (("x", x, (-1, 1, 1)), ("y", y, (1, -1, 1)), ("z", z, (1, 1, -1))):
        reverse = phrase("control-system.sign", name=name)
        yield reverse, f"--columns {column}=-{name}", partial(np.multiply, sign)
    for unit, scale in (("ft", 0.3048), ("mm", 0.001)):
        option = f"--columns x={x}[{unit}],y={y}[{unit}],z={z}[{unit}]"
        every = phrase("control-system.units", unit=unit)
        yield every, option, partial(np.multiply, (scale, scale, scale))
    if (values[:, 0] > ZONE).all():
        zone = phrase("control-system.zone", zone=int(values[0, 0] // ZONE))
        option = "--control-crs CRS, whose eastings have the zone (EPSG:4647 is ETRS89, zone 32)"
        yield zone, option, lambda xyz: np.column_stack([xyz[:, 0] % ZONE, xyz[:, 1:]])


def _systems(project: Project, settings: Settings) -> tuple[str, ...]:
    if settings.crs.get("control") or project.frame.kind != "topocentric" or project.frame.origin is None:
        return ()
    return (utm_zone(*project.frame.origin[:2]), "EPSG:4979", "EPSG:3857")
