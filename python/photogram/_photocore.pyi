"""The numerical core, compiled. Private: use it through the modules of `photogram`.

Arrays are float64. Angles are radians, image coordinates millimetres, lengths the linear unit of the object
space. All functions release the GIL.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypedDict, final

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Indices = NDArray[np.int64]
FoundRow = tuple[
    _Floats,
    _Floats,
    list[tuple[str, int, int]],
    _Floats,
    NDArray[np.bool_],
    NDArray[np.bool_],
    int | None,
    float | None,
]
"""Result of `find_first_values`."""

IterationRow = tuple[int, float, float, float]
"""Number from 1, weighted sum of squares after it, largest change in standard deviations, damping."""

CombinationRow = tuple[list[int], list[int], list[int], list[tuple[int, int]], list[str]]
"""Photos; cameras shared by several of them; common unknowns; cameras with notable parameters; notable
components of poses: positions `along` and `across` the view, `tilt`, `swing` about the view."""

FailureRow = tuple[str, str, list[CombinationRow], list[int], list[float]]
"""The reason why a network cannot be adjusted, as in :class:`BlockError`."""

CameraRow = tuple[list[float], list[float], list[float], list[float], int, int]
"""Adjusted camera: k parameters, k x k cofactors row by row, k redundancy numbers, the diagonal of the
normal equations (k), photos, image observations."""

ContributionRow = tuple[_Floats, _Floats, _Floats]
"""Contribution of a node to the one above: matrix, right-hand side, diagonal; see :class:`FormedNode`."""

_DatumRow = tuple[str, list[int], list[int], bool, list[int], float | None]
"""Datum: name, points, photos, whether scale counts, photos whose attitudes count, radius."""

RefractionRow = tuple[str | None, str | None, float, float, float]
"""Model of the air (`giant`, `standard` or None), model of the water (`giant`, `snell` or None), water level
(linear unit), refractive index of the water, metres in the linear unit."""

FlownRow = tuple[
    _Floats, _Floats, _Floats, _Floats, list[tuple[int, list[float]]], list[tuple[int, list[float]]]
]
"""Result of `flown`."""

class TrajectoryRow(TypedDict):
    """A trajectory for the core; coefficients are indices among the common unknowns."""

    times: list[float]
    positions: _Floats
    velocities: _Floats | None
    interpolation: str
    attitudes: tuple[list[float], _Floats, str]
    position_basis: tuple[str, int, list[float]]
    rotation_basis: tuple[str, int, list[float]]
    position: list[int]
    rotation: list[int]
    body: tuple[list[float], _Floats, str] | None
    axes: str
    rotations: str

__version__: str

def chi_square(x: float, dof: float, *, upper: bool = True) -> float:
    """Return the probability that a chi-square variable exceeds `x`, or is less than `x`.

    Parameters
    ----------
    x
        Not negative.
    dof
        Degrees of freedom, positive, not necessarily whole.
    upper
        True for the probability of larger values, False for smaller ones.

    Returns
    -------
    NaN for arguments outside these ranges.
    """

def chi_square_quantile(probability: float, dof: float, *, upper: bool = True) -> float:
    """Return the value that a chi-square variable exceeds (`upper`), or not, with a probability.

    Parameters
    ----------
    probability
        Between 0 and 1; accurate for small values on both sides.
    dof
        Degrees of freedom, positive, not necessarily whole.
    upper
        True for the upper tail, False for the lower tail.

    Returns
    -------
    NaN for arguments outside these ranges.
    """

def normal(z: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) probabilities that a normal variable is below values."""

def student(t: float, dof: float) -> float:
    """Return the probability that the absolute value of Student's variable exceeds `abs(t)`.

    Returns
    -------
    NaN for invalid arguments.
    """

def student_limit(probability: float, dof: float) -> float:
    """Return the value that the absolute value of Student's variable exceeds with a probability.

    Returns
    -------
    NaN for invalid arguments.
    """

def fisher(x: float, first: float, second: float) -> float:
    """Return the probability that Fisher's variable of `first` and `second` degrees of freedom exceeds `x`.

    Returns
    -------
    NaN for invalid arguments.
    """

def fisher_limit(probability: float, first: float, second: float) -> float:
    """Return the value that Fisher's variable of two degrees of freedom exceeds with a probability.

    Returns
    -------
    NaN for invalid arguments.
    """

def log_chi_square(x: _Floats, dof: _Floats) -> _Floats:
    """Return logarithms of the probabilities that chi-square variables exceed values.

    Parameters
    ----------
    x
        (n,) not negative.
    dof
        (n,) degrees of freedom, positive.

    Returns
    -------
    (n,) natural logarithms, also if the probability underflows; NaN for arguments outside these ranges.
    """

def log_fisher(x: _Floats, first: _Floats, second: _Floats) -> _Floats:
    """Return logarithms of the probabilities that Fisher's variables exceed values.

    Parameters
    ----------
    x
        (n,) not negative.
    first, second
        (n,) degrees of freedom, positive.

    Returns
    -------
    (n,) natural logarithms, also if the probability underflows; NaN for arguments outside these ranges.
    """

def noncentral_chi_square(x: float, dof: float, noncentrality: float) -> float:
    """Return the probability that a noncentral chi-square variable exceeds `x`; NaN if invalid."""

def noncentral_fisher(x: float, first: float, second: float, noncentrality: float) -> float:
    """Return the probability that a noncentral F variable exceeds `x`; NaN if invalid.

    If `second` is infinite, this is the noncentral chi-square variable over `first`.
    """

def detectable_noncentrality(level: float, power: float, first: float, second: float) -> float:
    """Return the noncentrality (Baarda's lambda0) at which a test is significant with a given probability.

    Parameters
    ----------
    level
        Significance level of the test.
    power
        Probability of detecting the error; more than the level.
    first, second
        Degrees of freedom of the F test; of the chi-square test if `second` is infinite.

    Returns
    -------
    NaN for arguments outside these ranges.
    """

def level_of_equal_power(noncentrality: float, power: float, dof: float) -> tuple[float, float]:
    """Return level and critical value of the chi-square test with a given power for a noncentrality.

    With the same noncentrality for all tests, this is Baarda's B-method. NaN if invalid.
    """

