"""Resection: position and attitude of one photo from control points, without initial values.

The model is the block model (`docs/adjustment.md`). `docs/resection.md` describes the search for initial
values, the validity of the covariance, and critical configurations.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import (
    argument_error,
    length,
    names,
    number,
    numbers,
    shaped,
    truth_value,
    value_field,
    whole_number,
)
from photogram.arguments.fields import array, check_arrays
from photogram.arguments.types import Array, Floats, Names
from photogram.errors import AdjustmentError, InputError, RankError
from photogram.lazy_dataclasses import converting_dataclass, dataclass, field
from photogram.messages import Message
from photogram.network.geometry import Spheroid
from photogram.results.parts import Iteration
from photogram.show.methods import Judged
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.limits import GlobalTest, global_test
from photogram.statistics.reliability import TESTABLE, standardized
from photogram.words import Phrase, phrase

RANK_FAILURES = ("too few points", "collinear", "danger cylinder", "undetermined")
"""Failures of the core that are a :class:`RankError`."""
SOLVED = (
    *("status", "cofactors", "pose_redundancy", "point_positions", "point_cofactors", "point_redundancy"),
    *("residuals", "redundancy", "standardized", "degrees_of_freedom", "outside_danger_cylinder"),
)
"""Attributes of a resection that are copied from the core."""
UNKNOWNS = ("X", "Y", "Z", "omega", "phi", "kappa")
DOUBTFUL = 3.0  # Minimum distance from the danger cylinder, in standard deviations


@dataclass(frozen=True, eq=False)
class Pose:
    """Position and attitude.

    Attributes
    ----------
    position
        (3,) X, Y, Z, or longitude (rad), latitude (rad), height.
    attitude
        (3,) omega, phi, kappa in radians.
    weighted_sum_of_squares
        Weighted sum of squares of the final adjustment; NaN if there was none.
    """

    position: Floats
    attitude: Floats
    weighted_sum_of_squares: float = math.nan

    @classmethod
    def of(cls, values: ArrayLike, weighted_sum_of_squares: float = math.nan) -> Self:
        """Create the pose from six values, position first."""
        six = np.asarray(values, dtype=np.float64)
        return cls(six[:3], six[3:], weighted_sum_of_squares)


@dataclass(frozen=True, eq=False)
class Resection(Judged):
    """Resected photo with n control points, in input order.

    Positions are X, Y, Z or longitude (rad), latitude (rad), height. Angles are in radians, image coordinates
    in millimetres. Cofactors refer to a-priori unit weight; covariances are cofactors times the variance of
    unit weight.

    Attributes
    ----------
    status
        `converged`, `not converged` or `diverged`.
    messages
        Notes: other poses that fit, a station near the danger cylinder, missing redundancy.
    position, attitude
        (3,) each: projection centre, and omega, phi, kappa.
    cofactors
        (6, 6) cofactors of position and attitude.
    pose_redundancy
        (6,) redundancy numbers of position and attitude as observations; 0 unless they were weighted.
    point_positions, point_cofactors, point_redundancy
        (n, 3), (n, 3, 3) and (n, 3): adjusted control, its cofactors, and the redundancy numbers of its
        observed coordinates; 0 unless weighted.
    residuals, redundancy, standardized
        (n, 2) each: observed minus computed in millimetres, redundancy numbers, and residual / (standard
        deviation x root of redundancy number) for a priori unit weight (Baarda's w; NaN without redundancy).
    pose_standardized, point_standardized
        (6,) and (n, 3): standardized residuals of observed position and attitude, and of control.
    point_ids
        Names of the points.
    weighted_sum_of_squares, degrees_of_freedom
        Of all observations: image coordinates, weighted control, weighted position and attitude.
    start
        Initial pose of the adjustment.
    iterations
        Iterations of the adjustment.
    alternatives
        Other poses with a similar fit: minima whose weighted sum of squares is larger by at most nine
        variances of unit weight. Three points often have one to three of them.
    outside_danger_cylinder
        Distance of the projection centre from the danger cylinder, negative inside; None unless there are
        exactly three points.
    """

    status: str
    messages: list[Message]
    position: Floats
    attitude: Floats
    cofactors: Floats
    pose_redundancy: Floats
    point_positions: Floats
    point_cofactors: Floats
    point_redundancy: Floats
    residuals: Floats
    redundancy: Floats
    standardized: Floats
    pose_standardized: Floats
    point_standardized: Floats
    point_ids: list[str]
    weighted_sum_of_squares: float
    degrees_of_freedom: int
    start: Pose
    iterations: list[Iteration]
    alternatives: list[Pose]
    outside_danger_cylinder: float | None

    def _findings(self) -> Findings:
        from photogram.results.parts import parts_of

        def tested(kind: str, w: Floats, redundancy: Floats, name: str, axes: Sequence[str]) -> Tested:
            def named(index: tuple[int, ...]) -> Phrase:
                point = {"point": str(self.point_ids[index[0]])} if w.ndim > 1 else {}
                return parts_of([axes[index[-1]]], Phrase(name, point))

            return Tested(Phrase(kind), np.where(redundancy > TESTABLE, w, np.nan), named, "w")

        control = self.point_standardized, self.point_redundancy, "named.control", UNKNOWNS
        station = self.pose_standardized, self.pose_redundancy, "named.station", UNKNOWNS
        images = self.standardized, self.redundancy, "named.object_point", "xy"
        # Standard deviations are given, so that the unit weight is known.
        return Findings(
            status=self.status,
            observations=[
                tested("test.image_coordinates", *images),
                tested("test.components_of_control", *control),
                tested("test.components_of_station", *station),
            ],
            degrees_of_freedom=self.degrees_of_freedom,
            global_test=self.global_test,
            untested=Phrase("untested.freedom"),
        )

    @property
    def converged(self) -> bool:
        """Whether the convergence criterion was met."""
        return self.status == "converged"

    @property
    def global_test(self) -> GlobalTest | None:
        """Test of all residuals together; None without degrees of freedom."""
        return global_test(self.weighted_sum_of_squares, self.degrees_of_freedom)

    @property
    def variance_of_unit_weight(self) -> float | None:
        """Weighted sum of squares / degrees of freedom; None without degrees of freedom."""
        return self.weighted_sum_of_squares / self.degrees_of_freedom if self.degrees_of_freedom > 0 else None

    @property
    def covariance(self) -> Floats:
        """(6, 6) covariance of position and attitude: cofactors x variance of unit weight, if any."""
        variance = self.variance_of_unit_weight
        return self.cofactors if variance is None else self.cofactors * variance

    @property
    def sd(self) -> Floats:
        """(6,) standard deviations of position and attitude, from `covariance`."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)))


def resect(
    object_points: ArrayLike,
    image_xy: ArrayLike,
    principal_distance: float,
    *,
    image_sd: ArrayLike = 0.010,
    object_sd: ArrayLike = 0.0,
    position: ArrayLike | None = None,
    position_sd: ArrayLike = math.inf,
    attitude: ArrayLike | None = None,
    attitude_sd: ArrayLike = math.inf,
    spheroid: Spheroid | None = None,
    photo_to_ground: bool = False,
    point_ids: Sequence[str] | None = None,
    max_iterations: int = 200,
    tolerance: float = 1e-5,
) -> Resection:
    """Compute position and attitude of a photo from control points without initial values.

    Poses are computed directly from well-spread triples of points (Grunert's problem in the form of Persson
    and Nordberg, 2018) and checked against all points. Consistent poses are adjusted. The result has the
    least sum of squares; other poses with a similar fit are its `alternatives`.

    Parameters
    ----------
    object_points
        (n, 3) control: X, Y, Z, or longitude (rad), latitude (rad), height if a spheroid is given.
    image_xy
        (n, 2) image coordinates in millimetres, reduced to the principal point and free of distortion.
    principal_distance
        Millimetres: negative for the positive (diapositive) plane, positive for the negative plane.
    image_sd
        Standard deviations of image coordinates in millimetres: a number or (n, 2).
    object_sd
        Standard deviations of control in the units of its coordinates: a number, (3,) or (n, 3); 0 fixes it.
    position, position_sd
        (3,) known position and its standard deviations (a number or (3,)): infinite is free, 0 is fixed, and
        others are weighted.
    attitude, attitude_sd
        (3,) known omega, phi, kappa in radians, with standard deviations as for the position.
    spheroid, photo_to_ground
        As in :class:`photogram.Block`.
    point_ids
        Names for messages; 1 to n by default.
    max_iterations, tolerance
        Iterate until no unknown changes by more than this fraction of its standard deviation (a priori unit
        weight).

    Returns
    -------
    The pose with its covariance, and every observation with its residual, redundancy number and test value.

    Raises
    ------
    RankError
        If there are fewer than three points, points are collinear, the station is on the danger cylinder, or
        the pose is otherwise undetermined; the message contains the reason.
    AdjustmentError
        If no position sees all points in front of the camera at their image coordinates.
    InputError
        If shapes are wrong, values are not finite, or standard deviations are invalid.

    Examples
    --------
    >>> import numpy as np
    >>> from photogram import resect
    >>> from photogram.network.geometry import project
    >>> ground = np.array([[0.0, 0, 10], [800, 50, 20], [750, 900, 0], [30, 820, 40], [400, 420, 5]])
    >>> station, angles = np.array([390.0, 430.0, 1500.0]), np.array([0.02, -0.03, 1.5])
    >>> xy = project(ground, np.tile(station, (5, 1)), np.tile(angles, (5, 1)), np.full(5, -152.0))
    >>> photo = resect(ground, xy, -152.0, image_sd=0.005)
    >>> photo.position.round(3).tolist(), photo.attitude.round(6).tolist()
    ([390.0, 430.0, 1500.0], [0.02, -0.03, 1.5])
    """
    if spheroid is not None and not isinstance(spheroid, Spheroid):
        raise argument_error("spheroid", "kind", kind="a Spheroid or None", value=spheroid)
    truth_value("photo_to_ground", photo_to_ground)
    given = Observed(object_points, object_sd, image_xy, image_sd, principal_distance, point_ids)
    known = np.concatenate(
        [_known("position", position, position_sd), _known("attitude", attitude, attitude_sd)]
    )
    limit = number("tolerance", tolerance, "positive")
    number("max_iterations", whole_number("max_iterations", max_iterations), "positive")
    known_sd = np.concatenate(
        [shaped("position_sd", position_sd, (3,), "sd"), shaped("attitude_sd", attitude_sd, (3,), "sd")]
    )
    solution = solve(
        given,
        known=known,
        known_sd=known_sd,
        spheroid=spheroid,
        photo_to_ground=photo_to_ground,
        limit=limit,
        max_iterations=max_iterations,
    )
    return Resection(
        **{name: getattr(solution, name) for name in SOLVED},
        messages=_messages(solution, spheroid),
        position=solution.pose[:3],
        attitude=solution.pose[3:],
        pose_standardized=standardized(
            _nearest(known - solution.pose, [*([0] if spheroid else []), 3, 4, 5]),
            known_sd,
            solution.pose_redundancy,
        ),
        point_standardized=standardized(
            _nearest(given.object_points - solution.point_positions, [0] if spheroid else []),
            given.object_sd,
            solution.point_redundancy,
        ),
        point_ids=given.names,
        weighted_sum_of_squares=solution.sum_of_squares,
        start=Pose.of(solution.start),
        iterations=[Iteration(*row) for row in solution.iterations],
        alternatives=[Pose.of(*other) for other in solution.alternatives],
    )


def _nearest(differences: Floats, angles: list[int]) -> Floats:
    """Reduce the angle components to the nearest multiple of a full circle."""
    nearest = differences.copy()
    nearest[..., angles] -= math.tau * np.round(nearest[..., angles] / math.tau)
    return nearest


@converting_dataclass(frozen=True, eq=False, repr=False)
class Observed:
    """Input of a resection: n control points, their images, standard deviations and names."""

    object_points: Array = field(metadata=array("points", 3))
    object_sd: Array = field(metadata=array("points", 3, rule="sd", one_row=True))
    image_xy: Array = field(metadata=array("points", 2))
    image_sd: Array = field(metadata=array("points", 2, rule="sd", one_row=True))
    principal_distance: float
    names: Names

    def __post_init__(self) -> None:
        count, given = length("image_xy", self.image_xy), self.names
        ids = [str(i + 1) for i in range(count)] if given is None else names("point_ids", given)
        if len(ids) != count:
            raise argument_error("point_ids", "count", count=count, actual=len(ids))
        check_arrays(self, points=count)
        distance = number("principal_distance", self.principal_distance, "not-zero")
        vars(self).update(principal_distance=distance, names=ids)
        for name in ("object_points", "object_sd", "image_xy", "image_sd"):
            values = getattr(self, name)
            good = np.isfinite(values) & ((values > 0) | (name != "image_sd"))
            if (rows := np.flatnonzero(~good.all(axis=1))).size:
                code = "positive" if name == "image_sd" else "finite"
                value = value_field(values[rows[0]].tolist())
                raise argument_error(f"{name} of point {ids[rows[0]]}", code, value=value)


def solve(
    observed: Observed,
    *,
    limit: float,
    max_iterations: int,
    criterion: Literal["fraction", "position"] = "fraction",
    at_measured: bool = False,
    known: Floats | None = None,
    known_sd: Floats | None = None,
    start: Floats | None = None,
    spheroid: Spheroid | None = None,
    photo_to_ground: bool = False,
) -> _photocore.ResectionSolution:
    """Resect with all options of the core, for :func:`resect` and other programs.

    RankError if the pose is undetermined, with the reason; AdjustmentError for other failures.
    """
    try:
        return _photocore.resect(
            observed.object_points,
            observed.object_sd,
            observed.image_xy,
            observed.image_sd,
            observed.principal_distance,
            known=np.full(6, np.nan) if known is None else known,
            known_sd=np.full(6, np.inf) if known_sd is None else known_sd,
            start=start,
            spheroid=None if spheroid is None else (spheroid.a, spheroid.b),
            photo_to_ground=photo_to_ground,
            at_measured=at_measured,
            criterion=criterion,
            limit=limit,
            max_iterations=max_iterations,
            covariance=True,
        )
    except _photocore.ResectionError as error:
        kind, message = error.args
        if kind in RANK_FAILURES:
            raise RankError(phrase(f"resection.{kind}"), [], observed.names) from None
        raise AdjustmentError(message if kind == "input" else phrase(f"resection.{kind}")) from None


def _known(name: str, value: ArrayLike | None, sd: ArrayLike) -> Floats:
    """Return validated known values; NaN if unknown."""
    if value is None:
        if np.isfinite(numbers(f"{name}_sd", sd)).any():
            raise InputError(phrase("resection.value-missing", name=name))
        return np.full(3, np.nan)
    return shaped(name, value, (3,), "finite")


def _messages(solution: _photocore.ResectionSolution, spheroid: Spheroid | None) -> list[Message]:
    messages = []
    if count := len(solution.alternatives):
        messages.append(phrase("resection.alternatives", n=count))
    if solution.undetermined is not None:
        reason = phrase(f"resection.{solution.undetermined}")
        messages.append(phrase("resection.undetermined-alternative", reason=reason))
    outside = solution.outside_danger_cylinder
    if outside is not None:
        # Position in the linear unit, with a-priori weight
        axes = [spheroid.a * np.cos(solution.pose[1]), spheroid.a, 1.0] if spheroid else [1.0, 1.0, 1.0]
        cofactors = solution.cofactors[:3, :3] * np.outer(axes, axes)
        known = np.isfinite(cofactors).all()
        largest = math.sqrt(float(np.linalg.eigvalsh(cofactors)[-1])) if known else math.inf
        if abs(outside) < DOUBTFUL * largest:
            messages.append(phrase("resection.near-cylinder", distance=abs(outside), limit=DOUBTFUL))
    if solution.degrees_of_freedom == 0:
        messages.append(phrase("resection.no-redundancy"))
    return [Message(message) for message in messages]
