"""Compiled numerical core. Private: use it through the modules of `photogram`.

Arrays are float64. Unless specified otherwise, angles are in radians, image coordinates in millimetres and
lengths in the linear unit of the object space. All functions release the GIL.

Every function raises a ValueError if the shape or length of an array, an index, the axes of a spheroid, the
name of a model, or another choice is invalid; the message names the argument. Sections `Raises` list further
errors.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, TypedDict, final

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
"""Photos; shared cameras; shared unknowns; cameras with significant parameters; significant components of
poses: positions `along` and `across` the view, `tilt`, `swing` about the view."""

FailureRow = tuple[str, str, list[CombinationRow], list[int], list[float]]
"""Why a network cannot be adjusted, as in :class:`BlockError`."""

CameraRow = tuple[list[float], list[float], list[float], list[float], int, int]
"""Adjusted camera: k parameters, k x k cofactors row by row, k redundancy numbers, the diagonal of the normal
equations (k), number of photos, number of images."""

ContributionRow = tuple[_Floats, _Floats, _Floats]
"""Contribution of a node to its parent: matrix, right-hand side, diagonal; see :class:`FormedNode`."""

_Progress = Callable[[str, int, int, IterationRow | None], None] | None
"""Progress of an adjustment, as in :class:`BlockNetwork`."""

_DatumRow = tuple[str, list[int], list[int], bool, list[int], float | None]
"""Datum: its name, points, photos, use of scale, photos whose attitudes count, radius."""

RefractionRow = tuple[str | None, str | None, float, float, float]
"""Model of the air (`giant`, `standard` or None), model of the water (`giant`, `snell` or None), water level
(linear unit), refractive index of the water, metres per linear unit."""

FlownRow = tuple[
    _Floats, _Floats, _Floats, _Floats, list[tuple[int, list[float]]], list[tuple[int, list[float]]]
]
"""Result of `flown`."""

class TrajectoryRow(TypedDict):
    """Trajectory in the format of the core; coefficients are indices of shared unknowns."""

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
    """Return the probability that a chi-square variable exceeds `x`, or is less than it.

    Parameters
    ----------
    x
        Value of the variable, not negative.
    dof
        Degrees of freedom, positive, not necessarily whole.
    upper
        Whether to return the probability of larger values, or else of smaller ones.

    Returns
    -------
    NaN for arguments outside these ranges.
    """

def chi_square_quantile(probability: float, dof: float, *, upper: bool = True) -> float:
    """Return the value that a chi-square variable exceeds (`upper`) with a probability.

    It is the inverse of :func:`chi_square`; small probabilities on either side retain their precision.
    """

def normal(z: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n,) the probabilities that a normal variable is less than each value."""

def student(t: float, dof: float) -> float:
    """Return the probability that the absolute value of Student's variable exceeds `t`; NaN if invalid."""

def student_limit(probability: float, dof: float) -> float:
    """Return the limit of the absolute value of Student's variable for a probability; NaN if invalid."""

def fisher(x: float, first: float, second: float) -> float:
    """Return the probability that an F variable of two degrees of freedom exceeds `x`; NaN if invalid."""

def fisher_limit(probability: float, first: float, second: float) -> float:
    """Return the limit of an F variable of two degrees of freedom for a probability; NaN if invalid."""

def log_chi_square(x: _Floats, dof: _Floats) -> _Floats:
    """Return the logarithms of the probabilities that chi-square variables exceed values.

    Parameters
    ----------
    x
        (n,) values, not negative.
    dof
        (n,) degrees of freedom, positive.

    Returns
    -------
    (n,) natural logarithms, also for probabilities below the smallest number; NaN for arguments outside these
    ranges.
    """

def log_fisher(x: _Floats, first: _Floats, second: _Floats) -> _Floats:
    """Return the logarithms of the probabilities that F variables exceed values.

    `first` and `second` are (n,) degrees of freedom; all else as in :func:`log_chi_square`.
    """

def noncentral_chi_square(x: float, dof: float, noncentrality: float) -> float:
    """Return the probability that a noncentral chi-square variable exceeds `x`; NaN if invalid."""

def noncentral_fisher(x: float, first: float, second: float, noncentrality: float) -> float:
    """Return the probability that a noncentral F variable exceeds `x`; NaN if invalid.

    If `second` is infinite, the variable is noncentral chi-square divided by `first`.
    """

def detectable_noncentrality(level: float, power: float, first: float, second: float) -> float:
    """Return the noncentrality (Baarda's lambda0) at which a test has a given power.

    Parameters
    ----------
    level
        Significance level: probability of rejection if nothing is wrong.
    power
        Probability of rejection if something is wrong; more than the level.
    first, second
        Degrees of freedom of the F test; of the chi-square test if `second` is infinite.

    Returns
    -------
    NaN for arguments outside these ranges.
    """

def level_of_equal_power(noncentrality: float, power: float, dof: float) -> tuple[float, float]:
    """Return level and critical value of the chi-square test with a given power.

    With the same noncentrality for all tests, this is the B-method of Baarda. NaN for invalid arguments.
    """

def film_readings(
    numbers: _Floats, vectors: _Floats, places: _Floats
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the readings of positions in the camera frame, with partial derivatives.

    Parameters
    ----------
    numbers
        Fixed properties of a film: mirrored, rows down, pitch, o1, o2, hx, hy; 0 (none), 1 (h) or 2 (g);
        whether it has a roll and curves; number and numbers of its pattern.
    vectors
        (k, 3) values of its unknowns: placement, size, h or g, roll, scanner, curves, weights.
    places
        (n, 2) positions in mm.

    Returns
    -------
    (n, 2) readings, and (n, 2, 10) partial derivatives by x, y, t1, t2, theta, m, b1, b2 and both of h or g.
    NaN outside the range of the scanner.
    """

def film_places(numbers: _Floats, vectors: _Floats, readings: _Floats) -> NDArray[np.float64]:
    """Return (n, 2) positions in the camera frame of readings (n, 2); NaN if undefined.

    `numbers` and `vectors` as in :func:`film_readings`.
    """

def camera_models() -> list[tuple[str, tuple[str, list[tuple[str, int]], int, str, str]]]:
    """Return the properties of the camera models, `CAMERAS`, by name.

    Returns
    -------
    For each model: its formula, its parameters with the power of the image unit (0 for dimensionless
    numbers), the number of constants, which are the last parameters and always fixed, and its direction. Lens
    terms are functions of ideal coordinates (`forward`) or of measured ones (`backward`).
    """

def camera_images(model: str, parameters: _Floats, u: _Floats, knots: _Floats | None = None) -> _Floats:
    """Project directions into the image.

    Parameters
    ----------
    model
        One of `CAMERAS`.
    parameters
        (k,) in the order of the model.
    u
        (n, 3) in the axes of the photo: x right, y up, z back towards the viewer; the camera looks along -z.
    knots
        For a splined model: dx, dy of each knot, row by row, in any shape; None for zeros.

    Returns
    -------
    (n, 2) in the unit of the camera; not finite if undefined.
    """

def camera_rays(model: str, parameters: _Floats, xy: _Floats, knots: _Floats | None = None) -> _Floats:
    """Compute the directions of image positions; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, 3) unit vectors in the axes of the photo, in front of it; NaN if no direction has the image.
    """

def camera_correct(model: str, parameters: _Floats, xy: _Floats) -> _Floats:
    """Correct image positions by a backward camera; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, 2) g, to compare with c (u1, u2) / u3.
    """

def camera_partials(
    model: str, parameters: _Floats, u: _Floats, knots: _Floats | None = None
) -> tuple[_Floats, _Floats, _Floats]:
    """Project directions with partial derivatives; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, 2) images, (n, 2, 3) partial derivatives by u, (n, 2, k) by the parameters, 0 for constants of a lens;
    not finite if undefined. For a backward camera, derivatives refer to the measured position that
    corresponds to u.
    """

def camera_patches(model: str, parameters: _Floats, u: _Floats) -> tuple[_Indices, _Floats]:
    """Return the knots that affect images; arguments as in :func:`camera_images`.

    Returns
    -------
    (n, s) numbers of knots, row by row, and (n, s) weights; s = 16 for order 3, 9 for order 2. The derivative
    of an image by a knot is diag(fx, fy) times its weight.
    """

def radial_domain(model: str, parameters: _Floats) -> tuple[float, float] | None:
    """Return the radius up to which a lens is radially one-to-one, and its image there.

    For a forward camera, the radius is the tangent of the angle from the axis, for a fisheye the angle (rad).
    It is mapped to the value that is multiplied by the focal length; `brown_forward` has lengths in the
    image. For a backward camera, both are distances from the principal point: of the measured and of the
    corrected position. Infinite if only the image ends.

    Returns
    -------
    None if the lens is one-to-one everywhere.
    """

def attitudes_from_numbers(
    representation: str, numbers: _Floats, boresight: _Floats
) -> tuple[_Floats, _Floats]:
    """Convert numbers to attitudes (`docs/conventions.md`).

    Parameters
    ----------
    representation
        "omega_phi_kappa", "omega_phi_kappa_photo_to_ground", "phi_omega_kappa", "azimuth_tilt_swing",
        "yaw_pitch_roll", "rotation_vector", "rotation_vector_to_photo", "rotation_vector_to_vision",
        "quaternion" or "quaternion_to_vision".
    numbers
        (n, 3), angles in radians; quaternions (n, 4), w, x, y, z of any length except zero.
    boresight
        (3, 3), photo axes from body axes; for yaw, pitch, roll.

    Returns
    -------
    (n, 3, 3) matrices A, photo to object; and K, (n, 3, k), the partial derivatives of the rotation step rho
    by the numbers. A step multiplies A by Exp(rho), about the photo's own axes.
    """

def numbers_of_attitudes(
    representation: str, attitudes: _Floats, boresight: _Floats
) -> tuple[_Floats, _Floats]:
    """Convert attitudes to numbers, the inverse of `attitudes_from_numbers`.

    Parameters
    ----------
    representation, boresight
        As in `attitudes_from_numbers`.
    attitudes
        (n, 3, 3) matrices A, photo to object.

    Returns
    -------
    (n, k) numbers, and their partial derivatives by the rotation step, (n, k, 3). If two rotation axes
    coincide, derivatives are NaN and one of the angles is zero.
    """

def nadir_boresight(quarters: int) -> _Floats:
    """Return photo axes from body axes, (3, 3), of a nadir camera.

    Parameters
    ----------
    quarters
        Direction of the top of the image, in quarter circles from forward to the right wing: 0 to 3.
    """

def rotation_matrix(angles: _Floats) -> _Floats:
    """Compute rotation matrices (n, 3, 3) M_kappa M_phi M_omega of (n, 3) omega, phi, kappa in radians."""

def rotation_angles(matrices: _Floats) -> _Floats:
    """Compute omega, phi, kappa of rotation matrices, the inverse of `rotation_matrix`.

    Parameters
    ----------
    matrices
        (n, 3, 3) orthogonal matrices with determinant 1.

    Returns
    -------
    (n, 3) omega and kappa in [-pi, pi], phi in [-pi/2, pi/2], radians. If phi is +-pi/2, only omega + kappa
    or omega - kappa is determined; the returned angles reproduce the matrix.
    """

def vector_rotations(vectors: _Floats) -> _Floats:
    """Convert rotation vectors (n, 3), axis times angle in radians, to matrices (n, 3, 3) (Rodrigues)."""

def rotation_vectors(matrices: _Floats) -> _Floats:
    """Convert rotation matrices (n, 3, 3) to vectors (n, 3), no longer than pi; see `vector_rotations`."""

def geographic_to_geocentric(positions: _Floats, a: float, b: float) -> _Floats:
    """Convert geographic positions to geocentric X, Y, Z.

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
    """

def geocentric_to_geographic(xyz: _Floats, a: float, b: float) -> _Floats:
    """Convert geocentric X, Y, Z to geographic positions, the inverse of `geographic_to_geocentric`.

    Returns
    -------
    (n, 3) longitude (rad, in [-pi, pi], 0 on the axis), latitude (rad), height (linear unit of the axes),
    accurate to the rounding of the coordinates.
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
    """Project points into photos row by row: point i into photo i.

    x = c u1/u3, y = c u2/u3 with u = M d (ground-to-photo) or M^T d (photo-to-ground). d is the vector from
    the projection centre to the point: in object space axes if rectangular, in the local vertical frame of
    the station (east, north, up) if geographic.

    Parameters
    ----------
    points
        (n, 3) X, Y, Z, or longitude (rad), latitude (rad), height.
    positions
        (n, 3) projection centres, in the same system.
    attitudes
        (n, 3) omega, phi, kappa in radians.
    principal_distances
        (n,) c in millimetres: negative for the positive (diapositive) plane, positive for the negative plane.
    spheroid
        Semi-axes (a, b) for geographic space, None for rectangular space.
    photo_to_ground
        Direction of the angles.
    refraction
        Refraction model; None for straight rays.

    Returns
    -------
    (n, 2) x, y in millimetres; not finite for a point in the plane of the projection centre (u3 = 0).
    """

