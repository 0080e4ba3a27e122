"""Figures of a statement by the requested standards.

See sections 2.3 and 2.6 of the specification of the statement. The factors of the National Standard for
Spatial Data Accuracy (FGDC-STD-007.3-1998) are valid for axes of nearly equal RMSE. In all cases the
statement gives the radius of 95 % of errors with the matrix of mean products. Numbers of measures of ISO
19157 are from annex D of the edition of 2013; names are from the same table in GeoAPI.

For the ASPRS standards, Edition 2 (2023; Version 2, 2024), section 2.2 lists confirmations by other texts and
open checks against the standard. Differences contain the errors of the product and of the check survey. The
standard adds the errors of the survey again: correct for common errors, otherwise conservative.

Measured lengths are tested against calibrated ones by VDI/VDE 2634 part 1 (section 2.5 of the specification):
at least seven lines with at least five lengths each. Every error is within E = A + K L, at most the user's
limit B. The longest length is at least two thirds of the diagonal of the volume, and a line is along one.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import counted
from photogram.network import point_sets
from photogram.network.observations import Control
from photogram.results.covariance import used_rows
from photogram.results.statement import comparison
from photogram.results.statement.figures import Figures
from photogram.results.statement.request import Asked, invalid, lengths_in
from photogram.show.quantity import members
from photogram.show.sketch.marks import ellipse_axes
from photogram.statistics.agreement import agreement
from photogram.statistics.error_radii import circular_error
from photogram.statistics.freedom import rmse_interval, root_mean
from photogram.statistics.limits import GlobalTest

if TYPE_CHECKING:
    from photogram import Result

LINES, LENGTHS, LONGEST = 7, 5, 2 / 3
"""Requirements: lines, lengths on each, and the longest of all over the diagonal of the volume."""
ALONG = math.radians(15.0)  # Largest angle between a line and a diagonal of the volume
REFERENCE = 20.0  # Temperature of calibrated lengths, degrees Celsius


@dataclass(frozen=True, eq=False)
class LengthTest:
    """m measured lengths against calibrated ones."""

    names: Sequence[str]  # (m,) of their lines
    calibrated: Floats  # (m,)
    errors: Floats  # (m,) measured minus calibrated
    sd: Floats  # (m,) their standard deviations, with those of the calibration
    limit: tuple[float, float, float] | None  # A, K and B of the limits of errors; B may be infinite
    # Test of all errors with their joint covariance; None without rank
    together: GlobalTest | None
    # The longest calibrated length over the diagonal of the volume; NaN if unknown
    longest: float
    # Smallest angle between a length and a diagonal of the volume, radians; NaN if unknown
    off_diagonal: float
    ends: Sequence[tuple[str, str]] = ()  # (m,) names of both points
    expansion: float | None = None  # Of the reduction to 20 degrees; None without

    @property
    def normalised(self) -> Floats:
        """(m,) errors / sd; NaN if the standard deviation is zero."""
        out = np.full(self.errors.shape, math.nan)
        return np.asarray(np.divide(self.errors, self.sd, out=out, where=self.sd > 0))

    @property
    def limits(self) -> Floats | None:
        """(m,) limits of the errors."""
        constant, slope, most = self.limit or (0.0, 0.0, 0.0)
        return None if self.limit is None else np.minimum(constant + slope * self.calibrated, most)

    @property
    def lines(self) -> int:
        return len(set(self.names))

    @property
    def least(self) -> int:
        """Number of lengths on the line with the fewest."""
        return min(Counter(self.names).values())

    @property
    def largest(self) -> float:
        return float(np.abs(self.errors).max())

    @property
    def rms(self) -> float:
        return math.sqrt(float(np.mean(self.errors**2)))

    @property
    def within(self) -> Bools | None:
        """(m,) whether errors are within their limits; None without limits."""
        return None if self.limits is None else np.asarray(np.abs(self.errors) <= self.limits)

    @property
    def met(self) -> bool | None:
        """Whether every error is within its limit; None without limits."""
        return None if self.within is None else bool(self.within.all())

    @property
    def enough(self) -> bool:
        """Whether there are enough lines, and lengths on each."""
        return self.lines >= LINES and self.least >= LENGTHS

    @property
    def long_enough(self) -> bool:
        """Whether the longest length is at least two thirds of the diagonal, if known."""
        return not self.longest < LONGEST * (1 - 1e-9)

    @property
    def along_diagonal(self) -> bool:
        """Whether a line is along a diagonal of the volume, if known."""
        return not self.off_diagonal > ALONG


def measured_lengths(positions: Floats, joint: Floats, pairs: Indices) -> tuple[Floats, Floats]:
    """Return (m,) distances of `pairs` of (p, 3) positions, and their joint covariance J C J'."""
    first, second = pairs.T
    steps = positions[second] - positions[first]
    found = np.linalg.norm(steps, axis=1)
    if not (found > 0).all():
        raise invalid(f"lengths[{np.argmin(found > 0)}]", "request.identical-positions")
    along, rows = steps / found[:, np.newaxis], np.arange(len(pairs))
    gradient = np.zeros((len(pairs), *positions.shape))
    gradient[rows, second] += along
    gradient[rows, first] -= along
    flat = gradient.reshape(len(pairs), -1)
    return found, np.asarray(flat @ joint @ flat.T)


