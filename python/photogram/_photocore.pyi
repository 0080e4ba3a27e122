"""The numerical core, compiled. Private: use it through the modules of `photogram`.

Arrays are float64. Angles are radians, image coordinates millimetres, lengths the linear unit of the object
space. All functions release the GIL.
"""

from collections.abc import Callable
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Indices = NDArray[np.int64]

IterationRow = tuple[int, float, float, float]
"""Number from 1, weighted sum of squares after it, largest change in standard deviations, damping."""

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

class BlockError(Exception):
    """A block that cannot be adjusted.

    `args` is (kind, message, photos, points): kind is `undetermined points`, `undetermined photos`, `no
    intersection`, `not finite`, `empty` or `input`; photos is a list of photo indices for each undetermined
    combination of unknowns, points a list of point indices.
    """

def adjust_block(
    photo_positions: _Floats,
    photo_attitudes: _Floats,
    photo_position_sd: _Floats,
    photo_attitude_sd: _Floats,
    principal_distances: _Floats,
    point_positions: _Floats,
    point_sd: _Floats,
    image_photos: _Indices,
    image_points: _Indices,
    image_xy: _Floats,
    image_sd: _Floats,
    *,
    spheroid: tuple[float, float] | None,
    photo_to_ground: bool,
    criterion: str,
    limit: float,
    max_iterations: int,
    covariance: bool,
    ordering: str,
    unit_variance: str,
    threads: int,
    progress: Callable[[str, int, int, IterationRow | None], None] | None,
) -> BlockSolution:
    """Adjust a block by least squares (GIANT guide, sections 4 to 9).

    Standard deviations are infinite for free unknowns, zero for fixed ones. Positions are X, Y, Z, or
    longitude (rad), latitude (rad), height when a spheroid is given.

    Parameters
    ----------
    photo_positions, photo_attitudes, photo_position_sd, photo_attitude_sd
        (P, 3) initial (and, where weighted, observed) values and their standard deviations; omega, phi, kappa
        in radians.
    principal_distances
        (P,) millimetres, signed.
    point_positions, point_sd
        (n, 3) coordinates, NaN where unknown, and standard deviations, finite for held components.
    image_photos, image_points
        (m,) indices.
    image_xy, image_sd
        (m, 2) millimetres.
    spheroid
        Semi-axes (a, b) for geographic space, None for rectangular space.
    photo_to_ground
        The sense of the angles.
    criterion, limit
        `fraction`: no unknown changes by more than `limit` of its standard deviation; `percent`: the sum of
        squares changes by less than `limit` percent.
    max_iterations
        Iterations at the most.
    covariance
        Whether to compute cofactors and redundancy numbers; NaN otherwise.
    ordering
        `auto`, `input` or `rcm`.
    unit_variance
        `free`, `constrained` or `unity` (GIANT guide, Appendix E).
    threads
        Number of threads; 0 for all processors.
    progress
        Called on the calling thread as (phase, points done, points in all, None), or ("iteration", number, 0,
        row). What it raises stops the adjustment and is passed on. Signals are looked after at the same time,
        so that Ctrl-C stops it too.

    Raises
    ------
    BlockError
        A block that cannot be adjusted.
    ValueError
        An argument of another shape, length or choice; the message names it.
    """