def refraction_shift(
    points: _Floats, positions: _Floats, *, spheroid: tuple[float, float] | None, refraction: RefractionRow
) -> _Floats:
    """Compute the refraction displacement of points as seen by cameras, row by row.

    Parameters
    ----------
    points, positions, spheroid, refraction
        As in :func:`project`.

    Returns
    -------
    (n, 3) vectors in the linear unit along X, Y, Z or the geocentric axes.
    """

class BlockError(Exception):
    """Block that cannot be adjusted.

    `args` is (kind, message, combinations, points, seconds). kind is `undetermined points`, `undetermined
    photos`, `no intersection`, `coarse` (too large for double precision), `outside` (a time beyond the reach
    of a trajectory), `not finite`, `memory`, `empty` or `input`. combinations are undetermined combinations
    of unknowns; for `coarse` and `outside`, the photos concerned, in one. points is a list of point indices;
    for `outside` the point of the image, empty for the photo itself. seconds, for `outside`: the time and the
    reach of the trajectory, relative to its origin.
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
    """Compute poses of photos from known data, in cartesian object space (`docs/first-values.md`).

    Parameters
    ----------
    photo_positions, photo_attitudes
        (P, 3) and (P, 3, 3), photo to object: given poses; NaN if unknown.
    observed_positions, observed_attitudes
        (P, 3) and (P, 3, 3) observed poses; NaN if not observed.
    point_positions, point_sd
        (n, 3) control in the linear unit, and its standard deviations; infinite for free coordinates.
    image_photos, image_points
        (m,) indices into photos and points.
    directions, direction_sd
        (m, 3) unit directions in the axes of the photos, not finite if undefined, and (m,) their standard
        deviations in radians.
    threads
        As in :class:`BlockNetwork`.

    Returns
    -------
    (P, 3) positions and (P, 3, 3) attitudes, NaN if not found. For each photo (`given`, `resected`,
    `observed` or `oriented`, 0, 0), or the reason: (`points`, known points, 0), (`misfit`, known points, 0)
    or (`apart`, objects that its model shares with known data, photos of the model). (n, 3) positions of
    points. (m,) whether an image was rejected. (n,) whether the images of a control point agree with each
    other but not with its coordinates. The photo that defines the datum, if nothing else does. The median
    angle between observed and computed directions, radians.
    """

def trajectory_span(trajectory: TrajectoryRow) -> tuple[float, float]:
    """Return the first and the last defined time of a trajectory, relative to its origin."""

def flown(trajectory: TrajectoryRow, position: _Floats, rotation: _Floats, times: list[float]) -> FlownRow:
    """Evaluate a trajectory at n times (docs/moving.md).

    Parameters
    ----------
    trajectory
        As in :func:`block_network`; indices of coefficients are ignored.
    position, rotation
        (K, 3) coefficients of positions, and of rotations in radians.
    times
        Seconds, relative to the origin of the trajectory.

    Returns
    -------
    (n, 3) positions; (n, 9) attitudes, axes of the position coefficients, and right Jacobians of the
    corrections r, row by row. For each time, the index of the first nonzero basis function of positions and
    the values from there on; the same for rotations.

    Raises
    ------
    InputError
        If times do not increase, or the number of coefficients is wrong.
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
    """Create a block for adjustment by least squares (GIANT guide, sections 4 to 9).

    Standard deviations are infinite for free unknowns, zero for fixed ones. Positions are X, Y, Z, or
    longitude (rad), latitude (rad), height if a spheroid is given.

    Parameters
    ----------
    photo_positions, photo_attitudes
        (P, 3) initial values, which fixed components retain; omega, phi, kappa in radians.
    photo_positions_observed, photo_attitudes_observed
        (P, 3) observed values of weighted components; angles may differ from initial ones by full circles.
    photo_position_sd, photo_attitude_sd
        (P, 3) standard deviations of the observed values.
    photo_cameras
        (P,) camera indices; photos of one camera share its unknowns.
    cameras
        Model, parameters in the order of the model and their standard deviations; covariance matrix of the
        weighted parameters row by row, None if uncorrelated; knots, None if absent.
    point_positions, point_sd
        (n, 3) coordinates, NaN if unknown, and standard deviations, finite for control.
    image_photos, image_points
        (m,) indices.
    image_xy, image_sd
        (m, 2) millimetres.
    observation_groups
        Additional observations, by type: name, (k, p) indices of points, (k, q) of photos and (k, c) of
        shared unknowns (-1 for none), (k, v) values and (k, r, r) covariance matrices of the r components.
        Lengths are in the unit of the object space, angles in radians, times in seconds. Values:

        `distance`: length (unknown: instrument); `equal height`: difference; `difference`: three components
        (NaN if not observed); `control`: three coordinates; `on level`: height above it; `on plane`: distance
        from it; `on plumb line` and `on line`: none; `position`: three coordinates, the known lever arm and
        the time (unknowns: lever arm, shift, drift); `attitude`: two matrices row by row, body to object and
        known body to photo (unknown: boresight); `relative`: translation and matrix; `base`: length (two
        sensors, -1 for the frame); `prior`: none; `velocity`: three components and the known lever arm
        (unknown: lever arm); `rate`: three components and the known matrix body to photo (unknowns:
        boresight, bias); `smoothness`: three components and a factor for each coefficient.
    unknowns
        Shared unknowns: type (see `UNKNOWNS`), position, rotation matrix row by row, standard deviations.
    mounts
        Photos on frames: index of the photo, index of the representing photo of the frame, and index of the
        sensor among the shared unknowns.
    trajectories
        Prior table of each, basis of its corrections, and indices of its coefficients among the shared
        unknowns.
    timed
        Photos on trajectories: indices of photo and trajectory, time of the photo in seconds, and indices of
        the rate and the offset of its times among the shared unknowns.
    image_times
        (m,) factor of the rate in the time of each image; empty if all are 0.
    passages
        Image transformations in addition to pose, point and camera: type, indices of shared unknowns, indices
        of points, photos or cameras, and numbers. `figure`: points displaced by w_1 e_1 + w_2 e_2; w is a
        `bend`, the numbers are (e_1, e_2) of each point.
    records
        Number of photos at the end that are records of trajectories: without images, with the last camera.
    spheroid, photo_to_ground
        As in :func:`project`.
    refraction
        Refraction model, applied in every iteration; None for image coordinates without refraction.
    criterion, limit
        `fraction`: no unknown changes by more than `limit` of its standard deviation. `percent`: the sum of
        squares changes by less than `limit` percent.
    max_iterations
        Maximum number of iterations.
    covariance
        Whether to compute cofactors and redundancy numbers; NaN otherwise.
    loss
        Robust loss of the image points, `huber` or `cauchy`, and its scale in a-priori standard deviations.
    ordering
        `auto`, `input`, `rcm`, `amd`, `dissection` or `graph-dissection`; see :func:`photogram.adjust`.
    unit_variance
        `free`, `constrained` or `unity` (GIANT guide, Appendix E), or `redundancy`.
    minimum
        Photo whose pose is fixed if nothing else defines a datum, and for the scale a photo and the index of
        its coordinate. None: selected by the core.
    memory
        Maximum bytes of the adjustment and of later covariances; None: unlimited.
    points_given
        Whether points start from their coordinates, if known, instead of the intersection of their rays.
    """