def angle_to_diagonal(steps: Floats, extent: Floats) -> float:
    """Return the smallest angle (radians) of (m, 3) non-zero steps to box diagonals."""
    sizes = np.linalg.norm(steps, axis=1) * float(np.linalg.norm(extent))
    # The nearest of the four diagonals has the component signs of the step.
    return math.acos(min(float((np.abs(steps) @ np.abs(extent) / sizes).max()), 1.0))


def at_reference(lengths: Floats, temperatures: Floats, expansion: float) -> Floats:
    """Return (m,) lengths at 20 degrees from others (deg C); `expansion` per kelvin: 11.5e-6 for steel."""
    grown = 1 + expansion * (temperatures - REFERENCE)
    if not (np.isfinite(grown) & (grown > 0)).all():
        raise invalid("expansion", "request.expansion", expansion)
    return lengths / grown


def length_test(
    measured: Floats,
    calibrated: Floats,
    *,
    covariance: Floats,
    sd: Floats,
    lines: Sequence[str],
    limit: tuple[float, float, float] | None = None,
    diagonal: float = math.nan,
    off_diagonal: float = math.nan,
    freedom: float = math.inf,
) -> LengthTest:
    """Test (m,) measured lengths against calibrated ones, both at 20 degrees.

    `covariance` is the (m, m) matrix of the measured lengths (:func:`measured_lengths`), `sd` are (m,)
    standard deviations of the calibrated ones, `lines` (m,) names of their lines. `limit` are A, K and B (may
    be infinite) of error limits A + K L, at most B. `diagonal` and `off_diagonal` belong to the measured
    volume: its diagonal, and the smallest angle between a length and it; NaN if unknown. `freedom` are
    degrees of freedom of the estimated unit weight of the covariance.
    """
    errors = measured - calibrated
    found = agreement(errors[:, np.newaxis], covariance, sd[:, np.newaxis, np.newaxis] ** 2, second=freedom)
    parts = lines, calibrated, errors, found.sd[:, 0], limit, found.together
    return LengthTest(*parts, float(calibrated.max()) / diagonal, off_diagonal)


ASPRS_POINTS = 30  # Check points of a tested product (7.13); with fewer it is produced to meet a class
MOST_STEPS = 10  # Number of steps of 1,000 km2, after which the number of check points is constant
MEAN_SHARE, MOST_TIMES = 0.25, 3.0
"""Limits for means and differences that require an investigation, relative to a class (7.2)."""


@dataclass(frozen=True)
class Accuracy:
    """A figure of the standard with its components, in the linear unit."""

    count: int  # Check points
    # RMSE of the differences (RMSE_1), and of the check survey by its standard deviations (RMSE_2)
    found: float
    survey: float
    rmse: float  # The figure: the root of the sum of both squares
    # Its upper limit, from the interval of the found RMSE, with the survey's; NaN if missing
    upper: float


@dataclass(frozen=True)
class Remark:
    """A mean or difference that requires an investigation first."""

    kind: str  # `mean` or `difference`
    component: str  # `e`, `n` or `h`
    value: float  # In the linear unit
    limit: float
    point: int | None = None  # Row of the difference; None for a mean


def points_asked_for(area: float) -> int:
    """Return required check points of an area (km2), for NVA and VVA (7.13, table C.1).

    Ten more for every 1,000 km2. Minimum and maximum are confirmed, the steps between are not.
    """
    return ASPRS_POINTS + 10 * (math.ceil(min(max(area / 1000.0, 1.0), MOST_STEPS)) - 1)


