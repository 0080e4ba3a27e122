"""Coordinate reference systems: from any system of PROJ to a frame, and back.

x is longitude or easting, y latitude or northing, z height, in any axis order of the authority. The axes of a
topocentric frame are east, north and up of the ellipsoid of WGS 84 at its origin. Remarks report the effect
of a map projection on a block that is adjusted in it.
"""

from __future__ import annotations

import re
import warnings
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.geometry import Frame, local_frames
from photogram.network.refraction import METRES_PER_UNIT
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    import pyproj

GEOCENTRIC, GEOGRAPHIC = "EPSG:4978", "EPSG:4979"
ORIGIN_DECIMALS = 4  # Decimals of degrees of a chosen origin; its height is rounded to a metre
_ENU = re.compile(r"\s*ENU:\s*([-+.\d]+)\s*,\s*([-+.\d]+)\s*(?:,\s*([-+.\d]+)\s*)?", re.IGNORECASE)
_GEOID = re.compile(r"\+geoid=([-+]?\d+(?:\.\d*)?)\s*$", re.IGNORECASE)
"""Suffix of a system: the height of the geoid above the ellipsoid, one for all points."""
STEP = 1.0  # Step in metres for the axis directions of a system at a point


@cache
def _system(crs: str) -> pyproj.CRS:
    import pyproj

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FutureWarning)  # About spellings that PROJ deprecates
            return pyproj.CRS.from_user_input(without_geoid(crs))
    except pyproj.exceptions.CRSError as error:
        raise InputError(phrase("crs.unknown", crs=crs, reason=str(error))) from None


@cache
def _transformer(source: str, target: str) -> Any:
    """Return a transformation that fails if a grid of heights is missing."""
    import pyproj

    first, second = _system(source), _system(target)
    return pyproj.Transformer.from_crs(first, second, always_xy=True, only_best=True, allow_ballpark=False)


def _transformed(source: str, target: str, xyz: Floats) -> Floats:
    import pyproj

    try:
        found = np.column_stack(_transformer(source, target).transform(*xyz.T, errcheck=True))
    except pyproj.exceptions.ProjError as error:
        compound = _system(source).is_compound or _system(target).is_compound
        fields = {"source": source, "target": target, "reason": str(error)}
        hint = [phrase("crs.grid")] if compound else []
        raise InputError(phrase("crs.transformation", **fields, hint=hint)) from None
    if not np.isfinite(found).all():
        row = int(np.flatnonzero(~np.isfinite(found).all(axis=1))[0])
        raise InputError(phrase("crs.outside", position=xyz[row].tolist(), source=source, target=target))
    return found


def geocentric(crs: str, xyz: Floats) -> Floats:
    """Return (n, 3) geocentric coordinates (WGS 84) of positions in a system, metres.

    `ENU:latitude,longitude[,height]` is the topocentric frame there.
    """
    local = enu_origin(crs)
    if local is not None:
        return _geocentric_of(local) + xyz @ east_north_up(local)
    return _transformed(_with_heights(crs), GEOCENTRIC, xyz + _geoid(crs))


def _geoid(crs: str) -> Floats:
    """Return the (3,) correction from heights above the geoid."""
    match = _GEOID.search(crs)
    return np.array([0.0, 0.0, 0.0 if match is None else float(match[1])])


def has_geoid_heights(crs: str) -> bool:
    """Return whether heights refer to the geoid instead of the ellipsoid."""
    return enu_origin(crs) is None and bool(_GEOID.search(crs) or _system(crs).is_compound)


def without_geoid(crs: str) -> str:
    """Return a system without its geoid height, for other programs."""
    return _GEOID.sub("", crs)


@cache
def _with_heights(crs: str) -> str:
    """Return a system; a two-dimensional one receives ellipsoidal heights."""
    system = _system(crs)
    return str(system.to_3d().to_wkt()) if len(system.axis_info) == 2 else crs


def enu_origin(crs: str) -> tuple[float, float, float] | None:
    """Return latitude, longitude and height of a system `ENU:lat,lon[,h]`."""
    match = _ENU.fullmatch(crs)
    if match is None:
        return None
    return float(match[1]), float(match[2]), float(match[3] or 0.0)


