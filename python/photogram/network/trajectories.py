"""Poses as functions of time: trajectories, rolling shutters, line scanners, clocks.

An image has the pose of its trajectory at its time (docs/moving.md)::

    C(t) = C0(t) + sum B_k(t) c_k        A(t) = A0(t) Exp(r(t)),  r(t) = sum B_k(t) r_k

C0 and A0 are a table with prior values, c_k and r_k are coefficients of a polynomial or a spline: free,
weighted or fixed. Times are in seconds.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import argument_error, number, numbers, object_name, shaped, whole_number
from photogram.arguments.fields import array, check_arrays, check_fields
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.unknowns import Numbers, rotations
from photogram.words import phrase

Interpolation = Literal["linear", "hermite", "lagrange"]
AttitudeInterpolation = Literal["linear", "lagrange"]
PositionAxes = Literal["table", "orbit", "flight"]
Angles = Literal["vector", "zxz"]
BasisRow = tuple[str, int, list[float]]
"""Name, degree, and reference and scale of a polynomial, or knots of a spline."""

DEGREES = {"polynomial": (0, 8), "spline": (1, 5)}


class Coefficient(Numbers):
    """Coefficient c_k or r_k of a trajectory."""


class PositionCoefficient(Coefficient):
    """Position coefficient of a trajectory, in its axes and the linear unit."""

    KIND = "position coefficient"


class RotationCoefficient(Coefficient):
    """Rotation coefficient of a trajectory, about the axes of the photo, in radians."""

    KIND = "rotation coefficient"


class GyroBias(Numbers):
    """Bias b of a gyroscope about the axes of the body.

    Parameters
    ----------
    name
        Name in reports.
    value, sd
        (3,) bias and standard deviations in radians per second.
    """

    KIND = "gyro bias"


@dataclass(frozen=True, eq=False)
class Clock(Numbers):
    """Offset d of a clock: its time t is t + d of the trajectory.

    Parameters
    ----------
    name
        Name in reports.
    value, sd
        Offset and standard deviation in seconds.
    """

    KIND = "clock"

    value: float = 0.0


@dataclass(frozen=True, eq=False)
class Readout(Numbers):
    """Readout time of a rolling shutter, or factor of the line rates of a scanner.

    Parameters
    ----------
    name
        Name in reports.
    value, sd
        Seconds, or a factor about 1.
    """

    KIND = "readout"

    value: float = 1.0


@dataclass(frozen=True, eq=False)
class Table:
    """Sampled trajectory with prior positions and attitudes.

    Parameters
    ----------
    times, positions
        (k,) seconds, increasing, and (k, 3) projection centres in the object space: X, Y, Z, geocentric if
        the object space is geographic; inertial if the trajectory has a `body`.
    attitude_times, attitudes
        (m,) and (m, 3, 3) rotation matrices whose columns are the axes of the photo (x right, y up, z back)
        in the axes of the positions.
    velocities
        (k, 3) per second, for `hermite`.
    interpolation, attitude_interpolation
        Between records: `linear` (attitudes rotate uniformly), `hermite` (positions only), `lagrange` (eight
        neighbours; attitudes by quaternions).

    Raises
    ------
    InputError
        If times do not increase, lengths of arrays differ, or matrices are not rotations.
    """

    times: Floats
    positions: Floats = field(metadata=array("times", 3))
    attitude_times: Floats
    attitudes: Floats
    velocities: Floats | None = field(default=None, metadata=array("times", 3))
    interpolation: Interpolation = "linear"
    attitude_interpolation: AttitudeInterpolation = "linear"

    def __post_init__(self) -> None:
        check_fields(self)
        given = self.velocities is not None
        require(
            given == (self.interpolation == "hermite"),
            "table",
            "together",
            name="velocities",
            other="hermite",
        )
        times, turned = increasing("times", self.times), increasing("attitude_times", self.attitude_times)
        attitudes = rotations("attitudes", self.attitudes, len(turned))
        vars(self).update(times=times, attitude_times=turned, attitudes=attitudes)
        check_arrays(self, times=len(times))

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of the records; a single record applies to all times."""
        both = [each for each in (self.times, self.attitude_times) if len(each) > 1] or [self.times]
        return max(float(each[0]) for each in both), min(float(each[-1]) for each in both)