def accuracy(found: float, survey: float, freedom: float, count: int) -> Accuracy:
    """Return RMSE_H (7.11), RMSE_V of NVA or VVA, or RMSE_3D; horizontal ones are radial.

    `found` and `survey` are RMSE_1 of the differences with effective degrees of freedom, and RMSE_2 of the
    check survey; linear unit.
    """
    upper = rmse_interval(found, freedom)[1]
    return Accuracy(count, found, survey, math.hypot(found, survey), math.hypot(upper, survey))


def verdict(figure: Accuracy | None, limit: float) -> str:
    """Return the verdict on a class in the linear unit.

    `missed` if the figure is larger. Otherwise, by the upper limit of its interval, `met with confidence` or
    `met`; with fewer than 30 points `produced to meet` or `not decided` instead. `not tested` without a
    figure.
    """
    if figure is None:
        return "not tested"
    if figure.rmse > limit:
        return "missed"
    sure = figure.upper <= limit
    if figure.count < ASPRS_POINTS:
        return "produced to meet" if sure else "not decided"
    return "met with confidence" if sure else "met"


def wording(count: int) -> str:
    if count >= ASPRS_POINTS:
        return "tested"
    return "produced" if count else "none"


def control_limits(classes: Mapping[str, float]) -> dict[str, float]:
    """Return limits of the RMSE of control in plan (radial) and height (7.9); empty without class `h`."""
    if "h" not in classes:
        return {}
    return {"h": classes["h"] / 2, "v": classes["v"] / 2 if "v" in classes else classes["h"]}


def remarks(
    differences: Floats, class_h: float | None = None, class_v: float | None = None
) -> tuple[Remark, ...]:
    """Return necessary investigations before a class is stated (7.2).

    Limits are a quarter of the class for means and three times the class for differences; in plan by axis,
    with the class divided by the root of 2. `differences` are (n, 3) east, north, height: adjusted minus
    given, in the linear unit; NaN if not given. Classes are None unless requested.
    """
    axis, found = None if class_h is None else class_h / math.sqrt(2), list[Remark]()
    for component, limit, values in zip("enh", (axis, axis, class_v), differences.T, strict=True):
        if limit is None:
            continue
        known = np.flatnonzero(np.isfinite(values))
        mean, most = float(values[known].mean()) if known.size else 0.0, MOST_TIMES * limit
        if abs(mean) > MEAN_SHARE * limit:
            found.append(Remark("mean", component, mean, MEAN_SHARE * limit))
        beyond = known[np.abs(values[known]) > most].tolist()
        found += [Remark("difference", component, float(values[row]), most, row) for row in beyond]
    return tuple(found)


ENOUGH = 20  # Required check points
VERTICAL, RADIAL, EITHER = 1.9600, 1.7308, 2.4477
"""Factors of RMSE_z, of the radial RMSE, and of the mean of the RMSE of both axes."""
LEAST_RATIO = 0.6  # Ratio of the RMSE of the axes below which the factors are not valid
ABSOLUTE = "absolute (external) positional accuracy"  # For check points
RELATIVE = "relative (internal) positional accuracy"  # For lengths, and for differences between points
MEASURES = {
    "bias": (128, "bias of positions"),
    "le90": (35, "linear map accuracy at 90 % significance level"),
    "le95": (36, "linear map accuracy at 95 % significance level"),
    "rmse": (39, "root mean square error"),
    "ce90": (44, "circular error at 90 % significance level"),
    "ce95": (45, "circular error at 95 % significance level"),
    "rmse_plan": (47, "root mean square error of planimetry"),
    "ellipse": (50, "uncertainty ellipse"),
}
Measure = tuple[str, str, Any, str]  # Key of `MEASURES`, element, value and scope


@dataclass(frozen=True, eq=False)
class Asprs:
    """ASPRS Positional Accuracy Standards, Edition 2."""

    figures: Mapping[str, Accuracy | None]  # By `h`, `v`, `3d`, `vva`; None without points
    # Verdicts on the requested classes, for sentences, headline, table and JSON
    verdicts: Mapping[str, str]
    words: str  # `tested`, `produced` or `none`, by the component with the fewest check points
    # Square kilometres; number of check points that the standard requires
    area: float
    points_asked: int
    # Whether the survey has half of the classes (7.12), by `h` and `v`
    survey_good_enough: Mapping[str, bool]
    control_limits: Mapping[str, float]
    # Root mean squares of the standard deviations of control, radial in plan, and in height; linear unit
    control_rmse: Mapping[str, float]
    remarks: tuple[Remark, ...]  # Means and differences to investigate first
    leave_one_out: Mapping[str, float]  # RMSE of control predicted by the others, `h` and `v`; NaN without

    @property
    def control_good_enough(self) -> dict[str, bool]:
        return {name: self.control_rmse[name] <= limit for name, limit in self.control_limits.items()}


