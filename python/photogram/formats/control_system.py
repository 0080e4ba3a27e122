"""Detection of control in another system than the photos, before the adjustment.

Common mistakes are tested: east and north, signs, feet, millimetres, zones before eastings, missing systems.
A mistake is reported with its remedy if its correction improves the fit ten times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.columns import heading_of
from photogram.formats.models import intersected
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import Transform
from photogram.formats.project import Project
from photogram.io.column_table import ColumnTable
from photogram.messages import Message
from photogram.network.observations import Position
from photogram.network.similarity import similarity
from photogram.words import Phrase, phrase

BETTER = 10.0  # Ratio of misfits that a correction must reach to be reported
FITS = 0.2  # Misfit, relative to the extent of control, below which control agrees with initial values
FAR = 100.0  # Distance of photos from control, in extents, that indicates different systems
ZONE = 1e6

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
                _from_below(stations, model[seen], own[seen]) for own in (values, _swapped(values))
            )
            if below and not above:
                return [Message(phrase("control-system.below", option=_swap(table)), table.path)]
        return []
    tried = [
        (misfit(settings, change(values))[0], what, option)
        for what, option, change in (_exchanges(table, values, free=free) if firm else ())
    ]
    tried += [
        (misfit(own, values)[0], phrase("control-system.crs", crs=crs), f"--control-crs {crs}")
        for crs, own in _systems(project, settings)
    ]
    best, what, option = min(tried, key=lambda trial: trial[0], default=(np.inf, Phrase(""), ""))
    if firm:
        extent = max(extent, float(np.std(model[seen], axis=0).max()))
    if best < as_is / BETTER and (not firm or best < extent):
        raise table.head.error(
            phrase("control-system.exchange", factor=as_is / best, what=what, option=option)
        )
    if not free and as_is > FAR * reach:
        raise table.head.error(
            phrase("control-system.far", distance=as_is, unit=block.linear_unit, extent=reach)
        )
    return []


def _swap(table: ColumnTable) -> str:
    return f"--columns x={heading_of(table, 'y')},y={heading_of(table, 'x')}"


def _swapped(xyz: Floats) -> Floats:
    return xyz[:, [1, 0, 2]]


def _from_below(stations: Floats, model: Floats, placed: Floats) -> bool:
    """Return whether control is above the transformed stations."""
    scale, turn, shift, misfit = similarity(model, placed)
    heights = (scale * stations @ turn.T + shift)[:, 2]
    return bool(np.isfinite(misfit) and (heights < placed[:, 2].min()).all())


def _exchanges(table: ColumnTable, values: Floats, *, free: bool) -> Iterator[Exchange]:
    """Yield corrections of control with their remedies."""
    x, y, z = (heading_of(table, axis) for axis in "xyz")
    yield phrase("control-system.swapped"), _swap(table), _swapped
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


def _systems(project: Project, settings: Settings) -> Iterator[tuple[str, Settings]]:
    """Yield possible systems of control without one, if the project is georeferenced."""
    if settings.crs.get("control") or project.frame.kind != "topocentric" or project.frame.origin is None:
        return
    latitude, longitude, _ = project.frame.origin
    zone = int((longitude + 180) // 6) % 60 + 1
    for crs in (f"EPSG:{(32600 if latitude >= 0 else 32700) + zone}", "EPSG:4979", "EPSG:3857"):
        yield crs, replace(settings, crs={"control": crs})