def film_readings(
    numbers: _Floats, vectors: _Floats, places: _Floats
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return readings of positions in a camera's frame, and their partials.

    Parameters
    ----------
    numbers
        Fixed values of a film: mirrored, rows down, pitch, o1, o2, hx, hy; 0, 1 or 2 for nothing, h or g;
        roll and curves; number and constants of its pattern.
    vectors
        (k, 3) the numbers of its unknowns: placement, size, h or g, roll, scanner, curves, weights.
    places
        (n, 2) mm.

    Returns
    -------
    (n, 2) readings, and (n, 2, 10) partials by x, y, t1, t2, theta, m, b1, b2 and both of h or g; NaN without
    reading of the scanner.
    """

def film_places(numbers: _Floats, vectors: _Floats, readings: _Floats) -> NDArray[np.float64]:
    """Return (n, 2) positions in a camera's frame of readings (n, 2); NaN if undefined.

    `numbers` and `vectors` are the same as in :func:`film_readings`.
    """

def camera_models() -> list[tuple[str, tuple[str, list[tuple[str, int]], int, str, str]]]:
    """Return the models of cameras, `CAMERAS`, by their names.

    Returns
    -------
    For each model its formula, its parameters with the power of their image unit (0 for plain numbers), the
    number of constants at their end, and its direction. Lens terms are functions of ideal coordinates
    (`forward`) or of measured ones (`backward`).
    """

def camera_images(model: str, parameters: _Floats, u: _Floats, knots: _Floats | None = None) -> _Floats:
    """Return image coordinates of directions.

    Parameters
    ----------
    model
        One of `CAMERAS`.
    parameters
        (k,) in the order of the model.
    u
        (n, 3) in the axes of the photo: x right, y up, z back towards the viewer; the camera looks along -z.
    knots
        Values dx, dy at the knots of a splined model, row by row, of any shape; None for zeros.

    Returns
    -------
    (n, 2) in the unit of the camera; not finite if undefined.

    Raises
    ------
    ValueError
        If the model is unknown, or a shape or the number of parameters differs.
    """

def camera_rays(model: str, parameters: _Floats, xy: _Floats, knots: _Floats | None = None) -> _Floats:
    """Return directions of image positions; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, 3) unit vectors in the axes of the photo, in front of it; NaN if undefined.

    Raises
    ------
    ValueError
        If the model is unknown, or a shape or the number of parameters differs.
    """

def camera_correct(model: str, parameters: _Floats, xy: _Floats) -> _Floats:
    """Return corrected image positions of a backward camera; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, 2) g, compared with c (u1, u2) / u3.

    Raises
    ------
    ValueError
        If the model is unknown or forward, or a shape or the number of parameters differs.
    """

def camera_partials(
    model: str, parameters: _Floats, u: _Floats, knots: _Floats | None = None
) -> tuple[_Floats, _Floats, _Floats]:
    """Return image coordinates of directions with partials; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, 2) image coordinates, (n, 2, 3) their partials by u, (n, 2, k) by the parameters, 0 for constants of a
    lens; not finite if undefined. Values of a backward camera refer to the measured position corresponding to
    u.

    Raises
    ------
    ValueError
        If the model is unknown, or a shape or the number of parameters differs.
    """

def camera_patches(model: str, parameters: _Floats, u: _Floats) -> tuple[_Indices, _Floats]:
    """Return the knots that affect image coordinates; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, s) numbers of knots, row by row, and (n, s) their weights, s = 16 of order 3, 9 of order 2: partials
    of the image by a knot are diag(fx, fy) times its weight.

    Raises
    ------
    ValueError
        If the model lacks knots, constants are invalid, or a shape or the number of parameters differs.
    """

def radial_domain(model: str, parameters: _Floats) -> tuple[float, float] | None:
    """Return the radius up to which the radial part of a lens is one-to-one, and its image.

    For a forward camera the radius is the tangent of the angle from the axis, for a fisheye the angle (rad).
    Its image is multiplied by the focal length; `brown_forward` has lengths in the image. For a backward
    camera they are the distances of the measured and the corrected position from the principal point.
    Infinite if only the image format is a limit.

    Returns
    -------
    None if the lens is one-to-one everywhere.

    Raises
    ------
    ValueError
        If the model is unknown, or the number of parameters differs.
    """

def attitudes_from_numbers(
    representation: str, numbers: _Floats, boresight: _Floats
) -> tuple[_Floats, _Floats]:
    """Return attitudes from numbers (`docs/conventions.md`).

    Parameters
    ----------
    representation
        "omega_phi_kappa", "omega_phi_kappa_photo_to_ground", "phi_omega_kappa", "azimuth_tilt_swing",
        "yaw_pitch_roll", "rotation_vector", "rotation_vector_to_photo", "rotation_vector_to_vision",
        "quaternion" or "quaternion_to_vision".
    numbers
        (n, 3), angles in radians; of quaternions (n, 4), w, x, y, z of any length but zero.
    boresight
        (3, 3), photo axes from body axes; of yaw, pitch, roll.

    Returns
    -------
    (n, 3, 3) matrices A, photo to object; and K, (n, 3, k), the partials of the rotation step rho by the
    numbers: A steps by Exp(rho), about the photo's own axes.

    Raises
    ------
    ValueError
        If a shape or the representation is invalid; the message names the argument.
    """

def numbers_of_attitudes(
    representation: str, attitudes: _Floats, boresight: _Floats
) -> tuple[_Floats, _Floats]:
    """Return numbers of attitudes, the inverse of `attitudes_from_numbers`.

    Parameters
    ----------
    representation, boresight
        As in `attitudes_from_numbers`.
    attitudes
        (n, 3, 3) matrices A, photo to object.

    Returns
    -------
    (n, k) numbers, and their partials by the rotation step, (n, k, 3); NaN if two angles rotate about the
    same axis, with one of them set to zero.

    Raises
    ------
    ValueError
        If a shape or the representation is invalid; the message names the argument.
    """

def nadir_boresight(quarters: int) -> _Floats:
    """Return photo axes from body axes, (3, 3), of a camera that looks at the nadir.

    Parameters
    ----------
    quarters
        Quarter turns of the top of the image from forward to the right wing: 0 to 3.
    """

def rotation_matrix(angles: _Floats) -> _Floats:
    """Return rotation matrices M = M_kappa M_phi M_omega.

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
        If a shape differs; the message names the argument and its shape.
    """

def rotation_angles(matrices: _Floats) -> _Floats:
    """Return angles omega, phi, kappa of rotation matrices, the inverse of `rotation_matrix`.

    Parameters
    ----------
    matrices
        (n, 3, 3) orthogonal matrices with determinant 1.

    Returns
    -------
    (n, 3) omega and kappa in [-pi, pi], phi in [-pi/2, pi/2], radians. If phi is +-pi/2 only omega + kappa or
    omega - kappa is determined; the returned angles are one solution.

    Raises
    ------
    ValueError
        If a shape differs; the message names the argument and its shape.
    """

def vector_rotations(vectors: _Floats) -> _Floats:
    """Return rotation matrices of (n, 3) rotation vectors: axis times angle, radians (Rodrigues).

    Returns
    -------
    (n, 3, 3) matrices.

    Raises
    ------
    ValueError
        If a shape differs; the message names the argument and its shape.
    """

def rotation_vectors(matrices: _Floats) -> _Floats:
    """Return rotation vectors of (n, 3, 3) rotation matrices, the inverse of `vector_rotations`.

    Returns
    -------
    (n, 3) axis times angle, radians, no longer than pi.

    Raises
    ------
    ValueError
        If a shape differs; the message names the argument and its shape.
    """

def geographic_to_geocentric(positions: _Floats, a: float, b: float) -> _Floats:
    """Return geocentric X, Y, Z of geographic positions.

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
        If a shape differs (the message names the argument and its shape), or the semi-axes are invalid.
    """

def geocentric_to_geographic(xyz: _Floats, a: float, b: float) -> _Floats:
    """Return geographic positions of geocentric X, Y, Z, the inverse of `geographic_to_geocentric`.

    Parameters
    ----------
    xyz
        (n, 3) in the linear unit of the axes.
    a, b
        Semi-major and semi-minor axis, 0 < b <= a.

    Returns
    -------
    (n, 3) longitude (rad, in [-pi, pi], 0 on the axis), latitude (rad), height (linear unit of the axes),
    accurate to rounding.

    Raises
    ------
    ValueError
        If a shape differs (the message names the argument and its shape), or the semi-axes are invalid.
    """

def project(
    points: _Floats,
    positions: _Floats,
    attitudes: _Floats,
    principal_distances: _Floats,
    *,
    spheroid: tuple[float, float] | None,
    photo_to_ground: bool,
    refraction: RefractionRow | None,
) -> _Floats:
    """Return image coordinates of points, row by row: point i on the photo of row i.

    x = c u1/u3, y = c u2/u3 with u = M d (ground-to-photo) or M^T d (photo-to-ground); d is the vector from
    the projection centre to the point. It is in object space axes if rectangular, in the local vertical frame
    of the station (east, north, up) if geographic.

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
    refraction
        Refraction model; None for straight rays.

    Returns
    -------
    (n, 2) x, y in millimetres; not finite for a point in the plane of the projection centre (u3 = 0).

    Raises
    ------
    ValueError
        If a shape or length differs (the message names the argument and its shape), or the semi-axes or the
        refraction are invalid.
    """

def refraction_shift(
    points: _Floats,
    positions: _Floats,
    *,
    spheroid: tuple[float, float] | None,
    refraction: RefractionRow,
) -> _Floats:
    """Return vectors from points to their apparent positions, row by row.

    Parameters
    ----------
    points, positions
        (n, 3) points and projection centres: X, Y, Z, or longitude (rad), latitude (rad), height.
    spheroid
        Semi-axes (a, b) for geographic space, None for rectangular space.
    refraction
        Refraction model.

    Returns
    -------
    (n, 3) vectors in the linear unit along X, Y, Z or the geocentric axes.

    Raises
    ------
    ValueError
        If a shape or length differs (the message names the argument and its shape), or the semi-axes or the
        refraction are invalid.
    """

class BlockError(Exception):
    """A block that cannot be adjusted.

    `args` is (kind, message, combinations, points, seconds). Kind is `undetermined points`, `undetermined
    photos`, `no intersection`, `coarse` (too large for double precision), `outside` (a time outside a
    trajectory), `not finite`, `memory`, `empty` or `input`. Combinations contain the unknowns of undetermined
    combinations; for `coarse` and `outside`, one with the affected photos. Points is a list of point indices;
    for `outside` the point of the observation, empty for the photo itself. Seconds are, for `outside`, the
    time and the first and last time of the trajectory, in its own scale.
    """

def find_first_values(
    photo_positions: _Floats,
    photo_attitudes: _Floats,
    observed_positions: _Floats,
    observed_attitudes: _Floats,
    point_positions: _Floats,
    point_sd: _Floats,
    image_photos: _Indices,
    image_points: _Indices,
    directions: _Floats,
    direction_sd: _Floats,
    *,
    threads: int,
) -> FoundRow:
    """Compute initial poses of photos in cartesian object space (`docs/first-values.md`).

    Parameters
    ----------
    photo_positions, photo_attitudes
        (P, 3) and (P, 3, 3), photo to object: given poses; NaN if unknown.
    observed_positions, observed_attitudes
        Observed poses; NaN if not observed.
    point_positions, point_sd
        (n, 3) control in the linear unit, and its standard deviations; infinite for free components.
    image_photos, image_points
        (m,) indices into photos and points.
    directions, direction_sd
        (m, 3) unit directions in the axes of the photos, not finite if undefined, and (m,) their standard
        deviations in radians.
    threads
        As for `block_network`.

    Returns
    -------
    (P, 3) positions and (P, 3, 3) attitudes, NaN if not computed; for each photo (`given`, `resected`,
    `observed` or `oriented`, 0, 0), or the reason of failure: (`points`, known points, 0), (`misfit`, known
    points, 0) or (`apart`, common points of its model, photos of the model); (n, 3) positions of points; (m,)
    rejected observations; (n,) control points whose observations agree with each other but not with its
    coordinates; the photo that defines the datum, if nothing else does; the median angle between observed and
    computed directions, radians.

    Raises
    ------
    ValueError
        If a shape or length differs, or an index is out of range; the message names the argument.
    """

def trajectory_span(trajectory: TrajectoryRow) -> tuple[float, float]:
    """Return the first and the last valid time of a trajectory, in its own scale."""

def flown(trajectory: TrajectoryRow, position: _Floats, rotation: _Floats, times: list[float]) -> FlownRow:
    """Return a trajectory at n times (docs/moving.md).

    Parameters
    ----------
    trajectory
        As in :func:`block_network`; the indices of its coefficients are not used.
    position, rotation
        (K, 3) coefficients of positions, and of rotations in radians.
    times
        Seconds, in the time scale of the trajectory.

    Returns
    -------
    (n, 3) positions; (n, 9) attitudes, axes of the coefficients of positions, and right Jacobians of the
    corrections r, row by row; for each time the number of the first nonzero function of positions and the
    values from this one, and the same for rotations.

    Raises
    ------
    InputError
        If times do not increase, or the numbers of coefficients and functions differ.
    """

def block_network(
    photo_positions: _Floats,
    photo_attitudes: _Floats,
    photo_positions_observed: _Floats,
    photo_attitudes_observed: _Floats,
    photo_position_sd: _Floats,
    photo_attitude_sd: _Floats,
    photo_cameras: _Indices,
    cameras: list[tuple[str, list[float], list[float], list[float] | None, list[float] | None]],
    point_positions: _Floats,
    point_sd: _Floats,
    image_photos: _Indices,
    image_points: _Indices,
    image_xy: _Floats,
    image_sd: _Floats,
    *,
    observation_groups: list[tuple[str, _Indices, _Indices, _Indices, _Floats, _Floats]],
    unknowns: list[tuple[str, list[float], list[float], list[float]]],
    mounts: list[tuple[int, int, int]],
    trajectories: list[TrajectoryRow],
    timed: list[tuple[int, int, float, int | None, int | None]],
    image_times: _Floats,
    passages: list[tuple[str, list[int], list[int], _Floats]],
    records: int,
    spheroid: tuple[float, float] | None,
    photo_to_ground: bool,
    refraction: RefractionRow | None,
    criterion: str,
    limit: float,
    max_iterations: int,
    covariance: bool,
    loss: tuple[str, float] | None,
    ordering: str,
    unit_variance: str,
    minimum: tuple[int, tuple[int, int] | None] | None,
    memory: int | None,
    points_given: bool,
) -> BlockNetwork:
    """Return a block for adjustment by least squares (GIANT guide, sections 4 to 9).

    Standard deviations are infinite for free unknowns, zero for fixed ones. Positions are X, Y, Z, or
    longitude (rad), latitude (rad), height if a spheroid is given.

    Parameters
    ----------
    photo_positions, photo_attitudes
        (P, 3) initial values, which fixed components retain; omega, phi, kappa in radians.
    photo_positions_observed, photo_attitudes_observed
        (P, 3) observed values of weighted components; angles may differ from initial ones by multiples of 2
        pi.
    photo_position_sd, photo_attitude_sd
        (P, 3) standard deviations of the observed values.
    photo_cameras
        (P,) indices into the cameras; photos with the same one share its unknowns.
    cameras
        Model, parameters in its order, standard deviations, covariance matrix of the weighted ones row by
        row, None if uncorrelated; knots, or None.
    point_positions, point_sd
        (n, 3) coordinates, NaN if unknown, and standard deviations, finite for weighted or fixed components.
    image_photos, image_points
        (m,) indices.
    image_xy, image_sd
        (m, 2) millimetres.
    observation_groups
        Additional observations, each type with its name, (k, p) indices of points, (k, q) of photos and (k,
        c) of common unknowns (-1 for none), (k, v) values and (k, r, r) covariance matrices of its r
        components. Values: `distance` the length (unknown: instrument), `equal height` the difference,
        `difference` three components (NaN if not observed), `control` three coordinates, `on level` the
        height above it, `on plane` the distance from it, `on plumb line` and `on line` none, `position` three
        coordinates, the known lever arm and the time (unknowns: lever arm, shift, drift), `attitude` two
        matrices row by row (body to object; body to photo if known; unknown: boresight), `relative` a
        translation and a matrix, `base` the length (two sensors, -1 for the frame), `prior` none, `velocity`
        three components and the known lever arm (unknown: lever arm), `rate` three components and the matrix
        body to photo if known (unknowns: boresight, bias), `smoothness` three components and a factor for
        each coefficient. Lengths in the unit of the object space, angles in radians, times in seconds.
    unknowns
        Common unknowns: type (see `UNKNOWNS`), position, rotation matrix row by row, standard deviations.
    mounts
        Photos on frames: index of the photo, of the photo that represents the frame, and of the sensor among
        the common unknowns.
    trajectories
        Prior trajectory, basis functions of its corrections, and the indices of their coefficients among the
        common unknowns.
    timed
        Photos on trajectories: indices of photo and trajectory, the time of the photo there in seconds, and
        the indices of the rate and of the offset of its times among the common unknowns.
    image_times
        (m,) factor of the rate for each observation; empty if all are 0.
    passages
        Additional transforms of observations: kind, indices of common unknowns, indices of points, photos or
        cameras, and numbers. `figure`: points displaced by w_1 e_1 + w_2 e_2; w is a `bend`, the numbers are
        (e_1, e_2) of each point.
    records
        Number of photos at the end that are records of trajectories, without observations, with the last
        camera.
    spheroid
        Semi-axes (a, b) for geographic space, None for rectangular space.
    photo_to_ground
        The sense of the angles.
    refraction
        Refraction model, applied in every iteration; None for corrected image coordinates.
    criterion, limit
        `fraction`: no unknown changes by more than `limit` of its standard deviation; `percent`: the sum of
        squares changes by less than `limit` percent.
    max_iterations
        Maximum number of iterations.
    covariance
        Whether to compute cofactors and redundancy numbers; NaN otherwise.
    loss
        Robust loss of the image points, `huber` or `cauchy`, and its scale in standard deviations a priori.
    ordering
        `auto`, `input`, `rcm`, `amd`, `dissection` or `graph-dissection`; see :func:`photogram.adjust`.
    unit_variance
        `free`, `constrained` or `unity` (GIANT guide, Appendix E), or `redundancy`.
    minimum
        Photo whose pose is fixed if nothing else defines the datum, and for the scale a photo and the number
        of its coordinate; None: chosen by the core.
    memory
        Limit of memory of the adjustment and of covariances, bytes; None for no limit.
    points_given
        True to use known coordinates of points as initial values instead of intersections.

    Raises
    ------
    ValueError
        If a shape, length or choice is invalid; the message names the argument.
    """

@final
class BlockNetwork:
    """A block with the options of its adjustment.

    A datum is (`inner`, points, photos, whether scale counts) for inner constraints. It is (`relative`, [],
    [photo], False) or (`relative`, points, [], False) for cofactors relative to these. Parameters of all
    methods:

    threads
        Number of threads, at most four for each processor; 0: chosen by the core. Small work is done on the
        calling thread, larger work on all processors.
    progress
        Called on the calling thread as (phase, points done, points in all, None), or ("iteration", number, 0,
        row). Its exceptions stop the work and are propagated. Signals are processed at the same time, so that
        Ctrl-C stops it as well.

    They raise BlockError if a block cannot be adjusted or transformed to a datum.
    """

    def adjust(
        self,
        *,
        datum: _DatumRow | None,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
        start: BlockState | None = None,
        keep: Sequence[int] | None = None,
    ) -> BlockSolution:
        """Adjust the block; a free one may be transformed to the datum of inner constraints.

        Without such a datum, it can be continued from the end of an adjustment, possibly with other weights.
        Then the ordering of that adjustment is used, without the points that had collapsed to a station.
        Without either, `keep` stores the data that tests need (see :meth:`trial`), and the joint cofactors of
        these points (:meth:`BlockState.joint`).
        """

    def in_datum(
        self,
        state: BlockState,
        datum: _DatumRow,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> BlockSolution:
        """Transform an adjusted block to another datum: values, cofactors, redundancy; no iterations."""

    def covariances(
        self,
        state: BlockState,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> BlockCovariances:
        """Factor the normal equations at the end of the adjustment, in its datum."""

    def trial(self, state: BlockState | None, *, threads: int, kept: bool = False) -> NetworkTrial:
        """Prepare trials without some observations, from the end of an adjustment or from the start.

        `kept` indicates that the state is of this network. At the first call, the stored data of its
        adjustment are used without forming them again.
        """

    def resistance(self, state: BlockState, *, threads: int) -> list[tuple[str, float]]:
        """Return the observation types that prevent a motion of the whole block.

        With each type, the largest part of the effect of a motion that remains if all unknowns adapt.
        """

    def held_for_datum(self, *, threads: int) -> list[tuple[int, int]]:
        """Return the unknowns that an adjustment fixes if the datum is undefined; otherwise an empty list.

        Photos, each with the number (0 to 5) of one of its unknowns.

        Raises
        ------
        BlockError
            As :meth:`adjust`, before its first iteration.
        """

    def parts_in_datum(
        self,
        datum: _DatumRow,
        held: list[tuple[int, int]],
        *,
        middle: tuple[float, float, float] | None,
        names: _Indices,
        values: _Floats,
        threads: int,
    ) -> tuple[_Floats, _Floats, _Floats, float, bool]:
        """Transform a partitioned block to the datum of inner constraints (docs/distributed.md).

        Parameters
        ----------
        datum
            Inner constraints.
        held
            Result of :meth:`held_for_datum`.
        middle
            The same as for all nodes.
        names
            (3 N,) all unknowns of the block, possibly repeated if in several nodes. Rows are as in
            :attr:`Node.unknown_names`, with indices into this block.
        values
            (N,) their adjusted values.
        threads
            As in :meth:`adjust`.

        Returns
        -------
        values
            (N,) in the datum.
        b, t
            (d N,) the columns B, nonzero only for unknowns that define the datum, and T = G (B^T G)^-1.
        condition
            Condition number of B^T G with scaled columns.
        exact
            Whether the number of datum unknowns does not exceed the number of columns, so that they do not
            change.

        Raises
        ------
        BlockError
            As :meth:`adjust` with a datum.
        BlockInputError
            If names do not contain all unknowns.
        """

    def node(
        self,
        outer: list[tuple[str, int]],
        children: list[list[tuple[str, int]]],
        *,
        middle: tuple[float, float, float] | None,
        threads: int,
        held: list[tuple[int, int]] = ...,
    ) -> Node:
        """Return the block as a node of the elimination tree of a larger one (Helmert blocking).

        The name of a block of unknowns is (`photo`, `camera`, `unknown` or `point`, index into the arrays of
        this block). A camera is named if several photos of the larger block share it and it has free
        parameters. A point is named if it has additional observations. Known cameras, and points with image
        observations only, are never named.

        Parameters
        ----------
        outer
            The blocks that are eliminated above this node, in an order known to the node above: photos shared
            with other partitions, shared cameras. Observations of their unknowns themselves belong to the
            node of their elimination, and are excluded here. Fixed unknowns remain fixed. Empty for the root.
        children
            For each child, in a fixed order, the blocks of its contribution, in the order of its `outer`. All
            are photos, cameras, unknowns or points of this block, outer ones or not.
        middle
            (3,) median of the positions of all photos of the larger block, component by component:
            coordinates are relative to it (rounded) in rectangular space, and it defines the vertical of
            shifts in geographic space. It must be the same for all nodes. None: of the photos of this block.
        threads
            As in :meth:`adjust`.
        held
            Result of :meth:`held_for_datum` of the larger block, for the photos of this one, outer ones or
            not.

        Raises
        ------
        InputError
            If a name is not in the block or occurs twice, or a loss is set.
        BlockError
            As :meth:`adjust`, before its first iteration.
        """

def give_back() -> None:
    """Return freed memory to the system; only effective with the GNU C library."""

def judge_full_step(
    taken: Sequence[tuple[float, float]],
    change: float,
    *,
    chord: float | None,
    unknowns: int,
    tolerance: float,
) -> str:
    """Return the type of a full step, by the rules of one process; see `adjustment/options.rs`.

    Parameters
    ----------
    taken
        Damping and largest change of each step so far.
    change
        No unknown changes by more than this multiple of its standard deviation.
    chord
        The length of the chord after the last step, or None.
    unknowns, tolerance
        Number of unknowns; convergence limit.

    Returns
    -------
    `last`: no further one is needed; `rests`: rounding only, as before; `before a chord`: a chord after it is
    efficient; `one of many`.
    """

def is_chord(chord: float, change: float) -> bool:
    """Return whether a chord of this length is accepted after a full step with this change."""

def step_rules() -> dict[str, float]:
    """Return the constants of the step rules of one process, by name; see `adjustment/damped.rs`."""

@final
class Node:
    """A node of the elimination tree of a partitioned block (Helmert 1880; Wolf 1978).

    It contains a part of the observations, their photos, and the elimination order of its own blocks, but no
    values. A *state* is a vector of all its unknowns: three of each point with image observations only, then
    of photos, shared cameras, common unknowns and other points, own blocks and outer ones. Positions are
    relative to the centre. A *step* is a vector of the same form. All methods are functions of their
    arguments, with identical bits for any number of threads; `threads` and `progress` are as in
    :class:`BlockNetwork`.
    """

    @property
    def size(self) -> int:
        """N, the number of unknowns in a state."""

    @property
    def outer(self) -> _Indices:
        """(S,) indices of the unknowns of the outer blocks in a state, block by block in their order."""

    @property
    def children(self) -> list[_Indices]:
        """For each child (S_c,) indices of the unknowns of its contribution in a state, in its own order."""

    @property
    def unknown_names(self) -> _Indices:
        """(N, 3) for each unknown of a state the type of its owner, its index, and the number of the unknown.

        0: a photo, 1: a camera that photos share, 2: a common unknown, 3: a point.
        """

    @property
    def counts(self) -> tuple[int, int, int]:
        """Observations, weighted unknowns, unknowns that are not fixed; outer ones are not counted."""

    @property
    def dropped(self) -> list[tuple[int, str]]:
        """Excluded points, each with the reason."""

    @property
    def initial(self) -> _Floats:
        """(N,) the initial state: photos as given, points intersected from the photos of this node.

        Its outer part must be set to the state of the node above, if points are among the outer blocks.
        """

    @property
    def ends_slowly(self) -> bool:
        """Whether photos share free cameras: a chord is efficient near the end (docs/adjustment.md)."""

    @property
    def prediction(self) -> dict[str, float]:
        """Predicted work and memory, from the pattern alone.

        `points`, `interior`, `outer`: unknowns of points, of blocks eliminated here, of outer ones (S);
        `images`, `observations`: image points, equations in all; `reduction`, `factor`, `inverse`:
        multiply-adds of one formation, one factorisation, one inversion; `node_bytes`: of the node alone;
        `factor_bytes`: additionally of a formed node, including the data of points for the solution;
        `memory_bytes`: the maximum while it is formed, inverted or written, including contributions and the
        node; `contribution_bytes`: data sent upwards, 8 (S (S + 1) / 2 + 2 S); `cofactor_bytes`: data
        received for the inversion, 8 S (S + 1) / 2; `step_bytes`: data received in each iteration, 8 S.
        """

    def advance(self, state: _Floats, step: _Floats) -> _Floats:
        """Return the state after a step: attitudes change by rotation vectors, the rest is added."""

    def relocate(self, state: _Floats, *, threads: int) -> _Floats:
        """Return the state with intersected positions of the points with image observations only."""

    def objective(self, state: _Floats, *, threads: int) -> tuple[float, float, float, float, float]:
        """Return weighted sums of squares (camera, ground, plates, observations), and the objective.

        The sums of this node; over all nodes they add up to :attr:`BlockSolution.sums_of_squares`. The
        objective is their sum, or the sum of losses.
        """

    def form(
        self,
        state: _Floats,
        contributions: list[ContributionRow],
        *,
        damping: float,
        curved: bool,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> FormedNode:
        """Form the normal equations at a state, and eliminate the points and blocks of this node.

        Parameters
        ----------
        state
            (N,) values of all unknowns.
        contributions
            :attr:`FormedNode.contribution` of each child, added in their order.
        damping
            Added to the diagonal of the normal equations as a fraction of it; 0 for a full step. The same in
            all nodes.
        curved
            True to include the second-order term of a loss. The same in all nodes.
        """

    def solution(self, state: _Floats, before: _Floats, *, threads: int) -> BlockSolution:
        """Return the adjusted values at a state, without cofactors.

        `before` is the state before the last step. Arrays are the arrays of the block of the node, including
        outer photos. Sums, counts and degrees of freedom are of this node, and add up.
        """

@final
class FormedNode:
    """A node at a state with eliminated points and blocks.

    It stores the factor, and copies of state and contributions temporarily. It cannot be pickled, but formed
    again.
    """

    @property
    def contribution(self) -> ContributionRow:
        """Contribution to the node above, over the S unknowns of the outer blocks; empty for the root.

        `U = A_SS - A_SI A_II^-1 A_IS` (S (S + 1) / 2,), lower triangle, column by column: row i of column j
        is at `j S - j (j - 1) / 2 + i - j`. `u = b_S - A_SI A_II^-1 b_I` (S,). The diagonal of A_SS before
        any elimination, including the children (S,), is the reference for small pivots. It can be read once.
        """

    @property
    def sum_of_squares(self) -> float:
        """Weighted sum of squares of this node at this state; they add up over all nodes."""

    @property
    def decrease(self) -> float:
        """Decrease of the sum of squares by a full step, as far as known in this node.

        The sum over all nodes is the decrease of the block. Its root bounds the change of any unknown in
        standard deviations (the largest change of an iteration).
        """

    @property
    def undetermined(self) -> FailureRow | None:
        """Undetermined unknowns of this node, as in :class:`BlockError`; or None."""

    def solve(
        self,
        outer: _Floats,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> _Floats:
        """Return the step (N,) of all unknowns, given the step of the outer ones (S,)."""

    @property
    def has_chord(self) -> bool:
        """Whether the right-hand side of a chord was reduced but not solved."""

    def reduce_chord(
        self,
        state: _Floats,
        left: Sequence[_Floats],
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> tuple[_Floats, float] | None:
        """Reduce the right-hand side of the equations at a state: a second step with the same factor.

        Parameters
        ----------
        state
            (N,) after a step.
        left
            (S,) remainder of each child.

        Returns
        -------
        (S,) remainder for the outer unknowns, and the decrease of the sum of squares by the chord, as far as
        known in this node; None if the required data were not stored, for lack of memory.
        """

    def solve_chord(
        self,
        outer: _Floats,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> _Floats:
        """Return the chord (N,) for the reduced right-hand side, given the outer unknowns (S,)."""

    def reduce(
        self,
        rights: _Floats,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> tuple[_Floats, _Floats]:
        """Reduce right-hand sides: y = L^-1 r of the unknowns eliminated in this node.

        Parameters
        ----------
        rights
            (d, N) of all unknowns: own ones of this node plus the remainders of the children.

        Returns
        -------
        left
            (d S,) remainder for the outer unknowns.
        products
            (d d,) y^T y, which adds up over all nodes to r^T Q r.
        """

    def complete(
        self,
        outer: _Floats,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> _Floats:
        """Return solutions (d N,) for reduced right-hand sides, given the outer ones (d, S); once only."""

    def invert(
        self,
        outer: _Floats,
        state: _Floats,
        *,
        threads: int,
        datum: tuple[_Floats, _Floats, _Floats, _Floats, float, list[int]] | None = None,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> tuple[BlockSolution, list[_Floats]]:
        """Return adjusted values with cofactors, and the cofactors that the children need.

        The factor is consumed.

        Parameters
        ----------
        outer
            (S (S + 1) / 2,) cofactors of the outer unknowns, a lower triangle packed like the contribution.
        state
            (N,) the final state: after the step if it was the last one, otherwise the same.
        datum
            Transformation of cofactors (except of the children) to a datum of the whole: T and W = Q B (d,
            N), B^T W of the whole (d, d), the last step (N,) before the transformation, the condition number
            of B^T G, and the unknowns that do not change in the datum, ascending.

        Returns
        -------
        BlockSolution
            As :meth:`Node.solution`, with cofactors, redundancy numbers and test values. Outer photos have
            cofactors, but not the redundancy numbers of their own weights.
        list
            For each child its (S_c (S_c + 1) / 2,) cofactors.
        """

@final
class NetworkSuspects:
    """The G groups of observations that may contain a joint gross error, in the order of all tests.

    The order is: image observations, control of points, positions and attitudes of photos, additional
    observations, and observations of cameras and common unknowns. Each has rows, M in all, stored group after
    group.
    """

    @property
    def subjects(self) -> tuple[NDArray[np.uint8], _Indices]:
        """(G,) types, and index of the image, point, photo, observation, camera or common unknown.

        Types are 0 image, 1 control, 2 position, 3 attitude, 4 observation, 5 camera, 6 common unknown.
        """

    @property
    def row_starts(self) -> _Indices:
        """(G + 1,) first row of each suspect."""

    @property
    def components(self) -> _Indices:
        """(M,) the component of each row."""

    @property
    def deviations(self) -> _Floats:
        """(M,) standard deviations a priori, in the units of the observations."""

@final
class NetworkTrial:
    """A network for trials without some of its observations; the symbolic analysis is done once.

    Rows and square blocks of its suspects are stored suspect after suspect. Excluded rows have weight zero.
    All methods raise errors of the adjustment: BlockError or CollectionError, of the kind `undetermined
    points` or `undetermined photos` if an exclusion removes their last support.
    """

    @property
    def suspects(self) -> NetworkSuspects:
        """Groups that may be excluded."""

    @property
    def photos(self) -> list[list[float]]:
        """The values of each photo at the end of the last trial: as given, pose first."""

    @property
    def points(self) -> _Floats:
        """(n, 3) coordinates of the points at the end of the last trial; NaN if excluded."""

    def stand(self) -> tuple[str, int, float, int, list[int]]:
        """Use the network at the end of its adjustment, with all observations; see `adjust`."""

    def adjust(
        self,
        rows: NDArray[np.bool_],
        points: list[int],
        photos: list[int],
        *,
        tolerance: float | None,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> tuple[str, int, float, int, list[int]]:
        """Adjust without the excluded observations, from the end of the last trial.

        Parameters
        ----------
        rows
            (M,) excluded rows.
        points, photos
            Points and photos excluded with all their observations; their values do not change.
        tolerance
            Convergence limit. A block has converged if no unknown would change by more than this multiple of
            its standard deviation in the next iteration; a collection as in its options. Default: the limit
            of the options.

        Returns
        -------
        Status, iterations, weighted sum of squares, degrees of freedom, points that collapsed to a station.
        """

    def resist(
        self,
        loss: str,
        scale: float,
        *,
        iterations: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> _Floats | None:
        """Adjust with a robust loss from the end of the last trial, and store the result.

        Returns
        -------
        (G,) factors of the weights; None if it diverges, with the state unchanged.
        """

    def tests(self) -> dict[str, NDArray[Any]]:
        """Test every included suspect.

        Returns
        -------
        `active` (G,) whether any row is included; `rank` (G,) directions in which an error is visible;
        `statistic` (G,) T, the decrease of the sum of squares without it; `least` (G,) the smallest
        redundancy of a visible direction; `shared` (G,) h of the bound of correlations with others;
        `residual` (M,) of unit weight; `cofactors` the square blocks of R; `error`, `error_sd` (M,) the
        estimated error and its standard deviation (a priori unit weight), in the units of the observations.
        NaN if excluded.
        """

    def hypotheses(
        self,
        *,
        velocities: _Floats,
        times: list[float],
        position_sets: list[int],
        control_sets: list[int | None],
        readouts: list[list[float] | None],
        widths: list[float],
        checks: list[int],
        centre: list[float] | None,
        estimated: tuple[float, float] | None,
        detection: tuple[float, float],
        limit: float,
        effects: int,
    ) -> tuple[list[dict[str, Any]], _Floats]:
        """Test errors that sets of observations have in common, and errors of groups except images.

        Parameters
        ----------
        velocities, times
            (P, 3) velocities of photos in the object space by time, and (P,) times; empty if unknown.
        position_sets, control_sets
            The set (strip, file) of the position of each photo, and of each control point; empty for none.
        readouts
            For each camera a, b, c: the line x, y is read at a x + b y + c of the readout time, -1/2 to 1/2.
        widths
            Width of the image of each camera in its unit; NaN if unknown.
        checks
            Points whose changes are returned with each effect.
        centre
            Centre of scale, rotation and bending; None for the middle of the network.
        estimated
            Sum of squares and degrees of freedom if the unit weight is estimated.
        detection
            Significance level and power of the minimal detectable bias (MDB).
        limit
            Standard deviations above which points are counted.
        effects
            Number of groups whose effects are computed: those of the largest bias-to-noise ratios.

        Returns
        -------
        For each hypothesis a dictionary: `code`, `group` (type as in `suspects`, None for sets), `index`,
        `component`, `parameters`, `observations`, `plausible` (sizes), `rank`, `statistic` T, `probability`,
        `estimate`, its `cofactors`, `redundancy` r, `noncentrality`, `mdb`, `error`, `bias_to_noise`, and
        `effect`: points beyond the limit, the same without points of the group, the largest change in
        standard deviations, its point and coordinate, the largest change, and the changes of `checks`. Then
        the (s, s) correlations of the scores of sets.
        """

    def predictions(
        self, suspects: list[int]
    ) -> list[tuple[float, list[int], list[float], list[float]] | None]:
        """Test the excluded rows of some suspects against the prediction from the rest.

        Returns
        -------
        For each: the statistic, chi-square with as many degrees of freedom as excluded rows; these rows;
        observed minus predicted of each, and its standard deviation. None if no row is excluded, or its point
        or photo is.
        """

    def on_points(self, points: list[int], *, gone: bool = False) -> list[tuple[list[int], _Floats, _Floats]]:
        """Return all observations of points together: suspects, residuals of unit weight, and R.

        Nothing for points with additional observations. `gone`: for excluded points, as if they were
        included, each separately against the photos as determined by the others. Nothing also if the rays do
        not determine the point.
        """

    def effects(self, suspects: list[int]) -> _Floats:
        """Return the effect of an error of one standard deviation in each row of some suspects.

        Returns
        -------
        (., 9): the three coordinates of the own point, the six numbers of the own photo; NaN if not
        applicable.
        """

    def responses(self, suspects: list[int]) -> _Floats:
        """Return the columns of R that belong to the rows of some suspects: (., M)."""

    def most_moved(self, suspects: list[int]) -> list[tuple[str, int, int, float, float]]:
        """Return, for each row of some suspects, the unknown that an error affects most.

        Returns
        -------
        Kind (`photo`, `camera`, `unknown`, `point`), index and component of the unknown; its change by an
        error of one standard deviation, in its unit and in its standard deviations (a priori unit weight).
        """

    def inseparable(self, points: list[int], limit: float) -> list[tuple[int, int, float]]:
        """Return pairs of suspects of one point whose tests are correlated by more than `limit`."""

@final
class BlockState:
    """Final state of the adjustment of a block, and its datum.

    Parameters
    ----------
    unknowns
        Adjusted unknowns, in the order of the core.
    held, collapsed, loose
        Unknowns fixed for a datum; points excluded because they collapsed to a station or are undetermined;
        photos excluded because they are undetermined.
    ordering
        The name of the ordering.
    datum
        Its name, points, photos, whether scale counts, photos whose attitudes count, and the factor between
        rotations and shifts; None for the datum of the fixed unknowns.
    released
        Whether minimal control was freed for it.

    Raises
    ------
    ValueError
        If the ordering or the datum is unknown.
    """

    def __new__(
        cls,
        unknowns: list[float],
        held: list[int],
        collapsed: list[int],
        loose: list[int],
        ordering: str,
        datum: _DatumRow | None,
        released: bool,
    ) -> BlockState: ...
    def __getnewargs__(
        self,
    ) -> tuple[list[float], list[int], list[int], list[int], str, _DatumRow | None, bool]: ...
    def joint(self, points: Sequence[int]) -> NDArray[np.float64] | None:
        """Return the (3k, 3k) joint cofactors of points, if the adjustment stored exactly these.

        None for copies and for states read from files.
        """

@final
class BlockCovariances:
    """Cofactors (a priori unit weight) of any unknowns of an adjusted network, from one factor.

    Unknowns are named by kind and index: `photo` (its pose), `step` (position and rotation about the photo's
    axes), `point`, `camera` (in a collection, the camera of the photo), `unknown`. Arguments are the same as
    in :class:`BlockNetwork`. The methods raise BlockError or CollectionError.
    """

    def cofactors(
        self,
        rows: list[tuple[str, int]],
        columns: list[tuple[str, int]] | None,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> _Floats:
        """Return the joint cofactors of `rows`, or of `rows` with `columns`."""

    def propagate(
        self,
        partials: _Floats,
        of: list[tuple[str, int]],
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> _Floats:
        """Return J Q J^T, for (m, k) partials J of m functions of the k named unknowns."""

    def suspects(self) -> NetworkSuspects:
        """Return the groups of observations of the network."""

    def influences(self, partials: _Floats, of: list[tuple[str, int]]) -> _Floats:
        """Return (m, M) effects of errors of one standard deviation in all rows on functions.

        Rows are the rows of all suspects; `partials` and `of` are as in :meth:`propagate`. The datum is the
        one of the fixed unknowns.
        """

    def group_squares(
        self,
        groups: tuple[int, _Indices, _Indices, _Indices, list[int], list[int], list[int]],
        *,
        classes: int | None,
        exact: int,
        vectors: int,
        seed: int,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> tuple[list[int], _Floats, list[bool]]:
        """Return sums of R_ij^2 over groups; R maps errors of observations to residuals, both in their sd.

        Parameters
        ----------
        groups
            Number g of groups; then the group of each observation, -1 for none: (m, 2) of x and y of images,
            (n, 3) of components of points, (P, 6) of unknowns of poses, of every camera, common unknown, and
            other observation.
        classes
            None: all sums. A number: only sums within each group. Groups with the same remainder of division
            by it share columns, and sums between such groups are included.
        exact, vectors, seed
            Groups of at most `exact` or `vectors` observations are computed column by column, others with
            `vectors` vectors of random signs (Hutchinson 1990). The same seed gives the same bits for any
            number of threads.

        Returns
        -------
        equations
            (g + 1,) observations of each group and of none; empty with classes.
        squares
            (g + 1) * g sums, row by row, of i in the group of the row (the last row: in no group) and j in
            the group of the column; with classes (g,) sums of i and j in each group.
        exact
            (g,) True for groups computed column by column; empty with classes.
        """

    def project_images(
        self,
        columns: _Floats,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> _Floats:
        """Return (k, m, 2) residuals of k columns of errors of all image observations, both in sd.

        This is R z for each column z; unused observations have neither.
        """

class _NetworkSolution:
    """Common part of adjusted blocks and collections; photos (P), points (n), observations (m) in order.

    A photo has k unknowns: position and attitude in a block, and its camera in a collection. Values are in
    the units in which they were given. Excluded points and observations are NaN. Cofactors refer to a priori
    unit weight.
    """

    @property
    def status(self) -> str:
        """`converged`, `not converged` or `diverged`."""

    @property
    def weak_points(self) -> list[tuple[int, float, float]]:
        """Points on nearly parallel rays, or at a station.

        For each its index, the ratio of its largest and smallest standard deviation (in any directions;
        infinite if the smallest is lost by rounding, NaN without cofactors), and its distance from the
        nearest observing station, relative to the median of these distances.
        """

    @property
    def weak(self) -> list[tuple[int, int]]:
        """Photos and unknowns of a combination that no step could determine.

        The sum of squares stopped decreasing, or the iterations were exhausted. Empty for another end of the
        adjustment.
        """

    @property
    def state(self) -> BlockState:
        """Final state of the adjustment."""

    @property
    def initial_sum_of_squares(self) -> float:
        """Weighted sum of squares, of losses with a loss, at the initial values."""

    @property
    def iterations(self) -> list[IterationRow]:
        """Every iteration."""

    @property
    def photo_cofactors(self) -> _Floats:
        """(P, k, k): position and attitude, or vector and translation, then the camera."""

    @property
    def photo_redundancy(self) -> _Floats:
        """(P, k) redundancy numbers of the unknowns as observations; 0 unless weighted."""

    @property
    def point_positions(self) -> _Floats:
        """(n, 3) X, Y, Z, or longitude (rad), latitude (rad), height."""

    @property
    def point_cofactors(self) -> _Floats:
        """(n, 3, 3) cofactors."""

    @property
    def point_redundancy(self) -> _Floats:
        """(n, 3) redundancy numbers of the coordinates as observations; 0 unless weighted."""

    @property
    def point_rays(self) -> _Indices:
        """(n,) number of observations; 0 for excluded points."""

    @property
    def residuals(self) -> _Floats:
        """(m, 2) observed minus computed, in the unit of the image."""

    @property
    def redundancy(self) -> _Floats:
        """(m, 2) redundancy numbers."""

    @property
    def standardized(self) -> _Floats:
        """(m, 2) residual / (standard deviation x root of redundancy number), a priori unit weight.

        NaN without redundancy.
        """

    @property
    def image_weights(self) -> _Floats:
        """(m,) factor by which a loss has changed the weight; 1 without a loss."""

    @property
    def undetermined(self) -> FailureRow | None:
        """Reason for missing cofactors, as in :class:`BlockError`, if requested."""

    @property
    def redundancy_excess(self) -> float | None:
        """Sum of all redundancy numbers minus the degrees of freedom: the rounding error of zero.

        None without cofactors, and with a loss.
        """

    @property
    def variance_of_unit_weight(self) -> float | None:
        """None without degrees of freedom."""

    @property
    def counts(self) -> tuple[int, int, int]:
        """Observations, weighted unknowns, unknowns that are not fixed."""

    @property
    def ordering(self) -> str:
        """The ordering."""

    @property
    def predictions(self) -> dict[str, float]:
        """Predicted multiply-adds of one factorisation in each ordering that was tried; NaN if it failed."""

    @property
    def operations(self) -> dict[str, float]:
        """Predicted multiply-adds of `reduction`, `factor` and `inverse`, per execution."""

    @property
    def formations(self) -> int:
        """Number of formations of the normal equations."""

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds in `form`, `factor`, `solve`, `invert` and `cofactors`, over all iterations."""

