"""Recorded comparator readings and their pointing precision, cases and sessions."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from heapq import heappop, heappush
from pathlib import Path

import numpy as np

from photogram.arguments.arrays import by_key
from photogram.arguments.types import Floats, Indices
from photogram.comparator.grid import Grid
from photogram.errors import InputError
from photogram.io.places import Place as Place
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message, unknown_name
from photogram.summaries import Brief
from photogram.words import Phrase, phrase

# A larger distance from the other readings of a point indicates another point or unit
FURTHEST_UM = 1000.0


LARGEST_UM = 1e8  # A hundred metres: larger coordinates are invalid, and their powers would overflow


CENTRE_UM = 125_000.0  # Centre of the range of most comparators (TRANS)
# Centres of the program's comparators with other ranges: STK1, PSK, other
CENTRES_UM = {10: 1_000_000.0, 11: 1_500_000.0, 12: 300_000.0, 13: 300_000.0, 14: 1_000_000.0}


@dataclasses.dataclass(frozen=True, slots=True)
class Reading:
    """Single pointing.

    Attributes
    ----------
    plate, case, operator
        Numbers; plate 0 is the only plate of the session.
    leg
        0: intersection of the lines. 1 to 4: a leg of the cross, with 1 opposite to 3.
    point
        Number of the grid point.
    xy_um
        Coordinates in micrometres.
    place
        Location of the record in the file.
    """

    plate: int
    case: int
    operator: int
    leg: int
    point: int
    xy_um: tuple[float, float]
    place: Place


@dataclass(frozen=True, eq=False)
class Case:
    """All pointings of one operator on a plate in one placement, in measured order.

    Attributes
    ----------
    number, operator, plate
        Numbers.
    points, legs
        (n,) point and leg (0: intersection) of each pointing.
    xy_um
        (n, 2) comparator coordinates in micrometres.
    places
        Location of each record in the file.
    """

    number: int
    operator: int
    plate: int
    points: Indices
    legs: Indices
    xy_um: Floats
    places: tuple[Place, ...]

    @property
    def place(self) -> Place:
        """Location of its first pointing in the file."""
        return self.places[0]

    def check(self, grid: Grid) -> None:
        """Reject points missing on the plate, and readings far from the others of a point.

        Raises
        ------
        InputError
            If a reading is invalid. The message locates the first one.
        """
        if not len(self.points) == len(self.legs) == len(self.xy_um) == len(self.places):
            lengths = [len(self.points), len(self.legs), len(self.xy_um), len(self.places)]
            raise InputError(phrase("comparators.lengths", case=self.number, lengths=lengths))
        largest = np.abs(self.xy_um).max(axis=1, initial=0.0)
        for code, bad in (
            ("error.finite", ~np.isfinite(largest)),
            ("error.most", largest > LARGEST_UM),
        ):
            if bad.any():
                at = int(np.argmax(bad))
                name = phrase("comparators.point", case=self.number, point=int(self.points[at]))
                message = phrase(code, value=float(largest[at]), high=LARGEST_UM)
                raise self.places[at].error(phrase("error.at", what=name, message=message))
        known = np.isin(self.points, grid.points)
        if not known.all():
            at = int(np.argmin(known))
            fields = {"plate": grid.number, "point": int(self.points[at])}
            raise self.places[at].error(phrase("comparators.no-point", **fields))
        rows = np.flatnonzero(self.legs == 0)
        _, group = np.unique(self.points[rows], return_inverse=True)
        away = np.abs(self.xy_um[rows] - _medians(group, self.xy_um[rows])[group]).max(axis=1)
        if away.max(initial=0.0) > FURTHEST_UM:
            at = int(rows[away.argmax()])
            fields = {"case": self.number, "point": int(self.points[at])}
            raise self.places[at].error(
                phrase("comparators.far-reading", distance=float(away.max()), **fields)
            )


def _medians(groups: Indices, values: Floats) -> Floats:
    counts = np.bincount(groups)
    first = np.cumsum(counts) - counts
    medians = np.empty((len(counts), values.shape[1]))
    for axis, column in enumerate(values.T):
        ordered = column[np.lexsort((column, groups))]
        medians[:, axis] = (ordered[first + (counts - 1) // 2] + ordered[first + counts // 2]) / 2
    return medians


@dataclass(frozen=True, eq=False, repr=False)
class Session(Brief):
    """All measurements of one calibration of one comparator.

    Attributes
    ----------
    cases
        The cases, in the order measured.
    grids
        The plates by their numbers.
    comparator
        Comparator number; `secondary` for the right stage of a stereocomparator.
    date
        Date of measurement, as text.
    left_handed
        Whether the comparator is left-handed relative to the plate; None if not specified. The measurements
        determine the handedness; a contradiction is an error.
    sorted_input, least_count_one_micrometre
        Options of the header that the title page prints.
    plot_each_case
        Whether to produce correction tables and plots of every case.
    range_centre_um
        Centre of the comparator range in x and in y (TRANS of the listing); None: default of the program for
        this comparator.
    temperature_c
        Plate temperature during the measurement, degrees Celsius; None if unknown.
    source
        File of the first record.
    messages
        Warnings of the reader.
    """

    cases: tuple[Case, ...]
    grids: Mapping[int, Grid]
    comparator: int = 0
    secondary: bool = False
    date: str = ""
    left_handed: bool | None = None
    sorted_input: bool = False
    least_count_one_micrometre: bool = True
    plot_each_case: bool = False
    range_centre_um: float | None = None
    source: Path | None = None
    temperature_c: float | None = None
    messages: list[Message] = field(default_factory=list)

    @property
    def centre_um(self) -> float:
        """Centre of the comparator range in x and y, for the table of corrections."""
        if self.range_centre_um is not None:
            return self.range_centre_um
        if self.secondary or (self.comparator == 11 and self.least_count_one_micrometre):
            return CENTRES_UM[10]
        return CENTRES_UM.get(self.comparator, CENTRE_UM)

    def grid_of(self, case: Case) -> Grid:
        """Return the plate of a case.

        Raises
        ------
        InputError
            If the plate number is unknown.
        """
        if case.plate not in self.grids:
            raise case.place.error(unknown_name("plate", str(case.plate), map(str, self.grids)))
        return self.grids[case.plate]

    def expanded(self) -> Session:
        """Return the session with plates at measuring temperature, and warnings."""
        t, grids, remarks = self.temperature_c, dict(self.grids), []
        for number, grid in self.grids.items():
            known = grid.temperature_c is not None and grid.expansion_per_k is not None
            if known and t is not None:
                grids[number] = grid.at(t)
            elif t is not None or grid.expansion_per_k:
                missing = (
                    "temperature_c of the measurements" if known else "its temperature_c or expansion_per_k"
                )
                remarks.append(Message(phrase("comparators.expansion", plate=number, missing=missing)))
        return replace(self, grids=grids, messages=[*self.messages, *remarks])

    def check(self) -> None:
        """Reject an inconsistent session.

        Raises
        ------
        InputError
            If cases are missing or repeated, if a plate or point is unknown, or if readings are far from the
            others of their point.
        """
        if not self.cases:
            raise InputError(phrase("error.empty-file", content="measurements"), file=self.source)
        first: dict[int, Case] = {}
        for case in self.cases:
            if case.number in first:
                raise case.place.error(_repeated(case.number, first[case.number].place))
            first[case.number] = case
            case.check(self.grid_of(case))


def _repeated(case: int, first: Place) -> Phrase:
    if first.record is None:
        return phrase("error.repeated", kind="case", name=str(case))
    return phrase("comparators.repeated-case", case=case, record=first.record, file=str(first.file))


def collect_cases(readings: Iterable[Reading]) -> tuple[Case, ...]:
    """Combine consecutive readings with one case number.

    Raises
    ------
    InputError
        If a case resumes after another one (it was measured twice), or if its plate or operator changes.
    """
    runs: dict[int, list[Reading]] = {}
    last: int | None = None
    for reading in readings:
        if reading.case != last and reading.case in runs:
            raise reading.place.error(_repeated(reading.case, runs[reading.case][0].place))
        last = reading.case
        run = runs.setdefault(reading.case, [reading])
        for what in ("plate", "operator"):
            before, now = getattr(run[0], what), getattr(reading, what)
            if before != now:
                fields = {"case": reading.case, "what": what, "first": before, "second": now}
                raise reading.place.error(phrase("comparators.changes", **fields))
        if reading is not run[0]:
            run.append(reading)
    return tuple(
        Case(
            number=run[0].case,
            operator=run[0].operator,
            plate=run[0].plate,
            points=np.array([reading.point for reading in run]),
            legs=np.array([reading.leg for reading in run]),
            xy_um=np.array([reading.xy_um for reading in run]),
            places=tuple(reading.place for reading in run),
        )
        for run in runs.values()
    )


def group(points: Indices) -> Indices:
    """Return the order of readings grouped by point, otherwise as measured."""
    _, first, inverse = np.unique(points, return_index=True, return_inverse=True)
    order: Indices = np.argsort(first[inverse], kind="stable")
    return order


def rows_by_point(points: Indices) -> list[tuple[int, Indices]]:
    order = group(points)
    starts = np.flatnonzero(np.diff(points[order])) + 1
    rows = np.split(order, starts) if len(points) else []
    return list(zip(points[order[np.r_[0, starts]]].tolist() if rows else [], rows, strict=True))


def group_as_listed(points: Indices) -> Indices:
    order = list(range(len(points)))
    numbers = points.tolist()
    # Positions of the readings of each point; those before `start` were moved.
    places = by_key((number, place) for place, number in enumerate(numbers))
    start = 0
    while start < len(order):
        own, end = places[numbers[start]], start
        while own:
            later = heappop(own)
            if later < start:
                continue
            if later > end:
                heappush(places[numbers[end]], later)
                order[end], order[later] = order[later], order[end]
                numbers[end], numbers[later] = numbers[later], numbers[end]
            end += 1
        start = end
    return np.array(order, dtype=np.int64)


# Multiples of the semi-axes for percentages of confidence (report; the program draws 39)
CONFIDENCE_FACTORS = {39: 1.00, 50: 1.18, 95: 2.45, 99: 3.03}


@dataclass(frozen=True)
class Ellipse:
    """Error ellipse: semi-axes (um) and angle of the major axis from +x to +y (rad)."""

    major_um: float
    minor_um: float
    angle_rad: float

    @classmethod
    def of(cls, variance_x: float, variance_y: float, covariance: float) -> Ellipse:
        """Return the ellipse of a covariance matrix; at 45 degrees for equal variances."""
        width = math.hypot(variance_x - variance_y, 2 * covariance)
        total = variance_x + variance_y
        angle = (
            math.copysign(math.pi / 4, covariance)
            if variance_x == variance_y
            else 0.5 * math.atan2(2 * covariance, variance_x - variance_y)
        )
        return cls(math.sqrt((total + width) / 2), math.sqrt(max(0.0, (total - width) / 2)), angle)


@dataclass(frozen=True)
class Precision:
    """Variances of single readings, pooled over one or more points."""

    readings: int  # Number of readings
    points: int
    degrees_of_freedom: int  # Readings minus means
    variance_um2: tuple[float, float]  # of a single reading in x and y; NaN without degrees of freedom
    covariance_um2: float  # Covariance of x and y of a single reading
    mean_variance_um2: tuple[float, float]  # of the mean of a point (equations 4 and 22)

    @property
    def sd_um(self) -> tuple[float, float]:
        """Standard deviations of a single reading in x and in y."""
        x, y = self.variance_um2
        return math.sqrt(x), math.sqrt(y)

    @property
    def sd_point_um(self) -> float:
        """Root mean square of both (equation 3)."""
        return math.sqrt(sum(self.variance_um2) / 2)

    @property
    def mean_sd_um(self) -> tuple[float, float]:
        """Standard deviations of a mean in x and in y."""
        x, y = self.mean_variance_um2
        return math.sqrt(x), math.sqrt(y)

    @property
    def mean_sd_point_um(self) -> float:
        """Root mean square of both (equation 5)."""
        return math.sqrt(sum(self.mean_variance_um2) / 2)

    @property
    def correlation(self) -> float:
        """Correlation of x and y (equation 7); NaN if one of them is constant."""
        product = math.prod(self.sd_um)
        return self.covariance_um2 / product if product > 0 else math.nan

    @property
    def listed_correlation_percent(self) -> float:
        """Percentage of the listing: 100 if one coordinate is constant, 0 if both are."""
        x, y = self.variance_um2
        if x > 0 and y > 0:
            return 100 * self.correlation
        return 100.0 if x > 0 or y > 0 else 0.0

    @property
    def ellipse(self) -> Ellipse:
        """Error ellipse of a single reading (39 percent)."""
        return Ellipse.of(*self.variance_um2, self.covariance_um2)


@dataclass(frozen=True, eq=False)
class PointReadings:
    point: int  # Point number; number of readings
    count: int
    mean_um: Floats = field(repr=False)  # (2,) mean (equation 1)
    squares_um2: tuple[float, float]  # Sums of (x - mean)^2 and (y - mean)^2
    products_um2: float  # Sum of (x - mean)(y - mean)

    @property
    def identical(self) -> bool:
        return self.count > 1 and self.squares_um2 == (0.0, 0.0)

    @property
    def precision(self) -> Precision:
        """Equations 2 to 7; zero for a single reading, as in the listing."""
        if self.count == 1:
            return Precision(1, 1, 0, (0.0, 0.0), 0.0, (0.0, 0.0))
        return pool([self])


def read_points(points: Indices, xy_um: Floats) -> list[PointReadings]:
    """Summarise readings by point, in the order of their first reading."""
    order = group(points)
    starts = np.flatnonzero(np.diff(points[order], prepend=points[order[:1]] - 1))
    counts = np.diff([*starts, len(points)])
    first = xy_um[order[starts]]
    offsets = xy_um[order] - np.repeat(first, counts, axis=0)
    shifts = np.add.reduceat(offsets, starts) / counts[:, np.newaxis]
    deviations = offsets - np.repeat(shifts, counts, axis=0)
    squares = np.add.reduceat(deviations**2, starts)
    products = np.add.reduceat(deviations.prod(axis=1), starts)
    return [
        PointReadings(point, count, mean, (square_x, square_y), product)
        for point, count, mean, (square_x, square_y), product in zip(
            points[order[starts]].tolist(),
            counts.tolist(),
            first + shifts,
            squares.tolist(),
            products.tolist(),
            strict=True,
        )
    ]


def pool(readings: Sequence[PointReadings], *, means: int | None = None) -> Precision:
    """Pool points of one or more cases (equations 13, 22, 23; 28, 30, 31).

    Each variance is weighted by its degrees of freedom: sums of squares over readings minus `means`, the
    number of all means by default.
    """
    total = sum(point.count for point in readings)
    dof = total - (len(readings) if means is None else means)

    def mean(values: Iterable[float]) -> float:
        return math.fsum(values) / dof if dof > 0 else math.nan

    return Precision(
        readings=total,
        points=len({point.point for point in readings}),
        degrees_of_freedom=dof,
        variance_um2=(mean(p.squares_um2[0] for p in readings), mean(p.squares_um2[1] for p in readings)),
        covariance_um2=mean(p.products_um2 for p in readings),
        mean_variance_um2=(
            mean(p.squares_um2[0] / p.count for p in readings),
            mean(p.squares_um2[1] / p.count for p in readings),
        ),
    )


def pool_points(
    cases: Sequence[Sequence[PointReadings]], *, as_published: bool = False
) -> tuple[dict[int, Precision], Precision]:
    """Pool each point over all cases (equations 25 to 27), then everything (28 to 32).

    `as_published` divides as in the listing. The divisor for a point is the number of its readings minus one.
    The divisor for all points is the number of readings minus the number of points.
    """
    by_number = by_key((point.point, point) for case in cases for point in case)
    each, all_means = (1, len(by_number)) if as_published else (None, None)
    by_point = {number: pool(own, means=each) for number, own in by_number.items()}
    return by_point, pool([point for own in by_number.values() for point in own], means=all_means)
