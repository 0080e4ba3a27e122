"""Input of a plate calibration: options, stars, images, weights, counts, rejected observations."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import partial
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import number
from photogram.arguments.fields import Checked, array, check_arrays, check_fields, option
from photogram.arguments.objects import require, require_name
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError, failure_of_core
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.stellar.parameters import COMMON, INDEX, NAMES
from photogram.stellar.sky import TAU, Site
from photogram.summaries import Brief
from photogram.words import Phrase, phrase

_DAYS = 20 * math.pi  # A time of ten days, in radians
_STEPS = 10_000  # Largest number of rows of a curve table


def _number(default: float | None, rule: str = "not-negative") -> Any:
    return field(default=default, metadata={"check": partial(number, rule=rule)})


def core_threads(threads: int | None) -> int:
    """Return the number of threads for the core; 0: default of the core."""
    require(threads is None or threads >= 1, "threads", "positive", value=threads)
    return threads or 0


@dataclass(frozen=True)
class Options:
    """Options of a plate calibration and its computations.

    Attributes
    ----------
    common_scale
        Use one principal distance for both axes (option 1).
    refraction
        Estimate the coefficients of refraction after the camera (option 5).
    minimum_stars
        Numbers of the stars of the minimum solution, which computes the initial values (option 6).
    pre_run
        Stop after the minimum solution, with the residuals of all images (option 7).
    curves
        Compute distortion curves (option 8).
    reference, pole
        Station to which attitudes are transformed (option 9). `pole` contains x (towards the prime meridian)
        and y (towards 90 degrees west) of the pole in radians.
    plate_list
        Write plate coordinates and residuals in the punched format of the program (option 11).
    max_iterations_minimum, max_iterations
        Iteration limits (options 12 and 13); 0: unlimited.
    mean_error
        Prior mean error of unit weight that replaces the computed one (option 14); 0: use the computed one.
    histogram
        Compute a histogram of residuals.
    tolerance
        Tolerance of the level of discrepancies, metres.
    refraction_tolerance, distortion_tolerance
        Tolerances of the inner iterations: radians, metres.
    movement_factor
        Attitudes are combined if their directions differ by less than this multiple of the mean error.
    movement_time
        Sidereal time of the fictitious points, radians.
    crossover, interval, extent
        Radius of zero transformed distortion; step and end of the curves; metres.
    comparator_angle
        Angle from the axes of the plate coordinates to the comparator axes, from x towards y, radians. Scales
        and nonperpendicularity are also given in comparator axes (equation 42). None for equal axes.
    distortion_first
        Principal distance (metres) of the form with scale after distortion, which the report prefers for
        calibration (equations 40 and 41). 0 is scale before distortion, as programmed.
    as_published
        Iterate with the partials and stop rules of the report.
    """

    common_scale: bool = False
    refraction: bool = False
    minimum_stars: tuple[str, ...] = ()
    pre_run: bool = False
    curves: bool = False
    reference: Site | None = None
    pole: tuple[float, float] = (0.0, 0.0)
    plate_list: bool = False
    max_iterations_minimum: int = option(0, 0)
    max_iterations: int = option(0, 0)
    mean_error: float = _number(0.0)
    histogram: bool = False
    tolerance: float = _number(1e-10)
    refraction_tolerance: float = _number(1e-4 * ARCSEC, "positive")
    distortion_tolerance: float = _number(1e-10)
    movement_factor: float = _number(0.0, "finite")
    movement_time: float = option(0.0, -_DAYS, _DAYS)
    crossover: float = _number(0.0)
    interval: float = _number(0.005, "positive")
    extent: float = _number(0.1)
    comparator_angle: float | None = _number(None, "finite")
    distortion_first: float = _number(0.0, "finite")
    as_published: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if self.pre_run and not self.minimum_stars:
            raise InputError(phrase("error.requires", name="pre_run", other="minimum_stars"))
        if self.curves and self.extent > _STEPS * self.interval:
            raise InputError(
                phrase("stars.curve-steps", extent=self.extent, interval=self.interval, most=_STEPS)
            )

    @property
    def camera_kind(self) -> tuple[float | None, bool, bool]:
        """Camera type of the core: reference distance, Brown's decentring, common scale."""
        return (self.distortion_first or None, False, self.common_scale)