@final
class BlockSolution(_NetworkSolution):
    """An adjusted block; k is 6."""

    @property
    def photo_corrections(self) -> _Floats:
        """(i, P, 6) corrections of position and attitude in each of i iterations, in their units."""

    @property
    def photo_positions(self) -> _Floats:
        """(P, 3) X, Y, Z, or longitude (rad), latitude (rad), height."""

    @property
    def photo_attitudes(self) -> _Floats:
        """(P, 3) omega, phi, kappa in radians."""

    @property
    def point_last_corrections(self) -> _Floats:
        """(n, 3) corrections in the last iteration, in the units of the values."""

    @property
    def images_behind(self) -> _Indices:
        """Indices of observations whose point is behind the camera, ascending."""

    @property
    def images_folded(self) -> _Indices:
        """Indices of observations outside the one-to-one domain of the lens, ascending."""

    @property
    def loose_photos(self) -> list[int]:
        """Indices of photos with unchanged poses, because their observations do not determine them."""

    @property
    def datum(self) -> list[tuple[int, int]]:
        """Photos and their unknowns (0 to 5) fixed to define the datum.

        Empty if observations and weights define it.
        """

    @property
    def datum_unknowns(self) -> list[tuple[int, int]]:
        """Coefficients of trajectories fixed to define the datum: common unknowns and components."""

    @property
    def relative_error(self) -> float:
        """Approximate relative rounding error of the variances in the datum."""

    @property
    def minimal_control(self) -> bool:
        """Whether control and weights of poses are exactly sufficient for a datum."""

    @property
    def weak_unknowns(self) -> list[tuple[int, int]]:
        """The same as `weak` for common unknowns: unknowns and their components."""

    @property
    def adjusted_unknowns(
        self,
    ) -> list[tuple[list[float], list[float], list[float], list[float], list[float], list[float], int]]:
        """The adjusted common unknowns, in the given order.

        Change from the given values, position (3), rotation matrix row by row (9), cofactors row by row for
        rotations about the adjusted axes, cofactors with the previous unknown in its block (empty for the
        first), redundancy numbers, and the number of observations.
        """

    @property
    def weak_cameras(self) -> list[tuple[int, int]]:
        """The same as `weak` for cameras shared by several photos: cameras and their parameters."""

    @property
    def cameras(self) -> list[CameraRow]:
        """The adjusted cameras, in the given order."""

    @property
    def dropped(self) -> list[tuple[int, str]]:
        """Excluded points, each with the reason."""

    @property
    def sums_of_squares(self) -> tuple[float, float, float, float]:
        """Weighted sums of squares: camera, ground, plates, additional observations."""

    @property
    def redundancies(self) -> tuple[float, float, float, float] | None:
        """Sums of the redundancy numbers of these; None without covariances."""

    @property
    def adjusted_observations(
        self,
    ) -> list[tuple[list[float], list[float], list[float], float, float] | None]:
        """Results of each additional observation, in the order of the groups.

        Residuals, redundancy numbers and standardized residuals of its components, in the units of its type;
        its weighted square; the factor of its weight by a loss. None for observations of excluded points.
        """

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom of the chosen unit variance."""

    @property
    def photo_order(self) -> _Indices:
        """(P,) indices of the photos in the order of their elimination."""

class ResectionError(Exception):
    """A photo that cannot be resected.

    `args` is (kind, message): kind is `too few points`, `collinear`, `danger cylinder`, `undetermined`, `no
    placement`, `not finite` or `input`.
    """

def resect(
    points: _Floats,
    point_sd: _Floats,
    image_xy: _Floats,
    image_sd: _Floats,
    principal_distance: float,
    *,
    known: _Floats,
    known_sd: _Floats,
    start: _Floats | None,
    spheroid: tuple[float, float] | None,
    photo_to_ground: bool,
    at_measured: bool,
    criterion: str,
    limit: float,
    max_iterations: int,
    covariance: bool,
) -> ResectionSolution:
    """Resect one photo by least squares on the calling thread; Ctrl-C is checked between iterations.

    Parameters
    ----------
    points, point_sd
        (n, 3) control, X, Y, Z or longitude (rad), latitude (rad), height; finite standard deviations, 0 to
        fix it.
    image_xy, image_sd
        (n, 2) millimetres.
    principal_distance
        Millimetres, signed.
    known, known_sd
        (6,) prior position and attitude (NaN if unknown), and standard deviations: infinite free, 0 fixed.
    start
        (6,) initial values; None: computed from triples of points.
    spheroid
        Semi-axes (a, b) for geographic space, None for rectangular space.
    photo_to_ground
        The sense of the angles.
    at_measured
        Form the partials at the measured image positions, as program W5344 does (USGS Computer Contribution
        2, 1969, equations 4 and 5), instead of the computed ones.
    criterion, limit
        `fraction`: no unknown changes by more than `limit` of its standard deviation; `position`: the
        correction of the position is shorter than `limit`, full steps without damping (program W5344).
    max_iterations
        Maximum number of iterations from each start.
    covariance
        Whether to compute cofactors and redundancy numbers; NaN otherwise.

    Raises
    ------
    ResectionError
        If the photo cannot be resected.
    ValueError
        If a shape, length or choice is invalid; the message names the argument.
    """

@final
class ResectionSolution:
    """A resected photo with n points. Cofactors hold for a priori unit weight."""

    @property
    def status(self) -> str:
        """`converged`, `not converged` or `diverged`."""

    @property
    def iterations(self) -> list[IterationRow]:
        """Every iteration."""

    @property
    def history(self) -> _Floats:
        """(k, 6) position and attitude after each iteration."""

    @property
    def start(self) -> _Floats:
        """(6,) the pose from which the adjustment started."""

    @property
    def pose(self) -> _Floats:
        """(6,) position, then omega, phi, kappa in radians."""

    @property
    def cofactors(self) -> _Floats:
        """(6, 6), in the units of the values; with the criterion `position` before the last correction."""

    @property
    def pose_redundancy(self) -> _Floats:
        """(6,) redundancy numbers of position and attitude as observations; 0 unless weighted."""

    @property
    def point_positions(self) -> _Floats:
        """(n, 3) adjusted control."""

    @property
    def point_cofactors(self) -> _Floats:
        """(n, 3, 3) in the units of the values."""

    @property
    def point_redundancy(self) -> _Floats:
        """(n, 3) redundancy numbers of control coordinates; 0 unless weighted."""

    @property
    def residuals(self) -> _Floats:
        """(n, 2) observed minus computed, millimetres."""

    @property
    def redundancy(self) -> _Floats:
        """(n, 2) redundancy numbers."""

    @property
    def standardized(self) -> _Floats:
        """(n, 2) residual / (standard deviation x root of redundancy number), a priori unit weight."""

    @property
    def partials(self) -> _Floats:
        """(n, 2, 6) partials of x and y with respect to position and attitude, at the solution."""

    @property
    def points_behind(self) -> _Indices:
        """Indices of the points behind the camera, ascending."""

    @property
    def sum_of_squares(self) -> float:
        """Weighted sum of squares."""

    @property
    def degrees_of_freedom(self) -> int:
        """Observations and weighted unknowns less unknowns."""

    @property
    def alternatives(self) -> list[tuple[list[float], float]]:
        """Other poses (6 values) that fit about as well, with their sums of squares."""

    @property
    def undetermined(self) -> str | None:
        """Reason why another fitting pose is undetermined, as in `ResectionError`; None without one."""

    @property
    def outside_danger_cylinder(self) -> float | None:
        """Distance of the projection centre from the danger cylinder, negative inside, or None."""

class ComparatorError(Exception):
    """A calibration that cannot be adjusted: (message, cases, points), both by their indices."""

@final
class ComparatorSolution:
    """An adjusted calibration of a comparator. Cofactors are for a priori unit weight."""

    @property
    def converged(self) -> bool:
        """Whether no unknown changed by more than `limit` of its standard deviation in the last step."""

    @property
    def iterations(self) -> int:
        """Number of iterations."""

    @property
    def comparator(self) -> list[float]:
        """Scale x, scale y, lack of orthogonality (rad), coefficients of x, of y (unit of the grid)."""

    @property
    def comparator_cofactors(self) -> _Floats:
        """(k, k) joint cofactors."""

    @property
    def case_placements(self) -> _Floats:
        """(q, 3) rotation (rad), and the grid coordinates of the centre of the polynomials."""

    @property
    def case_cofactors(self) -> _Floats:
        """(q, 3, 3) of each case."""

    @property
    def grid_xy(self) -> _Floats:
        """(l, 2) adjusted grid coordinates, in the axes of the plate."""

    @property
    def grid_cofactors(self) -> _Floats:
        """(l, 2, 2) of each grid point."""

    @property
    def grid_redundancy(self) -> _Floats:
        """(l, 2) redundancy numbers of given grid coordinates; zero for free and fixed ones."""

    @property
    def residuals(self) -> _Floats:
        """(m, 2) observed minus computed readings."""

    @property
    def redundancy(self) -> _Floats:
        """(m, 2) redundancy numbers of the readings."""

    @property
    def sum_of_squares(self) -> float:
        """Weighted sum of squares of readings and weighted grid coordinates."""

    @property
    def degrees_of_freedom(self) -> int:
        """Readings and weighted grid coordinates less unknowns."""

def adjust_comparator(
    grid_xy: _Floats,
    grid_sd: _Floats,
    case_placements: _Floats,
    case_left_handed: list[bool],
    measured_cases: _Indices,
    measured_points: _Indices,
    measured_xy: _Floats,
    measured_sd: _Floats,
    coefficients: tuple[list[float], list[float]],
    coefficient_sd: tuple[list[float], list[float]],
    *,
    degree: int,
    centre: tuple[float, float],
    half_range: tuple[float, float],
    limit: float,
    max_iterations: int,
) -> ComparatorSolution:
    """Adjust a comparator, its polynomials, the plate placements and their grids together.

    grid = M (x' + P(x') - centre) + t with x' = N S x: scales, lack of orthogonality, then polynomials, then
    rotation. Polynomials have the terms u^d, v^d, ... u^2, v^2; u and v are x' and y' minus `centre`, divided
    by `half_range`.

    Parameters
    ----------
    grid_xy, grid_sd
        (l, 2) coordinates of the grid points in the axes of their plate, and their standard deviations:
        infinite free, zero fixed.
    case_placements
        (q, 3) initial rotation (rad) and grid coordinates of `centre`.
    case_left_handed
        (q) whether X and Y of the grid are exchanged.
    measured_cases, measured_points
        (m,) indices of the case and the grid point of each reading.
    measured_xy, measured_sd
        (m, 2) readings and their standard deviations, in the unit of the grid.
    coefficients, coefficient_sd
        Initial coefficients in x and in y, in the unit of the grid, and their standard deviations: infinite
        free, zero fixed.
    degree, centre, half_range
        Degree, centre and half range of the polynomials.
    limit, max_iterations
        Convergence: largest change in standard deviations.

    Raises
    ------
    ComparatorError
        If unknowns are undetermined, or indices and lengths are inconsistent.
    ValueError
        If a shape differs; the message names the argument and its shape.
    """

_Vector = tuple[float, float, float] | list[float]
_Matrix = list[list[float]]

CentredRow = tuple[float, _Matrix, _Vector, _Vector, _Vector]
"""Scale s, rotation A (3 x 3), shift t, centre of the control c_X, centre of the model c_x of the similarity
x - c_x = s A (X - c_X) + t."""

ParametersRow = tuple[float, _Matrix, _Vector]
"""Scale s, rotation A (3 x 3), translation B of the similarity x = s A X + B."""

TraceRow = tuple[_Matrix, tuple[list[tuple[int, int]], _Floats], _Floats, _Floats, list[float], list[float]]
"""One cycle of the bulletin: initial rotation A; (station, component) and (m, 8) P-values of equations;
normal equations C (7, 8); auxiliary table D (7, 8); seven results; corrected omega, phi, kappa, s, b1, b2,
b3."""

class SimilarityError(Exception):
    """A model that cannot be oriented.

    `args` is (kind, message, stations): kind is `insufficient`, `undetermined`, `first stations`, `scale`,
    `not finite` or `input`; stations is a list of the affected indices.
    """

def orient_model(
    control: _Floats,
    control_sd: _Floats,
    model: _Floats,
    model_sd: _Floats,
    *,
    method: str,
    start: str,
    former: ParametersRow | None,
    max_iterations: int,
    tolerance: float,
    threads: int,
    trace: bool,
    scale: float | None = None,
) -> SimilaritySolution:
    """Estimate the similarity x = s A X + B of control X and model x (C&GS Technical Bulletin 19).

    Parameters
    ----------
    control, control_sd
        (n, 3) ground units: coordinates, NaN if unknown, and standard deviations, zero if exact, infinite if
        not used.
    model, model_sd
        (n, 3) model units: coordinates and standard deviations; zero only if the control is not exact.
    method
        `rigorous`, `report` or `fill-in`.
    start
        `auto`, `report` or `closed-form`; ignored with `former`.
    former
        A previous result used as initial values, or None.
    max_iterations
        Maximum number of iterations.
    tolerance
        Largest change of an unknown at convergence, as a fraction of its standard deviation (rigorous
        method).
    threads
        Number of threads; 0: chosen by the core (see `BlockNetwork`).
    trace
        True to store intermediate results of the report's methods.
    scale
        Fixed s, with six remaining unknowns; None: estimated.

    Raises
    ------
    SimilarityError
        If the model cannot be oriented.
    ValueError
        If a shape, length or choice is invalid; the message names the argument.
    """

@final
class SimilaritySolution:
    """An oriented model, in the order of its n stations. Cofactors hold for a priori unit weight."""

    @property
    def status(self) -> str:
        """`converged`, `not converged` or `diverged`."""

    @property
    def started(self) -> str:
        """Source of the initial values: `restart`, `report` or `closed-form`."""

    @property
    def similarity(self) -> CentredRow:
        """The similarity."""

    @property
    def initial(self) -> CentredRow:
        """Initial values of the iteration."""

    @property
    def alternatives(self) -> list[CentredRow]:
        """Other orientations that fit as well."""

    @property
    def iterations(self) -> list[IterationRow]:
        """Iterations of the rigorous method; empty with the report's."""

    @property
    def cycles(self) -> list[float] | None:
        """Largest angle correction (rad) in each cycle of the report's methods, otherwise None."""

    @property
    def traces(self) -> list[TraceRow]:
        """Intermediate results of each of these cycles, if requested."""

    @property
    def tangent_cofactors(self) -> _Floats:
        """(7, 7) of three small rotations about the model axes (rad), s, t."""

    @property
    def condition(self) -> float:
        """Condition number of the linearized misclosures."""

    @property
    def weakness(self) -> tuple[str, list[int]] | None:
        """Reason for weak control, and the affected stations.

        `coincident` (horizontal stations in plan), `elevations in line` (in plan) or `stations in line`.
        """

    @property
    def sum_of_squares(self) -> float:
        """Weighted sum of squares, both systems."""

    @property
    def misclosures(self) -> _Floats:
        """(n, 3) s X - A^T (x - B): control axes, model units; NaN if unknown."""

    @property
    def model_residuals(self) -> _Floats:
        """(n, 3) s A X + B - x with the adjusted X: model axes, model units."""

    @property
    def adjusted_control(self) -> _Floats:
        """(n, 3) adjusted control coordinates, ground units; unknown ones from the model."""

    @property
    def control_cofactors(self) -> _Floats:
        """(n, 3, 3) of the adjusted control coordinates."""

    @property
    def redundancy(self) -> _Floats:
        """(n, 3) redundancy numbers of the misclosures; NaN if unknown."""

    @property
    def standardized(self) -> _Floats:
        """(n, 3) misclosure / its standard deviation, a priori; NaN if unknown or without redundancy."""

