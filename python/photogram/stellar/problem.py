"""A calibration as it is known beforehand: stars, images, weights, counts, what is rejected."""

from __future__ import annotations

from collections.abc import Iterable, Set

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import listed
from photogram.show.summary import Brief
from photogram.stellar.options import Options
from photogram.stellar.parameters import INDEX, NAMES
from photogram.stellar.sky import TAU, Site

__all__ = [
    "Axis",
    "Counts",
    "Problem",
    "default_parameters",
    "degrees_of_freedom",
    "failure",
    "rejected",
    "singular",
]


def default_parameters(principal_distance: float) -> Floats:
    """Return parameters of an undistorted camera that looks at the zenith, (26,)."""
    parameters = np.zeros(len(NAMES))
    parameters[[INDEX["cx"], INDEX["cy"]]] = principal_distance
    parameters[-4:] = TAU
    return parameters


@dataclass(frozen=True, eq=False)
class Axis:
    """A direction of the camera known from outside (option 2, equation 72).

    Attributes
    ----------
    azimuth
        From south, positive west; radians.
    zenith_distance
        Radians, neither refracted nor aberrated.
    xy
        (2,) plate coordinates of its image, metres.
    weight
        (2, 2) weight matrix of these.
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
        """Xi and eta."""
        tangent = np.tan(self.zenith_distance)
        return (-tangent * np.cos(self.azimuth), -tangent * np.sin(self.azimuth))


@dataclass(frozen=True, eq=False, repr=False)
class Problem(Brief):
    """A calibration of S stars and m images.

    Angles are radians, lengths metres; weights are for one unit weight (m0^2 times the inverse covariance).

    Attributes
    ----------
    site
        Where the camera stands.
    star_ids, star_places, star_weights
        (S,) numbers, (S, 2) apparent right ascension and declination, (S, 2, 2) weights: zero for directions
        that are not known, infinite for places that are held.
    image_points, image_stars, image_groups, image_xy, image_weights, image_times
        (m,) point numbers, (m,) index of the star, (m,) 0 pre, 1 post, 2 event, (m, 2) plate coordinates of
        the diapositive, (m, 2, 2) weights, (m,) local apparent sidereal time.
    initial
        (26,) parameters in the order of :data:`photogram.stellar.NAMES`.
    parameter_weights
        (26, 26) weights of these values.
    fixed
        (26,) which parameters are held.
    axis
        Direction of the axis, if known.
    star_names
        (S,) catalogue numbers.
    options
        How to adjust and what to compute.
    labels
        What a listing says at its head: title, problem, event, camera, plate and so on.
    """

    site: Site
    star_ids: tuple[str, ...]
    star_places: Floats
    star_weights: Floats
    image_points: tuple[str, ...]
    image_stars: Indices
    image_groups: Indices
    image_xy: Floats
    image_weights: Floats
    image_times: Floats
    initial: Floats
    parameter_weights: Floats = field(default_factory=lambda: np.zeros((len(NAMES), len(NAMES))))
    fixed: Bools = field(default_factory=lambda: np.zeros(len(NAMES), bool))
    axis: Axis | None = None
    star_names: tuple[str, ...] = ()
    options: Options = field(default_factory=Options)
    labels: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        stars, images = len(self.star_ids), len(self.image_points)
        shapes = {
            "star_places": (stars, 2),
            "star_weights": (stars, 2, 2),
            "image_stars": (images,),
            "image_groups": (images,),
            "image_xy": (images, 2),
            "image_weights": (images, 2, 2),
            "image_times": (images,),
            "initial": (len(NAMES),),
            "parameter_weights": (len(NAMES), len(NAMES)),
            "fixed": (len(NAMES),),
        }
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array.shape != shape:
                raise InputError(f"{name} has the shape {array.shape}, not {shape}")
            if name not in ("star_weights", "fixed") and not np.isfinite(array).all():
                raise InputError(f"{name} holds what is not a number")
        if images and not (
            self.image_stars.min() >= 0
            and self.image_stars.max() < stars
            and set(self.image_groups) <= {0, 1, 2}
        ):
            raise InputError("an image names a star or a group that is not there")
        if np.isnan(self.star_weights).any():
            raise InputError("star_weights holds what is not a number")
        points = [
            f"point {point} of star {self.star_ids[star]}"
            for point, star in zip(self.image_points, self.image_stars, strict=True)
        ]
        _refuse_indefinite(points, self.image_weights)
        weighted = np.flatnonzero(self.known & ~self.held)
        _refuse_indefinite([f"star {self.star_ids[i]}" for i in weighted], self.star_weights[weighted])
        if self.axis is not None:
            _refuse_indefinite(["the axis"], self.axis.weight[None])

    @property
    def known(self) -> Bools:
        """(S,) which stars have a place of the catalogue."""
        return self.star_weights[:, 0, 0] > 0

    @property
    def held(self) -> Bools:
        """(S,) which stars are held at their places."""
        return np.isinf(self.star_weights[:, 0, 0])

    @property
    def weighted(self) -> Bools:
        """(26,) which parameters have weight."""
        return np.diag(self.parameter_weights) > 0

    def without(self, stars: Bools, images: Bools) -> Problem:
        """Return the problem without some stars and images, and without stars that have no image left."""
        keep_images = ~(images | stars[self.image_stars])
        keep = ~stars & np.isin(np.arange(len(self.star_ids)), self.image_stars[keep_images])
        place = np.cumsum(keep) - 1
        names = self.star_names or self.star_ids
        return replace(
            self,
            star_ids=_chosen(self.star_ids, keep),
            star_names=_chosen(names, keep),
            star_places=self.star_places[keep],
            star_weights=self.star_weights[keep],
            image_points=_chosen(self.image_points, keep_images),
            image_stars=place[self.image_stars[keep_images]],
            image_groups=self.image_groups[keep_images],
            image_xy=self.image_xy[keep_images],
            image_weights=self.image_weights[keep_images],
            image_times=self.image_times[keep_images],
        )

    def places_at(self, parameters: Floats, free: Bools) -> Floats:
        """Return (S, 2) catalogue places; of directions that are not known those of their first images."""
        places = self.star_places.copy()
        stars, first = np.unique(self.image_stars, return_index=True)
        seen = ~self.known[stars]
        if seen.any():
            places[stars[seen]] = self.core(parameters, places, ~free).directions()[first[seen]]
        return places

    def core(self, parameters: Floats, places: Floats, fixed: Bools) -> _photocore.StellarProblem:
        """Return the problem as the core takes it, at given values."""
        weighted = np.flatnonzero(self.weighted & ~fixed)
        block = self.parameter_weights[np.ix_(weighted, weighted)]
        held = self.held
        weights = np.where(held[:, None, None], 0.0, self.star_weights)
        return _photocore.StellarProblem(
            station=self.site.core,
            camera=self.options.camera_kind,
            pointings=parameters[:9].reshape(3, 3),
            common=parameters[9:],
            fixed=fixed.tolist(),
            weighted=weighted.astype(np.int64),
            weighted_values=self.initial[weighted],
            weight_root=weight_root(block, [NAMES[i] for i in weighted]),
            star_places=places,
            star_catalogue=self.star_places,
            star_weights=weights,
            star_fixed=held.tolist(),
            image_stars=self.image_stars,
            image_pointings=self.image_groups,
            image_xy=self.image_xy,
            image_weights=self.image_weights,
            image_times=self.image_times,
            image_shifts=np.zeros_like(self.image_xy),
            axis=None
            if self.axis is None
            else (self.axis.group, self.axis.standard, self.axis.xy.tolist(), self.axis.weight.tolist()),
        )


def weight_root(weights: Floats, names: list[str]) -> Floats:
    """Return R of P = R^T R, scaled on the way because parameters differ by many orders of magnitude."""
    scale = np.sqrt(np.diag(weights))
    try:
        lower = np.linalg.cholesky(weights / np.outer(scale, scale))
    except np.linalg.LinAlgError:
        raise InputError(f"the weight matrix of {', '.join(names)} is not positive definite") from None
    return np.ascontiguousarray(lower.T * scale)


def _refuse_indefinite(names: list[str], weights: Floats) -> None:
    first, cross, second = weights[:, 0, 0], weights[:, 0, 1], weights[:, 1, 1]
    definite = (first > 0) & (second - cross**2 / np.where(first > 0, first, 1.0) > 0)
    if not definite.all():
        named = listed([names[i] for i in np.flatnonzero(~definite)])
        raise InputError(f"the weight matrix of {named} is not positive definite")


def _chosen(names: tuple[str, ...], keep: Bools) -> tuple[str, ...]:
    return tuple(name for name, kept in zip(names, keep, strict=True) if kept)


@dataclass(frozen=True)
class Counts:
    """What an adjustment counts."""

    # Plate coordinates with those of the axis; catalogue coordinates that have weight; parameters that
    # have weight
    plate_observations: int
    star_observations: int
    parameter_observations: int
    parameter_unknowns: int  # What is estimated
    star_unknowns: int
    constraints: int = 0  # Of a combined solution

    @property
    def observations(self) -> int:
        """All together."""
        return self.plate_observations + self.star_observations + self.parameter_observations

    @property
    def unknowns(self) -> int:
        """All together."""
        return self.parameter_unknowns + self.star_unknowns

    @property
    def degrees_of_freedom(self) -> int:
        """Observations and constraints minus unknowns."""
        return self.observations + self.constraints - self.unknowns

    @property
    def usable(self) -> int:
        """Degrees of freedom, 1 where the solution is unique."""
        return self.degrees_of_freedom or 1


def degrees_of_freedom(problem: Problem, free: Bools) -> Counts:
    """Count observations and unknowns where the given parameters are estimated.

    Raises
    ------
    AdjustmentError
        There are fewer observations than unknowns (error 3).
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
            f"ERROR 3: not enough observations: {counts.observations} for {counts.unknowns} unknowns"
        )
    return counts