def default_parameters(principal_distance: float) -> Floats:
    """Return parameters (26,) of an undistorted camera that points to the zenith."""
    parameters = np.zeros(len(NAMES))
    parameters[[INDEX["cx"], INDEX["cy"]]] = principal_distance
    parameters[-4:] = TAU
    return parameters


@dataclass(frozen=True, eq=False)
class Axis(Checked):
    """Known external direction of the camera (option 2, equation 72).

    Attributes
    ----------
    azimuth
        Azimuth from south, positive west; radians.
    zenith_distance
        Zenith distance in radians, without refraction and aberration.
    xy
        (2,) plate coordinates of its image, metres.
    weight
        (2, 2) weight matrix of the plate coordinates.
    group
        0 pre, 1 post, 2 event.
    """

    azimuth: float
    zenith_distance: float
    xy: Floats
    weight: Floats
    group: int = 2

    @property
    def standard(self) -> tuple[float, float]:
        """Standard coordinates xi and eta."""
        tangent = np.tan(self.zenith_distance)
        return (-tangent * np.cos(self.azimuth), -tangent * np.sin(self.azimuth))


@dataclass(frozen=True, eq=False, repr=False)
class Problem(Brief):
    """Plate calibration of S stars and m images.

    Angles are in radians, lengths in metres. Weights are for one unit weight (m0^2 times the inverse
    covariance).

    Attributes
    ----------
    site
        Station of the camera.
    star_ids, star_places, star_weights
        (S,) numbers, (S, 2) apparent right ascension and declination, (S, 2, 2) weights: zero for unknown
        directions, infinite for fixed positions.
    image_points, image_stars, image_groups, image_xy, image_weights, image_times
        (m,) point numbers, (m,) star indices, (m,) groups: 0 pre, 1 post, 2 event. (m, 2) plate coordinates
        of the diapositive, (m, 2, 2) weights, (m,) local apparent sidereal time.
    initial
        (26,) parameters in the order of :data:`photogram.stellar.NAMES`.
    parameter_weights
        (26, 26) weights of the initial values.
    fixed
        (26,) whether parameters are fixed.
    axis
        Direction of the axis, if known.
    star_names
        (S,) catalogue numbers.
    options
        Options of the adjustment and computations.
    labels
        Header of a listing: title, problem, event, camera, plate and so on.
    """

    site: Site
    star_ids: tuple[str, ...]
    star_places: Floats = field(metadata=array("stars", 2, rule="finite"))
    star_weights: Floats = field(metadata=array("stars", 2, 2, rule="number"))
    image_points: tuple[str, ...]
    image_stars: Indices = field(metadata=array("images", index="stars"))
    image_groups: Indices = field(metadata=array("images", index="groups"))
    image_xy: Floats = field(metadata=array("images", 2, rule="finite"))
    image_weights: Floats = field(metadata=array("images", 2, 2, rule="finite"))
    image_times: Floats = field(metadata=array("images", rule="finite"))
    initial: Floats = field(metadata=array(len(NAMES), rule="finite"))
    parameter_weights: Floats = field(
        default_factory=lambda: np.zeros((len(NAMES), len(NAMES))),
        metadata=array(len(NAMES), len(NAMES), rule="finite"),
    )
    fixed: Bools = field(default_factory=lambda: np.zeros(len(NAMES), bool))
    axis: Axis | None = None
    star_names: tuple[str, ...] = ()
    options: Options = field(default_factory=Options)
    labels: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_fields(self)
        check_arrays(self, stars=len(self.star_ids), images=len(self.image_points), groups=3)
        shape = (len(NAMES),)
        require(self.fixed.shape == shape, "fixed", "shape", shape=shape, actual=self.fixed.shape)
        pairs = zip(self.image_points, self.image_stars, strict=True)
        points = [phrase("stars.point", point=point, star=self.star_ids[star]) for point, star in pairs]
        _refuse_indefinite(points, self.image_weights)
        weighted = np.flatnonzero(self.known & ~self.held)
        names = [phrase("stars.star", star=self.star_ids[i]) for i in weighted]
        _refuse_indefinite(names, self.star_weights[weighted])
        if self.axis is not None:
            _refuse_indefinite([phrase("stars.axis")], self.axis.weight[None])

    @property
    def known(self) -> Bools:
        """(S,) whether stars have a catalogue position."""
        return self.star_weights[:, 0, 0] > 0

    @property
    def held(self) -> Bools:
        """(S,) whether stars have a fixed position."""
        return np.isinf(self.star_weights[:, 0, 0])

    @property
    def weighted(self) -> Bools:
        """(26,) whether parameters are weighted."""
        return np.diag(self.parameter_weights) > 0

    def without(self, stars: Bools, images: Bools) -> Problem:
        """Return the problem without some stars and images, and stars without images."""
        keep_images = ~(images | stars[self.image_stars])
        keep = ~stars & np.isin(np.arange(len(self.star_ids)), self.image_stars[keep_images])
        place = np.cumsum(keep) - 1
        of_images = ("image_groups", "image_xy", "image_weights", "image_times")
        return replace(
            self,
            star_ids=_chosen(self.star_ids, keep),
            star_names=_chosen(self.star_names or self.star_ids, keep),
            star_places=self.star_places[keep],
            star_weights=self.star_weights[keep],
            image_points=_chosen(self.image_points, keep_images),
            image_stars=place[self.image_stars[keep_images]],
            **{name: getattr(self, name)[keep_images] for name in of_images},
        )

    def places_at(self, parameters: Floats, free: Bools) -> Floats:
        """Return (S, 2) catalogue positions, or directions of first images if unknown."""
        places = self.star_places.copy()
        stars, first = np.unique(self.image_stars, return_index=True)
        seen = ~self.known[stars]
        if seen.any():
            places[stars[seen]] = self.core(parameters, places, ~free).directions()[first[seen]]
        return places

    def core(self, parameters: Floats, places: Floats, fixed: Bools) -> _photocore.StellarProblem:
        """Return the problem of the core at given values."""
        axis, held = self.axis, self.held
        weighted = np.flatnonzero(self.weighted & ~fixed)
        return core_problem(
            self.site,
            self.options.camera_kind,
            parameters,
            fixed,
            prior=(
                weighted,
                self.initial[weighted],
                self.parameter_weights[np.ix_(weighted, weighted)],
                [NAMES[i] for i in weighted],
            ),
            places=places,
            catalogue=self.star_places,
            star_weights=np.where(held[:, None, None], 0.0, self.star_weights),
            star_fixed=held,
            image_stars=self.image_stars,
            image_pointings=self.image_groups,
            image_xy=self.image_xy,
            image_weights=self.image_weights,
            image_times=self.image_times,
            axis=None
            if axis is None
            else (axis.group, axis.standard, axis.xy.tolist(), axis.weight.tolist()),
        )