@final
class BlockNetwork:
    """Block with the options of its adjustment.

    A datum is (`inner`, points, photos, use of scale) for inner constraints, or (`relative`, [], [photo],
    False) or (`relative`, points, [], False) for relative cofactors. Arguments of all methods:

    threads
        Number of threads, at most four per processor. 0: small work uses the calling thread, larger work all
        processors.
    progress
        Called on the calling thread as (phase, points done, all points, None), or ("iteration", number, 0,
        row). An exception that it raises stops the work. Signals are checked at the same time, so that Ctrl-C
        also stops it.

    Methods raise BlockError, before the first iteration if possible, for a block that cannot be adjusted or
    transformed to a datum.
    """

    def adjust(
        self,
        *,
        datum: _DatumRow | None,
        threads: int,
        progress: _Progress,
        start: BlockState | None = None,
        keep: Sequence[int] | None = None,
    ) -> BlockSolution:
        """Adjust the block; a free block may be transformed to inner constraints.

        Without such a datum, the adjustment may continue from a former `start`, also with other weights: in
        the same order, and without points that converged to a station there. Without both, `keep` stores data
        for tests in the state (see :meth:`trial`), and the joint cofactors of these points
        (:meth:`BlockState.joint`).
        """

    def in_datum(
        self, state: BlockState, datum: _DatumRow, *, threads: int, progress: _Progress
    ) -> BlockSolution:
        """Transform an adjusted block to another datum, without iterations."""

    def covariances(self, state: BlockState, *, threads: int, progress: _Progress) -> BlockCovariances:
        """Factor the normal equations at the adjusted state, in its datum."""

    def trial(self, state: BlockState | None, *, threads: int, kept: bool = False) -> NetworkTrial:
        """Prepare trials without some observations, from an adjusted state or from the start.

        `kept` states that the state is of this network. The first trial then uses the data that its
        adjustment stored, without a new formation.
        """

    def resistance(self, state: BlockState, *, threads: int) -> list[tuple[str, float]]:
        """Return the observation types that prevent a similarity transformation of the block.

        Each has the greatest part of its change by a transformation that remains if all unknowns change.
        """

    def held_for_datum(self, *, threads: int) -> list[tuple[int, int]]:
        """Return unknowns that an adjustment fixes to define the datum; empty if not needed.

        Photos, each with the index (0 to 5) of one of its unknowns.
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
        """Transform a partitioned block to inner constraints (docs/distributed.md).

        Parameters
        ----------
        datum
            Inner constraints.
        held
            Result of :meth:`held_for_datum`.
        middle
            Origin, as for all nodes.
        names
            (3 N,) all unknowns of the block, possibly repeated: the rows of :attr:`Node.unknown_names`, with
            indices into this block.
        values
            (N,) adjusted values.
        threads
            As in :meth:`adjust`.

        Returns
        -------
        values
            (N,) values in the datum.
        b, t
            (d N,) columns B, nonzero only for unknowns that define the datum, and T = G (B^T G)^-1,
            concatenated.
        condition
            Condition number of B^T G with scaled columns.
        exact
            Whether the datum is defined by as many unknowns as columns, so that these do not change.

        Raises
        ------
        BlockInputError
            If the names are not the names of all unknowns.
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
        """Create a node of the elimination tree of a larger block (Helmert blocking).

        Blocks of unknowns are named by their owners, (`photo`, `camera`, `unknown` or `point`, index into the
        arrays of this block). A camera has a block if it has a free or weighted parameter and several photos
        of the larger block. A point has one if an additional observation touches it. Fixed cameras, and other
        points, are never named.

        Parameters
        ----------
        outer
            Blocks that are eliminated above this node, in an order known to the node above: photos of several
            parts, shared cameras. Observations of their unknowns alone belong to the node of their
            elimination, and are excluded here; fixed unknowns remain fixed. Empty for the root.
        children
            For each child, in a fixed order, the blocks of its contribution in the order of its `outer`; all
            are photos, cameras, unknowns or points of this block, outer ones or not.
        middle
            (3,) component-wise median of the positions of all photos of the larger block. It is the (rounded)
            origin of coordinates in rectangular space, and defines the vertical for shifts in geographic
            space. It must be the same for all nodes. None: of the photos of this block.
        threads
            As in :meth:`adjust`.
        held
            Result of :meth:`held_for_datum` of the larger block, for the photos of this one, outer ones or
            not.

        Raises
        ------
        InputError
            If a name is not in the block or repeated, or a loss is specified.
        """

def give_back() -> None:
    """Return freed memory to the system; no effect without the GNU C library."""

def judge_full_step(
    taken: Sequence[tuple[float, float]],
    change: float,
    *,
    chord: float | None,
    unknowns: int,
    tolerance: float,
) -> str:
    """Classify a full step by the rules for one process; see `adjustment/options.rs`.

    Parameters
    ----------
    taken
        Damping and largest change of each former step.
    change
        Largest change of any unknown, in standard deviations.
    chord
        Length of the chord after the last step, if any.
    unknowns, tolerance
        Number of unknowns; convergence limit.

    Returns
    -------
    `last`: no further step is needed; `rests`: rounding only, as before; `before a chord`: a chord should
    follow; `one of many`.
    """

def is_chord(chord: float, change: float) -> bool:
    """Return whether to take a chord of this length after a full step with this change."""

def step_rules() -> dict[str, float]:
    """Return the constants of the step rules for one process, by name; see `adjustment/steps.rs`."""

@final
class Node:
    """Node of the elimination tree of a partitioned block (Helmert 1880; Wolf 1978).

    It contains a part of the observations, the photos that they touch, and the elimination order of its own
    blocks, but no values. A *state* is a vector of all its unknowns: three of each point with images only,
    then of photos, shared cameras, shared unknowns and other points, own blocks and outer ones. Positions are
    relative to the origin. A *step* has the same layout. Results are identical to the last bit for any number
    of threads. `threads` and `progress` are as in :class:`BlockNetwork`.
    """

    size: Final[int]
    """N, the number of unknowns in a state."""
    outer: Final[_Indices]
    """(S,) indices of the outer unknowns in a state, block by block in their order."""
    children: Final[list[_Indices]]
    """For each child (S_c,) indices of the unknowns of its contribution in a state, in its order."""
    unknown_names: Final[_Indices]
    """(N, 3) type of the owner of each unknown, index of the owner, and index of the unknown.

    Types: 0 photo, 1 shared camera, 2 shared unknown, 3 point.
    """
    counts: Final[tuple[int, int, int]]
    """Observations, weighted unknowns, unknowns that are not fixed; without outer unknowns."""
    dropped: Final[list[tuple[int, str]]]
    """Excluded points, with the codes of the reasons."""
    initial: Final[_Floats]
    """(N,) initial state: given photos, points at the intersection of their rays here.

    If there are outer points, set the outer part to the values of the node above.
    """
    converges_linearly: Final[bool]
    """Whether photos share free or weighted cameras, so that a final chord helps (docs/adjustment.md)."""

    def prediction(self, threads: int) -> dict[str, float]:
        """Return the predicted work and memory with a number of threads, from the sparsity pattern.

        `points`, `interior`, `outer`: unknowns of points, of own blocks, of outer blocks (S). `images`,
        `observations`: image points, all equations. `reduction`, `factor`, `inverse`: multiply-adds of one
        formation, factorisation, inversion. `node_bytes`: the node without a factor. `factor_bytes`:
        additional bytes of a formed node, with point data for the solution. `memory_bytes`: peak while it is
        formed, inverted or written, with contributions and node. `contribution_bytes`: sent up, 8 (S (S + 1)
        / 2 + 2 S). `cofactor_bytes`: received for the inversion, 8 S (S + 1) / 2. `step_bytes`: received per
        iteration, 8 S.
        """

    def advance(self, state: _Floats, step: _Floats) -> _Floats:
        """Return the state after a step: attitudes step by rotation vectors, others by addition."""

    def relocate(self, state: _Floats, *, threads: int) -> _Floats:
        """Return the state with image-only points at the intersections of their rays."""

    def objective(self, state: _Floats, *, threads: int) -> tuple[float, float, float, float, float]:
        """Return weighted sums of squares (photos, control, images, others), and the objective.

        Own observations only; the sum over all nodes is :attr:`BlockSolution.sums_of_squares`. The objective
        is their total, or the total of losses.
        """

    def form(
        self,
        state: _Floats,
        contributions: list[ContributionRow],
        *,
        damping: float,
        curved: bool,
        threads: int,
    ) -> FormedNode:
        """Form the normal equations at a state, and eliminate own points and blocks.

        Parameters
        ----------
        state
            (N,) values of all unknowns.
        contributions
            :attr:`FormedNode.contribution` of each child in order. They are added in this order.
        damping
            Fraction of the diagonal of the normal equations that is added to it; 0 for a full step. It must
            be equal in all nodes.
        curved
            Whether to include the second-order term of a loss. It must be equal in all nodes.
        """

    def solution(self, state: _Floats, before: _Floats, *, threads: int) -> BlockSolution:
        """Return the solution at a state, without cofactors.

        `before` is the state before the last step. Arrays are of the block of the node, with outer photos.
        Sums, counts and degrees of freedom are of own observations and unknowns, and can be added.
        """