def transform_points(
    similarity: CentredRow, tangent_covariance: _Floats, points: _Floats, points_sd: _Floats
) -> tuple[_Floats, _Floats]:
    """Return control coordinates of model points with covariances.

    Parameters
    ----------
    similarity
        The similarity.
    tangent_covariance
        (7, 7) of three small rotations about the model axes (rad), s, t.
    points, points_sd
        (n, 3) model coordinates and their own standard deviations, model units.

    Returns
    -------
    (n, 3) X = A^T (x - B) / s and (n, 3, 3) covariances, ground units.

    Raises
    ------
    ValueError
        If a shape differs; the message names the argument and its shape.
    """

def similarity_partials(similarity: CentredRow) -> _Floats:
    """Return (7, 7) partials of omega, phi, kappa, s, b1, b2, b3 by three small rotations, s, t."""

def gauss_crout(normal: _Floats) -> tuple[_Floats, _Floats] | None:
    """Solve seven normal equations by the Gauss-Crout scheme of TB 19, section 4.

    Parameters
    ----------
    normal
        (7, 8) C; column 8 is the right-hand side.

    Returns
    -------
    (7, 8) auxiliary matrix D and (7,) solution E; None if a pivot vanishes.

    Raises
    ------
    ValueError
        If a shape differs; the message names the argument and its shape.
    """

