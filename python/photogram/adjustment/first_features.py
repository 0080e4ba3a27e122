"""Prior values of photos and points, and initial values of planes, lines, levels, boresights and sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.cameras import rays_of_row
from photogram.network.geometry import Cartesian, photo_axes
from photogram.network.motion import on_shared, scanners
from photogram.network.observations import Attitude, Observation, Position
from photogram.network.observations.observation import with_unknowns
from photogram.network.rays import meet_rays
from photogram.network.unknowns import Boresight, Level, LeverArm, Line, Plane, PlumbLine, Sensor, Unknown
from photogram.results.datum import given_control
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Known:
    """Prior values of P photos and n points in cartesian axes; NaN if unknown.

    Given poses are (P, 3) and (P, 3, 3), photo to object, always complete. Observed poses belong to photos
    without a given pose and may be incomplete. Points (n, 3) are control; free components have infinite
    standard deviations.
    """

    positions: Floats
    attitudes: Floats
    observed_positions: Floats
    observed_attitudes: Floats
    points: Floats
    point_sd: Floats

    @classmethod
    def of(cls, block: Block, axes: Cartesian) -> Known:
        """Collect the prior values of a block."""
        positions = axes.positions(block.photo_positions)
        attitudes = axes.from_local(
            photo_axes(block.photo_attitudes, block.photo_to_ground), block.photo_positions
        )
        given = np.asarray(np.isfinite(np.column_stack([positions, attitudes.reshape(-1, 9)])).all(axis=1))
        # A photo on a shared trajectory, or of a line scanner, has several poses.
        given &= ~(on_shared(block) | scanners(block))
        observed = block.photo_positions_observed
        centres = positions.copy()
        if observed is not None:
            weighted = np.isfinite(block.photo_position_sd).all(axis=1) & np.isfinite(observed).all(axis=1)
            centres[weighted] = axes.positions(observed)[weighted]
        turned = attitudes.copy()
        if (angles := block.photo_attitudes_observed) is not None:
            weighted = np.isfinite(block.photo_attitude_sd).all(axis=1) & np.isfinite(angles).all(axis=1)
            turned[weighted] = axes.from_local(
                photo_axes(angles, block.photo_to_ground), block.photo_positions
            )[weighted]
        _take_observations(block, axes, centres, turned)
        points, sd = _control(block, axes)
        return cls(
            positions=np.where(given[:, np.newaxis], positions, np.nan),
            attitudes=np.where(given[:, np.newaxis, np.newaxis], attitudes, np.nan),
            observed_positions=centres,
            observed_attitudes=turned,
            points=points,
            point_sd=sd,
        )


def with_poses(block: Block, positions: Floats, attitudes: Floats) -> Block:
    """Return the block with initial poses of photos; fixed values and observed values do not change."""
    changes: dict[str, Floats] = {}
    for name, values in (("position", positions), ("attitude", attitudes)):
        given, sd = getattr(block, f"photo_{name}s"), getattr(block, f"photo_{name}_sd")
        changes[f"photo_{name}s"] = np.where((sd == 0) & np.isfinite(given), given, values)
        if getattr(block, f"photo_{name}s_observed") is None and np.isfinite(sd).any():
            changes[f"photo_{name}s_observed"] = np.where(np.isfinite(sd), given, np.nan)
    return block.replace(**changes)


def _take_observations(block: Block, axes: Cartesian, centres: Floats, turned: Floats) -> None:
    """Insert observed attitudes A_obs B', and observed positions minus lever arms."""
    place = block._photo_rows
    positions = [each for each in block.observations.of_type(Position) if each.moment is None]
    for antenna in positions:
        centres[place[antenna.photos[0]]] = axes.positions(antenna.observed[np.newaxis, :3])[0]
        if antenna.shift is not None and axes.spheroid is None:
            centres[place[antenna.photos[0]]] -= antenna.shift.position
    for each in block.observations.of_type(Attitude):
        if each.moment is None:
            row = place[each.photos[0]]
            given, known = each.boresight, each.observed[9:18].reshape(3, 3)
            boresight = given.attitude if isinstance(given, Boresight) else known
            own = each.observed[:9].reshape(3, 3) @ boresight.T
            at = axes.from_cartesian(centres[row : row + 1])
            turned[row] = axes.from_local(own[np.newaxis], at)[0]
    for antenna in positions:
        row = place[antenna.photos[0]]
        if np.isfinite(turned[row]).all():
            unknown = antenna.lever_arm
            arm = unknown.position if isinstance(unknown, LeverArm) else antenna.observed[3:6]
            centres[row] -= turned[row] @ arm


def _control(block: Block, axes: Cartesian) -> tuple[Floats, Floats]:
    """Return positions and standard deviations of control in cartesian axes."""
    points, sd = given_control(block)
    held = np.isfinite(sd)
    points[~held.any(axis=1)] = np.nan
    if axes.spheroid is not None:
        # Only full control is usable in geocentric axes, with one standard deviation for all axes.
        full = held.all(axis=1, keepdims=True)
        metric = sd * [axes.spheroid.a, axes.spheroid.a, 1.0]
        sd = np.where(full, np.broadcast_to(metric.max(axis=1, keepdims=True), sd.shape), np.inf)
        points = np.where(full, axes.positions(points), np.nan)
    return points, sd


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
    known, places, turns = sites.known, [], []
    for each in (mount for mount in sites.block.mounts if mount.sensor is sensor):
        frame, photo = sites.photos[each.frame], sites.photos[each.photo]
        to_frame = known.attitudes[frame].T
        place = to_frame @ (known.positions[photo] - known.positions[frame])
        turn = to_frame @ known.attitudes[photo]
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
    u, _, v = np.linalg.svd(np.mean(turns, axis=0))
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v)