@final
class FormedNode:
    """Node at a state after elimination of its own points and blocks.

    It contains the factor, but no copies of state and contributions. It cannot be pickled; form it again
    instead.
    """

    contribution: Final[ContributionRow]
    """Contribution to the node above, over the S outer unknowns; empty for the root.

    `U = A_SS - A_SI A_II^-1 A_IS` (S (S + 1) / 2,), lower triangle, column by column: row i of column j
    is at `j S - j (j - 1) / 2 + i - j`. `u = b_S - A_SI A_II^-1 b_I` (S,). The diagonal of A_SS before
    any elimination, also by children (S,), is the reference for small pivots. Available once.
    """
    sum_of_squares: Final[float]
    """Weighted sum of squares of own observations at this state; the total is over all nodes."""
    decrease: Final[float]
    """Decrease of the sum of squares by a full step, as far as known here.

    The sum over all nodes applies to the block. Its root is an upper bound of the change of any unknown,
    in standard deviations (the largest change of an iteration).
    """
    undetermined: Final[FailureRow | None]
    """Undetermined unknowns of the node, as in :class:`BlockError`; or None."""

    def solve(self, outer: _Floats, *, threads: int) -> _Floats:
        """Return the step (N,) of all unknowns from the step of the outer ones (S,)."""

    has_chord: Final[bool]
    """Whether the right-hand side of a chord was reduced but not yet solved."""

    def reduce_chord(
        self, state: _Floats, left: Sequence[_Floats], *, threads: int
    ) -> tuple[_Floats, float] | None:
        """Reduce the right-hand side at a state: a second step with the same factor.

        Parameters
        ----------
        state
            (N,) state after a step.
        left
            (S,) remaining right-hand side of each child.

        Returns
        -------
        (S,) the remaining right-hand side of the outer unknowns, and the decrease of the sum of squares by
        the chord, as far as known here. None if the required data were not stored because of insufficient
        memory.
        """

    def reduce(self, rights: _Floats, *, threads: int) -> tuple[_Floats, _Floats]:
        """Reduce right-hand sides: y = L^-1 r of the unknowns eliminated here.

        Parameters
        ----------
        rights
            (d, N) for all unknowns: own ones, with remainders of the children.

        Returns
        -------
        left
            (d S,) remainders for the outer unknowns.
        products
            (d d,) y^T y; the sum over all nodes is r^T Q r.
        """

    def complete(self, outer: _Floats, *, threads: int) -> _Floats:
        """Return solutions (d N,) of reduced rights, or the chord (N,), from the outer ones (d, S); once."""

    def invert(
        self,
        outer: _Floats,
        state: _Floats,
        *,
        threads: int,
        datum: tuple[_Floats, _Floats, _Floats, _Floats, float, list[int]] | None = None,
    ) -> tuple[BlockSolution, list[_Floats]]:
        """Return the solution with cofactors, and the cofactors for the children.

        The factor is deleted.

        Parameters
        ----------
        outer
            (S (S + 1) / 2,) cofactors of the outer unknowns, a lower triangle packed as the contribution.
        state
            (N,) final state: after the step if it was the last one, otherwise unchanged.
        datum
            Transformation of cofactors to a datum of the whole, except for the children: T and W = Q B (d,
            N), B^T W of the whole (d, d), the last step (N,) before the transformation, the condition of B^T
            G, and the unknowns that do not change, ascending.

        Returns
        -------
        BlockSolution
            As :meth:`Node.solution`, with cofactors, redundancy numbers and test values. Outer photos have
            cofactors, but no redundancy numbers of their own weights.
        list
            For each child its (S_c (S_c + 1) / 2,) cofactors.
        """

@final
class NetworkSuspects:
    """G groups of observations that may share a gross error, in the order of all tests.

    Images in order, then control points, positions and attitudes of photos, additional observations, and
    observed values of cameras and shared unknowns. Each group has rows, M in total, stored group by group.
    """

    subjects: Final[tuple[NDArray[np.uint8], _Indices]]
    """(G,) types, and indices of image, point, photo, observation, camera or shared unknown.

    Types are 0 image, 1 control, 2 position, 3 attitude, 4 observation, 5 camera, 6 shared unknown.
    """
    row_starts: Final[_Indices]
    """(G + 1,) first row of each group."""
    components: Final[_Indices]
    """(M,) component of each row."""
    deviations: Final[_Floats]
    """(M,) a-priori standard deviations, in the units of the observations."""

@final
class NetworkSnooping:
    """Data snooping of a network: rounds of tests, removals and adjustments of a trial.

    Methods raise the errors of the trial.
    """

    def __new__(
        cls,
        trial: NetworkTrial,
        consensus: tuple[Sequence[int], set[int]] | None,
        *,
        level: float,
        is_rate: bool,
        known: bool,
        robust: bool | None,
        max_rounds: int,
        control: str,
        rough: float,
        exact: float,
        max_rows: int,
        is_supported: list[bool],
    ) -> NetworkSnooping:
        """Adjust and test all observations, or those of a consensus.

        Parameters
        ----------
        trial
            The network.
        consensus
            Groups of images, and photos, that a consensus removes; None for all observations.
        level, is_rate
            Joint level of all tests, or the false discovery rate.
        known
            Whether the unit weight is known: chi-square decides, otherwise F.
        robust
            Whether to start robustly; None: only if many observations are wrong.
        max_rounds
            Largest number of rounds.
        control
            Parts of control points and poses that may be removed alone: `whole` (none), `plan and height` or
            `components`.
        rough, exact
            Convergence limits of rounds with many rows, and of others; see `NetworkTrial.adjust`.
        max_rows
            Largest number of rows for which R of all rows is computed.
        is_supported
            (P,) whether the pose of each photo is determined without images.
        """

    needs_consensus: Final[bool]
    """Whether the adjustment diverges, or residuals exceed plausible sizes."""

    def may_have_common_errors(self, trial: NetworkTrial) -> bool:
        """Return whether the residuals are too large before any removal."""

    def restart(self, trial: NetworkTrial, consensus: tuple[Sequence[int], set[int]]) -> None:
        """Continue from the result of a consensus."""

    def adjust_exactly(self, trial: NetworkTrial) -> tuple[str, float, int]:
        """Adjust to `exact`; return status, weighted sum of squares and degrees of freedom."""

    def run(self, trial: NetworkTrial) -> None:
        """Remove groups in rounds until nothing changes."""

    def finish(self) -> dict[str, Any]:
        """Return the log, once.

        Returns
        -------
        `removals`: a dictionary for each; see `photogram.results.snooping_log.Removal`. `rounds`: number,
        standing (status, weighted sum of squares, degrees of freedom), limit, removed, returned. `remarks`:
        code, values, factors by type. `rows` (M,), `points`, `photos`: removed ones. `tests`: number of
        tested groups. `before`, `after`: standings. `factors` of standard deviations by type. `active` (G,):
        any row is in use.
        """

@final
class NetworkTrial:
    """Repeated adjustment of a network without some observations, with one symbolic analysis.

    Rows and square blocks are stored group by group. Removed observations have zero weight. Methods raise the
    errors of the adjustment, BlockError or CollectionError. The kind is `undetermined points` or
    `undetermined photos` if the removals leave these without support.
    """

    suspects: Final[NetworkSuspects]
    """Groups of observations that can be removed."""
    photos: Final[list[list[float]]]
    """Values of each photo after the last trial, in the input format, pose first."""
    points: Final[_Floats]
    """(n, 3) point coordinates after the last trial; NaN for removed points."""

    def stand(self) -> tuple[str, int, float, int, list[int]]:
        """Restore the adjusted state with all observations; return the same as `adjust`."""

    def adjust(
        self,
        rows: NDArray[np.bool_],
        points: list[int],
        photos: list[int],
        *,
        tolerance: float | None,
        progress: _Progress,
    ) -> tuple[str, int, float, int, list[int]]:
        """Adjust without removed observations, from the state of the last trial.

        Parameters
        ----------
        rows
            (M,) whether each row is removed.
        points, photos
            Points and photos removed with all their observations; their values do not change.
        tolerance
            Convergence limit. For a block, the largest expected change in the next iteration, in standard
            deviations; for a collection, as in its options. None: the limit of the options.

        Returns
        -------
        Status, iterations, weighted sum of squares, degrees of freedom, points that converged to a station.
        """

    def tests(self) -> dict[str, NDArray[Any]]:
        """Test every active group.

        Returns
        -------
        `active` (G,): any row is in use. `rank` (G,): number of detectable directions of an error.
        `statistic` (G,): T, the decrease of the sum of squares without the group. `least` (G,): smallest
        redundancy of a detectable direction. `residual` (M,): normalised residual. `cofactors`: square blocks
        of R. `error`, `error_sd` (M,): estimated error and its standard deviation (a-priori unit weight), in
        the units of the observations. NaN for removed groups.
        """

    def hypotheses(
        self,
        *,
        velocities: _Floats,
        times: list[float],
        position_sets: list[int | None],
        control_sets: list[int | None],
        readouts: list[list[list[float]]],
        widths: list[float],
        checks: list[int],
        centre: list[float] | None,
        estimated: tuple[float, float] | None,
        detection: tuple[float, float],
        limit: float,
        effects: int,
        observed: _Floats | None = None,
        compared: int = 0,
        by_component: bool = False,
        photos: list[int] = ...,
        last: bool = False,
    ) -> dict[str, Any]:
        """Test errors that sets of observations have in common, and errors of groups except images.

        Parameters
        ----------
        velocities, times
            (P, 3) velocities of photos in the object space by time, and (P,) times; empty if unknown.
        position_sets, control_sets
            The set (strip, file) of the position of each photo, and of each control point, or None; empty for
            none.
        readouts
            For each camera a, b, c if rows are read one after the other, and if columns are. The time of x, y
            within the readout is a x + b y + c, -1/2 to 1/2.
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
        observed
            (P, 3) observed positions of photos; NaN if unknown. None: the adjusted ones.
        compared
            The number c of `checks` with known differences: the first ones.
        by_component
            Whether check points also test errors of each component of groups.
        photos
            Photos that are tested for a shift of all their image observations; by default none.
        last
            Whether the trial ends: the data for tests of a large network are released.

        Returns
        -------
        Columns of the h hypotheses, those of s sets first: `code`, `group` (type as in `suspects`), `index`,
        `component` (-1 if a hypothesis has none), `observations`, `rank`, `statistic` T, `probability`,
        `redundancy` r, `noncentrality`, `bias_to_noise`; `estimate`, `plausible` (sizes) and `mdb`: (h, k)
        with NaN for missing values. `effects` by row: points beyond the limit, the second largest change of
        points other than those of the group, and the largest change of all, both in standard deviations, its
        point and coordinate, the largest change, and the changes of `checks`. `sets`: dictionaries with
        `parameters`, `plausible`, `estimate`, its `cofactors`, `error`, `sd_between_photos` (standard
        deviation of a significant readout time if it differs between photos; else None), and the changes of
        check points by each parameter, (c, 3, k) row by row; `groups`: the same by row of groups with
        effects, if `by_component`. `correlations`: (s, s), of the scores of sets.
        """

    def effects(self, suspects: list[int]) -> _Floats:
        """Return the effects of an error of one standard deviation in each row of some groups on its point.

        Returns
        -------
        (., 3): changes of the coordinates; NaN without a point.
        """

    def responses(self, suspects: list[int]) -> _Floats:
        """Return the columns of R of the rows of some groups: (., M)."""

    def inseparable(self, points: list[int], limit: float) -> tuple[_Indices, _Indices, _Floats]:
        """Return both groups of pairs on one point with correlated tests, and the correlation > `limit`."""