_Station = tuple[float, float, float, float]
"""Latitude (rad), constant of diurnal aberration (rad), temperature (K), pressure (mm of mercury)."""
_CameraKind = tuple[float | None, bool, bool] | tuple[str, bool]
"""For plates: principal distance of the distorted image (None: scale first), Brown's decentering, common
scale.
For another model (`camera_models`): its name, and whether fx is the principal distance of both axes."""

class StellarError(Exception):
    """A camera that cannot be calibrated.

    `args` are the kind (`undetermined stars`, `undetermined`, `weight`, `not finite`, `input`), a message,
    and the indices of the affected stars, or of the parameters if the kind is `undetermined`.
    """

def refraction(
    zenith_distances: _Floats, temperature: float, pressure: float, tau: _Floats, observed: bool
) -> _Floats:
    """Return the refraction of observed or true zenith distances (NOAA TR NOS 55, equations 7 to 11).

    Parameters
    ----------
    zenith_distances
        (n,) radians.
    temperature, pressure
        Kelvin, millimetres of mercury.
    tau
        (4,) coefficients in seconds of arc.
    observed
        True for observed zenith distances.

    Returns
    -------
    (n,) true minus observed zenith distance, radians.
    """

def measured_feature(
    kind: str, points: _Floats, covariance: _Floats
) -> tuple[list[tuple[str, bool]], _Floats, _Floats, _Floats, tuple[float, int] | None]:
    """Fit a feature to points, with the covariances of its quantities (docs/features.md).

    Parameters
    ----------
    kind
        `distance`, `line`, `plane`, `circle`, `sphere` or `cylinder`.
    points
        (n, 3), any unit of length.
    covariance
        (3n, 3n) of all coordinates, point by point.

    Returns
    -------
    Names of q quantities, and whether each is a length (else a component of a unit vector); (q,) values; (q,
    q) their covariance; (n, 4) deviations of points, radial (of a plane along its normal) and axial, each
    with its standard deviation; statistic and degrees of freedom of their test, or None.

    Raises
    ------
    InputError
        If there are too few points, the feature is undetermined or ambiguous, a value is not finite, or a
        shape differs.
    ValueError
        If the kind is unknown.
    """

