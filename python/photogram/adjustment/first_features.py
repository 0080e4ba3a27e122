"""Initial values of planes, lines, levels, boresights and rig sensors, from points and photos."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from photogram.adjustment.a_priori import Known
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import replace
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.cameras import rays_of_row
from photogram.network.geometry import Cartesian
from photogram.network.observations import Attitude, Observation
from photogram.network.observations.observation import with_unknowns
from photogram.network.rays import meet_rays
from photogram.network.unknowns import Boresight, Level, Line, Plane, PlumbLine, Sensor, Unknown
from photogram.words import phrase

FLAT = 1e-3  # Maximum relative width of points that form a line, not a plane


def started(block: Block) -> Block:
    """Return an oriented block with initial values of all shared unknowns.

    Planes and lines follow the principal axes of their points, at given positions or ray intersections. Plumb
    lines pass through the centre of their points, levels have the mean height. A boresight is the chordal
    mean of A' A_obs, i.e. the rotation nearest to the mean matrix. A sensor has the median position and
    chordal mean rotation in the frames of its photos. InputError if points or photos do not determine an
    unknown.
    """
    waiting = [each for each in block.unknowns if each.is_open]
    if not waiting:
        return block
    sites = _Sites(block)
    found: dict[int, Unknown] = {}
    for each in waiting:
        own = [one for one in block.observations if any(other is each for other in one.unknowns)]
        found[id(each)] = _FINDERS[type(each)](sites, each, own)
    return block.replace(
        observations=[with_unknowns(each, found) for each in block.observations],
        mounts=[
            replace(mount, sensor=sensor)
            if isinstance(sensor := found.get(id(mount.sensor)), Sensor)
            else mount
            for mount in block.mounts
        ],
    )


class _Sites:
    """Positions of points and photos before the adjustment, in cartesian axes."""

    def __init__(self, block: Block) -> None:
        self.block, self.axes = block, Cartesian(block.spheroid)
        self.known = Known.of(block, self.axes)
        self.points, self.photos = block._point_rows, block._photo_rows

    def places(self, names: Sequence[str], of: Unknown, least: int) -> Floats:
        """Return (k, 3) known positions of points; InputError for fewer than `least`."""
        rows = np.array(sorted({self.points[name] for name in names}), dtype=np.int64)
        places = self.axes.positions(self.block.point_positions)[rows]
        unknown = ~np.isfinite(places).all(axis=1)
        places[unknown] = self._met(rows[unknown])
        found = places[np.isfinite(places).all(axis=1)]
        if len(found) < least:
            fields = {"n": len(found), "all": len(rows), "least": least}
            raise InputError(phrase("first.unknown.points", unknown=of.title, **fields))
        return np.asarray(found)

    def _met(self, rows: Indices) -> Floats:
        """Return (k, 3) intersections of the rays of points."""
        block, known = self.block, self.known
        images = np.flatnonzero(np.isin(block.image_points, rows))
        photos = block.image_photos[images]
        posed = np.isfinite(known.attitudes[photos]).all(axis=(1, 2))
        images, photos = images[posed], photos[posed]
        inner = np.full((len(images), 3), np.nan)
        cameras, of_photo = block.core_cameras()
        for row in np.unique(of_photo[photos]):
            own = of_photo[photos] == row
            inner[own] = rays_of_row(cameras[row], block.image_xy[images[own]])
        seen = np.isfinite(inner).all(axis=1)
        images, photos = images[seen], photos[seen]
        directions = np.einsum("mij,mj->mi", known.attitudes[photos], inner[seen])
        places = np.searchsorted(rows, block.image_points[images])
        return meet_rays(places, len(rows), known.positions[photos], directions)

    def local(self, middle: Floats) -> Floats:
        """Return (3, 3) axes X, Y, Z, or east, north, up at a position, as rows."""
        if self.axes.spheroid is None:
            return np.eye(3)
        return np.asarray(geometry.local_frames(self.axes.from_cartesian(middle[np.newaxis]))[0])

    def place(self, position: Floats) -> Floats:
        """Return a position (3,) in coordinates of the block."""
        return np.asarray(self.axes.from_cartesian(position[np.newaxis])[0])


def _points(observations: Sequence[Observation]) -> list[str]:
    return [name for each in observations for name in each.points]


def _plane(sites: _Sites, plane: Unknown, own: Sequence[Observation]) -> Unknown:
    places = sites.places(_points(own), plane, 3)
    middle, axes, spread = _principal(places)
    if spread[1] <= FLAT * spread[0]:
        raise InputError(phrase("first.unknown.line", unknown=plane.title))
    return plane.replace(normal=sites.local(middle) @ axes[2], through=sites.place(middle))


def _line(sites: _Sites, line: Unknown, own: Sequence[Observation]) -> Unknown:
    middle, axes, spread = _principal(sites.places(_points(own), line, 2))
    if not spread[0] > 0:
        raise InputError(phrase("first.unknown.place", unknown=line.title))
    return line.replace(direction=sites.local(middle) @ axes[0], through=sites.place(middle))


def _plumb_line(sites: _Sites, line: Unknown, own: Sequence[Observation]) -> Unknown:
    return line.replace(through=sites.place(sites.places(_points(own), line, 1).mean(axis=0)))


def _level(sites: _Sites, level: Unknown, own: Sequence[Observation]) -> Unknown:
    heights = []
    for each in own:
        row = sites.points[each.points[0]]
        height = sites.block.point_positions[row, 2]
        if not np.isfinite(height):
            met = sites._met(np.array([row]))
            height = sites.axes.from_cartesian(met)[0, 2] if np.isfinite(met).all() else np.nan
        heights.append(height - each.observed[0])
    if not np.isfinite(heights).any():
        raise InputError(phrase("first.unknown.height", unknown=level.title))
    return level.replace(height=float(np.nanmean(heights)))


def _boresight(sites: _Sites, boresight: Unknown, own: Sequence[Observation]) -> Unknown:
    turns = []
    for each in own:
        if isinstance(each, Attitude) and each.moment is not None:
            table, time = each.moment.trajectory.table, each.moment.time
            about = table.attitudes[np.argmin(np.abs(table.attitude_times - time))]
            turns.append(about.T @ each.observed[:9].reshape(3, 3))
        elif isinstance(each, Attitude):
            row = sites.photos[each.photos[0]]
            at = sites.block.photo_positions[row : row + 1]
            observed = sites.axes.from_local(each.observed[:9].reshape(1, 3, 3), at)[0]
            turns.append(sites.known.attitudes[row].T @ observed)
    # Photos without a pose start from the observed attitude, with an identity boresight.
    posed = [turn for turn in turns if np.isfinite(turn).all()]
    return boresight.replace(value=_mean_rotation(posed) if posed else np.eye(3))


def _sensor(sites: _Sites, sensor: Unknown, own: Sequence[Observation]) -> Unknown:
    known = sites.known
    pairs = [
        (sites.photos[each.frame], sites.photos[each.photo])
        for each in sites.block.mounts
        if each.sensor is sensor
    ]
    places, turns = [], []
    for frame, photo in pairs:
        to_frame = known.attitudes[frame].T
        place, turn = (
            to_frame @ (known.positions[photo] - known.positions[frame]),
            to_frame @ known.attitudes[photo],
        )
        if np.isfinite(place).all() and np.isfinite(turn).all():
            places.append(place)
            turns.append(turn)
    flown = [each.photo for each in sites.block.timed if each.sensor is sensor]
    if not places:
        code = "first.unknown.trajectory" if flown else "first.unknown.frame"
        raise InputError(phrase(code, unknown=sensor.title, photo=flown[0] if flown else ""))
    return sensor.replace(value=np.median(places, axis=0), matrix=_mean_rotation(turns))


_FINDERS: dict[type[Unknown], Callable[[_Sites, Unknown, Sequence[Observation]], Unknown]] = {
    Plane: _plane,
    Line: _line,
    PlumbLine: _plumb_line,
    Level: _level,
    Boresight: _boresight,
    Sensor: _sensor,
}


def _principal(places: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the centre, principal axes (rows, longest first) and spreads of positions."""
    middle = places.mean(axis=0)
    _, spread, axes = np.linalg.svd(places - middle, full_matrices=True)
    return middle, axes, np.concatenate([spread, np.zeros(3 - len(spread))])


def _mean_rotation(turns: Sequence[Floats]) -> Floats:
    """Return the rotation that is nearest to the mean of some rotations."""
    u, _, v = np.linalg.svd(np.mean(turns, axis=0))
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v)