def increasing(name: str, values: ArrayLike) -> Floats:
    """Return validated times (k,), finite and increasing."""
    times = np.atleast_1d(numbers(name, values))
    if times.ndim != 1 or not len(times):
        raise kind_error(name, "a list of times", values)
    later = np.isfinite(times)
    later[1:] &= times[1:] > times[:-1]
    if not later.all():
        row = int(np.argmin(later))
        raise kind_error(f"{name}[{row}]", "a finite time after the previous one", float(times[row]))
    return times


@dataclass(frozen=True)
class Polynomial:
    """Polynomial corrections: B_k = ((t - reference) / scale)^k.

    Parameters
    ----------
    degree
        0 to 8.
    reference, scale
        Seconds. None: the centre and half of the table's span; 0 and 1 if the table has one record.
    value, sd
        (3,), (K, 3) or one number: given values of the K = degree + 1 coefficients and their standard
        deviations; infinite (free), 0 (fixed) or between (weighted).
    """

    degree: int = 0
    reference: float | None = None
    scale: float | None = None
    value: ArrayLike = 0.0
    sd: ArrayLike = np.inf

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return self.degree + 1

    def over(self, first: float, last: float) -> Polynomial:
        """Return the polynomial with reference and scale for a time span."""
        _degree("polynomial", self.degree)
        for name, value in (("reference", self.reference), ("scale", self.scale)):
            where = f"{name} of a polynomial"
            if value is not None and not (np.isfinite(number(where, value)) and (value or name != "scale")):
                raise argument_error(where, "positive" if name == "scale" else "finite", value=value)
        alone = not last > first
        reference = self.reference if self.reference is not None else 0.0 if alone else (first + last) / 2
        scale = self.scale if self.scale is not None else 1.0 if alone else (last - first) / 2
        return replace(self, reference=reference, scale=scale)

    def row(self, origin: float) -> BasisRow:
        """Return the row for the core, with times relative to an origin."""
        if self.reference is None or self.scale is None:
            raise argument_error("polynomial", "missing", name="reference or scale")
        return "polynomial", self.degree, [self.reference - origin, self.scale]

    @property
    def smoothed(self) -> list[tuple[list[int], list[float], float]]:
        """Joint observations of coefficients; always empty for polynomials."""
        return []