@dataclass(frozen=True)
class Nssda:
    """Accuracy of n check points at 95 %, linear unit; missing values None."""

    count: int  # n
    ratio: float | None  # Smaller RMSE of an axis over the larger
    # Horizontal, by the mean RMSE of the axes; None if the ratio is below 0.6
    accuracy_r_unequal: float | None
    accuracy_r_equal: float | None  # Horizontal, by the radial RMSE, for equal RMSE of both axes
    # Radius of 95 % from the mean products of differences, for any ratio
    ce95: float | None
    accuracy_z: float | None  # Vertical

    @property
    def enough(self) -> bool:
        return self.count >= ENOUGH

    @property
    def wording(self) -> str:
        return "tested" if self.count else "compiled"


@dataclass(frozen=True, eq=False)
class Standards:
    """Results by standards; None if not requested or not applicable."""

    asprs: Asprs | None = None
    nssda: Nssda | None = None
    lengths: LengthTest | None = None
    iso_19157: list[Measure] = field(default_factory=list)

    @property
    def nssda_member(self) -> dict[str, Any] | None:
        names = ("ratio", "accuracy_r_equal", "accuracy_r_unequal", "ce95", "accuracy_z")
        return None if self.nssda is None else members(self.nssda, *names)


def asprs_figures(
    result: Result,
    asked: Asked,
    found: comparison.Compared,
    of_all: Figures | None,
    of_vegetated: Figures | None,
    left_out: Sequence[comparison.LeftOut],
) -> Asprs:
    """Return the figures of the ASPRS, and the verdicts on the requested classes."""
    metre = lengths_in(result.block.linear_unit)
    area, used = asked.area, result.point_positions[result.used_points]
    if area is None:
        used = comparison.plan_positions(result.block, used)
        area = point_sets.area(point_sets.hull(used[:, :2])) if len(used) else 0.0
    km2 = area * metre**2 / 1e6
    figures = _accuracies(of_all, of_vegetated)
    classes = asked.classes
    verdicts = {name: verdict(figures[name], size) for name, size in classes.items()}
    counts = [0 if own is None else own.count for own in (figures["h"], figures["v"])]
    plan, height = _control_rmse(result)
    d = np.array([each.difference for each in left_out]).reshape(-1, 3)
    return Asprs(
        figures=figures,
        verdicts=verdicts,
        words=wording(min(filter(None, counts), default=0)),
        area=km2,
        points_asked=points_asked_for(km2),
        survey_good_enough={
            name: own.survey <= size / 2
            for name, size in classes.items()
            if name != "3d" and (own := figures[name])
        },
        control_limits=control_limits(classes),
        control_rmse={"h": plan, "v": height},
        remarks=()
        if of_all is None
        else remarks(np.where(found.counted, found.differences, np.nan), classes.get("h"), classes.get("v")),
        leave_one_out={"h": root_mean((d[:, :2] ** 2).sum(axis=1)), "v": root_mean(d[:, 2] ** 2)},
    )


def _accuracies(of_all: Figures | None, of_vegetated: Figures | None) -> dict[str, Accuracy | None]:
    found: dict[str, Accuracy | None] = dict.fromkeys(("h", "v", "3d", "vva"))
    for key, own, part in (("h", of_all, "plan"), ("v", of_all, "h"), ("vva", of_vegetated, "h")):
        axis = key[0]
        predicted = None if own is None else own.prediction[part]
        if own is not None and predicted is not None:
            pair = own.rmse[f"rmse_{axis}1"], own.rmse[f"rmse_{axis}2"]
            found[key] = accuracy(*pair, predicted.effective_dof, predicted.points)
    whole = None if of_all is None else of_all.prediction["all"]
    h, v = found["h"], found["v"]
    if h is not None and v is not None and whole is not None:
        both = math.hypot(h.found, v.found), math.hypot(h.survey, v.survey)
        found["3d"] = accuracy(*both, whole.effective_dof, min(h.count, v.count))
    return found


