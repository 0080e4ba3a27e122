"""Parts of results: iterations, sums by type, observations, cameras, and common unknowns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import freeze_fields, standard_deviations
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.observations import Observation
from photogram.network.unknowns import Unknown
from photogram.summaries import Brief
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import _photocore
    from photogram.show.quantity import Axis, Quantity


@dataclass(frozen=True)
class Iteration:
    """One iteration.

    Attributes
    ----------
    number
        From 1.
    weighted_sum_of_squares
        After its corrections.
    largest_change
        No unknown changed by more than this multiple of its standard deviation (a priori unit weight).
    damping
        Levenberg-Marquardt damping of its step; 0 for a Gauss-Newton step.
    """

    number: int
    weighted_sum_of_squares: float
    largest_change: float
    damping: float


@dataclass(frozen=True)
class SumsByKind:
    """Weighted sums of squares, or sums of redundancy numbers."""

    # Weighted positions and attitudes of the photos, and weighted parameters of cameras
    camera: float
    ground: float  # Weighted and fixed components of control
    plates: float  # Image coordinates
    observations: float = 0.0  # Additional observations

    @property
    def measured(self) -> float:
        """The sum without photos."""
        return self.ground + self.plates + self.observations

    @property
    def total(self) -> float:
        return self.camera + self.ground + self.plates + self.observations


@dataclass(frozen=True, eq=False)
class Observed:
    """Observations of one type, each with k components."""

    rows: Indices  # (r,) their points or photos
    residuals: Floats  # (r, k) observed minus adjusted; 0 if fixed, NaN if not observed
    sd: Floats  # (r, k) standard deviations: 0 if fixed, infinite if not observed
    # (r, k) redundancy numbers, and residual / (sd x root of redundancy number)
    redundancy: Floats
    standardized: Floats

    @property
    def differences(self) -> Floats:
        """(r, k) adjusted minus given: residuals with the sign of check points."""
        return 0.0 - self.residuals


@dataclass(frozen=True, eq=False)
class ObservedKind:
    """The k additional observations of one type, with r components each.

    Unobserved components and observations of excluded points are NaN. Arrays are read-only.
    """

    kind: str
    rows: Indices  # (k,) their indices in the block
    names: list[str]  # names of the observed items
    # components, units: Names and units of the r components: the linear unit of the object space, or radians
    components: tuple[str, ...]
    units: tuple[str, ...]
    sd: Floats  # (k, r) standard deviations a priori
    residuals: Floats  # (k, r) observed minus computed
    # (k, r) redundancy numbers; single ones may leave 0 to 1 where components are correlated
    redundancy: Floats
    # (k, r) standardized residuals, a priori unit weight: with W the inverse of the covariance matrix S of an
    # observation, `(W v)_i / sqrt((W Qvv W)_ii)`, which without correlations is Baarda's w; NaN without
    # redundancy
    standardized: Floats
    squares: Floats  # (k,) v' W v, weights after the loss
    weights: Floats  # (k,) weight factors by the loss; 1 without a loss

    def __post_init__(self) -> None:
        freeze_fields(self)

    @property
    def used(self) -> int:
        """The number of used observations."""
        return int(np.isfinite(self.squares).sum())

    @property
    def sum_of_squares(self) -> float:
        """The weighted sum of squares of used observations."""
        return float(np.nansum(self.squares))


def observed_kinds(block: Block, solution: _photocore.BlockSolution) -> dict[str, ObservedKind]:
    """Return the adjusted observations of a block by the names of their types."""
    counts, values, sums = solution.adjusted_observations
    all_columns = block.observations.columns
    starts = np.cumsum([0, *(len(columns.rows) for columns in all_columns)])
    ends = np.concatenate([[0], np.cumsum(counts)])[starts]
    parts: dict[str, list[tuple[Observation, Indices, list[str], tuple[Floats, ...]]]] = {}
    for columns, (start, stop), (begin, end) in zip(
        all_columns, pairwise(starts), pairwise(ends), strict=True
    ):
        first, rows = columns.first, columns.rows
        observed = np.ones((len(rows), len(first.components(geographic=block.geographic))), dtype=bool)
        if first.MISSING:
            observed = ~np.isnan(columns.table["observed"])
        tables = np.full((3, *observed.shape), np.nan)
        tables[:, observed & (counts[start:stop, np.newaxis] > 0)] = values[:, begin:end]
        variances = np.diagonal(np.asarray(columns.table["precision"]), axis1=1, axis2=2)
        sd = np.sqrt(np.where(observed, variances, np.nan))
        parts.setdefault(columns.label, []).append(
            (first, rows, columns.names, (sd, *tables, *sums[:, start:stop]))
        )
    kinds = {}
    for kind, groups in parts.items():  # Groups of one type have different numbers of unknowns
        first = groups[0][0]
        every = np.concatenate([own for _, own, *_ in groups])
        names = [name for *_, own, _ in groups for name in own]
        order = np.argsort(every, kind="stable")
        arrays = zip(*(own for *_, own in groups), strict=True)
        kinds[kind] = ObservedKind(
            kind,
            every[order],
            [names[place] for place in order.tolist()],
            first.components(geographic=block.geographic),
            first.units(block.linear_unit),
            *(np.concatenate(each)[order] for each in arrays),
        )
    return kinds


def named_observation(kind: str, of: str) -> Phrase:
    """Return the name of an observation: type, and points, photos or unknowns."""
    return Phrase("named.observation", {"one": kind_words(kind), "of": of})


def kind_words(kind: str) -> list[Phrase]:
    """Return the words of a single observation of a type, such as `prior, lever arm`."""
    return [Phrase(f"kind.{each}", {"n": 1}) for each in kind.split(", ")]


def parts_of(components: Iterable[str], name: Phrase) -> Phrase:
    """Return the name of some components of an observation."""
    return Phrase("named.parts", {"axes": [Phrase(f"axis.{each}") for each in components], "named": name})


@dataclass(frozen=True, eq=False)
class Terms:
    """Names, axes and units of the photos, points and images of a network."""

    photos: np.ndarray  # (P,), (n,) names, or numbers from 0
    points: np.ndarray
    photo_axes: tuple[Axis, ...]  # Unknowns of a photo, coordinates of a point, image coordinates
    point_axes: tuple[Axis, ...]
    image_axes: tuple[Axis, ...]
    photo_values: Floats  # (P, k) adjusted unknowns
    # Unknowns of a photo: their name in texts, and their member in JSON documents
    layers: Mapping[str, slice]
    parts: Mapping[str, slice]
    of_photos: tuple[Quantity, ...] = ()  # First columns of the tables of photos and points
    of_points: tuple[Quantity, ...] = ()
    kinds: Iterable[ObservedKind] = ()  # Additional observations
    # (o,) rows of these in the block, in the order of the core
    observation_rows: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    lengths: Floats | None = None  # (3,) length units of coordinates if plan coordinates are angles
    linear_unit: str = ""
    split: bool = False  # Whether JSON documents separate differences of positions and attitudes

    @property
    def identity(self) -> str:
        """The member of JSON documents for the name or number of an item."""
        return "number" if self.points.dtype.kind == "i" else "id"


_ARRAYS = ("change", "position", "attitude", "cofactors", "covariance", "with_former", "redundancy")


@dataclass(frozen=True, eq=False)
class AdjustedUnknown:
    """An adjusted common unknown with k components. Arrays are read-only."""

    given: Unknown
    # (k,) names and units: the linear unit, the linear unit a second, radians, radians a
    # second, seconds, or nothing
    components: tuple[str, ...]
    units: tuple[str, ...]
    # (k,) adjusted minus given; of rotations the rotation vector r about the given axes, R = R0
    # Exp(r)
    change: Floats
    # (3,) adjusted: l, s, d, (m, k, 0) of an instrument, c of a sensor, a coefficient of a trajectory, a
    # gyroscope's bias, (d, 0, 0) of a clock, (T, 0, 0) of a readout time or a factor of line rates; of
    # levels, planes and lines a position on them
    position: Floats
    # (3, 3) adjusted: the axes of a boresight, sensor, line or plane (the third along it, or its normal)
    attitude: Floats
    # (k, k) for a priori unit weight, of rotations about the adjusted axes and a line's position along these;
    # zero for fixed ones, NaN without covariances
    cofactors: Floats
    covariance: Floats  # (k, k) cofactors times the variance of unit weight
    # (k, j) cofactors with the unknown before it if both are adjusted as one: the size of a film with its
    # placement; j is 0 for all others
    with_former: Floats
    redundancy: Floats  # (k,) redundancy numbers of weighted components as observations; 0 unless weighted
    observations: int  # Number of its observations, and of its images of photos on frames or trajectories

    def __post_init__(self) -> None:
        # There may be four times as many as photos: their fields are not searched in each.
        for name in _ARRAYS:
            getattr(self, name).flags.writeable = False

    @property
    def name(self) -> str:
        return self.given.name

    @property
    def kind(self) -> str:
        return self.given.KIND

    @property
    def sd(self) -> Floats:
        """(k,) standard deviations; 0 if fixed."""
        return np.asarray(standard_deviations(self.covariance[np.newaxis])[0])

    @property
    def values(self) -> Floats:
        """(k,) its components of `position`, or else `change`."""
        values = self.position[self.given._VALUES][: len(self.change)]
        return np.append(values, self.change[len(values) :])

    @property
    def standardized(self) -> Floats:
        """(k,) given minus adjusted, over its standard deviation; NaN unless weighted."""
        sd = self.given.deviations
        tested = (sd > 0) & np.isfinite(sd) & (self.redundancy > 0)
        found = np.full(len(sd), np.nan)
        found[tested] = -self.change[tested] / (sd[tested] * np.sqrt(self.redundancy[tested]))
        return found


def adjusted_unknowns(
    block: Block, solution: _photocore.BlockSolution, scale: float
) -> tuple[AdjustedUnknown, ...]:
    found = []
    # Factors of line rates have the type of readout times, but are plain numbers.
    factors = {id(each.rate) for each in block.timed if each.rate is not None}
    for given, row in zip(block.unknowns, solution.adjusted_unknowns, strict=True):
        change, position, attitude, cofactors, with_former, redundancy, observations = row
        k = len(change)
        matrix = np.array(cofactors).reshape(k, k)
        plain = id(given) in factors
        names, units = (("factor",), ("",)) if plain else (given.components, given.units(block.linear_unit))
        former = np.array(with_former).reshape(k, len(with_former) // k)
        values = np.array(change), np.array(position), np.array(attitude).reshape(3, 3)
        precision = matrix, matrix * scale, former, np.array(redundancy)
        found.append(AdjustedUnknown(given, names, units, *values, *precision, observations))
    return tuple(found)


@dataclass(frozen=True, eq=False, repr=False)
class AdjustedCamera(Brief):
    """A camera with k parameters after the adjustment; arrays are read-only."""

    name: str
    given: Camera  # initial values, observed if weighted
    camera: Camera  # with the adjusted parameters
    cofactors: Floats  # (k, k) for a priori unit weight; zero for fixed parameters, NaN without covariances
    covariance: Floats  # (k, k) cofactors times the variance of unit weight
    redundancy: Floats  # (k,) redundancy numbers of weighted parameters; 0 for others
    # (k,) diagonal of the normal equations, weights counted: reciprocal cofactors that the parameters would
    # have if all other unknowns were known; 0 for fixed ones
    information: Floats
    photos: int  # numbers of its photos, and of their images in the adjustment
    images: int

    def __post_init__(self) -> None:
        freeze_fields(self)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.camera.names

    @property
    def values(self) -> Floats:
        """(k,) adjusted parameters."""
        return self.camera.values

    @property
    def sd(self) -> Floats:
        """(k,) standard deviations of the parameters; 0 if fixed."""
        return np.asarray(standard_deviations(self.covariance[np.newaxis])[0])

    @property
    def correlations(self) -> Floats:
        """(k, k) correlation coefficients; NaN for fixed parameters."""
        sd = np.sqrt(np.diag(self.cofactors))
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self.cofactors / np.outer(sd, sd))

    @property
    def estimated(self) -> list[int]:
        """Indices of free and weighted parameters."""
        return np.flatnonzero(self.given.deviations > 0).tolist()

    @property
    def weighted(self) -> list[int]:
        """Indices of weighted parameters."""
        sd = self.given.deviations
        return np.flatnonzero((sd > 0) & np.isfinite(sd)).tolist()

    def observed(self) -> Camera:
        """Return the camera as an observation of estimated parameters with covariances.

        Raises
        ------
        InputError
            If its knots were estimated: a camera cannot store their covariance.
        """
        if self.given.knot_unknowns:
            raise InputError(phrase("adjusted.knots", camera=self.name))
        rows = self.estimated
        names = [self.names[k] for k in rows]
        covariance = (names, self.covariance[np.ix_(rows, rows)]) if names else None
        return self.camera.replace(sd=0.0, covariance=covariance)

    def restarted(self) -> Camera:
        """Return the given camera with adjusted values of free parameters."""
        found = np.where(np.isinf(self.given.deviations), self.values, self.given.values)
        parameters = dict(zip(self.names, found.tolist(), strict=True))
        return self.given.replace(parameters=parameters, knots=self.camera.knots)

    def value(self, name: str) -> float:
        """Return an adjusted parameter."""
        return self.camera.parameters[name]

    def deviation(self, name: str) -> float:
        """Return the standard deviation of a parameter."""
        return float(self.sd[self.names.index(name)])


def adjusted_cameras(
    block: Block, solution: _photocore.BlockSolution, scale: float
) -> tuple[AdjustedCamera, ...]:
    """Return adjusted cameras with scaled covariances; none for principal distances."""
    if not block.cameras:
        return ()
    found = []
    knots = dict[int, Floats]()  # (ny, nx, 2) adjusted knots by `id` of the camera
    if moving := [each for each in block.cameras if each.knots is not None and each.knot_unknowns]:
        places = [position for _, position, *_ in solution.adjusted_unknowns]
        rows = {id(each): row for row, each in enumerate(block.unknowns)}
        for each in moving:
            of_camera = np.array([places[rows[id(knot)]][:2] for knot in each.knot_unknowns])
            knots[id(each)] = of_camera.reshape(np.asarray(each.knots).shape)
    for name, given, row in zip(block.camera_names, block.cameras, solution.cameras, strict=True):
        parameters, cofactors, redundancy, information, photos, images = row
        k = len(parameters)
        matrix = np.array(cofactors).reshape(k, k)
        values = dict(zip(given.names, parameters, strict=True))
        camera = given.replace(parameters=values, knots=knots.get(id(given), given.knots))
        numbers = np.array(redundancy), np.array(information), photos, images
        found.append(AdjustedCamera(name, given, camera, matrix, matrix * scale, *numbers))
    return tuple(found)