@dataclass(frozen=True)
class Spline:
    """Spline corrections in time: B-splines over knots.

    Parameters
    ----------
    every
        Approximate seconds between knots over the table's span, which is divided evenly; or use `knots`.
    knots
        (n,) all knots, not decreasing; n - degree - 1 coefficients.
    degree
        1 to 5.
    value, sd
        As for :class:`Polynomial`.
    smooth
        q and s: differences of order q = 1, 2 or 3 of neighbours are 0 with standard deviation s. For knots h
        apart, this is white noise of the q-th derivative with density s^2 / h^(2q - 1).
    correlation
        T and s: a Gauss-Markov process with correlation time T in seconds and standard deviation s.
    """

    every: float | None = None
    knots: ArrayLike | None = None
    degree: int = 3
    value: ArrayLike = 0.0
    sd: ArrayLike = np.inf
    smooth: tuple[int, float] | None = None
    correlation: tuple[float, float] | None = None

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return len(self._knots) - self.degree - 1

    @property
    def _knots(self) -> Floats:
        if self.knots is None:
            raise argument_error("spline", "missing", name="knots")
        return numbers("knots", self.knots)

    def over(self, first: float, last: float) -> Spline:
        """Return the spline with even knots for a time span, and `degree` knots beyond each end."""
        p = _degree("spline", self.degree)
        one = (self.every is None) != (self.knots is None)
        require(one, "spline", "exclusive", first="every", second="knots")
        for name, pair in (("smooth", self.smooth), ("correlation", self.correlation)):
            if pair is not None and (not isinstance(pair, tuple | list) or len(pair) != 2):
                raise argument_error(f"{name} of a spline", "numbers", count=2, value=pair)
            for value in pair or ():
                number(f"{name} of a spline", value)
        if self.every is not None:
            good = 0 < number("every", self.every) < np.inf and last > first
            require(good, "every (seconds within the table)", "positive", value=self.every)
            parts = max(1, round((last - first) / self.every))
            h = (last - first) / parts
            return replace(self, every=None, knots=first + h * np.arange(-p, parts + p + 1))
        knots = self._knots
        ascend = knots.ndim == 1 and np.isfinite(knots).all() and (np.diff(knots) >= 0).all()
        if not ascend or len(knots) < 2 * p + 2 or not knots[p] < knots[-p - 1]:
            raise kind_error("knots", f"{2 * p + 2} or more numbers in ascending order", self.knots)
        return self

    def row(self, origin: float) -> BasisRow:
        """Return the row for the core, with times relative to an origin."""
        return "spline", self.degree, (self._knots - origin).tolist()

    @property
    def smoothed(self) -> list[tuple[list[int], list[float], float]]:
        """Joint observations of coefficients: indices, factors, standard deviation of 0."""
        found: list[tuple[list[int], list[float], float]] = []
        if self.smooth is not None:
            found += self._differences(*self.smooth)
        if self.correlation is not None:
            time, sd = self.correlation
            good = 0 < time < np.inf and 0 < sd < np.inf
            require(good, "correlation", "positive", value=self.correlation)
            found.append(([0], [1.0], sd))
            for k, step in enumerate(np.diff(self._places).tolist()):
                kept = float(np.exp(-step / time))
                found.append(([k, k + 1], [-kept, 1.0], sd * float(np.sqrt(1 - kept**2))))
        return found

    @property
    def _places(self) -> Floats:
        """Greville points of the coefficients."""
        knots, p = self._knots, self.degree
        return np.array([knots[k + 1 : k + p + 1].mean() for k in range(self.count)])

    def _differences(self, order: int, sd: float) -> list[tuple[list[int], list[float], float]]:
        """Return divided differences at the Greville points, scaled by h^q."""
        if order not in (1, 2, 3) or not 0 < sd < np.inf:
            raise kind_error("smooth", "an order of 1, 2 or 3 and a standard deviation", self.smooth)
        places = self._places
        h = float(np.median(np.diff(places)))
        found = []
        for k in range(self.count - order):
            own = places[k : k + order + 1]
            gaps = own[:, np.newaxis] - own
            np.fill_diagonal(gaps, 1.0)
            factors = h**order * math.factorial(order) / gaps.prod(axis=1)
            step = (own[-1] - own[0]) / order
            found.append((list(range(k, k + order + 1)), factors.tolist(), sd * float(np.sqrt(h / step))))
        return found


Basis = Polynomial | Spline