Prior = tuple[Indices, Floats, Floats, Sequence[str]]
"""Weighted parameters of the core: (k,) rows, values, (k, k) weights, names."""
NO_PRIOR: Prior = np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 0)), []


def core_problem(
    site: Site,
    camera: tuple[float | None, bool, bool] | tuple[str, bool],
    values: Floats,
    fixed: Bools,
    *,
    places: Floats,
    star_weights: Floats,
    star_fixed: Bools,
    image_stars: Indices,
    image_pointings: Indices,
    image_xy: Floats,
    image_weights: Floats,
    image_times: Floats,
    image_shifts: Floats | None = None,
    catalogue: Floats | None = None,
    prior: Prior = NO_PRIOR,
    axis: tuple[int, tuple[float, float], list[float], list[list[float]]] | None = None,
) -> _photocore.StellarProblem:
    """Return a problem of the core with three values per attitude and 17 common ones."""
    attitudes, (rows, prior_values, weights, names) = len(values) - len(COMMON), prior
    # Weights are scaled for P = R^T R, since parameter units differ.
    scale = np.sqrt(np.diag(weights))
    try:
        lower = np.linalg.cholesky(weights / np.outer(scale, scale))
    except np.linalg.LinAlgError:
        raise InputError(phrase("stars.indefinite", names=names)) from None
    return _photocore.StellarProblem(
        station=site.core,
        camera=camera,
        pointings=values[:attitudes].reshape(-1, 3),
        common=values[attitudes:],
        fixed=fixed.tolist(),
        weighted=rows,
        weighted_values=prior_values,
        weight_root=np.ascontiguousarray(lower.T * scale),
        star_places=places,
        star_catalogue=places if catalogue is None else catalogue,
        star_weights=star_weights,
        star_fixed=star_fixed.tolist(),
        image_stars=image_stars.astype(np.int64),
        image_pointings=image_pointings.astype(np.int64),
        image_xy=image_xy,
        image_weights=image_weights,
        image_times=image_times,
        image_shifts=np.zeros_like(image_xy) if image_shifts is None else image_shifts,
        axis=axis,
    )