def east_north_up(origin: tuple[float, float, float]) -> Floats:
    """Return (3, 3) rows: east, north and up at a position, geocentric."""
    return np.asarray(local_frames([[*np.radians(origin[1::-1]), 0.0]])[0])


def _geocentric_of(origin: tuple[float, float, float]) -> Floats:
    latitude, longitude, height = origin
    return np.asarray(_transformed(GEOGRAPHIC, GEOCENTRIC, np.array([[longitude, latitude, height]]))[0])


def amid(crs: str, xyz: Floats) -> tuple[float, float, float]:
    """Return the rounded latitude, longitude and height of the mean of positions."""
    middle = geocentric(crs, xyz).mean(axis=0)[np.newaxis]
    longitude, latitude, height = _transformed(GEOCENTRIC, GEOGRAPHIC, middle)[0].tolist()
    return round(latitude, ORIGIN_DECIMALS), round(longitude, ORIGIN_DECIMALS), float(round(height))


def utm_system(zone: int, *, south: bool) -> str:
    """Return the system of a zone of UTM (WGS 84)."""
    return f"EPSG:{(32700 if south else 32600) + zone}"


def utm_zone(latitude: float, longitude: float) -> str:
    """Return the system of the zone of UTM of a position in degrees."""
    return utm_system(int((longitude + 180.0) // 6.0) % 60 + 1, south=latitude < 0)


def in_degrees(xyz: Floats, geographic: bool = True) -> Floats:
    """Return (n, 3) positions with longitudes and latitudes in degrees if they are geographic."""
    return np.column_stack([np.degrees(xyz[:, :2]), xyz[:, 2]]) if geographic else xyz


def to_frame(crs: str, xyz: Floats, covariances: Floats, frame: Frame) -> tuple[Floats, Floats, list[Phrase]]:
    """Transform positions into the frame of a project.

    Parameters
    ----------
    crs
        System of the positions.
    xyz
        (n, 3) longitude or easting, latitude or northing, height.
    covariances
        (n, 3, 3) along east, north and up of the system (of a geocentric one along its axes), metres.
    frame
        Topocentric with an origin, geocentric or geographic (WGS 84).

    Returns
    -------
    (n, 3) positions and (n, 3, 3) covariances in the frame, and remarks.

    Raises
    ------
    InputError
        If a system is unknown or a position cannot be transformed.
    """
    remarks = _remarks(crs)
    earth = geocentric(crs, xyz)
    axes = _axes(crs, xyz, earth)
    turned = turned_covariances(axes.transpose(0, 2, 1), covariances)
    if frame.kind == "geocentric":
        return earth, turned, remarks
    if frame.kind == "geographic":
        found = _transformed(GEOCENTRIC, GEOGRAPHIC, earth)
        found[:, :2] = np.radians(found[:, :2])
        local = local_frames(found)
        return found, turned_covariances(local, turned), remarks
    if frame.origin is None:
        raise InputError(phrase("crs.origin"))
    rows = east_north_up(frame.origin)
    return (earth - _geocentric_of(frame.origin)) @ rows.T, turned_covariances(rows, turned), remarks


def turned_covariances(turns: Floats, covariances: Floats) -> Floats:
    """Return (n, 3, 3) covariances along rotated axes; isotropic ones exactly."""
    alike = covariances[:, :1, :1] * np.eye(3)
    return alike + turns @ (covariances - alike) @ turns.swapaxes(-1, -2)


def from_frame(crs: str, xyz: Floats, covariances: Floats, frame: Frame) -> tuple[Floats, Floats]:
    """Transform positions and covariances of a frame into a system.

    Covariances refer to east, north and up of the system, square metres.

    Raises
    ------
    InputError
        If the position of the frame on the earth is unknown, or a position cannot be transformed.
    """
    found, turns = to_system(crs, xyz, frame)
    return found, turned_covariances(turns, covariances)


def to_system(crs: str, xyz: Floats, frame: Frame) -> tuple[Floats, Floats]:
    """Transform positions of a frame into a system.

    `xyz`: (n, 3) in the frame; of a geographic one longitude and latitude in radians.

    Returns (n, 3) positions: longitude or easting, latitude or northing, height; and (n, 3, 3) rotations of
    vectors from the axes of the frame to the axes of the system. Axes of a geographic frame are east, north
    and up at each position.
    """
    if frame.kind in ("cartesian", "geographic") and frame.crs == crs and crs:
        own = in_degrees(xyz.copy(), frame.kind == "geographic")
        return own, np.broadcast_to(np.eye(3), (len(xyz), 3, 3)).copy()
    earth, own = _on_earth(xyz, frame)
    if (local := enu_origin(crs)) is not None:
        found: Floats = (earth - _geocentric_of(local)) @ east_north_up(local).T
    else:
        found = _transformed(GEOCENTRIC, _with_heights(crs), earth) - _geoid(crs)
    return found, np.asarray(_axes(crs, found, earth) @ own.transpose(0, 2, 1))


def is_on(crs: str, ellipsoid: tuple[float, float]) -> bool:
    """Return whether a system is geographic on this ellipsoid (semi-axes, m)."""
    if enu_origin(crs) is not None or not _system(crs).is_geographic:
        return False
    own: Any = _system(crs).ellipsoid  # Geographic systems have one
    axes = own.semi_major_metre, own.semi_minor_metre
    return bool(np.allclose(axes, ellipsoid, rtol=0, atol=0.01))  # Semi-axes in cards have two decimals


def has_place(frame: Frame) -> bool:
    """Return whether the position of a frame on the earth is known."""
    places = {"topocentric": frame.origin, "geographic": _geographic(frame), "cartesian": frame.crs}
    return frame.kind == "geocentric" or bool(places.get(frame.kind))


def _geographic(frame: Frame) -> str:
    """Return the system of a geographic frame; empty if only its ellipsoid is known."""
    if frame.crs:
        return frame.crs
    return GEOGRAPHIC if np.allclose(frame.ellipsoid, Frame().ellipsoid, rtol=0, atol=1e-3) else ""


def _on_earth(xyz: Floats, frame: Frame) -> tuple[Floats, Floats]:
    """Return geocentric positions, and (n, 3, 3) local axes of the frame as rows."""
    if not has_place(frame):
        raise InputError(phrase("crs.place", frame=frame.phrase))
    if frame.kind == "topocentric" and frame.origin is not None:
        rows = np.broadcast_to(east_north_up(frame.origin), (len(xyz), 3, 3))
        return _geocentric_of(frame.origin) + xyz @ rows[0] if len(xyz) else xyz, rows
    if frame.kind == "geocentric":
        return xyz, np.broadcast_to(np.eye(3), (len(xyz), 3, 3))
    if frame.kind == "geographic":
        return geocentric(_geographic(frame), in_degrees(xyz)), local_frames(xyz)
    earth = geocentric(frame.crs, xyz)
    return earth, _axes(frame.crs, xyz, earth)


def is_projected(crs: str) -> bool:
    return axes_of(crs)[0][0] == "easting"


def axes_of(crs: str) -> tuple[tuple[str, str, str], tuple[str, str, str]]:
    """Return names and units of the three coordinates; angles in degrees."""
    if enu_origin(crs) is not None:
        return ("east", "north", "up"), ("m", "m", "m")
    system = _system(crs)
    if system.is_geocentric:
        return ("x", "y", "z"), ("m", "m", "m")
    if system.is_projected or (system.is_compound and system.sub_crs_list[0].is_projected):
        return ("easting", "northing", "height"), ("m", "m", "m")
    return ("longitude", "latitude", "height"), ("deg", "deg", "m")


def _axes(crs: str, xyz: Floats, earth: Floats) -> Floats:
    """Return (n, 3, 3) rows: axes of a system at points, geocentric.

    The axes of a projected system are grid axes, so they include the convergence of meridians.
    """
    if (local := enu_origin(crs)) is not None:
        return np.broadcast_to(east_north_up(local), (len(xyz), 3, 3)).copy()
    system = _system(crs)
    if system.is_geocentric:
        return np.broadcast_to(np.eye(3), (len(xyz), 3, 3)).copy()
    geographic = _transformed(GEOCENTRIC, GEOGRAPHIC, earth)
    found: Floats = local_frames(np.radians(geographic))
    if is_projected(crs):
        north = geocentric(crs, xyz + np.array([0.0, STEP, 0.0])) - earth
        local = np.einsum("nij,nj->ni", found, north)
        angle = np.arctan2(local[:, 0], local[:, 1])
        zero, one = np.zeros_like(angle), np.ones_like(angle)
        sine, cosine = np.sin(angle), np.cos(angle)
        turn = np.array([[cosine, -sine, zero], [sine, cosine, zero], [zero, zero, one]])
        found = turn.transpose(2, 0, 1) @ found
    return found


def _remarks(crs: str) -> list[Phrase]:
    if enu_origin(crs) is not None:
        return []
    system = _system(crs)
    remarks = []
    if _GEOID.search(crs):
        remarks.append(phrase("crs.geoid", height=float(_geoid(crs)[2])))
    elif len(system.axis_info) == 2:
        remarks.append(phrase("crs.heights", crs=crs))
    if system.datum is not None and "dynamic" in system.datum.type_name.lower():
        remarks.append(phrase("crs.dynamic", crs=crs))
    if system.is_projected and system.axis_info[0].direction == "north":
        remarks.append(phrase("crs.northing", crs=crs))
    return remarks


def turn_to_frame(crs: str, xyz: Floats, frame: Frame) -> Floats:
    """Return (n, 3, 3) rotations of local attitudes of a system into a frame."""
    if frame.kind != "topocentric" or frame.origin is None:
        raise InputError(phrase("crs.attitudes", crs=crs, frame=frame.phrase))
    return np.asarray(east_north_up(frame.origin) @ _axes(crs, xyz, geocentric(crs, xyz)).transpose(0, 2, 1))


RADIUS = 6_371_000.0  # Radius of the earth, metres
LIKE_A_PLANE = 1e5  # Metres: if both coordinates are larger, they are map coordinates, not local ones
LONG_STEP = 100.0  # Metres, for the computation of scales


def bend(xyz: Floats, crs: str = "") -> Phrase:
    """Return the effect of a map projection on (n, 3) positions, metres.

    `extent` is the distance from the centre of the block to its edge, `curvature` the height of the plane
    above a level surface at the edge, d^2 / 2R. If the projection is known, `least` and `largest` are the
    relative excess (ppm) of horizontal lengths in the plane over lengths in space; heights have scale 1.
    """
    middle = (xyz.min(axis=0) + xyz.max(axis=0)) / 2
    extent = float(np.hypot(*(xyz - middle)[:, :2].T).max())
    sizes = {"curvature": extent**2 / (2 * RADIUS), "extent": extent}
    if not crs:
        return phrase("planes.heights", **sizes)
    corners = np.array([middle, *xyz[xyz[:, :2].argmin(axis=0)], *xyz[xyz[:, :2].argmax(axis=0)]])
    east = np.array([LONG_STEP / 2, 0.0, 0.0])
    steps = geocentric(crs, corners + east) - geocentric(crs, corners - east)
    found = 1e6 * (LONG_STEP / np.linalg.norm(steps, axis=1) - 1)
    return phrase("planes.scales", **sizes, least=float(found.min()), largest=float(found.max()))


def plane_remarks(block: Block, path: Path, starts: Floats | None = None) -> list[Message]:
    """Return remarks on the effect if a block seems to be in a map projection.

    `starts`: (n, 3) approximate positions of its points; NaN if unknown.
    """
    frame = block.frame
    if frame.kind != "cartesian" or block.geographic:
        return []
    known = np.vstack([block.photo_positions, block.point_positions, *([] if starts is None else [starts])])
    known = known[np.isfinite(known).all(axis=1)] * METRES_PER_UNIT.get(block.linear_unit, 1.0)
    if len(known) < 2:
        return []
    if frame.crs:
        if not is_projected(frame.crs):
            return []
        return [Message(phrase("planes.projected", crs=frame.crs, bend=bend(known, frame.crs)), path)]
    like_a_map = (np.abs(np.median(known[:, :2], axis=0)) > LIKE_A_PLANE).all()
    if not like_a_map or np.abs(known[:, 2]).max() > LIKE_A_PLANE:
        return []
    return [Message(phrase("planes.map", bend=bend(known)), path)]
