"""Readings grouped by point (subroutine GROUP), and their pointing precision."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from heapq import heappop, heappush

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, field


def group(points: Indices) -> Indices:
    """Return the order of readings grouped by point, otherwise as measured."""
    _, first, inverse = np.unique(points, return_index=True, return_inverse=True)
    order: Indices = np.argsort(first[inverse], kind="stable")
    return order


def rows_by_point(points: Indices) -> list[tuple[int, Indices]]:
    """Return each point with the rows of its readings, in the order measured."""
    order = group(points)
    starts = np.flatnonzero(np.diff(points[order])) + 1
    rows = np.split(order, starts) if len(points) else []
    return list(zip(points[order[np.r_[0, starts]]].tolist() if rows else [], rows, strict=True))


def group_as_listed(points: Indices) -> Indices:
    """Return the order of readings in the listing."""
    order = list(range(len(points)))
    numbers = points.tolist()
    # Positions of the readings of each point; those before `start` were moved.
    places: dict[int, list[int]] = {}
    for place, number in enumerate(numbers):
        places.setdefault(number, []).append(place)
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
    """Summary of the readings of one point in one case."""

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
    by_number: dict[int, list[PointReadings]] = {}
    for case in cases:
        for point in case:
            by_number.setdefault(point.point, []).append(point)
    each, all_means = (1, len(by_number)) if as_published else (None, None)
    by_point = {number: pool(own, means=each) for number, own in by_number.items()}
    return by_point, pool([point for own in by_number.values() for point in own], means=all_means)