@final
class BlockState:
    """Final state of the adjustment of a block, and its datum.

    Parameters
    ----------
    unknowns
        Adjusted values, in the order of the core.
    held, collapsed, undetermined_photos
        Unknowns fixed for a datum; points excluded because they converged to a station or their rays do not
        determine them; photos excluded because their images do not determine them.
    ordering
        Name of the ordering in use.
    datum
        Name, points, photos, use of scale, photos whose attitudes count, and the factor that makes rotations
        comparable with translations. None for a datum of fixed unknowns.
    released
        Whether minimal control was released for the datum.
    """

    def __new__(
        cls,
        unknowns: list[float],
        held: list[int],
        collapsed: list[int],
        undetermined_photos: list[int],
        ordering: str,
        datum: _DatumRow | None,
        released: bool,
    ) -> BlockState: ...
    def __getnewargs__(
        self,
    ) -> tuple[list[float], list[int], list[int], list[int], str, _DatumRow | None, bool]: ...
    def joint(self, points: Sequence[int]) -> NDArray[np.float64] | None:
        """Return the stored joint cofactors (3k, 3k) of exactly these points.

        None for copies of a state and for states read from files.
        """

@final
class BlockCovariances:
    """Cofactors (a-priori unit weight) of any quantities of an adjusted network, from one factor.

    Quantities are identified by type and index: `photo` (its pose), `step` (position and rotation about the
    photo's axes), `point`, `camera` (of a photo in a collection), `unknown`. Arguments as in
    :class:`BlockNetwork`. Methods raise BlockError or CollectionError.
    """

    def cofactors(
        self,
        rows: list[tuple[str, int]],
        columns: list[tuple[str, int]] | None,
        *,
        threads: int,
        progress: _Progress,
    ) -> _Floats:
        """Return the cofactors of all unknowns of `rows`, or of `rows` with `columns`."""

    def propagate(
        self, partials: _Floats, of: list[tuple[str, int]], *, threads: int, progress: _Progress
    ) -> _Floats:
        """Return J Q J^T for (m, k) partial derivatives J of m functions of k unknowns."""

    def suspects(self) -> NetworkSuspects:
        """Return the groups of observations of the network."""

    def influences(self, partials: _Floats, of: list[tuple[str, int]]) -> _Floats:
        """Return the effects of one-sigma errors in all rows on functions of the unknowns: (m, M).

        Rows are in the order of all groups; `partials` and `of` as in :meth:`propagate`. The datum is defined
        by fixed unknowns.
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
        progress: _Progress,
    ) -> tuple[list[int], _Floats, list[bool]]:
        """Return sums of R_ij^2 over groups; R maps errors to residuals, both in standard deviations.

        Parameters
        ----------
        groups
            Number g of groups; then the group of each observation, -1 for none: (m, 2) x and y of images, (n,
            3) components of points, (P, 6) unknowns of poses, of every camera, shared unknown, and other
            observation.
        classes
            None: all sums. A number: sums within each group only. Groups with the same index modulo this
            number share columns, and the sums between such groups are included.
        exact, vectors, seed
            Groups with at most `exact` observations, and groups with at most `vectors`, are computed column
            by column. Others use `vectors` random sign vectors (Hutchinson 1990). Results are identical to
            the last bit for the same seed and any number of threads.

        Returns
        -------
        equations
            (g + 1,) observations of each group and of none; empty with classes.
        squares
            (g + 1) * g sums, row by row, of i in the row's group (last row: no group) and j in the column's
            group; with classes (g,) sums of i and j in each group.
        exact
            (g,) whether columns were computed column by column; empty with classes.
        """

    def project_images(self, columns: _Floats, *, threads: int, progress: _Progress) -> _Floats:
        """Return (k, m, 2) residuals from k columns of errors of all images, both in standard deviations.

        The result is R z for each column z; unused images have neither errors nor residuals.
        """

class _NetworkSolution:
    """Common attributes of adjusted blocks and collections, for P photos, n points, m images.

    A photo of a block has k unknowns of position and attitude, in a collection also of its camera. Values are
    in the input units. Excluded points and images are NaN. Cofactors refer to a-priori unit weight.
    """

    status: Final[str]
    """`converged`, `not converged` or `diverged`."""
    weak_points: Final[list[tuple[int, float, float]]]
    """Points with nearly parallel rays, or at the position of a station.

    For each its index, the ratio of its largest to its smallest standard deviation (in any directions;
    infinite if the smallest is lost by rounding, NaN without cofactors), and its distance from the
    nearest station that observes it, relative to the median of these distances.
    """
    weak: Final[list[tuple[int, int]]]
    """Photos and their unknowns in a combination that no step could follow.

    The sum of squares was nevertheless stationary, or the iterations were exhausted. Empty otherwise.
    """
    state: Final[BlockState]
    """Final state of the adjustment."""
    initial_sum_of_squares: Final[float]
    """Weighted sum of squares, or of losses, at the initial values."""
    iterations: Final[list[IterationRow]]
    """All iterations."""
    photo_cofactors: Final[_Floats]
    """(P, k, k): position and attitude, or vector and translation, then the camera."""
    photo_redundancy: Final[_Floats]
    """(P, k) redundancy numbers of the observed unknowns; 0 unless weighted."""
    point_positions: Final[_Floats]
    """(n, 3) X, Y, Z, or longitude (rad), latitude (rad), height."""
    point_cofactors: Final[_Floats]
    """(n, 3, 3) cofactors of the points."""
    point_redundancy: Final[_Floats]
    """(n, 3) redundancy numbers of the observed coordinates; 0 unless weighted."""
    point_rays: Final[_Indices]
    """(n,) number of images; 0 for excluded points."""
    residuals: Final[_Floats]
    """(m, 2) observed minus computed, in the image unit."""
    redundancy: Final[_Floats]
    """(m, 2) redundancy numbers."""
    standardized: Final[_Floats]
    """(m, 2) residual / (standard deviation x root of redundancy number), a-priori unit weight.

    NaN without redundancy.
    """
    image_weights: Final[_Floats]
    """(m,) factor of the weight by a loss; 1 without a loss."""
    undetermined: Final[FailureRow | None]
    """Reason for missing cofactors, as in :class:`BlockError`."""
    redundancy_excess: Final[float | None]
    """Sum of all redundancy numbers minus the degrees of freedom: rounding errors.

    None without cofactors, and with a loss.
    """
    variance_of_unit_weight: Final[float | None]
    """Variance of unit weight; None without degrees of freedom."""
    counts: Final[tuple[int, int, int]]
    """Observations, weighted unknowns, unknowns that are not fixed."""
    ordering: Final[str]
    """Name of the ordering in use."""
    predictions: Final[dict[str, float]]
    """Predicted multiply-adds of one factorisation in each tested ordering; NaN if it failed."""
    operations: Final[dict[str, float]]
    """Predicted multiply-adds of `reduction`, `factor` and `inverse`, per execution."""
    formations: Final[int]
    """Number of formations of the normal equations."""
    seconds: Final[dict[str, float]]
    """Seconds in `form`, `factor`, `solve`, `invert` and `cofactors`, over all iterations."""

@final
class BlockSolution(_NetworkSolution):
    """Adjusted block; k is 6."""

    photo_corrections: Final[_Floats]
    """(i, P, 6) corrections of position and attitude in each of i iterations, in their units."""
    photo_positions: Final[_Floats]
    """(P, 3) X, Y, Z, or longitude (rad), latitude (rad), height."""
    photo_attitudes: Final[_Floats]
    """(P, 3) omega, phi, kappa in radians."""
    point_last_corrections: Final[_Floats]
    """(n, 3) corrections in the last iteration, in the units of the values."""
    images_behind: Final[_Indices]
    """Indices of the images with a point behind the camera, ascending."""
    images_folded: Final[_Indices]
    """Indices of the images outside the one-to-one range of the lens, ascending."""
    loose_photos: Final[list[int]]
    """Indices of the photos that were not adjusted because their images do not determine them."""
    datum: Final[list[tuple[int, int]]]
    """Photos and their unknowns (0 to 5) that are fixed to define a datum.

    Empty if observations and weights define one.
    """
    datum_unknowns: Final[list[tuple[int, int]]]
    """Coefficients of trajectories fixed to define a datum: shared unknowns and components."""
    relative_error: Final[float]
    """Approximate relative error of the variances in the new datum, by rounding."""
    minimal_control: Final[bool]
    """Whether control and weights of poses are exactly minimal for a datum."""
    weak_unknowns: Final[list[tuple[int, int]]]
    """Shared unknowns and their components, as in `weak`."""
    @property
    def adjusted_unknowns(
        self,
    ) -> list[tuple[list[float], list[float], list[float], list[float], list[float], list[float], int]]:
        """Adjusted shared unknowns, in the input order.

        Change, position (3), rotation matrix row by row (9); cofactors row by row for rotations about the
        adjusted axes. Then cofactors with the unknowns of the previous one in its block (empty for the
        first), redundancy numbers, and the number of observations and images.
        """

    weak_cameras: Final[list[tuple[int, int]]]
    """Shared cameras and their parameters, as in `weak`."""
    cameras: Final[list[CameraRow]]
    """Adjusted cameras, in the input order."""
    dropped: Final[list[tuple[int, str]]]
    """Excluded points, with the codes of the reasons."""
    sums_of_squares: Final[tuple[float, float, float, float]]
    """Weighted sums of squares: photos, control, image coordinates, additional observations."""
    redundancies: Final[tuple[float, float, float, float] | None]
    """Sums of the redundancy numbers of the same types; None without covariances."""
    adjusted_observations: Final[tuple[_Indices, _Floats, _Floats]]
    """Results of the n observations, in the order of the groups.

    (n,) numbers of components, zero for observations of excluded points; (3, r) residuals, redundancy
    numbers and standardized residuals of all components in sequence, in the units of their types; (2, n)
    weighted squares, and factors of the weights by a loss, NaN for observations of excluded points.
    """
    degrees_of_freedom: Final[int]
    """Degrees of freedom for the selected unit variance."""
    photo_order: Final[_Indices]
    """(P,) indices of the photos in elimination order."""

class ResectionError(Exception):
    """Photo that cannot be resected.

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
    """Resect one photo by least squares on the calling thread; Ctrl-C is checked in iterations.

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
        (6,) known position and attitude (NaN if unknown), and their standard deviations: infinite is free, 0
        is fixed.
    start
        (6,) initial values; None to compute them from triples of points.
    spheroid, photo_to_ground
        As in :func:`project`.
    at_measured
        Whether to form the partial derivatives at the measured image positions, as program W5344 does (USGS
        Computer Contribution 2, 1969, equations 4 and 5), instead of the computed ones.
    criterion, limit
        `fraction`: no unknown changes by more than `limit` of its standard deviation. `position`: the
        correction of the position is shorter than `limit`, full steps without damping (program W5344).
    max_iterations, covariance
        As in :func:`block_network`; iterations are from each initial pose.

    Raises
    ------
    ResectionError
        If the photo cannot be resected.
    """