def nearest_points(points: _Floats, others: _Floats, limit: float, but: _Indices | None = None) -> _Indices:
    """Return the nearest of the others for each point of a plane, (n,); -1 if none is near enough.

    Parameters
    ----------
    points
        (n, 2).
    others
        (m, 2), sorted into cells as wide as the limit.
    limit
        Largest distance, in the unit of the points.
    but
        (n,) for each point one of the others to ignore; -1 for none.

    Raises
    ------
    InputError
        If shapes differ.
    """

def star_similarities(
    images: _Floats,
    stars: _Floats,
    candidates: _Indices,
    *,
    makers: int,
    tolerance: float,
    stretch: float,
    least: float,
    axis: tuple[tuple[float, float], float] | None,
    limit: float,
    wanted: int,
) -> tuple[int, _Floats]:
    """Find similarities between images and stars from pairs of candidates and votes of all images.

    Parameters
    ----------
    images
        (m, 2), the brightest first; every one votes.
    stars
        (n, 2) predicted images.
    candidates
        (c, 2) an image, of the first `makers`, and a star that it may show.
    makers
        Number of images whose pairs define similarities.
    tolerance, stretch
        Tolerance of the difference of the separations of two images and of their stars, and the added part of
        the separation of the images.
    least
        Lower limit of the separation of two images.
    axis
        x, y of the point of rotation of the camera, and its largest displacement; None for any rotation.
    limit
        Distance from a star within which an image votes, with cells of half this width.
    wanted
        Maximum number of returned similarities.

    Returns
    -------
    Number of agreeing pairs, and (k, 4) similarities with the most votes, best first: an image z, as a
    complex number, is mapped to (a + b i) z + (c + d i). All images vote for the 4,096 candidates of the
    makers.

    Raises
    ------
    InputError
        If shapes differ.
    ValueError
        If a candidate is not an image and a star.
    """