def _degree(kind: str, degree: int) -> int:
    low, high = DEGREES[kind]
    checked = whole_number(f"degree of a {kind}", degree)
    require(low <= checked <= high, f"degree of a {kind}", "whole-range", low=low, high=high, value=checked)
    return checked


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Pose as a function of time, shared by images and records.

    Parameters
    ----------
    name
        Name in reports.
    table
        Table with prior values.
    position, rotation
        Basis of the corrections; None without corrections.
    body
        (m,) times and (m, 3, 3) matrices, inertial to body, of a body that rotates under an inertial table.
    position_axes
        Axes of the position coefficients. `table`: the axes of the `table`. `orbit`: along the flight, across
        it (to the left) and radial, away from the origin of the axes. `flight`: along, across and up (third
        axis of the table).
    angles
        Meaning of the rotation coefficients. `vector`: rotation vectors about the axes of the photo, A = A0
        Exp(r). `zxz`: radians added to the angles a1, a2, a3 of the table, M = [a3]_3 [a2]_1 [a1]_3 from its
        axes to the axes of a camera that looks along +z, x right, y down. Polynomials instead of a table are
        equivalent to a table sampled from them.

    Attributes
    ----------
    coefficients
        Position coefficients and rotation coefficients, as shared unknowns of the block.

    Raises
    ------
    InputError
        If a basis or the table is invalid.
    """

    name: str
    table: Table
    position: Basis | None = None
    rotation: Basis | None = None
    body: tuple[ArrayLike, ArrayLike] | None = None
    position_axes: PositionAxes = "table"
    angles: Angles = "vector"
    coefficients: tuple[tuple[Coefficient, ...], tuple[Coefficient, ...]] = field(
        init=False, repr=False, metadata={"stored": "_with_coefficients"}
    )

    def __post_init__(self) -> None:
        vars(self)["name"] = object_name("name of a trajectory", self.name)
        check_fields(self, f"trajectory {self.name}")
        if self.position_axes != "table" and len(self.table.times) < 2:
            raise argument_error(f"positions of trajectory {self.name}", "least", low=2, value=1)
        kinds = (("position", PositionCoefficient), ("rotation", RotationCoefficient))
        vars(self)["coefficients"] = tuple(self._coefficients(name, kind) for name, kind in kinds)
        if self.body is not None:
            if not isinstance(self.body, tuple | list) or len(self.body) != 2:
                raise kind_error(f"body of trajectory {self.name}", "a pair of times and matrices", self.body)
            times, matrices = self.body
            times = increasing("times of a body", times)
            vars(self)["body"] = (times, rotations("matrices of a body", matrices, len(times)))

    def _coefficients(self, what: str, kind: type[Coefficient]) -> tuple[Coefficient, ...]:
        basis: Basis | None = getattr(self, what)
        if basis is None:
            return ()
        if not isinstance(basis, Polynomial | Spline):
            raise kind_error(f"{what} of trajectory {self.name}", "a Polynomial or a Spline", basis)
        basis = basis.over(*self.table.span)
        vars(self)[what] = basis
        where, shape = f"the {what} of {self.name}", (basis.count, 3)
        value = shaped(f"value of {where}", basis.value, shape, one_row=True)
        sd = shaped(f"sd of {where}", basis.sd, shape, one_row=True)
        return tuple(kind(f"{self.name} {what} {k}", value=value[k], sd=sd[k]) for k in range(basis.count))

    def _with_coefficients(self, coefficients: tuple[tuple[Coefficient, ...], ...]) -> Trajectory:
        """Return the trajectory with coefficients that others share; they must match its bases."""
        own, shared = (
            [[each.title for each in part] for part in both] for both in (self.coefficients, coefficients)
        )
        if own != shared:
            raise InputError(phrase("adjusted.coefficients", name=self.name))
        made = replace(self)
        vars(made)["coefficients"] = coefficients
        return made

    @property
    def origin(self) -> float:
        """A whole second at the start; relative times preserve digits."""
        return float(np.floor(self.table.times[0]))

    def row(self, places: dict[int, int]) -> _photocore.TrajectoryRow:
        """Return the row for the core; `places` are indices of unknowns by object identity."""
        table, origin = self.table, self.origin

        def attitudes(times: Floats, matrices: Floats, joined: str) -> tuple[list[float], Floats, str]:
            return (times - origin).tolist(), matrices.reshape(-1, 9), joined

        position, rotation = ([places[id(each)] for each in own] for own in self.coefficients)
        none: BasisRow = ("none", 0, [])
        return {
            "times": (table.times - origin).tolist(),
            "positions": table.positions,
            "velocities": table.velocities,
            "interpolation": table.interpolation,
            "attitudes": attitudes(table.attitude_times, table.attitudes, table.attitude_interpolation),
            "position_basis": none if self.position is None else self.position.row(origin),
            "rotation_basis": none if self.rotation is None else self.rotation.row(origin),
            "position": position,
            "rotation": rotation,
            "body": None
            if self.body is None
            else attitudes(np.asarray(self.body[0]), np.asarray(self.body[1]), "linear"),
            "axes": self.position_axes,
            "rotations": self.angles,
        }

    def flown(self, times: Floats, position: Floats, rotation: Floats) -> _photocore.FlownRow:
        """Evaluate the core at (n,) times, with (K, 3) position and rotation coefficients."""
        c, r = np.reshape(position, (-1, 3)), np.reshape(rotation, (-1, 3))
        return _photocore.flown(self._row, c, r, (times - self.origin).tolist())

    @property
    def reach(self) -> tuple[float, float]:
        """First and last time at which the pose is defined, in seconds.

        The interval extends half a record beyond the table, and is limited by the knots of splines.
        """
        first, last = _photocore.trajectory_span(self._row)
        return self.origin + first, self.origin + last

    @property
    def _row(self) -> _photocore.TrajectoryRow:
        """Row for the core, if the indices of coefficients are irrelevant."""
        return self.row({id(each): 0 for own in self.coefficients for each in own})