@final
class ResectionSolution:
    """Resected photo with n points. Cofactors refer to a-priori unit weight."""

    status: Final[str]
    """`converged`, `not converged` or `diverged`."""
    iterations: Final[list[IterationRow]]
    """All iterations."""
    history: Final[_Floats]
    """(k, 6) position and attitude after each iteration."""
    start: Final[_Floats]
    """(6,) initial pose of the adjustment."""
    pose: Final[_Floats]
    """(6,) position, then omega, phi, kappa in radians."""
    cofactors: Final[_Floats]
    """(6, 6), in the units of the values; with the criterion `position` before the last correction."""
    pose_redundancy: Final[_Floats]
    """(6,) redundancy numbers of observed position and attitude; 0 unless weighted."""
    point_positions: Final[_Floats]
    """(n, 3) adjusted control."""
    point_cofactors: Final[_Floats]
    """(n, 3, 3) in the units of the values."""
    point_redundancy: Final[_Floats]
    """(n, 3) redundancy numbers of control coordinates; 0 unless weighted."""
    residuals: Final[_Floats]
    """(n, 2) observed minus computed, millimetres."""
    redundancy: Final[_Floats]
    """(n, 2) redundancy numbers."""
    standardized: Final[_Floats]
    """(n, 2) residual / (standard deviation x root of redundancy number), a-priori unit weight."""
    partials: Final[_Floats]
    """(n, 2, 6) partial derivatives of x and y by position and attitude, at the solution."""
    points_behind: Final[_Indices]
    """Indices of the points behind the camera, ascending."""
    sum_of_squares: Final[float]
    """Weighted sum of squares."""
    degrees_of_freedom: Final[int]
    """Observations and weighted unknowns minus unknowns."""
    alternatives: Final[list[tuple[list[float], float]]]
    """Other poses (6 values) with a similar fit, with their sums of squares."""
    undetermined: Final[str | None]
    """Reason why another fitting pose is undetermined, a kind as in `ResectionError`; or None."""
    outside_danger_cylinder: Final[float | None]
    """Distance of the projection centre from the danger cylinder, negative inside, or None."""

class ComparatorError(Exception):
    """Calibration that cannot be adjusted: (message, cases, points), both as indices."""

@final
class ComparatorSolution:
    """Adjusted calibration of a comparator. Cofactors refer to a-priori unit weight."""

    converged: Final[bool]
    """Whether no unknown changed by more than `limit` of its standard deviation in the last step."""
    iterations: Final[int]
    """Number of iterations."""
    comparator: Final[list[float]]
    """Scale x, scale y, lack of orthogonality (rad), coefficients of x, of y (unit of the grid)."""
    comparator_cofactors: Final[_Floats]
    """(k, k) joint cofactors of these parameters."""
    case_placements: Final[_Floats]
    """(q, 3) rotation (rad), and the grid coordinates of the centre of the polynomials."""
    case_cofactors: Final[_Floats]
    """(q, 3, 3) cofactors of each case."""
    grid_xy: Final[_Floats]
    """(l, 2) adjusted grid coordinates, in the axes of the plate."""
    grid_cofactors: Final[_Floats]
    """(l, 2, 2) cofactors of each grid point."""
    grid_redundancy: Final[_Floats]
    """(l, 2) redundancy numbers of given grid coordinates; zero for free and fixed ones."""
    residuals: Final[_Floats]
    """(m, 2) observed minus computed readings."""
    redundancy: Final[_Floats]
    """(m, 2) redundancy numbers of the readings."""
    sum_of_squares: Final[float]
    """Weighted sum of squares of readings and weighted grid coordinates."""
    degrees_of_freedom: Final[int]
    """Readings and weighted grid coordinates minus unknowns."""

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
    """Adjust a comparator, its polynomials, plate placements and grids together.

    grid = M (x' + P(x') - centre) + t with x' = N S x: scales, non-orthogonality, then polynomials, then
    rotation. Polynomials consist of u^d, v^d, ... u^2, v^2; u and v are x' and y' minus `centre`, divided by
    `half_range`.

    Parameters
    ----------
    grid_xy, grid_sd
        (l, 2) coordinates of the grid points in the axes of their plate, and their standard deviations:
        infinite is free, zero is fixed.
    case_placements
        (q, 3) initial rotation (rad) and grid coordinates of `centre`.
    case_left_handed
        (q) whether X and Y of the grid are swapped.
    measured_cases, measured_points
        (m,) indices of the case and the grid point of each reading.
    measured_xy, measured_sd
        (m, 2) readings and their standard deviations, in the unit of the grid.
    coefficients, coefficient_sd
        Initial coefficients in x and in y, in the unit of the grid, and their standard deviations: infinite
        is free, zero is fixed.
    degree, centre, half_range
        Degree, centre and half range of the polynomials.
    limit, max_iterations
        Convergence limit, largest change in standard deviations; maximum number of iterations.

    Raises
    ------
    ComparatorError
        If the readings leave unknowns undetermined, or indices and lengths are inconsistent.
    """

_Vector = tuple[float, float, float] | list[float]
_Matrix = list[list[float]]

CentredRow = tuple[float, _Matrix, _Vector, _Vector, _Vector]
"""Scale s, rotation A (3 x 3), translation t, centre of the control c_X, centre of the model c_x of the
similarity x - c_x = s A (X - c_X) + t."""

ParametersRow = tuple[float, _Matrix, _Vector]
"""Scale s, rotation A (3 x 3), translation B of the similarity x = s A X + B."""

TraceRow = tuple[_Matrix, tuple[list[tuple[int, int]], _Floats], _Floats, _Floats, list[float], list[float]]
"""One cycle of the bulletin: initial rotation A; (station, component) and (m, 8) P-values of equations;
normal equations C (7, 8); auxiliary table D (7, 8); seven results; corrected omega, phi, kappa, s, b1, b2,
b3."""

