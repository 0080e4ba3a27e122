"""Geometry: rotations, geographic and geocentric coordinates, projection into photos.

Angles are radians, image coordinates millimetres, lengths the linear unit of the object space. Rotation,
frames and collinearity follow the GIANT Program User's Guide (Elassal and Malhotra, NOAA 1987).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import shaped, truth_value
from photogram.arguments.fields import check_fields
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.refraction import Refraction
from photogram.words import Phrase, phrase

__all__ = [
    "Spheroid",
    "geocentric_to_geographic",
    "geographic_to_geocentric",
    "lengths_of_units",
    "local_frames",
    "project",
    "refraction_shift",
    "rotation_angles",
    "rotation_matrix",
    "viewing_directions",
]


@dataclass(frozen=True)
class Frame:
    """Reference frame of the coordinates of a block.

    Attributes
    ----------
    kind
        `cartesian`, `topocentric` (east, north, up at the origin), `geocentric` or `geographic`.
    crs
        Coordinate reference system of the origin, or of the coordinates; empty if unspecified.
    origin
        Latitude and longitude in degrees and ellipsoidal height in metres of a topocentric frame.
    ellipsoid
        Semi-axes of the ellipsoid of geographic coordinates; WGS 84.
    """

    kind: str = "cartesian"
    crs: str = ""
    origin: tuple[float, float, float] | None = None
    ellipsoid: tuple[float, float] = (6378137.0, 6356752.314245179)

    @property
    def phrase(self) -> Phrase:
        """The frame as a message."""
        own = Phrase(f"frame.{self.kind}")
        if self.origin is not None:
            place = zip(("latitude", "longitude", "height"), self.origin, strict=True)
            own = Phrase("frame.origin", {"frame": own, **dict(place)})
        return Phrase("frame.crs", {"frame": own, "crs": self.crs}) if self.crs else own

    def __str__(self) -> str:
        return str(self.phrase)


@dataclass(frozen=True)
class Spheroid:
    """Ellipsoid of revolution; heights define its linear unit.

    Parameters
    ----------
    a, b
        Semi-major and semi-minor axis.

    Raises
    ------
    InputError
        If the axes are not finite, or do not satisfy 0 < b <= a.
    """

    a: float
    b: float

    def __post_init__(self) -> None:
        check_fields(self)
        if not (math.isfinite(self.a) and 0 < self.b <= self.a):
            raise InputError(phrase("block.spheroid", a=self.a, b=self.b))

    @classmethod
    def clarke_1866(cls) -> Spheroid:
        """Clarke 1866 in metres, the default of GIANT."""
        return cls(6378206.4, 6356583.8)

    @classmethod
    def wgs84(cls) -> Spheroid:
        """WGS 84 in metres."""
        return cls(6378137.0, 6356752.314245179)


def rotation_matrix(angles: ArrayLike) -> Floats:
    """Compute (n, 3, 3) matrices M_kappa M_phi M_omega of (n, 3) omega, phi, kappa, radians.

    Raises
    ------
    ValueError
        If the shape is wrong.
    """
    return _photocore.rotation_matrix(_floats(angles))


def rotation_angles(matrices: ArrayLike) -> Floats:
    """Compute (n, 3) omega, phi, kappa (rad) of (n, 3, 3) matrices; phi in [-pi/2, pi/2].

    Raises
    ------
    ValueError
        If the shape is wrong.
    """
    return _photocore.rotation_angles(_floats(matrices))


def rotation_fault(matrix: Floats, tolerance: float = 1e-6) -> Phrase | None:
    """Return the fault of a (3, 3) matrix of a file; None for a rotation within the precision of the file."""
    with np.errstate(over="ignore", invalid="ignore"):
        apart = np.abs(matrix @ matrix.T - np.eye(3))
    if apart.max() < tolerance:
        return None if np.linalg.det(matrix) > 0 else phrase("format.rotation.mirrored")
    row = int(np.argmax(apart.sum(axis=1)))
    return phrase("format.rotation.row", row=row + 1, excess=float(apart[row].max()))


def geographic_to_geocentric(positions: ArrayLike, spheroid: Spheroid) -> Floats:
    """Convert (n, 3) longitude (rad, east positive), latitude (rad), height to X, Y, Z.

    Raises
    ------
    ValueError
        If the shape is wrong.
    """
    return _photocore.geographic_to_geocentric(_floats(positions), spheroid.a, spheroid.b)


def geocentric_to_geographic(xyz: ArrayLike, spheroid: Spheroid) -> Floats:
    """Convert (n, 3) geocentric X, Y, Z to longitude (rad), latitude (rad) and height.

    Raises
    ------
    ValueError
        If the shape is wrong.
    """
    return _photocore.geocentric_to_geographic(_floats(xyz), spheroid.a, spheroid.b)


@dataclass(frozen=True)
class Cartesian:
    """Cartesian axes of a block: geocentric, or its own axes if `spheroid` is None."""

    spheroid: Spheroid | None

    def positions(self, positions: Floats) -> Floats:
        """Convert (n, 3) positions of the block to these axes; NaN if unknown."""
        if self.spheroid is None:
            return positions
        return geographic_to_geocentric(positions, self.spheroid)

    def from_cartesian(self, positions: Floats) -> Floats:
        """Convert positions in these axes to positions of the block."""
        if self.spheroid is None or not len(positions):
            return positions
        return geocentric_to_geographic(positions, self.spheroid)

    def from_local(self, attitudes: Floats, positions: Floats) -> Floats:
        """Convert (n, 3, 3) attitudes in local frames at positions of the block to these axes."""
        if self.spheroid is None:
            return attitudes
        return np.asarray(local_frames(positions).transpose(0, 2, 1) @ attitudes)

    def to_local(self, attitudes: Floats, positions: Floats) -> Floats:
        """Convert attitudes in these axes to local frames at positions of the block."""
        if self.spheroid is None:
            return attitudes
        return np.asarray(local_frames(positions) @ attitudes)


def lengths_of_units(positions: ArrayLike, spheroid: Spheroid | None) -> Floats:
    """Return (n, 3) lengths of the coordinate units at positions, in the linear unit.

    They are 1 in rectangular space. In geographic space, the length for longitude is the radius of the
    parallel. The length for latitude is the radius of curvature of the meridian. Both refer to the height of
    the position.
    """
    values = _floats(positions)
    if spheroid is None:
        return np.ones_like(values)
    latitude, height = values[:, 1], values[:, 2]
    w = np.sqrt(1 - (1 - (spheroid.b / spheroid.a) ** 2) * np.sin(latitude) ** 2)
    parallel = (spheroid.a / w + height) * np.cos(latitude)
    meridian = spheroid.b**2 / spheroid.a / w**3 + height
    return np.stack([parallel, meridian, np.ones_like(height)], axis=1)


def local_frames(positions: ArrayLike) -> Floats:
    """Return (n, 3, 3) local frames, rows east, north, up, at longitude, latitude (rad), height.

    Raises
    ------
    InputError
        If the shape is wrong.
    """
    values = shaped("positions", positions, (None, 3))
    longitude, latitude = values[:, :2].T
    sl, cl, sp, cp = np.sin(longitude), np.cos(longitude), np.sin(latitude), np.cos(latitude)
    rows = [[-sl, cl, np.zeros_like(sl)], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)


def photo_axes(attitudes: ArrayLike, photo_to_ground: bool) -> Floats:
    """Return photo axes as columns, (n, 3, 3), of (n, 3) omega, phi, kappa."""
    rotations = rotation_matrix(attitudes)
    return rotations if photo_to_ground else rotations.transpose(0, 2, 1)


def viewing_directions(
    positions: ArrayLike,
    attitudes: ArrayLike,
    *,
    spheroid: Spheroid | None = None,
    photo_to_ground: bool = False,
) -> Floats:
    """Return viewing directions, the negative z axes of photos, as (n, 3) unit vectors.

    Arguments as in :func:`project`; with a spheroid the directions are geocentric.
    """
    truth_value("photo_to_ground", photo_to_ground)
    directions = -photo_axes(attitudes, photo_to_ground)[:, :, 2]
    if spheroid is None:
        return directions
    return np.asarray(np.einsum("nij,ni->nj", local_frames(positions), directions))


def project(
    points: ArrayLike,
    positions: ArrayLike,
    attitudes: ArrayLike,
    principal_distances: ArrayLike,
    *,
    spheroid: Spheroid | None = None,
    photo_to_ground: bool = False,
    refraction: Refraction | None = None,
    linear_unit: str = "m",
) -> Floats:
    """Project points into photos row by row: point i into photo i.

    Parameters
    ----------
    points, positions
        (n, 3) object points and projection centres: X, Y, Z, or longitude (rad), latitude (rad), height if
        a spheroid is given.
    attitudes
        (n, 3) omega, phi, kappa in radians; with a spheroid relative to the local vertical frame of each
        station.
    principal_distances
        (n,) in millimetres: negative for the positive (diapositive) plane, positive for the negative plane.
    spheroid
        None for rectangular space.
    photo_to_ground
        Direction of the angles; False is ground-to-photo.
    refraction
        Refraction model; None for straight rays.
    linear_unit
        Linear unit of the object space, "m" or "ft"; required by refraction.

    Returns
    -------
    (n, 2) x, y in millimetres; not finite for a point in the plane of the projection centre.

    Raises
    ------
    ValueError
        If shapes or numbers of rows differ, or refraction has another linear unit (an InputError).
    """
    truth_value("photo_to_ground", photo_to_ground)
    return _photocore.project(
        _floats(points),
        _floats(positions),
        _floats(attitudes),
        _floats(principal_distances),
        spheroid=None if spheroid is None else (spheroid.a, spheroid.b),
        photo_to_ground=photo_to_ground,
        refraction=None if refraction is None else refraction.row(linear_unit),
    )


def refraction_shift(
    points: ArrayLike,
    positions: ArrayLike,
    refraction: Refraction,
    *,
    spheroid: Spheroid | None = None,
    linear_unit: str = "m",
) -> Floats:
    """Compute the refraction displacement of points as seen by cameras, row by row.

    Parameters
    ----------
    points, positions
        (n, 3) object points and projection centres, as for :func:`project`.
    refraction
        Refraction model.
    spheroid
        None for rectangular space.
    linear_unit
        Linear unit of the object space, "m" or "ft".

    Returns
    -------
    (n, 3) vectors in the linear unit, along X, Y, Z or the geocentric axes. The lift dZ of the GIANT guide
    (Appendices F and G) is along the up direction of the camera. The lift of the ray by Snell's law is along
    the up direction of the point. Zero if no model applies.

    Raises
    ------
    ValueError
        If shapes or numbers of rows differ, or the linear unit is another one (an InputError).
    """
    return _photocore.refraction_shift(
        _floats(points),
        _floats(positions),
        spheroid=None if spheroid is None else (spheroid.a, spheroid.b),
        refraction=refraction.row(linear_unit),
    )


def _floats(values: ArrayLike) -> Floats:
    return np.asarray(values, dtype=np.float64)
