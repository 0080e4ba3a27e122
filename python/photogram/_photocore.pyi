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
"""What `find_first_values` returns."""

IterationRow = tuple[int, float, float, float]
"""Number from 1, weighted sum of squares after it, largest change in standard deviations, damping."""

CombinationRow = tuple[list[int], list[int], list[int], list[tuple[int, int]], list[str]]
"""Photos; cameras that several of them share; common unknowns; cameras with parameters that take a notable
part; parts of poses that do: positions `along` and `across` the view, `tilt`, `swing` about the view."""

FailureRow = tuple[str, str, list[CombinationRow], list[int], list[float]]
"""Why a network cannot be adjusted, as in :class:`BlockError`."""

CameraRow = tuple[list[float], list[float], list[float], list[float], int, int]
"""Of an adjusted camera: k parameters, k x k cofactors row by row, k redundancy numbers, the diagonal of the
normal equations (k), photos, images."""

ContributionRow = tuple[_Floats, _Floats, _Floats]
"""What a node leaves to the one above: matrix, right-hand side, diagonal; see :class:`FormedNode`."""

_DatumRow = tuple[str, list[int], list[int], bool, list[int], float | None]
"""What a datum is: its name, points, photos, whether scale counts, photos whose attitudes count, radius."""

RefractionRow = tuple[str | None, str | None, float, float, float]
"""Model of the air (`giant`, `standard` or None), model of the water (`giant`, `snell` or None), water level
(linear unit), refractive index of the water, metres in the linear unit."""

FlownRow = tuple[
    _Floats, _Floats, _Floats, _Floats, list[tuple[int, list[float]]], list[tuple[int, list[float]]]
]
"""What `flown` returns."""

class TrajectoryRow(TypedDict):
    """A trajectory as the core takes it; coefficients are indices among the common unknowns."""

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
    """Probability that a chi-square variable exceeds `x`, or is less than it.

    Parameters
    ----------
    x
        Not negative.
    dof
        Degrees of freedom, positive, not necessarily whole.
    upper
        Whether the probability of larger values is meant, or that of smaller ones.

    Returns
    -------
    NaN for arguments outside these ranges.
    """

def chi_square_quantile(probability: float, dof: float, *, upper: bool = True) -> float:
    """Return the value that a chi-square variable exceeds (`upper`), or falls short of, with a probability.

    Parameters
    ----------
    probability
        Between 0 and 1; small ones keep their digits on either side.
    dof
        Degrees of freedom, positive, not necessarily whole.
    upper
        The side on which the probability lies.

    Returns
    -------
    NaN for arguments outside these ranges.
    """