@final
class BlockSolution:
    """An adjusted block, in the order of its photos (P), points (n) and images (m).

    Points and images that were left out are NaN. Cofactors hold for a priori unit weight.
    """

    @property
    def status(self) -> str:
        """`converged`, `not converged` or `diverged`."""

    @property
    def initial_sum_of_squares(self) -> float:
        """Weighted sum of squares at the initial values."""

    @property
    def iterations(self) -> list[IterationRow]:
        """Every iteration."""

    @property
    def photo_positions(self) -> _Floats:
        """(P, 3) X, Y, Z, or longitude (rad), latitude (rad), height."""

    @property
    def photo_attitudes(self) -> _Floats:
        """(P, 3) omega, phi, kappa in radians."""

    @property
    def photo_cofactors(self) -> _Floats:
        """(P, 6, 6): position, then attitude, in the units of the values."""

    @property
    def photo_redundancy(self) -> _Floats:
        """(P, 6) redundancy numbers of position and attitude as observations; 0 unless weighted."""

    @property
    def point_positions(self) -> _Floats:
        """(n, 3) X, Y, Z, or longitude (rad), latitude (rad), height."""

    @property
    def point_cofactors(self) -> _Floats:
        """(n, 3, 3) in the units of the values."""

    @property
    def point_redundancy(self) -> _Floats:
        """(n, 3) redundancy numbers of held components; 0 unless weighted."""

    @property
    def point_rays(self) -> _Indices:
        """(n,) number of images; 0 for points left out."""

    @property
    def residuals(self) -> _Floats:
        """(m, 2) observed minus computed, millimetres."""

    @property
    def redundancy(self) -> _Floats:
        """(m, 2) redundancy numbers."""

    @property
    def standardized(self) -> _Floats:
        """(m, 2) residual / (standard deviation x root of redundancy number), a priori unit weight."""

    @property
    def dropped(self) -> list[tuple[int, str]]:
        """Points left out, each with the reason."""

    @property
    def sums_of_squares(self) -> tuple[float, float, float]:
        """Weighted sums of squares: camera, ground, plates."""

    @property
    def degrees_of_freedom(self) -> int:
        """Of the chosen unit variance."""

    @property
    def variance_of_unit_weight(self) -> float | None:
        """None without degrees of freedom."""

    @property
    def counts(self) -> tuple[int, int, int]:
        """Image coordinates, weighted unknowns, unknowns that are not fixed."""

    @property
    def ordering(self) -> str:
        """`input` or `rcm`."""

    @property
    def operations(self) -> dict[str, float]:
        """Predicted multiply-adds of `reduction`, `factor` and `inverse`, each time they are carried out."""

    @property
    def formations(self) -> int:
        """How often the normal equations were formed."""

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds in `form`, `factor`, `solve`, `invert` and `cofactors`, over all iterations."""

_Station = tuple[float, float, float, float]
"""Latitude (rad), constant of diurnal aberration (rad), temperature (K), pressure (mm of mercury)."""
_CameraKind = tuple[float | None, bool, bool]
"""Principal distance of the distorted image (None: scale first), Brown's decentering, common scale."""

class StellarError(Exception):
    """The camera cannot be calibrated.

    `args` are the kind (`undetermined stars`, `undetermined`, `weight`, `not finite`, `input`), a message,
    and the indices of the stars concerned.
    """

def refraction(
    zenith_distances: _Floats, temperature: float, pressure: float, tau: _Floats, observed: bool
) -> _Floats:
    """Refraction of (n,) zenith distances, observed or true, radians (NOAA TR NOS 55, equations 7 to 11).

    Parameters
    ----------
    zenith_distances
        (n,) radians.
    temperature, pressure
        Kelvin, millimetres of mercury.
    tau
        (4,) coefficients in seconds of arc.
    observed
        Whether the zenith distances are observed.

    Returns
    -------
    (n,) true minus observed zenith distance, radians.
    """

def standard_coordinates(places: _Floats, sidereal_times: _Floats, place: _Station, tau: _Floats) -> _Floats:
    """Refracted standard coordinates xi (north), eta (east), (n, 2), of (n, 2) apparent places.

    NaN at and below the horizon.
    """

def star_places(standard: _Floats, sidereal_times: _Floats, place: _Station, tau: _Floats) -> _Floats:
    """Apparent right ascension and declination, (n, 2), of refracted standard coordinates."""

def pointing_matrix(angles: _Floats) -> _Floats:
    """Matrix (3, 3) of alpha, omega, kappa (3,): north, east, zenith to x, y, axis (equation 19)."""

def pointing_of_matrix(matrix: _Floats) -> _Floats:
    """Angles alpha, omega, kappa (3,) of a matrix (3, 3)."""

def plate_images(standard: _Floats, angles: _Floats, interior: _Floats, camera: _CameraKind) -> _Floats:
    """Plate coordinates (n, 2) of standard coordinates (n, 2); NaN behind the camera.

    Parameters
    ----------
    standard
        (n, 2) xi, eta.
    angles
        (3,) alpha, omega, kappa.
    interior
        (13,) epsilon, xp, yp, cx, cy, dx, dy, K1, K2, K3, and K4, K5, phi_T or P1, P2, P3.
    camera
        Its kind.
    """