def rejected(problem: Problem, stars: Set[str], points: Set[str]) -> Problem:
    """Return a problem without the named stars and plate points; a star that loses all its images goes, too.

    Raises
    ------
    InputError
        A number that is not there.
    """
    missing = sorted(set(stars) - set(problem.star_ids)) + sorted(set(points) - set(problem.image_points))
    if missing:
        raise InputError(f"rejected but not there: {', '.join(missing)}")
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


def singular(parameters: Iterable[int]) -> AdjustmentError:
    """Return error 4 of the report, with the names of the parameters."""
    names = ", ".join(NAMES[i] for i in parameters)
    return AdjustmentError(
        f"ERROR 4: no inverse for the reduced normal equations: the stars do not determine {names}"
    )


def failure(problem: Problem, error: _photocore.StellarError) -> AdjustmentError:
    """Say which stars or parameters of a problem an error of the core tells of."""
    kind, message, indices = error.args
    if kind == "undetermined":
        return singular(indices)
    stars = [problem.star_ids[i] for i in indices]
    if kind == "undetermined stars":
        return AdjustmentError(f"ERROR 2: no inverse for the submatrix of star {', '.join(stars)}")
    if kind == "not finite":
        return AdjustmentError(f"below the horizon or behind the camera: star {listed(stars)}")
    return AdjustmentError(message)