def normal(z: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) the probabilities that a normal variable lies below values."""

def student(t: float, dof: float) -> float:
    """Probability that the absolute value of Student's variable exceeds that of `t`.

    Returns
    -------
    NaN for arguments that cannot be.
    """

def student_limit(probability: float, dof: float) -> float:
    """Return the value that the absolute value of Student's variable exceeds with a probability.

    Returns
    -------
    NaN for arguments that cannot be.
    """

def fisher(x: float, first: float, second: float) -> float:
    """Probability that Fisher's variable of `first` and `second` degrees of freedom exceeds `x`.

    Returns
    -------
    NaN for arguments that cannot be.
    """

def fisher_limit(probability: float, first: float, second: float) -> float:
    """Return the value that Fisher's variable of two degrees of freedom exceeds with a probability.

    Returns
    -------
    NaN for arguments that cannot be.
    """

def log_chi_square(x: _Floats, dof: _Floats) -> _Floats:
    """Logarithms of the probabilities that chi-square variables exceed values.

    Parameters
    ----------
    x
        (n,) not negative.
    dof
        (n,) degrees of freedom, positive.

    Returns
    -------
    (n,) natural logarithms, also where the probability is less than the smallest number; NaN for arguments
    outside these ranges.
    """

def log_fisher(x: _Floats, first: _Floats, second: _Floats) -> _Floats:
    """Logarithms of the probabilities that Fisher's variables exceed values.

    Parameters
    ----------
    x
        (n,) not negative.
    first, second
        (n,) degrees of freedom, positive.

    Returns
    -------
    (n,) natural logarithms, also where the probability is less than the smallest number; NaN for arguments
    outside these ranges.
    """

def noncentral_chi_square(x: float, dof: float, noncentrality: float) -> float:
    """Probability that a noncentral chi-square variable exceeds `x`; NaN for arguments that cannot be."""

def noncentral_fisher(x: float, first: float, second: float, noncentrality: float) -> float:
    """Probability that a noncentral F variable exceeds `x`; NaN for arguments that cannot be.

    With `second` infinite it is that of the noncentral chi-square variable over `first`.
    """

def detectable_noncentrality(level: float, power: float, first: float, second: float) -> float:
    """Return the noncentrality (Baarda's lambda0) at which a test is significant with a given probability.

    Parameters
    ----------
    level
        Of the test: probability that it rejects where nothing is wrong.
    power
        Probability that it does where something is; more than the level.
    first, second
        Degrees of freedom of the F test; with `second` infinite of the chi-square test.

    Returns
    -------
    NaN for arguments outside these ranges.
    """

def level_of_equal_power(noncentrality: float, power: float, dof: float) -> tuple[float, float]:
    """Return level and critical value of the chi-square test that finds a noncentrality with a given power.

    With the noncentrality of one test for all others it is Baarda's B-method. NaN for arguments that cannot
    be.
    """

def film_readings(
    numbers: _Floats, vectors: _Floats, places: _Floats
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return readings of places in a camera's frame, and their partials.

    Parameters
    ----------
    numbers
        What is never unknown of a film: mirrored, rows down, pitch, o1, o2, hx, hy; 0, 1 or 2 for nothing, h
        or g; whether it has a roll and curves; the number of its pattern and what that takes.
    vectors
        (k, 3) the numbers of its unknowns: placement, size, h or g, roll, scanner, curves, weights.
    places
        (n, 2) mm.

    Returns
    -------
    (n, 2) readings, and (n, 2, 10) partials by x, y, t1, t2, theta, m, b1, b2 and both of h or g; NaN where
    the scanner has no reading.
    """

def film_places(numbers: _Floats, vectors: _Floats, readings: _Floats) -> NDArray[np.float64]:
    """Return (n, 2) the places in a camera's frame that have readings (n, 2); NaN where there are none.

    `numbers` and `vectors` as of :func:`film_readings`.
    """

def camera_models() -> list[tuple[str, tuple[str, list[tuple[str, int]], int, str, str]]]:
    """Return the models of cameras, `CAMERAS`, by their names.

    Returns
    -------
    Of each its formula, its parameters with the power of the unit of the image in which they are measured (0
    for plain numbers), how many of these, the last ones, are constants that are never unknown, and its
    direction: `forward`, lens terms are functions of ideal coordinates, or `backward`, of measured ones.
    """

def camera_images(model: str, parameters: _Floats, u: _Floats, knots: _Floats | None = None) -> _Floats:
    """Images of directions.

    Parameters
    ----------
    model
        One of `CAMERAS`.
    parameters
        (k,) in the order of the model.
    u
        (n, 3) in the axes of the photo: x right, y up, z back towards the viewer; the camera looks along -z.
    knots
        Of a splined model: dx, dy of each, row by row, of any shape; None for zeros.

    Returns
    -------
    (n, 2) in the unit of the camera; not finite where there are none.

    Raises
    ------
    ValueError
        A model that there is not, other shapes or numbers of parameters.
    """

def camera_rays(model: str, parameters: _Floats, xy: _Floats, knots: _Floats | None = None) -> _Floats:
    """Directions of image positions; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, 3) unit vectors in the axes of the photo, in front of it; NaN where no direction has the image.

    Raises
    ------
    ValueError
        A model that there is not, other shapes or numbers of parameters.
    """

def camera_correct(model: str, parameters: _Floats, xy: _Floats) -> _Floats:
    """Corrected image positions of a backward camera; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, 2) g, compared with c (u1, u2) / u3.

    Raises
    ------
    ValueError
        A model that there is not or that is forward, other shapes or numbers of parameters.
    """

def camera_partials(
    model: str, parameters: _Floats, u: _Floats, knots: _Floats | None = None
) -> tuple[_Floats, _Floats, _Floats]:
    """Images of directions with their partials; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, 2) images, (n, 2, 3) their partials by u, (n, 2, k) by the parameters, 0 for those that are constants
    of a lens; not finite where there are none. Those of a backward camera are the ones of the measured
    position that corresponds to u.

    Raises
    ------
    ValueError
        A model that there is not, other shapes or numbers of parameters.
    """

def camera_patches(model: str, parameters: _Floats, u: _Floats) -> tuple[_Indices, _Floats]:
    """Knots that images depend on; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, s) numbers of knots, row by row, and (n, s) their weights, s = 16 of order 3, 9 of order 2: partials
    of the image by a knot are diag(fx, fy) times its weight.

    Raises
    ------
    ValueError
        A model without knots, constants that are none of a spline, other shapes or numbers of parameters.
    """

def radial_domain(model: str, parameters: _Floats) -> tuple[float, float] | None:
    """Return the radius up to which the radial part of a lens is one-to-one, and what it becomes.

    Of a forward camera the radius is the tangent of the angle from the axis, of a fisheye the angle (rad),
    and becomes what the focal length multiplies; `brown_forward` has lengths in the image. Of a backward
    camera it is that of the measured position from the principal point, which becomes that of the corrected
    one. Infinite where only the image ends.

    Returns
    -------
    None where the lens is one-to-one everywhere.

    Raises
    ------
    ValueError
        A model that there is not, or another number of parameters.
    """

def attitudes_from_numbers(
    representation: str, numbers: _Floats, boresight: _Floats
) -> tuple[_Floats, _Floats]:
    """Attitudes from numbers (`docs/conventions.md`).

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
        An argument of another shape, or another representation; the message names it.
    """

def numbers_of_attitudes(
    representation: str, attitudes: _Floats, boresight: _Floats
) -> tuple[_Floats, _Floats]:
    """Numbers of attitudes, the inverse of `attitudes_from_numbers`.

    Parameters
    ----------
    representation, boresight
        As there.
    attitudes
        (n, 3, 3) matrices A, photo to object.

    Returns
    -------
    (n, k) numbers, and their partials by the rotation step, (n, k, 3); NaN where two angles turn about one
    axis: one of them is zero then.

    Raises
    ------
    ValueError
        An argument of another shape, or another representation; the message names it.
    """

def nadir_boresight(quarters: int) -> _Floats:
    """Photo axes from body axes, (3, 3), of a camera that looks at the nadir.

    Parameters
    ----------
    quarters
        Of a turn that the top of the picture is turned by from forward to the right wing: 0 to 3.
    """

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

def vector_rotations(vectors: _Floats) -> _Floats:
    """Rotation matrices of (n, 3) rotation vectors: axis times angle, radians (Rodrigues).

    Returns
    -------
    (n, 3, 3) matrices.

    Raises
    ------
    ValueError
        An argument of another shape; the message names it and its shape.
    """

def rotation_vectors(matrices: _Floats) -> _Floats:
    """Rotation vectors of (n, 3, 3) rotation matrices, the inverse of `vector_rotations`.

    Returns
    -------
    (n, 3) axis times angle, radians, no longer than pi.

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
    refraction: RefractionRow | None,
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
    refraction
        What bends the rays; None for straight ones.

    Returns
    -------
    (n, 2) x, y in millimetres; not finite for a point in the plane of the projection centre (u3 = 0).

    Raises
    ------
    ValueError
        An argument of another shape or length (the message names it and its shape), axes that make no
        spheroid, or refraction that cannot be.
    """

def refraction_shift(
    points: _Floats,
    positions: _Floats,
    *,
    spheroid: tuple[float, float] | None,
    refraction: RefractionRow,
) -> _Floats:
    """From points to where cameras see them, row by row.

    Parameters
    ----------
    points, positions
        (n, 3) points and projection centres: X, Y, Z, or longitude (rad), latitude (rad), height.
    spheroid
        Semi-axes (a, b) for geographic space, None for rectangular space.
    refraction
        What bends the rays.

    Returns
    -------
    (n, 3) vectors in the linear unit along X, Y, Z or the geocentric axes.

    Raises
    ------
    ValueError
        An argument of another shape or length (the message names it and its shape), axes that make no
        spheroid, or refraction that cannot be.
    """

class BlockError(Exception):
    """A block that cannot be adjusted.

    `args` is (kind, message, combinations, points, seconds): kind is `undetermined points`, `undetermined
    photos`, `no intersection`, `coarse` (too large for double precision), `outside` (a time that a trajectory
    does not reach), `not finite`, `memory`, `empty` or `input`; combinations are what undetermined
    combinations of unknowns move (of `coarse` and `outside`, the photos concerned, in one), points a list of
    point indices: of `outside` the point of the image that is, none where it is the photo itself. Seconds
    are, of `outside`, the time and the first and the last that the trajectory reaches, counted as its own.
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
    """Find poses of photos from what is known, in cartesian object space (`docs/first-values.md`).

    Parameters
    ----------
    photo_positions, photo_attitudes
        (P, 3) and (P, 3, 3), photo to object: given poses; NaN where none is.
    observed_positions, observed_attitudes
        The same as observed; NaN where they were not.
    point_positions, point_sd
        (n, 3) control in the linear unit, and its standard deviations; infinite where it is not held.
    image_photos, image_points
        (m,) indices into photos and points.
    directions, direction_sd
        (m, 3) unit directions in the axes of the photos, not finite where there is none, and (m,) their
        standard deviations in radians.
    threads
        As for `block_network`.

    Returns
    -------
    (P, 3) positions and (P, 3, 3) attitudes, NaN where none was found; for each photo (`given`, `resected`,
    `observed` or `oriented`, 0, 0), or why it has none: (`points`, known points, 0), (`misfit`, known points,
    0) or (`apart`, what its model has in common, photos of the model); (n, 3) positions of points; (m,)
    whether an image was set aside; (n,) whether the images of a control point agree with each other but not
    with its coordinates; the photo that is the datum, if nothing else is; the median of the angles
    between observed and computed directions, radians.

    Raises
    ------
    ValueError
        An argument of another shape or length, an index out of range; the message names it.
    """

def trajectory_span(trajectory: TrajectoryRow) -> tuple[float, float]:
    """Return the first and the last time that a trajectory may be asked for, counted as its own."""

def flown(trajectory: TrajectoryRow, position: _Floats, rotation: _Floats, times: list[float]) -> FlownRow:
    """Return a trajectory at n times (docs/moving.md).

    Parameters
    ----------
    trajectory
        As of :func:`block_network`; which unknowns its coefficients are does not matter.
    position, rotation
        (K, 3) coefficients of positions, and of rotations in radians.
    times
        Seconds, counted as those of the trajectory.

    Returns
    -------
    (n, 3) positions; (n, 9) attitudes, axes of the coefficients of positions, and right Jacobians of the
    corrections r, row by row; for each time the number of the first function of positions that is not zero
    and the values from there on, and the same of rotations.

    Raises
    ------
    InputError
        Times that do not increase, more or fewer coefficients than functions.
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
    """Return a block as it is adjusted by least squares (GIANT guide, sections 4 to 9).

    Standard deviations are infinite for free unknowns, zero for fixed ones. Positions are X, Y, Z, or
    longitude (rad), latitude (rad), height when a spheroid is given.

    Parameters
    ----------
    photo_positions, photo_attitudes
        (P, 3) initial values, at which fixed components stay; omega, phi, kappa in radians.
    photo_positions_observed, photo_attitudes_observed
        (P, 3) observed values where weighted; angles may differ from initial ones by whole turns.
    photo_position_sd, photo_attitude_sd
        (P, 3) standard deviations of the observed values.
    photo_cameras
        (P,) indices into the cameras; photos with the same one share its unknowns.
    cameras
        Model, parameters in its order and their standard deviations, covariance matrix of those that are
        weighted row by row, None where these were observed one by one; knots, None where there are none.
    point_positions, point_sd
        (n, 3) coordinates, NaN where unknown, and standard deviations, finite for held components.
    image_photos, image_points
        (m,) indices.
    image_xy, image_sd
        (m, 2) millimetres.
    observation_groups
        Observations beside images, each kind with its name, (k, p) indices of points, (k, q) of photos and
        (k, c) of common unknowns (-1 for none), (k, v) values and (k, r, r) covariance matrices of its r
        components. Values: `distance` the length (unknown: instrument), `equal height` the difference,
        `difference` three components (NaN where not observed), `control` three coordinates, `on level` the
        height above it, `on plane` the distance from it, `on plumb line` and `on line` none, `position` three
        coordinates, the lever arm where it is known and the time (unknowns: lever arm, shift, drift),
        `attitude` two matrices row by row (body to object; body to photo where that is known; unknown:
        boresight), `relative` a translation and a matrix, `base` the length (two sensors, -1 for the frame),
        `prior` none, `velocity` three components and
        the lever arm where it is known (unknown: lever arm), `rate` three components and the matrix body to
        photo where that is known (unknowns: boresight, bias), `smoothness` three components and a factor for
        each coefficient. Lengths in the unit of the object space, angles in radians, times in seconds.
    unknowns
        Common unknowns: type (see `UNKNOWNS`), position, rotation matrix row by row, standard deviations.
    mounts
        Photos on frames: index of the photo, of the photo that stands for the frame, and of the sensor among
        the common unknowns.
    trajectories
        What is known of each beforehand, what its corrections are made of, and the indices of their
        coefficients among the common unknowns.
    timed
        Photos on trajectories: indices of photo and trajectory, the time of the photo there in seconds, and
        the indices of the rate and of the offset of its times among the common unknowns.
    image_times
        (m,) the number of each image that the rate is multiplied by; empty where all are 0.
    passages
        What images pass beside pose, point and camera: kind, indices of common unknowns, indices of points,
        photos or cameras, and numbers. `figure`: points beside what is given by w_1 e_1 + w_2 e_2; w a
        `bend`, the numbers (e_1, e_2) of each point.
    records
        How many photos, the last, are records of trajectories: they have no images, and the last camera.
    spheroid
        Semi-axes (a, b) for geographic space, None for rectangular space.
    photo_to_ground
        The sense of the angles.
    refraction
        What bends the rays, applied in every iteration; None for image coordinates that are free of it.
    criterion, limit
        `fraction`: no unknown changes by more than `limit` of its standard deviation; `percent`: the sum of
        squares changes by less than `limit` percent.
    max_iterations
        Iterations at the most.
    covariance
        Whether to compute cofactors and redundancy numbers; NaN otherwise.
    loss
        Robust loss of the image points, `huber` or `cauchy`, and its scale in standard deviations a priori.
    ordering
        `auto`, `input`, `rcm`, `amd`, `dissection` or `graph-dissection`; see :func:`photogram.adjust`.
    unit_variance
        `free`, `constrained` or `unity` (GIANT guide, Appendix E), or `redundancy`.
    minimum
        Photo whose pose is held where nothing else gives a datum, and for the scale a photo and the number of
        its coordinate; None leaves either to the core.
    memory
        Bytes that the adjustment, or covariances that are asked for, may take; None for any number.
    points_given
        Whether points start from their coordinates where these are known, not where their rays meet.

    Raises
    ------
    ValueError
        An argument of another shape, length or choice; the message names it.
    """

@final
class BlockNetwork:
    """A block with the options of its adjustment.

    A datum is (`inner`, points, photos, whether scale counts) for inner constraints, (`relative`, [],
    [photo], False) or (`relative`, points, [], False) for cofactors relative to these. Of all methods:

    threads
        Number of threads, no more than four for each processor; 0 leaves it to the core: small work stays on
        the calling thread, larger work has all processors.
    progress
        Called on the calling thread as (phase, points done, points in all, None), or ("iteration", number, 0,
        row). What it raises stops the work and is passed on. Signals are looked after at the same time,
        so that Ctrl-C stops it too.

    They raise BlockError for a block that cannot be adjusted, or taken to a datum.
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
        """Adjust it; a free one may be taken to the datum of inner constraints.

        Or, without such a datum, adjust it from where an adjustment of it has ended, perhaps with other
        weights: in the order of that, and without the points that had run into a station there.
        Without either, `keep` has the state keep what tests need (see :meth:`trial`), and the cofactors of
        these points with each other (:meth:`BlockState.joint`).
        """

    def in_datum(
        self,
        state: BlockState,
        datum: _DatumRow,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> BlockSolution:
        """Take an adjusted block to another datum: values, cofactors, redundancy numbers; no iterations."""

    def covariances(
        self,
        state: BlockState,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> BlockCovariances:
        """Factor the normal equations where the adjustment has ended, in the datum that it was taken to."""

    def trial(self, state: BlockState | None, *, threads: int, kept: bool = False) -> NetworkTrial:
        """Prepare for trials without some observations, from where an adjustment ended, or from the start.

        `kept` says that the state is of this very network: the first time, what its adjustment has kept
        is taken, and nothing is formed again.
        """

    def resistance(self, state: BlockState, *, threads: int) -> list[tuple[str, float]]:
        """Return what keeps the block from moving as a whole: kinds of observations.

        With each the greatest share of what a motion changes in them that remains when all unknowns move.
        """

    def held_for_datum(self, *, threads: int) -> list[tuple[int, int]]:
        """Return what an adjustment holds where nothing gives a datum; nothing where there is one.

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
        """Move a block that was adjusted in parts to the datum of inner constraints (docs/distributed.md).

        Parameters
        ----------
        datum
            Inner constraints.
        held
            What :meth:`held_for_datum` gives.
        middle
            As all nodes were given it.
        names
            (3 N,) all unknowns of the block, those of several nodes perhaps several times: the rows of
            :attr:`Node.unknown_names`, but with indices into this block.
        values
            (N,) where they have been adjusted to.
        threads
            As in :meth:`adjust`.

        Returns
        -------
        values
            (N,) in the datum.
        b, t
            (d N,) the columns B, zero but for what carries the datum, and T = G (B^T G)^-1, one after the
            other.
        condition
            Of B^T G, its columns scaled.
        exact
            Whether there are no more carriers than columns, so that these do not move.

        Raises
        ------
        BlockError
            As of :meth:`adjust` with a datum.
        BlockInputError
            Names that are not those of all unknowns.
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
        """Take the block as a node of the elimination tree of a larger one (Helmert blocking).

        Blocks of unknowns are named by what they belong to, (`photo`, `camera`, `unknown` or `point`, index
        into the arrays of this block). A camera has one where several photos of the larger block share it and
        a parameter of it is unknown, a point where an observation beside images touches it; cameras that are
        known, and points that only images touch, are never named.

        Parameters
        ----------
        outer
            The blocks that are eliminated above this node, in an order that the node above knows: photos that
            other parts see too, shared cameras. What was observed of their unknowns themselves belongs to the
            node where they are eliminated, and is left out here; what is fixed stays fixed. Empty for the
            root.
        children
            For each child, in a fixed order, the blocks that its contribution is over, in the order of its
            `outer`; all are photos, cameras, unknowns or points of this block, outer ones or not.
        middle
            (3,) median of the positions of all photos of the larger block, component by component:
            coordinates
            are counted from it (rounded) in rectangular space, and it says what is up for shifts in
            geographic
            space. Every node must be given the same. None: of the photos of this block.
        threads
            As in :meth:`adjust`.
        held
            What :meth:`held_for_datum` of the larger block gives, of the photos of this one, which are
            outer ones or not.

        Raises
        ------
        InputError
            A name that is not of the block, or is there twice; a loss.
        BlockError
            As :meth:`adjust`, before its first iteration.
        """

def give_back() -> None:
    """Have the allocator give back to the system what was freed; nothing but with the C library of GNU."""

def judge_full_step(
    taken: Sequence[tuple[float, float]],
    change: float,
    *,
    chord: float | None,
    unknowns: int,
    tolerance: float,
) -> str:
    """Return what a full step is, by the rules of one process; see `adjustment/options.rs`.

    Parameters
    ----------
    taken
        Damping and largest change of each step so far.
    change
        No unknown changes by more than this multiple of its standard deviation.
    chord
        The length of the chord that followed the last step, where one did.
    unknowns, tolerance
        How many unknowns there are; when to stop.

    Returns
    -------
    `last`: no further one is needed; `rests`: it is rounding, as those before; `before a chord`: a chord
    after it pays; `one of many`.
    """

def is_chord(chord: float, change: float) -> bool:
    """Return whether a chord so long is taken after a full step that has changed the unknowns so much."""

def step_rules() -> dict[str, float]:
    """Return the constants of the rules of steps of one process, by name; see `adjustment/damped.rs`."""

@final
class Node:
    """A node of the elimination tree of a block that is adjusted in parts (Helmert 1880; Wolf 1978).

    It holds a part of the observations, the photos that they touch, and the order in which the blocks at home
    here are eliminated, found once; no values. A *state* is a vector of all its unknowns: three of each point
    that only images touch, then those of photos, shared cameras, common unknowns and other points, blocks
    here and outer ones, positions counted from the middle; so is a *step*. All methods are functions of their
    arguments, the same bits for any number of threads; `threads` and `progress` are as in
    :class:`BlockNetwork`.
    """

    @property
    def size(self) -> int:
        """N, the number of unknowns in a state."""

    @property
    def outer(self) -> _Indices:
        """(S,) where the unknowns of the outer blocks stand in a state, block by block in their order."""

    @property
    def children(self) -> list[_Indices]:
        """For each child (S_c,) where the unknowns that it is over stand in a state, in its own order."""

    @property
    def unknown_names(self) -> _Indices:
        """(N, 3) what each unknown of a state belongs to, its index, and the number of the unknown there.

        0: a photo, 1: a camera that photos share, 2: a common unknown, 3: a point.
        """

    @property
    def counts(self) -> tuple[int, int, int]:
        """Observations, weighted unknowns, unknowns that are not fixed; outer ones are not counted."""

    @property
    def dropped(self) -> list[tuple[int, str]]:
        """Points left out, each with the reason."""

    @property
    def initial(self) -> _Floats:
        """(N,) the state to begin with: photos as given, points where the rays of their photos here meet.

        The outer part of it must be set to what the node above has, where points are among the outer blocks.
        """

    @property
    def ends_slowly(self) -> bool:
        """Whether photos share cameras that are unknown: a chord pays near the end (docs/adjustment.md)."""

    @property
    def prediction(self) -> dict[str, float]:
        """What work and memory it takes, from the pattern alone.

        `points`, `interior`, `outer`: unknowns of points, of blocks eliminated here, of outer ones (S);
        `images`, `observations`: image points, equations in all; `reduction`, `factor`, `inverse`:
        multiply-adds of one formation, one factorisation, one inversion; `node_bytes`: of the node by itself;
        `factor_bytes`: of a formed node beside, what points have left for the solution counted;
        `memory_bytes`: at the most, while it is formed, inverted or written, contributions and the node
        itself counted; `contribution_bytes`: of what it sends up, 8 (S (S + 1) / 2 + 2 S);
        `cofactor_bytes`: of what it receives for the inversion, 8 S (S + 1) / 2; `step_bytes`: of what it
        receives in each iteration, 8 S.
        """

    def advance(self, state: _Floats, step: _Floats) -> _Floats:
        """Return the state after a step: attitudes step by rotation vectors, all else is added."""

    def relocate(self, state: _Floats, *, threads: int) -> _Floats:
        """Return the state with the points that only images touch where the rays of their photos meet."""

    def objective(self, state: _Floats, *, threads: int) -> tuple[float, float, float, float, float]:
        """Return weighted sums of squares (camera, ground, plates, observations), and what is minimised.

        Those at home here; they add up over all nodes to those of :attr:`BlockSolution.sums_of_squares`. What
        is minimised is their sum, or that of losses.
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
        """Form the normal equations at a state, and eliminate the points and blocks at home here.

        Parameters
        ----------
        state
            (N,) values of all unknowns.
        contributions
            What the children leave, :attr:`FormedNode.contribution` of each in their order. They are added in
            this order.
        damping
            Added to the diagonal of the normal equations as a fraction of it; 0 for a full step. The same in
            all nodes.
        curved
            Whether the second-order term of a loss is taken in. The same in all nodes.
        """

    def solution(self, state: _Floats, before: _Floats, *, threads: int) -> BlockSolution:
        """Return what is adjusted at a state, without cofactors.

        `before` is the state before the last step. Arrays are those of the block of the node, outer photos
        among them; sums, counts and degrees of freedom are of what is at home here, and add up.
        """

@final
class FormedNode:
    """A node at a state, its points and blocks eliminated.

    It holds the factor, and copies of state and contributions no longer; it is not pickled, but formed again.
    """

    @property
    def contribution(self) -> ContributionRow:
        """What it leaves to the node above, over the S unknowns of the outer blocks; of the root it is empty.

        `U = A_SS - A_SI A_II^-1 A_IS` (S (S + 1) / 2,), lower triangle, column by column: row i of column j
        stands at `j S - j (j - 1) / 2 + i - j`; `u = b_S - A_SI A_II^-1 b_I` (S,); the diagonal of A_SS
        before
        any elimination, those of the children included (S,): what small pivots are compared with. It is
        handed
        out once.
        """

    @property
    def sum_of_squares(self) -> float:
        """Weighted sum of squares of what is at home here at this state; they add up over all nodes."""

    @property
    def decrease(self) -> float:
        """By how much a full step lowers it, as far as it is known here.

        The sum over all nodes is that of the block; its root bounds what any unknown moves by, in standard
        deviations (the largest change of an iteration).
        """

    @property
    def undetermined(self) -> FailureRow | None:
        """What the observations leave undetermined here, as in :class:`BlockError`; or None."""

    def solve(
        self,
        outer: _Floats,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> _Floats:
        """Return the step (N,) of all unknowns, given that of the outer ones (S,)."""

    @property
    def has_chord(self) -> bool:
        """Whether the right-hand side of a chord was reduced, and is not solved for."""

    def reduce_chord(
        self,
        state: _Floats,
        left: Sequence[_Floats],
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> tuple[_Floats, float] | None:
        """Reduce the right-hand side that the equations have at a state: a second step with one factor.

        Parameters
        ----------
        state
            (N,) after a step.
        left
            (S,) of each child what it has left.

        Returns
        -------
        (S,) what is left for the outer unknowns, and by how much the chord lowers the sum of squares, as far
        as known here; None where what that takes is not kept, for want of memory.
        """

    def solve_chord(
        self,
        outer: _Floats,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> _Floats:
        """Return the chord (N,) where its right-hand side was reduced, given that of the outer ones (S,)."""

    def reduce(
        self,
        rights: _Floats,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> tuple[_Floats, _Floats]:
        """Reduce right-hand sides: y = L^-1 r of what is eliminated here.

        Parameters
        ----------
        rights
            (d, N) of all unknowns: own ones of what is at home here, with what the children have left.

        Returns
        -------
        left
            (d S,) what is left for the outer unknowns.
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
        """Return solutions (d N,) where right-hand sides were reduced, given the outer ones (d, S); once."""

    def invert(
        self,
        outer: _Floats,
        state: _Floats,
        *,
        threads: int,
        datum: tuple[_Floats, _Floats, _Floats, _Floats, float, list[int]] | None = None,
        progress: Callable[[str, int, int, IterationRow | None], None] | None = None,
    ) -> tuple[BlockSolution, list[_Floats]]:
        """Return what is adjusted, with its cofactors, and what the children need for theirs.

        The factor is used up.

        Parameters
        ----------
        outer
            (S (S + 1) / 2,) cofactors of the outer unknowns, a lower triangle packed like the contribution.
        state
            (N,) the state that is reached: after the step, where that was the last one, else the same.
        datum
            What takes cofactors to a datum of the whole, but for those of the children: T and W = Q B (d, N),
            B^T W of the whole (d, d), the last step (N,) before it was moved there, the condition of B^T G,
            and the unknowns that do not move in the datum, ascending.

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
    """The G groups of observations that may hold a gross error together, in the order of all tests.

    Images in their order, then the control of points, positions and attitudes of photos, observations beside
    images, and what was observed of cameras and common unknowns. Each has rows, M in all, which stand one
    group after the other.
    """

    @property
    def subjects(self) -> tuple[NDArray[np.uint8], _Indices]:
        """(G,) kinds, and which image, point, photo, observation, camera or common unknown.

        Kinds are 0 image, 1 control, 2 position, 3 attitude, 4 observation, 5 camera, 6 common unknown.
        """

    @property
    def row_starts(self) -> _Indices:
        """(G + 1,) where the rows of each suspect start."""

    @property
    def components(self) -> _Indices:
        """(M,) the component that each row is."""

    @property
    def deviations(self) -> _Floats:
        """(M,) standard deviations a priori, in the units of the observations."""

@final
class NetworkTrial:
    """A network tried without some of its observations; the symbolic analysis is done once.

    Rows and square blocks of its suspects stand one suspect after the other. What is out has weight zero.

    Of all methods, errors are those of the adjustment: BlockError or CollectionError, of the kind
    `undetermined points` or `undetermined photos` where what is out takes their last support.
    """

    @property
    def suspects(self) -> NetworkSuspects:
        """What may be out."""

    @property
    def photos(self) -> list[list[float]]:
        """The values of each photo where the last trial has ended: as they are given, pose first."""

    @property
    def points(self) -> _Floats:
        """(n, 3) coordinates of the points where the last trial has ended; NaN for those that are out."""

    def stand(self) -> tuple[str, int, float, int, list[int]]:
        """Take the network as its adjustment has ended, with everything in it; return what `adjust` does."""

    def adjust(
        self,
        rows: NDArray[np.bool_],
        points: list[int],
        photos: list[int],
        *,
        tolerance: float | None,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> tuple[str, int, float, int, list[int]]:
        """Adjust without what is out, from where the last trial has ended.

        Parameters
        ----------
        rows
            (M,) which rows are out.
        points, photos
            Those that are out with all that was observed of them: they stay where they are.
        tolerance
            When to stop: for a block when no unknown would change by more than this multiple of its standard
            deviation in the next iteration, for a collection as its options count it; theirs when None.

        Returns
        -------
        Status, iterations, weighted sum of squares, degrees of freedom, points that ran into a station.
        """

    def resist(
        self,
        loss: str,
        scale: float,
        *,
        iterations: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> _Floats | None:
        """Adjust with a robust loss from where the last trial has ended, and stay there.

        Returns
        -------
        (G,) factors by which it has changed weights; None where it diverges: then nothing has changed.
        """

    def tests(self) -> dict[str, NDArray[Any]]:
        """Test every suspect that takes part.

        Returns
        -------
        `active` (G,) whether any row of it takes part; `rank` (G,) directions in which an error shows;
        `statistic` (G,) T, by which the sum of squares falls without it; `least` (G,) the smallest redundancy
        of a direction that shows; `shared` (G,) h of the bound of correlations with others; `residual` (M,)
        of unit weight; `cofactors` the square blocks of R; `error`, `error_sd` (M,) the estimated error and
        its standard deviation (a priori unit weight), in the units of the observations. NaN for what is out.
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
            Standard deviations from which on points are counted.
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
        """Test what is out of some suspects against what the rest predicts.

        Returns
        -------
        For each: the statistic, chi-square with as many degrees of freedom as rows are out; these rows;
        observed minus predicted of each, and its standard deviation. None where nothing is out, or its point
        or photo is.
        """

    def on_points(self, points: list[int], *, gone: bool = False) -> list[tuple[list[int], _Floats, _Floats]]:
        """Return all observations of points together: suspects, residuals of unit weight, and R.

        Nothing for points that observations beside images touch. `gone`: of points that are out with all that
        was observed of them, as if they took part, each by itself against the photos as the others determine
        them; nothing then also where the rays do not determine the point.
        """

    def effects(self, suspects: list[int]) -> _Floats:
        """Return what an error of one standard deviation in each row of some suspects moves.

        Returns
        -------
        (., 9): the three coordinates of the own point, the six numbers of the own photo; NaN where there is
        none.
        """

    def responses(self, suspects: list[int]) -> _Floats:
        """Return the columns of R that belong to the rows of some suspects: (., M)."""

    def most_moved(self, suspects: list[int]) -> list[tuple[str, int, int, float, float]]:
        """Return, for each row of some suspects, the unknown that an error in it moves most.

        Returns
        -------
        Kind (`photo`, `camera`, `unknown`, `point`), index and component of the unknown; by how much an error
        of one standard deviation moves it, in its unit and in its standard deviations (a priori unit weight).
        """

    def inseparable(self, points: list[int], limit: float) -> list[tuple[int, int, float]]:
        """Return pairs of suspects of one point whose tests are correlated by more than `limit`."""

@final
class BlockState:
    """Where the adjustment of a block has ended, and the datum that it was taken to.

    Parameters
    ----------
    unknowns
        Adjusted, in the order of the core.
    held, collapsed, loose
        Unknowns held for a datum; points left out because they ran into a station or their rays do not
        determine them; photos left out because their images do not.
    ordering
        The name of the ordering in force.
    datum
        Its name, points, photos, whether scale counts, photos whose attitudes count, and what makes turns
        comparable with shifts; None for that of what was held.
    released
        Whether control that was exactly minimal was given up for it.

    Raises
    ------
    ValueError
        An ordering or a datum that there is not.
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
        """Return the (3k, 3k) cofactors of points with each other, where the adjustment has kept just these.

        None of copies and of what was read.
        """

@final
class BlockCovariances:
    """Cofactors (a priori unit weight) of anything in an adjusted block or collection, from one factor.

    What has cofactors is told by its kind and index: `photo` (its pose), `step` (position and rotation about
    the photo's axes), `point`, `camera` (of a collection: that of the photo), `unknown`. Arguments as of
    :class:`BlockNetwork`. Its methods raise BlockError or CollectionError.
    """

    def cofactors(
        self,
        rows: list[tuple[str, int]],
        columns: list[tuple[str, int]] | None,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> _Floats:
        """Return the cofactors of every two unknowns of `rows`, or of those with what `columns` names."""

    def propagate(
        self,
        partials: _Floats,
        of: list[tuple[str, int]],
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> _Floats:
        """Return J Q J^T, for (m, k) partials J of m functions of the k unknowns of what is named."""

    def suspects(self) -> NetworkSuspects:
        """Return the groups of observations of the network."""

    def influences(self, partials: _Floats, of: list[tuple[str, int]]) -> _Floats:
        """Return what errors of one standard deviation in every row do to functions of the unknowns: (m, M).

        Rows are those of all suspects; `partials`, `of` are those of :meth:`propagate`; the datum is that of
        what was held.
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
        """Return sums of R_ij^2 over groups, R taking errors of observations to residuals, both in their sd.

        Parameters
        ----------
        groups
            Number g of groups; then the group of each observation, -1 for none: (m, 2) of x and y of images,
            (n, 3) of components of points, (P, 6) of unknowns of poses, of every camera, common unknown, and
            other observation.
        classes
            None: all of them. A number: only those within each group, whose columns groups share that leave
            the same rest by it; what is between such groups is added.
        exact, vectors, seed
            Groups of so many observations at the most, and all that have no more than there are vectors, are
            taken column by column; others with so many vectors of random signs (Hutchinson 1990). Same seed,
            same bits, for any number of threads.

        Returns
        -------
        equations
            (g + 1,) observations of each group and of none; empty with classes.
        squares
            (g + 1) * g sums, row by row, of i in the group of the row (the last row: in none) and j in that
            of the column; with classes (g,) sums of i and j in each group.
        exact
            (g,) which columns were taken column by column; empty with classes.
        """

    def project_images(
        self,
        columns: _Floats,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> _Floats:
        """Return (k, m, 2) what k columns of errors of all images leave as their residuals, both in their sd.

        That is R z for each column z; images that took no part have neither.
        """

class _NetworkSolution:
    """What adjusted blocks and collections have alike, in the order of photos (P), points (n), images (m).

    A photo has k unknowns: of a block its position and attitude, of a collection also its camera. Values are
    in the units in which they were given. Points and images that were left out are NaN. Cofactors hold for a
    priori unit weight.
    """

    @property
    def status(self) -> str:
        """`converged`, `not converged` or `diverged`."""

    @property
    def weak_points(self) -> list[tuple[int, float, float]]:
        """Points on nearly parallel rays, or at a station's own place.

        For each its index, the largest of its standard deviations over the smallest (in any directions;
        infinite where rounding has taken the smallest, NaN without cofactors) and its distance from the
        nearest station that sees it, in the median of these distances.
        """

    @property
    def weak(self) -> list[tuple[int, int]]:
        """Photos and their unknowns that a combination moves which no step could follow.

        The sum of squares stood still all the same, or the iterations ran out. Empty where the adjustment
        ended otherwise.
        """

    @property
    def state(self) -> BlockState:
        """Where the adjustment has ended."""

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
        """(n, 3, 3)."""

    @property
    def point_redundancy(self) -> _Floats:
        """(n, 3) redundancy numbers of the coordinates as observations; 0 unless weighted."""

    @property
    def point_rays(self) -> _Indices:
        """(n,) number of images; 0 for points left out."""

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
        """Why there are no cofactors although they were asked for, as in :class:`BlockError`."""

    @property
    def redundancy_excess(self) -> float | None:
        """Sum of all redundancy numbers minus the degrees of freedom: what rounding has made of zero.

        None without cofactors, and with a loss.
        """

    @property
    def variance_of_unit_weight(self) -> float | None:
        """None without degrees of freedom."""

    @property
    def counts(self) -> tuple[int, int, int]:
        """Observations, weighted unknowns, unknowns that are neither fixed nor held."""

    @property
    def ordering(self) -> str:
        """The ordering in force."""

    @property
    def predictions(self) -> dict[str, float]:
        """Predicted multiply-adds of one factorisation in each ordering that was tried; NaN if it failed."""

    @property
    def operations(self) -> dict[str, float]:
        """Predicted multiply-adds of `reduction`, `factor` and `inverse`, each time they are carried out."""

    @property
    def formations(self) -> int:
        """How often the normal equations were formed."""

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
        """Indices of the images whose point stands behind the camera, ascending."""

    @property
    def images_folded(self) -> _Indices:
        """Indices of the images beyond where the lens of their camera is one-to-one, ascending."""

    @property
    def loose_photos(self) -> list[int]:
        """Indices of the photos that stay as they are because their images do not determine them."""

    @property
    def datum(self) -> list[tuple[int, int]]:
        """Photos and their unknowns (0 to 5) held to give a datum.

        Empty where observations and weights give one.
        """

    @property
    def datum_unknowns(self) -> list[tuple[int, int]]:
        """Coefficients of trajectories held to give a datum: common unknowns and their components."""

    @property
    def relative_error(self) -> float:
        """Relative error, by rounding, of the variances in the datum that it was taken to, about."""

    @property
    def minimal_control(self) -> bool:
        """Whether control and weights of poses are exactly what a datum takes."""

    @property
    def weak_unknowns(self) -> list[tuple[int, int]]:
        """The same for common unknowns: unknowns and their components."""

    @property
    def adjusted_unknowns(
        self,
    ) -> list[tuple[list[float], list[float], list[float], list[float], list[float], list[float], int]]:
        """The adjusted common unknowns, in the order in which they were given.

        Change from what was given, position (3), rotation matrix row by row (9), cofactors row by row for
        rotations about the adjusted axes, the same with the unknowns of the one before in its block (none of
        the first), redundancy numbers, and the number of observations and images.
        """

    @property
    def weak_cameras(self) -> list[tuple[int, int]]:
        """The same for cameras that several photos share: cameras and their parameters."""

    @property
    def cameras(self) -> list[CameraRow]:
        """The adjusted cameras, in the order in which they were given."""

    @property
    def dropped(self) -> list[tuple[int, str]]:
        """Points left out, each with the reason."""

    @property
    def sums_of_squares(self) -> tuple[float, float, float, float]:
        """Weighted sums of squares: camera, ground, plates, observations beside images."""

    @property
    def redundancies(self) -> tuple[float, float, float, float] | None:
        """Sums of the redundancy numbers of the same; None without covariances."""

    @property
    def adjusted_observations(
        self,
    ) -> list[tuple[list[float], list[float], list[float], float, float] | None]:
        """What has become of each observation, in the order of the groups.

        Residuals, redundancy numbers and standardized residuals of its components, in the units of its kind;
        its weighted square; the factor by which a loss has changed its weight. None for observations of
        points that were left out.
        """

    @property
    def degrees_of_freedom(self) -> int:
        """Of the chosen unit variance."""

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
    """Resect one photo by least squares, on the calling thread; Ctrl-C is looked after between iterations.

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
        (6,) position and attitude as they are known beforehand (NaN where unknown), and their standard
        deviations: infinite free, 0 fixed.
    start
        (6,) initial values; None to find some from triples of points.
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
        Iterations at the most, from each start.
    covariance
        Whether to compute cofactors and redundancy numbers; NaN otherwise.

    Raises
    ------
    ResectionError
        A photo that cannot be resected.
    ValueError
        An argument of another shape, length or choice; the message names it.
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
        """Indices of the points that stand behind the camera, ascending."""

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
        """Why a further pose that fits is not determined, a kind as in `ResectionError`; None without one."""

    @property
    def outside_danger_cylinder(self) -> float | None:
        """Distance of the projection centre from the danger cylinder, negative inside, or None."""

class ComparatorError(Exception):
    """The calibration cannot be adjusted: (message, cases, points), both by their indices."""

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
        """(k, k) of all of them together."""

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
    """Adjust a comparator, its polynomials, the placements of the plates and their grids together.

    grid = M (x' + P(x') - centre) + t with x' = N S x: scales, lack of orthogonality, then polynomials, then
    rotation. Polynomials are made of u^d, v^d, ... u^2, v^2; u and v are x' and y' less `centre` over
    `half_range`.

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
        Of the polynomials.
    limit, max_iterations
        Convergence: largest change in standard deviations.

    Raises
    ------
    ComparatorError
        The readings leave unknowns undetermined, or indices and lengths contradict each other.
    ValueError
        An argument of another shape; the message names it and its shape.
    """

_Vector = tuple[float, float, float] | list[float]
_Matrix = list[list[float]]

CentredRow = tuple[float, _Matrix, _Vector, _Vector, _Vector]
"""Scale s, rotation A (3 x 3), shift t, centre of the control c_X, centre of the model c_x of the similarity
x - c_x = s A (X - c_X) + t."""

ParametersRow = tuple[float, _Matrix, _Vector]
"""Scale s, rotation A (3 x 3), translation B of the similarity x = s A X + B."""

TraceRow = tuple[_Matrix, tuple[list[tuple[int, int]], _Floats], _Floats, _Floats, list[float], list[float]]
"""One cycle of the bulletin: rotation A as it began; (station, component) and (m, 8) P-values of equations;
normal equations C (7, 8); auxiliary table D (7, 8); seven results; corrected omega, phi, kappa, s, b1, b2,
b3."""

class SimilarityError(Exception):
    """A model that cannot be oriented.

    `args` is (kind, message, stations): kind is `insufficient`, `undetermined`, `first stations`, `scale`,
    `not finite` or `input`; stations is a list of the indices concerned.
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
    """Find the similarity x = s A X + B between control X and model x (C&GS Technical Bulletin 19).

    Parameters
    ----------
    control, control_sd
        (n, 3) ground units: coordinates, NaN where unknown, and standard deviations, zero for an exact one,
        infinite for one that takes no part.
    model, model_sd
        (n, 3) model units: coordinates and their standard deviations; zero where those of the control are
        positive.
    method
        `rigorous`, `report` or `fill-in`.
    start
        `auto`, `report` or `closed-form`; of no account with `former`.
    former
        A former result to start from, or None.
    max_iterations
        Iterations at the most.
    tolerance
        Fraction of its standard deviation by which no unknown changes any more (rigorous method).
    threads
        Number of threads; 0 leaves it to the core (see `BlockNetwork`).
    trace
        Whether the report's methods keep what each cycle computed on its way.
    scale
        s that is held, so that six unknowns are left; None: it is found.

    Raises
    ------
    SimilarityError
        A model that cannot be oriented.
    ValueError
        An argument of another shape, length or choice; the message names it.
    """

@final
class SimilaritySolution:
    """An oriented model, in the order of its n stations. Cofactors hold for a priori unit weight."""

    @property
    def status(self) -> str:
        """`converged`, `not converged` or `diverged`."""

    @property
    def started(self) -> str:
        """Where the initial values are from: `restart`, `report` or `closed-form`."""

    @property
    def similarity(self) -> CentredRow:
        """The similarity."""

    @property
    def initial(self) -> CentredRow:
        """Where the iteration started."""

    @property
    def alternatives(self) -> list[CentredRow]:
        """Other orientations that fit as well."""

    @property
    def iterations(self) -> list[IterationRow]:
        """Iterations of the rigorous method; none with the report's."""

    @property
    def cycles(self) -> list[float] | None:
        """Largest correction of an angle (rad) in each cycle of the report's methods, else None."""

    @property
    def traces(self) -> list[TraceRow]:
        """What each of these cycles computed on its way, where it was asked for."""

    @property
    def tangent_cofactors(self) -> _Floats:
        """(7, 7) of three small rotations about the model axes (rad), s, t."""

    @property
    def condition(self) -> float:
        """Condition number of the linearized misclosures."""

    @property
    def weakness(self) -> tuple[str, list[int]] | None:
        """What makes the control weak, and the stations concerned.

        `coincident` (horizontal stations in plan), `elevations in line` (in plan) or `stations in line`.
        """

    @property
    def sum_of_squares(self) -> float:
        """Weighted sum of squares, both systems."""

    @property
    def misclosures(self) -> _Floats:
        """(n, 3) s X - A^T (x - B): control axes, model units; NaN where unknown."""

    @property
    def model_residuals(self) -> _Floats:
        """(n, 3) s A X + B - x with the adjusted X: model axes, model units."""

    @property
    def adjusted_control(self) -> _Floats:
        """(n, 3) adjusted control coordinates, ground units; unknown ones as the model gives them."""

    @property
    def control_cofactors(self) -> _Floats:
        """(n, 3, 3) of the adjusted control coordinates."""

    @property
    def redundancy(self) -> _Floats:
        """(n, 3) redundancy numbers of the misclosures; NaN where unknown."""

    @property
    def standardized(self) -> _Floats:
        """(n, 3) misclosure / its standard deviation, a priori; NaN where unknown or unchecked."""

def transform_points(
    similarity: CentredRow, tangent_covariance: _Floats, points: _Floats, points_sd: _Floats
) -> tuple[_Floats, _Floats]:
    """Control coordinates of model points, with their covariances.

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
        An argument of another shape; the message names it and its shape.
    """

def similarity_partials(similarity: CentredRow) -> _Floats:
    """(7, 7) partials of omega, phi, kappa, s, b1, b2, b3 by three small rotations (model axes), s, t."""

def gauss_crout(normal: _Floats) -> tuple[_Floats, _Floats] | None:
    """Gauss-Crout scheme of TB 19, section 4, for seven normal equations.

    Parameters
    ----------
    normal
        (7, 8) C; column 8 is the right-hand side.

    Returns
    -------
    (7, 8) auxiliary matrix D and (7,) solution E; None when a pivot vanishes.

    Raises
    ------
    ValueError
        An argument of another shape; the message names it and its shape.
    """

_Station = tuple[float, float, float, float]
"""Latitude (rad), constant of diurnal aberration (rad), temperature (K), pressure (mm of mercury)."""
_CameraKind = tuple[float | None, bool, bool] | tuple[str, bool]
"""Of plates: principal distance of the distorted image (None: scale first), Brown's decentering, common
scale.

Of another model (`camera_models`): its name, and whether fx is the principal distance of both axes.
"""

class StellarError(Exception):
    """The camera cannot be calibrated.

    `args` are the kind (`undetermined stars`, `undetermined`, `weight`, `not finite`, `input`), a message,
    and the indices of the stars concerned, of the parameters where these are `undetermined`.
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

def measured_feature(
    kind: str, points: _Floats, covariance: _Floats
) -> tuple[list[tuple[str, bool]], _Floats, _Floats, _Floats, tuple[float, int] | None]:
    """Fit a feature to points, with all that follows from their covariance (docs/features.md).

    Parameters
    ----------
    kind
        `distance`, `line`, `plane`, `circle`, `sphere` or `cylinder`.
    points
        (n, 3), any unit of length.
    covariance
        (3n, 3n) of all coordinates, those of a point together.

    Returns
    -------
    Names of q quantities, and whether each is a length (else a component of a unit vector); (q,) values;
    (q, q) their covariance; (n, 4) deviations of points, radial (of a plane along its normal) and axial, each
    with its standard deviation; statistic and degrees of freedom of their test, None where there is none.

    Raises
    ------
    InputError
        Too few points, points that do not determine the feature, or several as well, what is not finite,
        arrays of other shapes.
    ValueError
        Another kind.
    """

def nearest_points(points: _Floats, others: _Floats, limit: float, but: _Indices | None = None) -> _Indices:
    """Return the nearest of the others for each point of a plane, (n,); -1 where none is near enough.

    Parameters
    ----------
    points
        (n, 2).
    others
        (m, 2), sorted into cells as wide as the limit.
    limit
        Largest distance, of one unit with the points.
    but
        (n,) one of the others for each point that does not count; -1 for none.

    Raises
    ------
    InputError
        Arrays of other shapes.
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
    """Find similarities between images and stars: pairs of candidates make them, all images vote.

    Parameters
    ----------
    images
        (m, 2), the brightest first; every one votes.
    stars
        (n, 2) predicted images.
    candidates
        (c, 2) an image, of the first `makers`, and a star that it may show.
    makers
        Images that make similarities.
    tolerance, stretch
        By how much the separations of two images and of their stars may differ, and the share of that of the
        images that is added.
    least
        Separation that two images have more than.
    axis
        x, y of the point about which the camera may be turned, and how far it may move; None for any turn.
    limit
        Distance from a star within which an image votes, in cells half as wide.
    wanted
        Similarities that are returned at most.

    Returns
    -------
    How many pairs agree, and (k, 4) those with the most votes, the best first: an image z, as a complex
    number, goes to (a + b i) z + (c + d i). All images vote for the 4,096 that the makers choose.

    Raises
    ------
    InputError
        Arrays of other shapes.
    ValueError
        A candidate is no image and star.
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
        (13,) epsilon, xp, yp, cx, cy, dx, dy, K1, K2, K3, and K4, K5, phi_T or P1, P2, P3; of another model
        its own parameters, then zeros: x counts right, y down.
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
        (k,) which parameters have weight, their given values, and R (k, k) of their weight matrix R^T R.
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
        whole: bool = False,
    ) -> dict[str, Any]:
        """Adjust by least squares with exact partials.

        Parameters
        ----------
        unit
            Mean error of unit weight that is expected: `fraction` and the history count in it.
        fraction
            Converged when no unknown changes by more than this fraction of its standard deviation.
        max_iterations, covariance, threads, progress
            As for `block_network`.
        whole
            Whether to compute the cofactors of every two parameters, where there are cofactors.

        Returns
        -------
        `status`, `iterations`, `initial_sum_of_squares` (in units of `unit` squared), `parameters`
        (3 G + 17,); `places` (S, 2), `place_cofactors` (S, 2, 2), `place_inverses` (S, 2, 2): what of these
        would be left if the parameters were known; `residuals` (m, 2) measured minus computed,
        `axis_residual`, `sums_of_squares` (images, stars, parameters, axis), and `redundancy` and
        `standardized` of `image`, `place`, `axis`: of decorrelated components where weights are correlated.
        Where there are cofactors, all for unit weight: `pointing_cofactors` (G, 3, 3), `cross_cofactors`
        (G, 3, 17) of attitudes and common parameters, `common_cofactors` (17, 17); where the whole is asked
        for, `cofactors` (3 G + 17, 3 G + 17) and `log_determinant`: natural logarithm of the determinant of
        the normal equations reduced to the parameters.

        Raises
        ------
        StellarError
            Stars or parameters that are not determined, or that have no image at the initial values.
        """

    def without_effect(self) -> list[int]:
        """Find the parameters, by index, that no image, no weight and not the axis touches.

        Parameters that are held are not among them.

        Raises
        ------
        StellarError
            Stars that have no image at the initial values.
        """

    def correction(self, *, refraction: float, distortion: float, passes: int) -> dict[str, Any]:
        """Correct the parameters once with the equations of `published` at the initial values.

        Parameters
        ----------
        refraction, distortion, passes
            As for `published`.

        Returns
        -------
        `parameters` (3 G + 17,): corrections; `cofactors` of every two and `log_determinant`, both for unit
        weight; `without_effect`: indices of the parameters that nothing touches yet, which are not
        corrected.

        Raises
        ------
        StellarError
            Stars or parameters that are not determined, or that have no image at the initial values.
        """

    def residual_cycle(
        self, cofactors: _Floats, *, refraction: float, distortion: float, passes: int
    ) -> dict[str, Any]:
        """Correct the stars with the parameters as they are; residuals and their tests (equations 64 to 71).

        Parameters
        ----------
        cofactors
            (3 G + 17, 3 G + 17) of the parameters, for unit weight.
        refraction, distortion, passes
            As for `published`.

        Returns
        -------
        As `adjust` has them, but of the plate coordinates themselves: `places`, `place_cofactors`,
        `place_inverses`, `residuals`, `axis_residual`, `sums_of_squares`, and `redundancy` and
        `standardized` of `image` and `place`.

        Raises
        ------
        StellarError
            Stars that are not determined, or that have no image.
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

    def published(self, *, refraction: float, distortion: float, passes: int) -> dict[str, Any]:
        """Equations of the images as the report's program formed them (equations 48 to 62, 73, 74).

        Parameters
        ----------
        refraction, distortion, passes
            Tolerances (radians, unit of the plate) and limit of the inner iterations.

        Returns
        -------
        As `equations`, and `standard` (m, 2), `undistorted` (m, 2), `unsettled`: images and last changes.
        """

    def directions(self) -> _Floats:
        """Right ascension and declination (m, 2) of every image at the initial values."""

class CollectionError(Exception):
    """A collection cannot be adjusted: (kind, message, combinations, points).

    The kinds are those of :class:`BlockError`, without `no intersection`.
    """

def read_numbers(text: bytes) -> tuple[_Floats, bool]:
    """Read the numbers of a text, separated by white space, up to the first word that is not a finite number.

    Returns
    -------
    (k,) numbers, and whether they are the whole text.
    """

@final
class TableReader:
    """Columns of a table of text whose lines are all regular.

    A regular line has as many cells as columns, or an empty one more. The cells of columns of numbers are
    empty or numbers with one decimal mark throughout. Names have no control characters. A cell can be in
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
        """Append whole lines. Return False if a line is irregular; the reader then has no columns."""

    def columns(self) -> list[_Floats | tuple[bytes, _Indices, bool]]:
        """Return the columns and empty the reader.

        Returns
        -------
        Numbers, NaN for empty cells. Of names: each name once in the order of the rows, with a line feed
        behind it; the number of the name of each row; whether it is known that no name is empty or NaN, and
        that all differ by more than blanks and case.
        """

def csv_rows(columns: Sequence[_Floats | _Indices | NDArray[np.bool_] | list[str | None]]) -> bytes:
    """Return the rows of a table as text of commas (UTF-8), a line each.

    Numbers have the shortest digits that read back to the last bit, NaN and None are empty cells, truth
    values are `true` and `false`; texts stand in quotation marks where commas, semicolons, bars, tabs,
    hashes, quotation marks, line ends or blanks about them would be taken for something else. Line ends
    become blanks.

    Parameters
    ----------
    columns
        Of one length.

    Raises
    ------
    ValueError
        Columns that differ in length.
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
        Where the header stands in it.
    file
        Its name, for errors.

    Returns
    -------
    Network, target, created, modified, description and user, None where they are not said; the number of
    points, if said; version 2: the lengths of the points' messages; radii in metres; fields that nobody
    knows, byte for byte.

    Raises
    ------
    InputError
        The header is damaged.
    """

def control_header_message(
    texts: Sequence[str | None], points: int, radii: Sequence[float], rest: bytes
) -> bytes:
    """Write the header of a binary control network of version 5: what :func:`control_header` returns."""

def control_points(
    data: bytes, start: int, stop: int, lengths: Sequence[int] | None, file: Path | None
) -> tuple[_ControlColumns, _ControlColumns, _Indices]:
    """Read the points of a binary control network.

    Parameters
    ----------
    data
        The file.
    start, stop
        Where the points stand in it.
    lengths
        The lengths of their messages; None where each stands before its message.
    file
        Its name, for errors.

    Returns
    -------
    Columns of points, columns of measures, the first measure of each point and the number of all (n + 1).
    Columns are arrays by their names, `ids` a list of texts, `serial` indices and the texts that they mean; a
    column in which nothing stands is left out. `rest` holds what has no column: fields of messages, byte for
    byte, and where those of each row begin.

    Raises
    ------
    InputError
        The points are damaged; it has the number of the point, from 1, as its record.
    """

def control_points_of_text(
    data: bytes, file: Path | None
) -> tuple[tuple[_ControlColumns, _ControlColumns, _Indices], str]:
    """Read the points of a control network in text (UTF-8).

    Returns
    -------
    What :func:`control_points` returns, and the text without its points, on the same lines.

    Raises
    ------
    InputError
        The text is no control network; it has the number of the line, from 1, as its record.
    """

def control_point_messages(points: _ControlColumns, measures: _ControlColumns, firsts: _Indices) -> bytes:
    """Write points as messages of version 5, each behind its length: what :func:`control_points` returns.

    Raises
    ------
    InputError
        Columns that do not agree, or something kept that only text can hold.
    """

def control_point_text(points: _ControlColumns, measures: _ControlColumns, firsts: _Indices) -> bytes:
    """Write points as text, as it stands in the object of their network: what :func:`control_points` returns.

    Raises
    ------
    InputError
        Columns that do not agree, or something kept that only messages can hold.
    """

UNKNOWNS: list[tuple[str, list[tuple[str, str]]]]
"""Types of common unknowns: name, and for each unknown its name and whether it is a `length`, a `speed`, an
`angle` or a `ratio`."""

CAMERAS: list[str]
"""What the models of cameras are called."""

def collection_images(camera: str, photo_parameters: _Floats, points: _Floats) -> _Floats:
    """Image coordinates of points, row by row: point i on the photo of row i.

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
    (n, 2) in the unit of the camera; not finite in the plane of the projection centre. A point behind the
    camera has the image that the formula gives.

    Raises
    ------
    ValueError
        An argument of another shape, length or choice; the message names it.
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
    """Return a collection of photos as it is adjusted by Levenberg-Marquardt steps.

    Parameters
    ----------
    camera
        The model of the cameras, one of `CAMERAS`.
    photo_parameters, photo_sd
        (P, 6 + k) initial (and, where weighted, observed) parameters and their standard deviations, infinite
        for free ones, zero for fixed ones; see :func:`collection_images`.
    point_positions, point_sd
        (n, 3) likewise.
    image_photos, image_points
        (m,) indices.
    image_xy, image_sd
        (m, 2) pixels.
    decrease
        Until a step lowers the weighted sum of squares by less than this fraction of it.
    max_iterations
        Iterations at the most.
    covariance
        Whether to compute cofactors and redundancy numbers; NaN otherwise.
    loss
        Robust loss of the image points, `huber` or `cauchy`, and its scale in standard deviations a priori.
    ordering
        `auto`, `input`, `rcm`, `amd`, `dissection` or `graph-dissection`; see :func:`photogram.adjust`.
    memory
        Bytes that the adjustment may take; None for any number.

    Raises
    ------
    ValueError
        An argument of another shape, length or choice; the message names it.
    """

@final
class CollectionNetwork:
    """A collection with the options of its adjustment; arguments as of :class:`BlockNetwork`.

    Its methods raise CollectionError for a collection that cannot be adjusted, and ValueError for images that
    name photos or points that are not there.
    """

    def adjust(
        self,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
        start: BlockState | None = None,
    ) -> CollectionSolution:
        """Adjust it, perhaps from where an adjustment of it with other weights has ended."""

    def covariances(
        self,
        state: BlockState,
        *,
        threads: int,
        progress: Callable[[str, int, int, IterationRow | None], None] | None,
    ) -> BlockCovariances:
        """Factor the normal equations where the adjustment has ended."""

    def trial(self, state: BlockState | None, *, threads: int) -> NetworkTrial:
        """Prepare for trials without some observations, from where an adjustment ended, or from the start."""

@final
class CollectionSolution(_NetworkSolution):
    """An adjusted collection; k is 6 plus the number of parameters of a camera."""

    @property
    def photo_parameters(self) -> _Floats:
        """(P, k) as they were given, adjusted."""

    @property
    def photo_images(self) -> _Indices:
        """(P,) number of images that took part."""

    @property
    def point_rays_behind(self) -> _Indices:
        """(n,) number of images that have the point behind the camera."""

    @property
    def collapsed(self) -> list[int]:
        """Indices of the points that ran into a station and were left out."""

    @property
    def beside_stations(self) -> list[int]:
        """Indices of the points that are held beside a station and were left out."""

    @property
    def not_determined(self) -> list[int]:
        """Indices of the points that were left out because their rays do not determine them."""

    @property
    def sum_of_squares(self) -> float:
        """Weighted sum of squares, weights as the loss has changed them."""

    @property
    def degrees_of_freedom(self) -> int:
        """Observations and weighted unknowns less unknowns."""

    @property
    def datum(self) -> list[tuple[int, int]]:
        """Photos and parameters held to give a datum; empty where observations and weights give one."""
