"""Figures of a statement by the requested standards.

See sections 2.3 and 2.6 of the specification of the statement. The factors of the National Standard for
Spatial Data Accuracy (FGDC-STD-007.3-1998) are valid for axes of nearly equal RMSE. In all cases the
statement gives the radius of 95 % of errors with the matrix of mean products. Numbers of measures of ISO
19157 are from annex D of the edition of 2013; names are from the same table in GeoAPI.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import counted, unknown_name
from photogram.network.observations import Control
from photogram.results.statement import asprs
from photogram.results.statement.comparison import Compared, plan_positions, turned_jointly, turned_to_east
from photogram.results.statement.figures import Figures, root_mean
from photogram.results.statement.layout import area_in_plan
from photogram.results.statement.leave_one_out import LeftOut
from photogram.results.statement.lengths import (
    LengthTest,
    Limit,
    angle_to_diagonal,
    at_reference,
    length_test,
    measured_lengths,
)
from photogram.results.statement.request import Asked, lengths_in
from photogram.show.quantity import members
from photogram.statistics.error_radii import circular_error
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result

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
_METRES_OF = {"h": "class_h_m", "v": "class_v_m", "3d": "class_3d_m"}
_NAMES = {"h": "horizontal", "v": "vertical", "3d": "three_d"}


@dataclass(frozen=True, eq=False)
class Asprs:
    """ASPRS Positional Accuracy Standards, Edition 2."""

    figures: Mapping[str, asprs.Accuracy | None]  # By `h`, `v`, `3d`, `vva`; None without points
    # Verdicts on the requested classes, for sentences, headline, table and JSON
    verdicts: Mapping[str, str]
    words: str  # `tested`, `produced` or `none`, by the component with the fewest check points
    # Square kilometres; number of check points that the standard requires
    area: float
    points_asked: int
    # Whether survey and control are accurate enough for the classes, by `h` and `v`
    survey: Mapping[str, bool]
    control: Mapping[str, bool]
    # Root mean squares of the standard deviations of control, radial in plan, and in height; linear unit
    control_rmse: tuple[float, float]
    remarks: tuple[asprs.Remark, ...]  # Means and differences to investigate first
    left_out: Mapping[str, float]  # RMSE of control predicted by the others, `h` and `v`; NaN without

    def member(self, asked: Asked, metre: float) -> dict[str, Any]:
        found: dict[str, Any] = dict.fromkeys(_METRES_OF.values())
        found |= {_METRES_OF[name]: size * metre for name, size in asked.classes.items()}
        for name, each in self.figures.items():
            found |= {f"upper_{name}": each and each.upper, f"rmse_{name}": each and each.rmse}
        found |= {own: self.verdicts.get(name) for name, own in _NAMES.items()}
        return found | {
            "words": self.words,
            "enough_points": self.words == "tested",
            "survey_good_enough": dict(self.survey),
            "control_good_enough": dict(self.control),
            "control_rmse": {"h": self.control_rmse[0], "v": self.control_rmse[1]},
            "points_asked_for": {f"{self.area:g} km2": self.points_asked},
            "remarks": [vars(each) for each in self.remarks],
            "leave_one_out": dict(self.left_out),
        }


@dataclass(frozen=True)
class Nssda:
    """Accuracy of n check points at 95 %, linear unit; missing values None."""

    count: int  # n
    ratio: float | None  # Smaller RMSE of an axis over the larger
    accuracy_r: float | None  # Horizontal, by the mean RMSE of the axes; None if the ratio is below 0.6
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
class Lengths:
    lines: Sequence[str]
    ends: Sequence[tuple[str, str]]
    calibrated: Floats
    limit: Limit | None
    test: LengthTest
    expansion: float | None


@dataclass(frozen=True, eq=False)
class Standards:
    """Results by standards; None if not requested or not applicable."""

    asprs: Asprs | None = None
    nssda: Nssda | None = None
    lengths: Lengths | None = None
    iso_19157: list[dict[str, Any]] = field(default_factory=list)

    @property
    def nssda_member(self) -> dict[str, Any] | None:
        if self.nssda is None:
            return None
        more = {"accuracy_r_unequal": "accuracy_r", "ce95": "ce95", "accuracy_z": "accuracy_z"}
        return members(self.nssda, "ratio", "accuracy_r_equal", **more)


def asprs_figures(
    result: Result,
    asked: Asked,
    found: Compared,
    of_all: Figures | None,
    of_vegetated: Figures | None,
    left_out: Sequence[LeftOut],
) -> Asprs:
    """Return the figures of the ASPRS, and the verdicts on the requested classes."""
    metre = lengths_in(result.block.linear_unit)
    area = asked.area
    if area is None:
        area = area_in_plan(plan_positions(result.block, result.point_positions[result.used_points]))
    km2 = area * metre**2 / 1e6
    figures = _accuracies(of_all, of_vegetated)
    classes = asked.classes
    verdicts = {name: asprs.verdict(figures[name], size) for name, size in classes.items()}
    counts = [0 if own is None else own.count for own in (figures["h"], figures["v"])]
    plan, height = _control_rmse(result)
    d = np.array([each.difference for each in left_out]).reshape(-1, 3)
    control: dict[str, bool] = {}
    if "h" in classes:
        good = asprs.control_good_enough(plan, height, classes["h"], classes.get("v"))
        control = dict(zip(("h", "v"), good, strict=True))
    return Asprs(
        figures=figures,
        verdicts=verdicts,
        words=asprs.wording(min(filter(None, counts), default=0)),
        area=km2,
        points_asked=asprs.points_asked_for(km2),
        survey={
            name: asprs.survey_good_enough(own.survey, size)
            for name, size in classes.items()
            if name != "3d" and (own := figures[name])
        },
        control=control,
        control_rmse=(plan, height),
        remarks=()
        if of_all is None
        else asprs.remarks(
            np.where(found.counted, found.differences, np.nan), classes.get("h"), classes.get("v")
        ),
        left_out={"h": root_mean((d[:, :2] ** 2).sum(axis=1)), "v": root_mean(d[:, 2] ** 2)},
    )


def _accuracies(of_all: Figures | None, of_vegetated: Figures | None) -> dict[str, asprs.Accuracy | None]:
    found: dict[str, asprs.Accuracy | None] = dict.fromkeys(("h", "v", "3d", "vva"))
    for key, own, part in (("h", of_all, "plan"), ("v", of_all, "h"), ("vva", of_vegetated, "h")):
        predicted = None if own is None else own.prediction[part]
        if own is not None and predicted is not None:
            pair = (own.rmse_h1, own.rmse_h2) if part == "plan" else (own.rmse_v1, own.rmse_v2)
            found[key] = asprs.accuracy(*pair, predicted.effective_dof, predicted.points)
    whole = None if of_all is None else of_all.prediction["all"]
    if found["h"] is not None and found["v"] is not None and whole is not None:
        found["3d"] = asprs.three_d(found["h"], found["v"], whole.effective_dof)
    return found


def _control_rmse(result: Result) -> tuple[float, float]:
    block, found = result.block, []
    turns = turned_to_east(block, block.point_positions)
    for row in np.flatnonzero(np.isfinite(block.point_sd).any(axis=1) & result.used_points).tolist():
        known = np.isfinite(block.point_sd[row])
        own = np.abs(turns[row]) @ np.where(known, block.point_sd[row], 0.0)
        found.append(np.where(known, own, np.nan))
    found += [np.sqrt(np.diag(each.precision)) for each in block.observations.of_type(Control)]
    if not found:
        return math.nan, math.nan
    squares = np.array(found) ** 2
    return root_mean(squares[:, :2].sum(axis=1)), root_mean(squares[:, 2])


def nssda(moments: Floats, rmse_z: float, count: int) -> Nssda:
    """Return the accuracy of `count` check points at 95 %.

    `moments` are (2, 2) mean products of the differences in plan, sum d d' / n: squares of RMSE_x and RMSE_y
    on its diagonal. `rmse_z` belongs to the heights, in the linear unit. Missing values are NaN.
    """
    vertical = VERTICAL * rmse_z if math.isfinite(rmse_z) else None
    if not np.isfinite(moments).all():
        return Nssda(count, None, None, None, None, vertical)
    ce95 = float(circular_error(moments[np.newaxis], 0.95)[0])
    small, large = sorted(math.sqrt(each) for each in np.diag(moments).tolist())
    ratio = small / large if large > 0 else 1.0
    mean = EITHER * (small + large) / 2
    equal = RADIAL * math.hypot(small, large)
    return Nssda(count, ratio, mean if ratio >= LEAST_RATIO else None, equal, ce95, vertical)


def tested_lengths(result: Result, asked: Asked) -> Lengths:
    """Return calibrated lengths with their test; refuse unknown points."""
    block = result.block
    names = list(dict.fromkeys(end for each in asked.lengths for end in (each["from"], each["to"])))
    places = {name: row for row, name in enumerate(block.point_ids)}
    for name in names:
        if name not in places:
            raise InputError(unknown_name("point", name, block.point_ids))
        if not result.used_points[places[name]]:
            raise InputError(phrase("adjusted.unused-point", point=name))
    rows = np.array([places[name] for name in names], dtype=np.int64)
    positions, joint = result.point_positions[rows], result.covariance(("point", names))
    if block.geographic:
        joint = turned_jointly(turned_to_east(block, positions), joint)
        positions = plan_positions(block, positions)
    pairs = np.array([[names.index(each["from"]), names.index(each["to"])] for each in asked.lengths])
    measured, covariance = measured_lengths(positions, joint, pairs)
    temperatures = np.array([each.get("temperature", math.nan) for each in asked.lengths], dtype=float)
    turned = asked.expansion is not None and bool(np.isfinite(temperatures).all())
    if turned and asked.expansion is not None:
        measured = at_reference(measured, temperatures, asked.expansion)
    limit = None if asked.limit is None else Limit(*asked.limit)
    extent = np.ptp(plan_positions(block, result.point_positions[result.used_points]), axis=0)
    ends_in_plan = plan_positions(block, result.point_positions[rows])[pairs]
    lines = [str(each["line"]) for each in asked.lengths]
    calibrated = np.array([each["length"] for each in asked.lengths], dtype=float)
    test = length_test(
        measured,
        calibrated,
        covariance=covariance,
        sd=np.array([each["sd"] for each in asked.lengths], dtype=float),
        lines=lines,
        limit=limit,
        diagonal=float(np.linalg.norm(extent)),
        off_diagonal=angle_to_diagonal(ends_in_plan[:, 1] - ends_in_plan[:, 0], extent),
        freedom=result.freedom_of_scale,
    )
    ends = [(str(each["from"]), str(each["to"])) for each in asked.lengths]
    return Lengths(lines, ends, calibrated, limit, test, asked.expansion if turned else None)


def iso_measures(
    result: Result, asked: Asked, of_all: Figures | None, lengths: Lengths | None
) -> list[dict[str, Any]]:
    """Return the figures as measures of ISO 19157."""
    more = {"unit": result.block.linear_unit, "date": asked.date}
    found: list[dict[str, Any]] = []
    if of_all is not None:
        whole = of_all.parts["all"]
        values: dict[str, Any] = {
            "bias": [None if each is None else each.mean for each in (of_all.parts[part] for part in "enh")],
            "rmse": None if whole is None else whole.rmse,
            "rmse_plan": of_all.rmse_h1,
            **{name: of_all.of_moments[name] for name in ("ce90", "ce95", "le90", "le95")},
            "ellipse": _ellipse(of_all.moments),
        }
        found += measures(values, ABSOLUTE, scope=counted(of_all.n, "check point"), **more)
    if lengths is not None:
        scope = counted(len(lengths.lines), "length")
        found += measures({"rmse": lengths.test.rms}, RELATIVE, scope=scope, **more)
    return found


def measures(
    values: Mapping[str, object], element: str, *, unit: str, date: str, scope: str
) -> list[dict[str, Any]]:
    """Return figures as data quality measures for JSON by keys in `MEASURES`."""
    return [
        {
            "element": element,
            "measure": MEASURES[key][1],
            "measure_id": MEASURES[key][0],
            "value": value,
            "unit": unit,
            "evaluation": "direct external",
            "date": date,
            "scope": scope,
        }
        for key, value in values.items()
        if value is not None
    ]


def _ellipse(moments: Floats) -> list[float] | None:
    """Return semi-axes of plan errors, and the larger axis' azimuth (rad)."""
    if not np.isfinite(moments).all():
        return None
    values, vectors = np.linalg.eigh(moments)
    a, b = (math.sqrt(max(float(each), 0.0)) for each in values[::-1])
    return [a, b, math.atan2(vectors[0, 1], vectors[1, 1]) % math.pi]