class SimilarityError(Exception):
    """Model that cannot be oriented.

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
    """Compute the similarity x = s A X + B from control X and model x (C&GS Technical Bulletin 19).

    Parameters
    ----------
    control, control_sd
        (n, 3) ground units: coordinates, NaN if unknown, and standard deviations; zero for an exact one,
        infinite for an unused one.
    model, model_sd
        (n, 3) model units: coordinates and their standard deviations; zero if those for control are positive.
    method
        `rigorous`, `report` or `fill-in`.
    start
        `auto`, `report` or `closed-form`; ignored with `former`.
    former
        Former result to start from, or None.
    max_iterations
        Maximum number of iterations.
    tolerance
        Convergence limit: fraction of the standard deviation of any unknown (rigorous method).
    threads
        Number of threads; 0: selected by the core (see `BlockNetwork`).
    trace
        Whether the methods of the report store intermediate results of each cycle.
    scale
        Fixed scale s, which leaves six unknowns; None: free.

    Raises
    ------
    SimilarityError
        If the model cannot be oriented.
    """

@final
class SimilaritySolution:
    """Oriented model, in the order of its n stations. Cofactors refer to a-priori unit weight."""

    status: Final[str]
    """`converged`, `not converged` or `diverged`."""
    started: Final[str]
    """Source of the initial values: `restart`, `report` or `closed-form`."""
    similarity: Final[CentredRow]
    """Adjusted similarity."""
    initial: Final[CentredRow]
    """Initial similarity of the iteration."""
    alternatives: Final[list[CentredRow]]
    """Other orientations with the same fit."""
    iterations: Final[list[IterationRow]]
    """Iterations of the rigorous method; empty for the methods of the report."""
    cycles: Final[list[float] | None]
    """Largest correction of an angle (rad) in each cycle of the report's methods, else None."""
    traces: Final[list[TraceRow]]
    """Intermediate results of these cycles, if requested."""
    tangent_cofactors: Final[_Floats]
    """(7, 7) cofactors of three small rotations about the model axes (rad), s, t."""
    condition: Final[float]
    """Condition number of the linearized misclosures."""
    weakness: Final[tuple[str, list[int]] | None]
    """Reason for weak control, and the stations concerned.

    `coincident` (horizontal stations in plan), `elevations in line` (in plan) or `stations in line`.
    """
    sum_of_squares: Final[float]
    """Weighted sum of squares in both systems."""
    misclosures: Final[_Floats]
    """(n, 3) s X - A^T (x - B): control axes, model units; NaN if unknown."""
    model_residuals: Final[_Floats]
    """(n, 3) s A X + B - x with the adjusted X: model axes, model units."""
    adjusted_control: Final[_Floats]
    """(n, 3) adjusted control coordinates, ground units; unknown ones from the model."""
    control_cofactors: Final[_Floats]
    """(n, 3, 3) cofactors of the adjusted control coordinates."""
    redundancy: Final[_Floats]
    """(n, 3) redundancy numbers of the misclosures; NaN if unknown."""
    standardized: Final[_Floats]
    """(n, 3) misclosure / a-priori standard deviation; NaN if unknown or unchecked."""

def transform_points(
    similarity: CentredRow, tangent_covariance: _Floats, points: _Floats, points_sd: _Floats
) -> tuple[_Floats, _Floats]:
    """Compute control coordinates of model points, with covariances.

    Parameters
    ----------
    similarity
        Similarity.
    tangent_covariance
        (7, 7) of three small rotations about the model axes (rad), s, t.
    points, points_sd
        (n, 3) model coordinates and their standard deviations, model units.

    Returns
    -------
    (n, 3) X = A^T (x - B) / s and (n, 3, 3) covariances, ground units.
    """

def similarity_partials(similarity: CentredRow) -> _Floats:
    """Return (7, 7) partials of omega, phi, kappa, s, b1, b2, b3 by small rotations, s, t."""

def gauss_crout(normal: _Floats) -> tuple[_Floats, _Floats] | None:
    """Solve seven normal equations by the Gauss-Crout scheme of TB 19, section 4.

    Parameters
    ----------
    normal
        (7, 8) C; column 8 is the right-hand side.

    Returns
    -------
    (7, 8) auxiliary matrix D and (7,) solution E; None if a pivot vanishes.
    """

_Station = tuple[float, float, float, float]
"""Latitude (rad), constant of diurnal aberration (rad), temperature (K), pressure (mm of mercury)."""
_CameraKind = tuple[float | None, bool, bool] | tuple[str, bool]
"""For plates: principal distance of the distorted image (None: scale first), Brown's decentering, common
scale. For another model (`camera_models`): its name, and whether fx is the principal distance of both axes.
"""

class StellarError(Exception):
    """Camera that cannot be calibrated.

    `args` are the kind (`undetermined stars`, `undetermined`, `weight`, `not finite`, `input`), a message,
    and the indices of the stars concerned, or of the parameters if these are `undetermined`.
    """

def refraction(
    zenith_distances: _Floats, temperature: float, pressure: float, tau: _Floats, observed: bool
) -> _Floats:
    """Compute the refraction of (n,) zenith distances (NOAA TR NOS 55, equations 7 to 11).

    Parameters
    ----------
    zenith_distances
        (n,) zenith distances, observed or true, radians.
    temperature, pressure
        Kelvin, millimetres of mercury.
    tau
        (4,) coefficients in seconds of arc.
    observed
        Whether the zenith distances are observed ones.

    Returns
    -------
    (n,) true minus observed zenith distance, radians.
    """

def measured_feature(
    kind: str, points: _Floats, covariance: _Floats
) -> tuple[list[tuple[str, bool]], _Floats, _Floats, _Floats, tuple[float, int] | None]:
    """Fit a feature to points, with covariance and test (docs/features.md).

    Parameters
    ----------
    kind
        `distance`, `line`, `plane`, `circle`, `sphere` or `cylinder`.
    points
        (n, 3), any unit of length.
    covariance
        (3n, 3n) covariance of all coordinates, point by point.

    Returns
    -------
    Names of q quantities, and whether each is a length (else a component of a unit vector); (q,) values; (q,
    q) covariance; (n, 4) deviations of points, radial (for a plane along its normal) and axial, each with its
    standard deviation; statistic and degrees of freedom of the test, None without a test.

    Raises
    ------
    InputError
        If there are too few points, the feature is not uniquely determined, a value is not finite, or shapes
        are wrong.
    """

