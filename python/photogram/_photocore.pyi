"""The numerical core, compiled. Private: use it through the modules of `photogram`.

Arrays are float64. Angles are radians, image coordinates millimetres, lengths the linear unit of the object
space. All functions release the GIL.
"""

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

__version__: str

def rotation_matrix(angles: _Floats) -> _Floats:
    """Rotation matrices M = M_kappa M_phi M_omega.

    Parameters
    ----------
    angles
        (n, 3) omega, phi, kappa in radians.

    Returns
    -------
    (n, 3, 3) matrices.

    Raises
    ------
    ValueError
        An argument of another shape; the message names it and its shape.
    """

def rotation_angles(matrices: _Floats) -> _Floats:
    """Angles omega, phi, kappa of rotation matrices, the inverse of `rotation_matrix`.

    Parameters
    ----------
    matrices
        (n, 3, 3) orthogonal matrices with determinant 1.

    Returns
    -------
    (n, 3) omega and kappa in [-pi, pi], phi in [-pi/2, pi/2], radians. Where phi is +-pi/2 only omega + kappa
    or omega - kappa is determined; the angles returned give the matrix.

    Raises
    ------
    ValueError
        An argument of another shape; the message names it and its shape.
    """

def geographic_to_geocentric(positions: _Floats, a: float, b: float) -> _Floats:
    """Geocentric X, Y, Z of geographic positions.

    Parameters
    ----------
    positions
        (n, 3) longitude (rad, east positive), latitude (rad), height above the spheroid (linear unit of the
        axes).
    a, b
        Semi-major and semi-minor axis, 0 < b <= a.

    Returns
    -------
    (n, 3) X, Y, Z in the linear unit of the axes.

    Raises
    ------
    ValueError
        An argument of another shape (the message names it and its shape) or axes that make no spheroid.
    """

def geocentric_to_geographic(xyz: _Floats, a: float, b: float) -> _Floats:
    """Geographic positions of geocentric X, Y, Z, the inverse of `geographic_to_geocentric`.

    Parameters
    ----------
    xyz
        (n, 3) in the linear unit of the axes.
    a, b
        Semi-major and semi-minor axis, 0 < b <= a.

    Returns
    -------
    (n, 3) longitude (rad, in [-pi, pi], 0 on the axis), latitude (rad), height (linear unit of the axes), to
    the rounding of the coordinates.

    Raises
    ------
    ValueError
        An argument of another shape (the message names it and its shape) or axes that make no spheroid.
    """

def project(
    points: _Floats,
    positions: _Floats,
    attitudes: _Floats,
    principal_distances: _Floats,
    *,
    spheroid: tuple[float, float] | None,
    photo_to_ground: bool,
) -> _Floats:
    """Image coordinates of points, row by row: point i on the photo of row i.

    x = c u1/u3, y = c u2/u3 with u = M d (ground-to-photo) or M^T d (photo-to-ground); d is the vector from
    the projection centre to the point: in object space axes when rectangular, in the local vertical frame of
    the station (east, north, up) when geographic.

    Parameters
    ----------
    points
        (n, 3) X, Y, Z, or longitude (rad), latitude (rad), height.
    positions
        (n, 3) projection centres, likewise.
    attitudes
        (n, 3) omega, phi, kappa in radians.
    principal_distances
        (n,) c in millimetres: negative for the positive (diapositive) plane, positive for the negative plane.
    spheroid
        Semi-axes (a, b) for geographic space, None for rectangular space.
    photo_to_ground
        The sense of the angles.

    Returns
    -------
    (n, 2) x, y in millimetres; not finite for a point in the plane of the projection centre (u3 = 0).

    Raises
    ------
    ValueError
        An argument of another shape or length (the message names it and its shape) or axes that make no
        spheroid.
    """