def plate_directions(
    xy: _Floats, angles: _Floats, interior: _Floats, camera: _CameraKind, *, tolerance: float, passes: int
) -> _Floats:
    """Directions of plate coordinates, the inverse of `plate_images`.

    Returns
    -------
    (n, 5) xi, eta, undistorted x, y, and 1 where the distortion settled within `tolerance` in `passes`
    passes.
    """

@final
class StellarProblem:
    """A calibration as it is known beforehand: S stars, G attitudes, m images.

    Parameters
    ----------
    station, camera
        Where, and the kind of the camera.
    pointings, common
        (G, 3) attitudes; (17,) 13 interior parameters and 4 coefficients of refraction (arcsec).
    fixed
        3 G + 17 flags: which parameters are held.
    weighted, weighted_values, weight_root
        (k,) which parameters have weight, their given values, and R (k, k) of their weight matrix R^T R. With
        more than three attitudes only common parameters can.
    star_places, star_catalogue, star_weights, star_fixed
        (S, 2) initial and catalogue places; (S, 2, 2) weights, zero for unknown directions; S flags.
    image_stars, image_pointings, image_xy, image_weights, image_times, image_shifts
        (m,) indices of star and attitude; (m, 2) measured; (m, 2, 2); (m,) sidereal time; (m, 2) place of the
        star at the time of the image minus the place that is adjusted.
    axis
        Attitude, standard coordinates, plate coordinates and weight of the axis, if it is known.

    Raises
    ------
    ValueError
        An argument of another shape.
    """

    def __new__(
        cls,
        *,
        station: _Station,
        camera: _CameraKind,
        pointings: _Floats,
        common: _Floats,
        fixed: list[bool],
        weighted: _Indices,
        weighted_values: _Floats,
        weight_root: _Floats,
        star_places: _Floats,
        star_catalogue: _Floats,
        star_weights: _Floats,
        star_fixed: list[bool],
        image_stars: _Indices,
        image_pointings: _Indices,
        image_xy: _Floats,
        image_weights: _Floats,
        image_times: _Floats,
        image_shifts: _Floats,
        axis: tuple[int, tuple[float, float], list[float], list[list[float]]] | None,
    ) -> StellarProblem: ...
    def adjust(
        self,
        *,
        unit: float,
        fraction: float,
        max_iterations: int,
        covariance: bool,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> dict[str, Any]:
        """Adjust by least squares with exact partials.

        Parameters
        ----------
        unit
            Mean error of unit weight that is expected: `fraction` and the history count in it.
        fraction
            Converged when no unknown changes by more than this fraction of its standard deviation.
        max_iterations, covariance, threads, progress
            As for `adjust_block`.

        Returns
        -------
        `status`, `iterations`, `initial_sum_of_squares` (in units of `unit` squared), `parameters`
        (3 G + 17,), `cofactors` for unit weight (all parameters squared where G <= 3; else of each attitude
        3 x 20, then 17 x 17), `places` (S, 2), `place_cofactors` (S, 2, 2), `residuals` (m, 2) measured minus
        computed, `axis_residual`, `sums_of_squares` (images, stars, parameters, axis), and `redundancy` and
        `standardized` of `image`, `place`, `axis`: of decorrelated components where weights are correlated.

        Raises
        ------
        StellarError
            Unknowns that are not determined, or initial values that give no image.
        """

    def equations(self) -> dict[str, _Floats]:
        """Equations of the images at the initial values with exact partials, not weighted.

        Returns
        -------
        `constant` (m, 2) measured minus computed, `star` (m, 2, 2), `pointing` (m, 2, 3), `common` (m, 2,
        17).
        """

    def axis_equations(self) -> dict[str, _Floats]:
        """Equations of the axis as `equations` has them, with one row or none."""

    def published(
        self, corrections: _Floats, *, refraction: float, distortion: float, passes: int
    ) -> dict[str, Any]:
        """Equations of the images as the report's program formed them (equations 48 to 62, 73, 74).

        Parameters
        ----------
        corrections
            (S, 2) added to the refracted places.
        refraction, distortion, passes
            Tolerances (radians, unit of the plate) and limit of the inner iterations.

        Returns
        -------
        As `equations`, and `standard` (m, 2), `undistorted` (m, 2), `unsettled`: images and last changes.
        """

    def directions(self) -> _Floats:
        """Right ascension and declination (m, 2) of every image at the initial values."""