def standard_coordinates(places: _Floats, sidereal_times: _Floats, place: _Station, tau: _Floats) -> _Floats:
    """Return refracted standard coordinates xi (north), eta (east), (n, 2), of apparent positions.

    NaN at and below the horizon.
    """

def star_places(standard: _Floats, sidereal_times: _Floats, place: _Station, tau: _Floats) -> _Floats:
    """Return apparent right ascension and declination, (n, 2), of refracted standard coordinates."""

def pointing_matrix(angles: _Floats) -> _Floats:
    """Return the matrix (3, 3) of alpha, omega, kappa: north, east, zenith to x, y, axis (equation 19)."""

def pointing_of_matrix(matrix: _Floats) -> _Floats:
    """Return the angles alpha, omega, kappa (3,) of a matrix (3, 3)."""

def plate_images(standard: _Floats, angles: _Floats, interior: _Floats, camera: _CameraKind) -> _Floats:
    """Return plate coordinates (n, 2) of standard coordinates (n, 2); NaN behind the camera.

    Parameters
    ----------
    standard
        (n, 2) xi, eta.
    angles
        (3,) alpha, omega, kappa.
    interior
        (13,) epsilon, xp, yp, cx, cy, dx, dy, K1, K2, K3, and K4, K5, phi_T or P1, P2, P3. For another model
        its own parameters, then zeros: x to the right, y down.
    camera
        Its kind.
    """

def plate_directions(
    xy: _Floats, angles: _Floats, interior: _Floats, camera: _CameraKind, *, tolerance: float, passes: int
) -> _Floats:
    """Return directions of plate coordinates, the inverse of `plate_images`.

    Returns
    -------
    (n, 5) xi, eta, undistorted x, y, and 1 if the distortion converged within `tolerance` in `passes` passes.
    """