def nearest_points(points: _Floats, others: _Floats, limit: float, but: _Indices | None = None) -> _Indices:
    """Return the index (n,) of the nearest of the others for each point; -1 if beyond the limit.

    Parameters
    ----------
    points
        (n, 2) points in a plane.
    others
        (m, 2), sorted into cells with the width of the limit.
    limit
        Maximum distance, in the unit of the points.
    but
        (n,) one of the others to ignore for each point; -1 for none.
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
    """Find similarities between images and stars: candidate pairs define them, all images vote.

    Parameters
    ----------
    images
        (m, 2), the brightest first; all images vote.
    stars
        (n, 2) predicted images.
    candidates
        (c, 2) an image, one of the first `makers`, and a star that it may show.
    makers
        Number of images that define similarities.
    tolerance, stretch
        Maximum difference of the separations of two images and of their stars: a constant, and a part of the
        image separation that is added.
    least
        Minimum separation of two images.
    axis
        x, y of the centre of possible rotation of the camera, and its maximum shift; None for any rotation.
    limit
        Maximum distance from a star for an image to vote; cells have half this width.
    wanted
        Maximum number of returned similarities.

    Returns
    -------
    Number of pairs that agree, and (k, 4) similarities with the most votes, the best first. An image z, as a
    complex number, is mapped to (a + b i) z + (c + d i). All images vote on the 4,096 similarities selected
    by the makers.
    """

def standard_coordinates(places: _Floats, sidereal_times: _Floats, place: _Station, tau: _Floats) -> _Floats:
    """Compute refracted standard coordinates xi (north), eta (east), (n, 2), of apparent places.

    `places` are (n, 2). The result is NaN at and below the horizon.
    """

def star_places(standard: _Floats, sidereal_times: _Floats, place: _Station, tau: _Floats) -> _Floats:
    """Compute apparent right ascension and declination, (n, 2), of refracted coordinates."""

def pointing_matrix(angles: _Floats) -> _Floats:
    """Return the matrix (3, 3) of alpha, omega, kappa: north, east, zenith to x, y, axis (equation 19)."""

def pointing_of_matrix(matrix: _Floats) -> _Floats:
    """Return the angles alpha, omega, kappa (3,) of a matrix (3, 3)."""

def plate_images(standard: _Floats, angles: _Floats, interior: _Floats, camera: _CameraKind) -> _Floats:
    """Compute plate coordinates (n, 2) of standard coordinates (n, 2); NaN behind the camera.

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
        Kind of the camera.
    """

def plate_directions(
    xy: _Floats, angles: _Floats, interior: _Floats, camera: _CameraKind, *, tolerance: float, passes: int
) -> _Floats:
    """Compute directions of plate coordinates, the inverse of `plate_images`.

    Returns
    -------
    (n, 5) xi, eta, undistorted x, y, and 1 if the distortion converged within `tolerance` in `passes` passes.
    """

@final
class StellarProblem:
    """Calibration problem with prior values: S stars, G attitudes, m images.

    Methods raise StellarError if stars or parameters are undetermined, or star images are undefined at the
    initial values.

    Parameters
    ----------
    station, camera
        Station, and kind of the camera.
    pointings, common
        (G, 3) attitudes; (17,) 13 interior parameters and 4 coefficients of refraction (arcsec).
    fixed
        3 G + 17 flags of fixed parameters.
    weighted, weighted_values, weight_root
        (k,) indices of weighted parameters, their given values, and R (k, k) of their weight matrix R^T R.
    star_places, star_catalogue, star_weights, star_fixed
        (S, 2) initial and catalogue places; (S, 2, 2) weights, zero for unknown directions; S flags.
    image_stars, image_pointings, image_xy, image_weights, image_times, image_shifts
        (m,) indices of star and attitude; (m, 2) measured; (m, 2, 2); (m,) sidereal time; (m, 2) place of the
        star at the time of the image minus the adjusted place.
    axis
        Attitude, standard coordinates, plate coordinates and weight of the axis, if it is known.
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
        progress: _Progress,
        whole: bool = False,
    ) -> dict[str, Any]:
        """Adjust by least squares with exact partial derivatives.

        Parameters
        ----------
        unit
            Expected mean error of unit weight, the unit of `fraction` and of the history.
        fraction
            Convergence limit: largest change of an unknown as a fraction of its standard deviation.
        max_iterations, covariance
            As in :func:`block_network`; `threads` and `progress` as in :class:`BlockNetwork`.
        whole
            Whether to compute the cofactors of all pairs of parameters, if there are cofactors.

        Returns
        -------
        `status`, `iterations`, `initial_sum_of_squares` (in units of `unit` squared), `parameters` (3 G +
        17,). `places` (S, 2), `place_cofactors` (S, 2, 2), and `place_inverses` (S, 2, 2), the cofactors for
        known parameters. `residuals` (m, 2) measured minus computed, `axis_residual`, `sums_of_squares`
        (images, stars, parameters, axis). `redundancy` and `standardized` of `image`, `place`, `axis`; for
        correlated weights of decorrelated components. With cofactors, all for unit weight:
        `pointing_cofactors` (G, 3, 3), `cross_cofactors` (G, 3, 17) of attitudes and common parameters,
        `common_cofactors` (17, 17). With `whole`: `cofactors` (3 G + 17, 3 G + 17) and `log_determinant`, the
        natural logarithm of the determinant of the reduced normal equations.
        """

    def without_effect(self) -> list[int]:
        """Return the indices of parameters that no image, weight or axis touches.

        Fixed parameters are excluded.
        """

    def correction(self, *, refraction: float, distortion: float, passes: int) -> dict[str, Any]:
        """Correct the parameters once with the equations and arguments of `published` at the initial values.

        Returns
        -------
        `parameters` (3 G + 17,): corrections; `cofactors` of all pairs and `log_determinant`, both for unit
        weight; `without_effect`: indices of the parameters that nothing touches, which are not corrected.
        """

    def residual_cycle(
        self, cofactors: _Floats, *, refraction: float, distortion: float, passes: int
    ) -> dict[str, Any]:
        """Correct the stars with fixed parameters; return residuals and tests (equations 64 to 71).

        Parameters
        ----------
        cofactors
            (3 G + 17, 3 G + 17) of the parameters, for unit weight.
        refraction, distortion, passes
            As in `published`.

        Returns
        -------
        As in `adjust`, with plate coordinates instead of angles: `places`, `place_cofactors`,
        `place_inverses`, `residuals`, `axis_residual`, `sums_of_squares`, and `redundancy` and `standardized`
        of `image` and `place`.
        """

    def equations(self) -> dict[str, _Floats]:
        """Return unweighted image equations at the initial values with exact partial derivatives.

        Returns
        -------
        `constant` (m, 2) measured minus computed, `star` (m, 2, 2), `pointing` (m, 2, 3), `common` (m, 2,
        17).
        """

    def axis_equations(self) -> dict[str, _Floats]:
        """Return the equations of the axis as in `equations`, with one row or none."""

    def published(self, *, refraction: float, distortion: float, passes: int) -> dict[str, Any]:
        """Return image equations as in the report's program (equations 48 to 62, 73, 74).

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
    """Collection that cannot be adjusted: (kind, message, combinations, points).

    The kinds are the same as in :class:`BlockError`, without `no intersection`.
    """

def read_numbers(text: bytes) -> tuple[_Floats, bool]:
    """Read numbers separated by white space, up to the first word that is not a finite number.

    Returns
    -------
    (k,) numbers, and whether they are the whole text.
    """

@final
class TableReader:
    """Reader of the columns of a text table with regular lines.

    A regular line has as many cells as columns, or an empty one more. Cells of number columns are empty or
    numbers with the same decimal mark. Names are without control characters. A cell can be in quotation marks
    if no quotation mark is inside. Comments, and blank lines above others, are irregular.

    Parameters
    ----------
    delimiter
        Code of the character between cells (ASCII).
    numeric
        For each column, whether its cells are numbers.
    """

    def __new__(cls, delimiter: int, numeric: Sequence[bool]) -> TableReader: ...
    def add(self, lines: bytes) -> bool:
        """Append whole lines. Return False if a line is irregular; the reader is then empty."""

    def columns(self) -> list[_Floats | tuple[bytes, _Indices, bool]]:
        """Return the columns and empty the reader.

        Returns
        -------
        For numbers, an array with NaN for empty cells. For names: the unique names in order of appearance,
        each followed by a line feed; the index of the name of each row; whether it is known that no name is
        empty or NaN, and that all differ by more than blanks and case.
        """

def csv_rows(
    head: bytes, columns: Sequence[_Floats | _Indices | NDArray[np.bool_] | list[str | None]]
) -> bytes:
    """Return a head and the rows of a table as comma-separated text (UTF-8), one line each.

    Numbers have the shortest digits that are read back exactly. NaN and None are empty cells, Booleans are
    `true` and `false`. Texts with commas, semicolons, bars, tabs, hashes, quotation marks, line ends or
    surrounding blanks are in quotation marks if necessary. Line ends become blanks.

    Parameters
    ----------
    head
        Lines before the rows.
    columns
        Columns of equal length.
    """

_ControlColumns = dict[str, Any]

def control_header(
    data: bytes, start: int, stop: int, file: Path | None
) -> tuple[list[str | None], int | None, list[int], list[float], bytes]:
    """Read the header of a binary control network.

    Parameters
    ----------
    data
        Content of the file.
    start, stop
        Position of the header in the content.
    file
        File name, for errors.

    Returns
    -------
    Network, target, created, modified, description and user, None if unspecified; the number of points, if
    specified; version 2: the lengths of the point messages; radii in metres; unknown fields, unchanged bytes.

    Raises
    ------
    InputError
        If the header is damaged.
    """

def control_header_message(
    texts: Sequence[str | None], points: int, radii: Sequence[float], rest: bytes
) -> bytes:
    """Write the header of a binary control network of version 5, from :func:`control_header`."""

def control_points(
    data: bytes, start: int, stop: int, lengths: Sequence[int] | None, file: Path | None
) -> tuple[_ControlColumns, _ControlColumns, _Indices]:
    """Read the points of a binary control network.

    Parameters
    ----------
    data, start, stop, file
        As in :func:`control_header`; the position is that of the points.
    lengths
        Lengths of the messages; None if each precedes its message.

    Returns
    -------
    Columns of points, columns of measures, the first measure of each point and the number of measures (n +
    1). Columns are arrays by name, `ids` a list of texts, `serial` indices and texts. Empty columns are
    omitted. `rest` contains fields without a column: unchanged bytes of messages, and the first byte of each
    row.

    Raises
    ------
    InputError
        If the points are damaged; the record is the number of the point, from 1.
    """

def control_points_of_text(
    data: bytes, file: Path | None
) -> tuple[tuple[_ControlColumns, _ControlColumns, _Indices], str]:
    """Read the points of a control network in text (UTF-8).

    Returns
    -------
    The result of :func:`control_points`, and the text without its points, with unchanged line numbers.

    Raises
    ------
    InputError
        If the text is not a control network; the record is the number of the line, from 1.
    """

def control_point_messages(points: _ControlColumns, measures: _ControlColumns, firsts: _Indices) -> bytes:
    """Write points of :func:`control_points` as messages of version 5 with lengths.

    Raises
    ------
    InputError
        If columns are inconsistent, or contain data that only text can represent.
    """

def control_point_text(points: _ControlColumns, measures: _ControlColumns, firsts: _Indices) -> bytes:
    """Write points of :func:`control_points` as text, as in the object of their network.

    Raises
    ------
    InputError
        If columns are inconsistent, or contain data that only messages can represent.
    """

UNKNOWNS: list[tuple[str, list[tuple[str, str]]]]
"""Types of shared unknowns: name, and for each unknown its name and whether it is a `length`, a `speed`, an
`angle` or a `ratio`."""

CAMERAS: list[str]
"""Names of the camera models."""

def collection_images(camera: str, photo_parameters: _Floats, points: _Floats) -> _Floats:
    """Project points into photos row by row: point i into photo i.

    Parameters
    ----------
    camera
        Camera model, one of `CAMERAS`; `docs/cameras.md` contains the formulas.
    photo_parameters
        (n, 6 + k) angle-axis vector w (rad) and t, so that P = R(w) X + t in the photo's axes (x right, y up,
        looking along -z), then the k parameters of the camera.
    points
        (n, 3) object points X.

    Returns
    -------
    (n, 2) in the unit of the camera; not finite in the plane of the projection centre. The formula also
    applies to points behind the camera.
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
    """Create a collection for adjustment by Levenberg-Marquardt steps.

    Parameters
    ----------
    camera
        Camera model, one of `CAMERAS`.
    photo_parameters, photo_sd
        (P, 6 + k) initial (and, if weighted, observed) parameters and their standard deviations: infinite for
        free ones, zero for fixed ones; see :func:`collection_images`.
    point_positions, point_sd
        (n, 3) initial positions and standard deviations, in the same way.
    image_photos, image_points
        (m,) indices.
    image_xy, image_sd
        (m, 2) pixels.
    decrease
        Convergence limit: relative decrease of the weighted sum of squares by a step.
    max_iterations, covariance, loss, ordering, memory
        As in :func:`block_network`.
    """

@final
class CollectionNetwork:
    """Collection with the options of its adjustment; arguments as in :class:`BlockNetwork`.

    Methods raise CollectionError for a collection that cannot be adjusted, and ValueError for images with
    invalid photo or point indices.
    """

    def adjust(
        self, *, threads: int, progress: _Progress, start: BlockState | None = None
    ) -> CollectionSolution:
        """Adjust the collection, optionally from a former state with other weights."""

    def covariances(self, state: BlockState, *, threads: int, progress: _Progress) -> BlockCovariances:
        """Factor the normal equations at the adjusted state."""

    def trial(self, state: BlockState | None, *, threads: int) -> NetworkTrial:
        """Prepare trials without some observations, from an adjusted state or from the start."""

@final
class CollectionSolution(_NetworkSolution):
    """Adjusted collection; k is 6 plus the number of parameters of a camera."""

    photo_parameters: Final[_Floats]
    """(P, k) adjusted parameters, as in the input."""
    photo_images: Final[_Indices]
    """(P,) number of used images."""
    point_rays_behind: Final[_Indices]
    """(n,) number of images with the point behind the camera."""
    collapsed: Final[list[int]]
    """Indices of the points that converged to a station and were excluded."""
    beside_stations: Final[list[int]]
    """Indices of the points that are fixed close to a station and were excluded."""
    not_determined: Final[list[int]]
    """Indices of the points that were excluded because their rays do not determine them."""
    sum_of_squares: Final[float]
    """Weighted sum of squares, with weights modified by the loss."""
    degrees_of_freedom: Final[int]
    """Observations and weighted unknowns minus unknowns."""
    datum: Final[list[tuple[int, int]]]
    """Photos and parameters fixed to define a datum; empty if observations and weights define one."""
