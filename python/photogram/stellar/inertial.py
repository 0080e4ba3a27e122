"""Attitudes of exposures in the inertial system ICRS: matrices, quaternions, covariances."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.stellar.places import Earth, sidereal_time, to_date
from photogram.stellar.sky import Site
from photogram.stellar.transformation import pole_matrix, terrestrial

__all__ = ["InertialAttitude", "equatorial_axes", "inertial_attitude"]


@dataclass(frozen=True, eq=False)
class InertialAttitude:
    """The attitude of an exposure in ICRS.

    Axes of the camera are x right, y down, z along the axis; that is the camera of computer vision.

    Attributes
    ----------
    matrix
        (3, 3) R with camera direction = R times ICRS direction, of places without aberration and refraction;
        det R = 1.
    covariance
        (3, 3) radians squared: of the small turn d about the axes of the camera with R_true = Exp(d) R.
    """

    matrix: Floats
    covariance: Floats

    @property
    def quaternion(self) -> Floats:
        """(4,) w, x, y, z of the same rotation: Hamilton's, w first and not negative; camera = q icrs q*."""
        vector = _photocore.rotation_vectors(self.matrix[None])[0]
        angle = float(np.linalg.norm(vector))
        # sin(angle / 2) / angle
        factor = 0.5 * float(np.sinc(angle / (2 * np.pi)))
        found = np.concatenate([[np.cos(0.5 * angle)], factor * vector])
        return np.asarray(found if found[0] >= 0 else -found, float)

    @property
    def quaternion_covariance(self) -> Floats:
        """(4, 4) of the quaternion, to first order: of rank 3, as its length is 1."""
        w, x, y, z = self.quaternion
        # (0, d / 2) times q.
        partials = 0.5 * np.array([[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]])
        return np.asarray(partials @ self.covariance @ partials.T, float)

    @property
    def axis(self) -> tuple[float, float]:
        """Right ascension (0 to 2 pi) and declination of the camera's axis, radians."""
        x, y, z = self.matrix[2]
        return float(np.arctan2(y, x) % (2 * np.pi)), float(np.arctan2(z, np.hypot(x, y)))


def inertial_attitude(
    angles: Floats, covariance: Floats, site: Site, utc: str, earth: Earth | None = None
) -> InertialAttitude:
    """Return the attitude of an exposure in ICRS.

    Parameters
    ----------
    angles, covariance
        (3,) alpha, omega, kappa from the mean pole, radians, and their covariance (3, 3).
    site
        The station, from the mean pole.
    utc
        Mid exposure.
    earth
        UT1 - UTC and the pole; zero when None.

    Notes
    -----
    From the axes of the camera to north, east, zenith by the transposed matrix of the report, to hour angle
    and declination by the latitude, to the true equator and equinox by apparent sidereal time, to ICRS by the
    transposed matrix of bias, precession and nutation (IAU 2006/2000A).
    """
    earth = earth or Earth()
    matrix = _photocore.pointing_matrix(np.asarray(angles, float))
    local = _local_axes(matrix)
    place = earth.site_of_date(site)
    seen = matrix.T
    if earth.pole != (0.0, 0.0):
        seen = terrestrial(place).T @ pole_matrix(earth.pole).T @ terrestrial(site) @ seen
    equatorial = equatorial_axes(place.latitude, sidereal_time(place, utc, earth.dut1))
    turned = to_date(utc).T @ equatorial @ seen
    # The pole's small rotation is not quite orthogonal.
    left, _, right = np.linalg.svd(turned.T)
    return InertialAttitude(np.asarray(left @ right, float), np.asarray(local @ covariance @ local.T, float))


def _local_axes(m: Floats) -> Floats:
    """Return the turns about the axes of the camera (columns) that alpha, omega, kappa make."""
    alpha = [
        m[2, 2] * m[1, 0] - m[2, 0] * m[1, 2],
        m[0, 2] * m[2, 0] - m[0, 0] * m[2, 2],
        m[1, 2] * m[0, 0] - m[1, 0] * m[0, 2],
    ]
    # -cos omega sin kappa and cos omega cos kappa stand in the second column.
    cosine = np.hypot(m[0, 1], m[1, 1])
    omega = [m[1, 1] / cosine, -m[0, 1] / cosine, 0.0] if cosine > 0 else [1.0, 0.0, 0.0]
    return np.column_stack([alpha, omega, [0.0, 0.0, 1.0]])


def equatorial_axes(latitude: float, time: float) -> Floats:
    """Return the matrix from north, east, zenith to the true equator and equinox of date."""
    (sp, cp), (sl, cl) = (np.sin(latitude), np.cos(latitude)), (np.sin(time), np.cos(time))
    # cos(dec) cos H, cos(dec) sin H, sin(dec); then the hour angle becomes right ascension.
    hour = np.array([[-sp, 0.0, cp], [0.0, -1.0, 0.0], [cp, 0.0, sp]])
    turn = np.array([[cl, sl, 0.0], [sl, -cl, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ hour, float)