@final
class StellarProblem:
    """A calibration with its initial values: S stars, G attitudes, m images.

    Parameters
    ----------
    station, camera
        Station, and type of the camera.
    pointings, common
        (G, 3) attitudes; (17,) 13 interior parameters and 4 coefficients of refraction (arcsec).
    fixed
        3 G + 17 flags of fixed parameters.
    weighted, weighted_values, weight_root
        (k,) indices of weighted parameters, their given values, and R (k, k) of their weight matrix R^T R.
    star_places, star_catalogue, star_weights, star_fixed
        (S, 2) initial and catalogue positions; (S, 2, 2) weights, zero for unknown directions; S flags.
    image_stars, image_pointings, image_xy, image_weights, image_times, image_shifts
        (m,) indices of star and attitude; (m, 2) measured; (m, 2, 2); (m,) sidereal time; (m, 2) position of
        the star at the time of the image minus the adjusted position.
    axis
        Attitude, standard coordinates, plate coordinates and weight of the axis, if it is known.

    Raises
    ------
    ValueError
        If a shape differs.
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
        whole: bool = False,
    ) -> dict[str, Any]:
        """Adjust by least squares with exact partials.

        Parameters
        ----------
        unit
            Expected standard deviation of unit weight, the unit of `fraction` and the history.
        fraction
            Convergence limit of the change of an unknown, as a fraction of its standard deviation.
        max_iterations, covariance, threads, progress
            As in `block_network`.
        whole
            True to compute the joint cofactors of all parameters, if cofactors are computed.

        Returns
        -------
        `status`, `iterations`, `initial_sum_of_squares` (in units of `unit` squared), `parameters` (3 G +
        17,); `places` (S, 2), `place_cofactors` (S, 2, 2), `place_inverses` (S, 2, 2): the same for known
        parameters; `residuals` (m, 2) measured minus computed, `axis_residual`, `sums_of_squares` (images,
        stars, parameters, axis), and `redundancy` and `standardized` of `image`, `place`, `axis`: of
        decorrelated components if weights are correlated. With cofactors, all for unit weight:
        `pointing_cofactors` (G, 3, 3), `cross_cofactors` (G, 3, 17) of attitudes and common parameters,
        `common_cofactors` (17, 17); with `whole`, `cofactors` (3 G + 17, 3 G + 17) and `log_determinant`:
        natural logarithm of the determinant of the normal equations reduced to the parameters.

        Raises
        ------
        StellarError
            If stars or parameters are undetermined, or without image at the initial values.
        """

    def without_effect(self) -> list[int]:
        """Return the indices of parameters that affect no image, no weight and not the axis.

        Fixed parameters are not included.

        Raises
        ------
        StellarError
            If stars are without image at the initial values.
        """

    def correction(self, *, refraction: float, distortion: float, passes: int) -> dict[str, Any]:
        """Correct the parameters once with the equations of `published` at the initial values.

        Parameters
        ----------
        refraction, distortion, passes
            As in `published`.

        Returns
        -------
        `parameters` (3 G + 17,): corrections; `cofactors` of every two and `log_determinant`, both for unit
        weight; `without_effect`: indices of parameters without effect, which are not corrected.

        Raises
        ------
        StellarError
            If stars or parameters are undetermined, or without image at the initial values.
        """

    def residual_cycle(
        self, cofactors: _Floats, *, refraction: float, distortion: float, passes: int
    ) -> dict[str, Any]:
        """Correct the stars for given parameters; residuals and their tests (equations 64 to 71).

        Parameters
        ----------
        cofactors
            (3 G + 17, 3 G + 17) of the parameters, for unit weight.
        refraction, distortion, passes
            As in `published`.

        Returns
        -------
        As in `adjust`, but of the plate coordinates themselves: `places`, `place_cofactors`,
        `place_inverses`, `residuals`, `axis_residual`, `sums_of_squares`, and `redundancy` and `standardized`
        of `image` and `place`.

        Raises
        ------
        StellarError
            If stars are undetermined, or without image.
        """

    def equations(self) -> dict[str, _Floats]:
        """Return unweighted equations of the images at the initial values with exact partials.

        Returns
        -------
        `constant` (m, 2) measured minus computed, `star` (m, 2, 2), `pointing` (m, 2, 3), `common` (m, 2,
        17).
        """

    def axis_equations(self) -> dict[str, _Floats]:
        """Return equations of the axis, like `equations`, with one row or none."""

    def published(self, *, refraction: float, distortion: float, passes: int) -> dict[str, Any]:
        """Return equations of the images as in the report's program (equations 48 to 62, 73, 74).

        Parameters
        ----------
        refraction, distortion, passes
            Tolerances (radians, unit of the plate) and limit of the inner iterations.

        Returns
        -------
        As `equations`, and `standard` (m, 2), `undistorted` (m, 2), `unsettled`: images and last changes.
        """

    def directions(self) -> _Floats:
        """Return right ascension and declination (m, 2) of every image at the initial values."""

class CollectionError(Exception):
    """A collection that cannot be adjusted: (kind, message, combinations, points).

    The kinds are as in :class:`BlockError`, without `no intersection`.
    """

def read_numbers(text: bytes) -> tuple[_Floats, bool]:
    """Read numbers separated by white space, up to the first word that is not a finite number.

    Returns
    -------
    (k,) numbers, and whether they are the whole text.
    """

@final
class TableReader:
    """Columns of a table of text whose lines are all regular.

    A regular line has as many cells as columns, or an empty one more. The cells of columns of numbers are
    empty or numbers with the same decimal mark. Names are without control characters. A cell can be in
    quotation marks if no quotation mark is inside. Comments, and blank lines above others, are irregular.

    Parameters
    ----------
    delimiter
        The code of the character between cells (ASCII).
    numeric
        For each column, whether its cells are numbers.
    """

    def __new__(cls, delimiter: int, numeric: Sequence[bool]) -> TableReader: ...
    def add(self, lines: bytes) -> bool:
        """Append whole lines. Return False and drop all columns if a line is irregular."""

    def columns(self) -> list[_Floats | tuple[bytes, _Indices, bool]]:
        """Return the columns and empty the reader.

        Returns
        -------
        Numbers, NaN for empty cells. For names: each unique name in the order of the rows, followed by a line
        feed; the number of the name of each row; whether no name is known to be empty or NaN, and all differ
        by more than blanks and case.
        """

def csv_rows(columns: Sequence[_Floats | _Indices | NDArray[np.bool_] | list[str | None]]) -> bytes:
    """Return the rows of a table as comma-separated text (UTF-8), one line each.

    Numbers have the shortest digits that are read back to the last bit, NaN and None are empty cells, truth
    values are `true` and `false`. Texts are quoted if commas, semicolons, bars, tabs, hashes, quotation
    marks, line ends or outer blanks would be misread. Line ends are replaced by blanks.

    Parameters
    ----------
    columns
        Columns of equal length.

    Raises
    ------
    ValueError
        If columns differ in length.
    """

_ControlColumns = dict[str, Any]

def control_header(
    data: bytes, start: int, stop: int, file: Path | None
) -> tuple[list[str | None], int | None, list[int], list[float], bytes]:
    """Read the header of a binary control network.

    Parameters
    ----------
    data
        The file.
    start, stop
        Position of the header in the file.
    file
        Its name, for errors.

    Returns
    -------
    Network, target, created, modified, description and user, None if missing; the number of points, if given;
    version 2: the lengths of the points' messages; radii in metres; unknown fields, byte for byte.

    Raises
    ------
    InputError
        If the header is damaged.
    """

def control_header_message(
    texts: Sequence[str | None], points: int, radii: Sequence[float], rest: bytes
) -> bytes:
    """Return the header of a binary control network of version 5; see :func:`control_header`."""

def control_points(
    data: bytes, start: int, stop: int, lengths: Sequence[int] | None, file: Path | None
) -> tuple[_ControlColumns, _ControlColumns, _Indices]:
    """Read the points of a binary control network.

    Parameters
    ----------
    data
        The file.
    start, stop
        Position of the points in the file.
    lengths
        The lengths of their messages; None if each length precedes its message.
    file
        Its name, for errors.

    Returns
    -------
    Columns of points, columns of measures, the first measure of each point and the number of all (n + 1).
    Columns are arrays by name; `ids` is a list of texts, `serial` indices and their texts. Empty columns are
    omitted. `rest` contains fields without a column, byte for byte, and the start of each row.

    Raises
    ------
    InputError
        If the points are damaged; its record is the number of the point, from 1.
    """

def control_points_of_text(
    data: bytes, file: Path | None
) -> tuple[tuple[_ControlColumns, _ControlColumns, _Indices], str]:
    """Read the points of a control network in text (UTF-8).

    Returns
    -------
    The same as :func:`control_points`, and the text without its points, on the same lines.

    Raises
    ------
    InputError
        If the text is not a control network; its record is the number of the line, from 1.
    """

def control_point_messages(points: _ControlColumns, measures: _ControlColumns, firsts: _Indices) -> bytes:
    """Return points as messages of version 5, each after its length; see :func:`control_points`.

    Raises
    ------
    InputError
        If columns are inconsistent, or contain data that only text can represent.
    """

def control_point_text(points: _ControlColumns, measures: _ControlColumns, firsts: _Indices) -> bytes:
    """Return points as text in the object of their network; see :func:`control_points`.

    Raises
    ------
    InputError
        If columns are inconsistent, or contain data that only messages can represent.
    """

UNKNOWNS: list[tuple[str, list[tuple[str, str]]]]
"""Types of common unknowns: name, and for each unknown its name and whether it is a `length`, a `speed`, an
`angle` or a `ratio`."""

CAMERAS: list[str]
"""Names of the camera models."""

def collection_images(camera: str, photo_parameters: _Floats, points: _Floats) -> _Floats:
    """Return image coordinates of points, row by row: point i on the photo of row i.

    Parameters
    ----------
    camera
        The model, one of `CAMERAS`; `docs/cameras.md` has their formulas.
    photo_parameters
        (n, 6 + k) angle-axis vector w (rad) and t, so that P = R(w) X + t in the photo's axes (x right, y up,
        looking along -z), then the k parameters of the camera.
    points
        (n, 3) X.

    Returns
    -------
    (n, 2) in the unit of the camera; not finite in the plane of the projection centre. For a point behind the
    camera, the formula is applied as well.

    Raises
    ------
    ValueError
        If a shape, length or choice is invalid; the message names the argument.
    """

def collection_network(
    camera: str,
    photo_parameters: _Floats,
    photo_sd: _Floats,
    point_positions: _Floats,
    point_sd: _Floats,
    image_photos: _Indices,
    image_points: _Indices,
    image_xy: _Floats,
    image_sd: _Floats,
    *,
    decrease: float,
    max_iterations: int,
    covariance: bool,
    loss: tuple[str, float] | None,
    ordering: str,
    memory: int | None,
) -> CollectionNetwork:
    """Return a collection of photos for adjustment by Levenberg-Marquardt steps.

    Parameters
    ----------
    camera
        The model of the cameras, one of `CAMERAS`.
    photo_parameters, photo_sd
        (P, 6 + k) initial parameters (also the observed values of weighted ones) and their standard
        deviations, infinite for free ones, zero for fixed ones; see :func:`collection_images`.
    point_positions, point_sd
        (n, 3) likewise.
    image_photos, image_points
        (m,) indices.
    image_xy, image_sd
        (m, 2) pixels.
    decrease
        Convergence limit of the relative decrease of the weighted sum of squares by a step.
    max_iterations
        Maximum number of iterations.
    covariance
        Whether to compute cofactors and redundancy numbers; NaN otherwise.
    loss
        Robust loss of the image points, `huber` or `cauchy`, and its scale in standard deviations a priori.
    ordering
        `auto`, `input`, `rcm`, `amd`, `dissection` or `graph-dissection`; see :func:`photogram.adjust`.
    memory
        Limit of memory of the adjustment, bytes; None for no limit.

    Raises
    ------
    ValueError
        If a shape, length or choice is invalid; the message names the argument.
    """

@final
class CollectionNetwork:
    """A collection with the options of its adjustment; arguments as in :class:`BlockNetwork`.

    The methods raise CollectionError if the collection cannot be adjusted, and ValueError if observations
    refer to missing photos or points.
    """

    def adjust(
        self,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
        start: BlockState | None = None,
    ) -> CollectionSolution:
        """Adjust the collection, possibly from the end of an adjustment with other weights."""

    def covariances(
        self,
        state: BlockState,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> BlockCovariances:
        """Factor the normal equations at the end of the adjustment."""

    def trial(self, state: BlockState | None, *, threads: int) -> NetworkTrial:
        """Prepare trials without some observations, from the end of an adjustment or from the start."""

@final
class CollectionSolution(_NetworkSolution):
    """An adjusted collection; k is 6 plus the number of parameters of a camera."""

    @property
    def photo_parameters(self) -> _Floats:
        """(P, k) adjusted parameters, as given."""

    @property
    def photo_images(self) -> _Indices:
        """(P,) number of used observations."""

    @property
    def point_rays_behind(self) -> _Indices:
        """(n,) number of observations with the point behind the camera."""

    @property
    def collapsed(self) -> list[int]:
        """Indices of excluded points that collapsed to a station."""

    @property
    def beside_stations(self) -> list[int]:
        """Indices of excluded points that are given near an observing station and do not fit."""

    @property
    def not_determined(self) -> list[int]:
        """Indices of excluded points that their rays do not determine."""

    @property
    def sum_of_squares(self) -> float:
        """Weighted sum of squares, with the weights changed by the loss."""

    @property
    def degrees_of_freedom(self) -> int:
        """Observations and weighted unknowns less unknowns."""

    @property
    def datum(self) -> list[tuple[int, int]]:
        """Photos and parameters fixed to define the datum; empty if observations and weights define it."""