def _control_rmse(result: Result) -> tuple[float, float]:
    block = result.block
    known = np.isfinite(block.point_sd) & result.used_points[:, np.newaxis]
    turns = np.abs(comparison.turned_to_east(block, block.point_positions))
    own = np.where(known, np.einsum("nij,nj->ni", turns, np.where(known, block.point_sd, 0.0)), np.nan)
    observed = [np.sqrt(np.diag(each.precision)) for each in block.observations.of_type(Control)]
    squares = np.vstack([own, *observed]) ** 2
    return root_mean(squares[:, :2].sum(axis=1)), root_mean(squares[:, 2])


def nssda(moments: Floats, rmse_z: float, count: int) -> Nssda:
    """Return the accuracy of `count` check points at 95 %, from (2, 2) sum d d' / n in plan, and RMSE_z."""
    vertical = VERTICAL * rmse_z if math.isfinite(rmse_z) else None
    if not np.isfinite(moments).all():
        return Nssda(count, None, None, None, None, vertical)
    ce95 = float(circular_error(moments[np.newaxis], 0.95)[0])
    small, large = sorted(math.sqrt(each) for each in np.diag(moments).tolist())
    ratio = small / large if large > 0 else 1.0
    mean = EITHER * (small + large) / 2
    equal = RADIAL * math.hypot(small, large)
    return Nssda(count, ratio, mean if ratio >= LEAST_RATIO else None, equal, ce95, vertical)


def tested_lengths(result: Result, asked: Asked) -> LengthTest:
    """Return calibrated lengths with their test; refuse unknown points."""
    block = result.block
    names = list(dict.fromkeys(end for each in asked.lengths for end in (each["from"], each["to"])))
    rows = used_rows(result, names)
    positions, joint = result.point_positions[rows], result.covariance(("point", names))
    if block.geographic:
        joint = comparison.turned_jointly(comparison.turned_to_east(block, positions), joint)
        positions = comparison.plan_positions(block, positions)
    pairs = np.array([[names.index(each["from"]), names.index(each["to"])] for each in asked.lengths])
    measured, covariance = measured_lengths(positions, joint, pairs)
    temperatures = np.array([each.get("temperature", math.nan) for each in asked.lengths], dtype=float)
    expansion = asked.expansion if np.isfinite(temperatures).all() else None
    if expansion is not None:
        measured = at_reference(measured, temperatures, expansion)
    extent = np.ptp(comparison.plan_positions(block, result.point_positions[result.used_points]), axis=0)
    ends_in_plan = comparison.plan_positions(block, result.point_positions[rows])[pairs]
    test = length_test(
        measured,
        np.array([each["length"] for each in asked.lengths], dtype=float),
        covariance=covariance,
        sd=np.array([each["sd"] for each in asked.lengths], dtype=float),
        lines=[str(each["line"]) for each in asked.lengths],
        limit=asked.limit,
        diagonal=float(np.linalg.norm(extent)),
        off_diagonal=angle_to_diagonal(ends_in_plan[:, 1] - ends_in_plan[:, 0], extent),
        freedom=result.freedom_of_scale,
    )
    ends = [(str(each["from"]), str(each["to"])) for each in asked.lengths]
    return replace(test, ends=ends, expansion=expansion)


def iso_measures(of_all: Figures | None, lengths: LengthTest | None) -> list[Measure]:
    """Return the figures as measures of ISO 19157."""
    figures: list[Measure] = []
    if of_all is not None:
        whole = of_all.parts["all"]
        # Semi-axes of plan errors, and the azimuth of the larger one (rad)
        semi_axes, angles = ellipse_axes(of_all.moments[np.newaxis])
        ellipse = [*semi_axes[0].tolist(), math.radians(90.0 - float(angles[0])) % math.pi]
        values: dict[str, Any] = {
            "bias": [None if each is None else each.mean for each in (of_all.parts[part] for part in "enh")],
            "rmse": None if whole is None else whole.rmse,
            "rmse_plan": of_all.rmse["rmse_h1"],
            **{name: of_all.of_moments[name] for name in ("ce90", "ce95", "le90", "le95")},
            "ellipse": ellipse if np.isfinite(ellipse).all() else None,
        }
        scope = counted(of_all.n, "check point")
        figures += [(key, ABSOLUTE, value, scope) for key, value in values.items()]
    if lengths is not None:
        figures.append(("rmse", RELATIVE, lengths.rms, counted(len(lengths.errors), "length")))
    return [own for own in figures if own[2] is not None]