def _refuse_indefinite(names: Sequence[Phrase], weights: Floats) -> None:
    first, cross, second = weights[:, 0, 0], weights[:, 0, 1], weights[:, 1, 1]
    definite = (first > 0) & (second - cross**2 / np.where(first > 0, first, 1.0) > 0)
    if not definite.all():
        raise InputError(
            phrase("stars.indefinite", names=[names[i] for i in np.flatnonzero(~definite).tolist()])
        )


def _chosen(names: tuple[str, ...], keep: Bools) -> tuple[str, ...]:
    return tuple(name for name, kept in zip(names, keep, strict=True) if kept)


@dataclass(frozen=True)
class Counts:
    plate_observations: int  # Plate coordinates, including the axis
    star_observations: int  # Catalogue coordinates with a weight
    parameter_observations: int  # Parameters with a weight
    parameter_unknowns: int
    star_unknowns: int
    constraints: int = 0  # Constraints of a combined solution

    @property
    def observations(self) -> int:
        return self.plate_observations + self.star_observations + self.parameter_observations

    @property
    def unknowns(self) -> int:
        return self.parameter_unknowns + self.star_unknowns

    @property
    def degrees_of_freedom(self) -> int:
        return self.observations + self.constraints - self.unknowns

    @property
    def usable(self) -> int:
        """Degrees of freedom, 1 for a unique solution."""
        return self.degrees_of_freedom or 1


def degrees_of_freedom(problem: Problem, free: Bools) -> Counts:
    """Count observations and unknowns for a set of free parameters.

    AdjustmentError: if there are fewer observations than unknowns (error 3).
    """
    free_stars = int((~problem.held).sum())
    counts = Counts(
        plate_observations=2 * len(problem.image_points) + 2 * (problem.axis is not None),
        star_observations=2 * int((problem.known & ~problem.held).sum()),
        parameter_observations=int((problem.weighted & free).sum()),
        parameter_unknowns=int(free.sum()),
        star_unknowns=2 * free_stars,
    )
    if counts.degrees_of_freedom < 0:
        raise AdjustmentError(
            phrase("stars.error-3", observations=counts.observations, unknowns=counts.unknowns)
        )
    return counts


def rejected(problem: Problem, stars: Collection[str], points: Collection[str]) -> Problem:
    """Return a problem without some stars and plate points, and stars without images.

    InputError: if a number is unknown.
    """
    for kind, names, known in (
        ("star", stars, problem.star_ids),
        ("plate point", points, problem.image_points),
    ):
        for name in sorted(names):
            require_name(kind, name, known)
    if not stars and not points:
        return problem
    left = problem.without(
        np.array([star in stars for star in problem.star_ids]),
        np.array([point in points for point in problem.image_points]),
    )
    lost = sorted(set(problem.star_ids) - set(left.star_ids) - set(stars))
    labels = dict(problem.labels)
    for name, values in (("rejected stars", sorted(stars)), ("rejected points", sorted(points))):
        if values:
            labels[name] = ", ".join(values)
    if lost:
        labels["stars eliminated, all images rejected"] = ", ".join(lost)
    return replace(left, labels=labels)


def singular(parameters: Sequence[int]) -> AdjustmentError:
    """Return error 4 of the report, with the names of the parameters."""
    return AdjustmentError(phrase("stars.error-4", names=[NAMES[i] for i in parameters]))


def failure(problem: Problem, error: _photocore.StellarError) -> AdjustmentError:
    """Return an error of the core with the names of stars or parameters."""
    kind, message, indices = error.args
    if kind == "undetermined":
        return singular(indices)
    codes = {"undetermined stars": "stars.error-2", "not finite": "stars.not-visible"}
    if kind not in codes:
        return failure_of_core(kind, message)
    return AdjustmentError(phrase(codes[kind], names=[problem.star_ids[i] for i in indices]))
