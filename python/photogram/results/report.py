"""The adjustment report as text: problems, then how good it is, then values with their deviations."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.network.geometry import lengths_of_units
from photogram.network.structuring import structure
from photogram.results.calibration_report import calibration_sections
from photogram.results.features_report import features_sections
from photogram.results.findings import axes, tested_observations
from photogram.results.group_sums import observables, sums_of
from photogram.results.grouping import grouped
from photogram.results.kinds import kind_lines
from photogram.results.observed import image_lines, observed_lines
from photogram.results.outward import outward
from photogram.results.result import Result
from photogram.results.unknowns import unknown_lines
from photogram.results.weakest import weakest_lines
from photogram.show.angles import ARCSEC, degrees_minutes_seconds
from photogram.show.sections import Section, composed, headline, problems, problems_or_none, verdict_sections
from photogram.show.ways import report_of
from photogram.statistics.limits import normal_limit
from photogram.statistics.outliers import outliers
from photogram.statistics.reliability import TESTABLE

if TYPE_CHECKING:
    from photogram.arguments.types import Floats

__all__ = ["bandwidths", "problems_of", "report", "summary"]

_SUSPECTS = 20
_BLUNDER = 3.0
_ORDERINGS = {
    "input": "in input order",
    "rcm": "by reverse Cuthill-McKee",
    "amd": "by minimum degree",
    "dissection": "by nested dissection",
    "graph-dissection": "by dissection of the graph",
    "parts": "in parts, and the separators between them",
}


@report_of.register(Result)
@np.errstate(over="ignore")  # what is too large for its unit is infinite
def report(result: Result) -> str:
    """Return the report of an adjusted block."""
    sections = [
        *summary(result),
        ("Redundancy by kind of observation", _redundancy(result)),
        ("Reliability", _reliability(result)),
        ("Iterations", _iterations(result)),
        ("Check points: adjusted minus given, standard deviations, test", _check_points(result)),
        (
            "Control as observations: adjusted minus given, redundancy, standardized difference",
            _control(result),
        ),
        (
            "Components of control that are not held: adjusted minus given",
            _difference_table(result, _unheld_differences(result)),
        ),
        (
            "Stations as observations: adjusted minus given, redundancy, standardized difference",
            _stations(result),
        ),
        (
            "Observations beside images: observed minus adjusted, redundancy, standardized residual",
            kind_lines(result.kinds),
        ),
        *calibration_sections(result),
        ("Cameras that are held", _held_cameras(result)),
        ("Unknowns that observations have in common", unknown_lines(result.unknowns)),
        ("Photos", _photos(result)),
        ("Points", _points(result)),
        ("Weakest points and photos", weakest_lines(result)),
        ("Image points: observed minus computed, redundancy, standardized residual", _images(result)),
        ("Work", _work(result)),
    ]
    return composed(headline("block adjustment", result.block.title), sections)


@np.errstate(over="ignore")
def summary(result: Result) -> list[Section]:
    """Return what a reader wants first, as titled sections: verdict, problems, adjustment, residuals."""
    return [
        *verdict_sections(result.verdict),
        ("Problems", problems_or_none(problems_of(result), result.verdict)),
        ("Adjustment", _adjustment(result)),
        *features_sections(result.features),
        ("Residuals", _residuals(result)),
        (f"Image coordinates with |standardized residual| > {_BLUNDER:g}, largest first", _suspects(result)),
    ]


def problems_of(result: Result) -> list[str]:
    """Return what keeps a reader from using the values: a failed test and outliers before other remarks."""
    found = outliers(tested_observations(result), normal_limit, "standardized residuals")
    messages = [*found, *result.messages]
    return problems(messages, result.status, result.variance_of_unit_weight, result.global_test)


def _adjustment(result: Result) -> list[str]:
    block, sums = result.block, result.sums_of_squares
    kinds = result.point_kinds[result.used_points].tolist()
    variance = result.variance_of_unit_weight
    held = np.isfinite(block.point_sd) & result.used_points[:, np.newaxis]
    counts = zip(axes(result), held.sum(axis=0), strict=True)
    components = ", ".join(f"{axis} {count}" for axis, count in counts)
    basis = {
        "free": "rule of 1987",
        "constrained": "all weighted values",
        "unity": "set to 1",
        "redundancy": "redundancy numbers",
    }[result.unit_variance]
    rows = [
        ("status", result.status),
        ("iterations", f"{len(result.iterations)}"),
        ("variance of unit weight", f"{variance:.6f} ({basis})" if variance is not None else "undefined"),
        (
            "standard deviation of unit weight",
            f"{math.sqrt(variance):.6f}" if variance is not None else "undefined",
        ),
        ("degrees of freedom", f"{result.degrees_of_freedom:.8g}"),
        ("weighted sum of squares, photos", f"{sums.camera:.6f}"),
        ("weighted sum of squares, control", f"{sums.ground:.6f}"),
        ("weighted sum of squares, images", f"{sums.plates:.6f}"),
        *(
            (f"weighted sum of squares, {each.kind}", f"{each.sum_of_squares:.6f}")
            for each in result.kinds.values()
        ),
        ("weighted sum of squares, total", f"{sums.total:.6f}"),
        ("photos", f"{len(block.photo_ids)}"),
        *([("cameras", f"{len(block.cameras)}")] if block.cameras else []),
        ("points", ", ".join(f"{kinds.count(kind)} {kind}" for kind in ("pass", "control", "check"))),
        ("held components of control", components),
        ("image points", f"{int(result.used_images.sum())} used of {len(block.image_xy)}"),
        *(
            (f"observations, {each.kind}", f"{each.used} used of {len(each.rows)}")
            for each in result.kinds.values()
        ),
        ("object space", "geographic" if block.geographic else "rectangular"),
        ("rotation angles", "photo-to-ground" if block.photo_to_ground else "ground-to-photo"),
        ("datum", str(result.datum)),
        ("refraction", block.refraction.describe(block.linear_unit) if block.refraction else "none"),
    ]
    return [f"{name:<36}{value}" for name, value in rows]


def _residuals(result: Result) -> list[str]:
    used = result.used_images
    unit, factor = image_unit(result)
    rms = [_rms(result.residuals[used][:, axis]) * factor for axis in (0, 1)]
    lines = [
        f"rms of image residuals              {value:.3f} {unit} in {name}"
        for value, name in zip(rms, "xy", strict=True)
    ]
    redundancy = result.redundancy[used]
    if np.isfinite(redundancy).all() and redundancy.size:
        lines.append(
            f"mean redundancy number              {redundancy.mean():.3f} (least {redundancy.min():.3f})"
        )
        largest = np.nan_to_num(np.abs(result.standardized[used])).max()
        lines.append(f"largest |standardized residual|     {largest:.2f}")
    for what, differences in (
        ("control points", _held_differences(result)),
        ("unheld components", _unheld_differences(result)),
        ("check points", _check_differences(result)),
    ):
        values = [_rms(column[np.isfinite(column)]) for column in differences.T]
        if np.isfinite(differences).any():
            lines.append(f"{f'rms of {what}':<36}{', '.join(_differences(result, values))}")
    return lines


def _redundancy(result: Result) -> list[str]:
    """List number, redundancy and sum of squares of every kind; the redundancies sum to the excess."""
    if result.redundancies is None or result.loss is not None:
        return []
    grouping = grouped(observables(result), "kind")
    counts, squares, redundancy = sums_of(result, grouping)
    lines = [f"{'kind':<36}{'number':>8}{'redundancy':>14}{'v P v':>14}{'factor of sd':>14}"]
    rows = zip(grouping.groups.names, counts, squares, redundancy, strict=True)
    for name, count, square, r in rows:
        factor = f"{math.sqrt(square / r):>14.3f}" if r > TESTABLE else f"{'-':>14}"
        lines.append(f"{name:<36}{count:>8}{r:>14.4f}{square:>14.4f}{factor}")
    others = result.redundancies.total - float(redundancy.sum())
    if abs(others) > TESTABLE:
        lines.append(f"{'cameras and common unknowns':<36}{'':>8}{others:>14.4f}")
    lines.append(f"{'all':<36}{'':>8}{result.redundancies.total:>14.4f}{result.sums_of_squares.total:>14.4f}")
    return lines


def _reliability(result: Result) -> list[str]:
    summary = result.reliability_summary
    return [] if summary is None else summary.lines(result.block.linear_unit)


def _iterations(result: Result) -> list[str]:
    lines = [f"{'number':>6} {'weighted sum of squares':>24} {'largest change / sd':>20} {'damping':>9}"]
    lines.append(f"{0:>6} {result.initial_weighted_sum_of_squares:>24.6f}")
    lines += [
        f"{i.number:>6} {i.weighted_sum_of_squares:>24.6f} {i.largest_change:>20.3e} {i.damping:>9.1e}"
        for i in result.iterations
    ]
    return lines


def _suspects(result: Result) -> list[str]:
    testable = result.redundancy > TESTABLE
    size = np.where(testable, np.nan_to_num(np.abs(result.standardized)), 0.0)
    images, axes = np.nonzero(size > _BLUNDER)
    if not images.size:
        return ["none"]
    order = np.argsort(-size[images, axes], kind="stable")[:_SUSPECTS]
    block, (unit, factor) = result.block, image_unit(result)
    lines = [
        f"{'photo':<10} {'point':<10}   {f'residual {unit}':>12} {'redundancy':>11} {'standardized':>13}"
    ]
    lines += [
        f"{block.photo_ids[block.image_photos[i]]:<10} {block.point_ids[block.image_points[i]]:<10} "
        f"{'xy'[axis]}"
        f" {result.residuals[i, axis] * factor:>12.2f} {result.redundancy[i, axis]:>11.3f}"
        f" {result.standardized[i, axis]:>13.2f}"
        for i, axis in zip(images[order], axes[order], strict=True)
    ]
    return lines if images.size == len(order) else [*lines, f"and {images.size - len(order)} more"]


def _held_differences(result: Result) -> Floats:
    return _differences_where(result, np.isfinite(result.block.point_sd))


def _unheld_differences(result: Result) -> Floats:
    """Return those of components of control that are not held, but have a value to compare with."""
    held = np.isfinite(result.block.point_sd)
    return _differences_where(result, held.any(axis=1, keepdims=True) & ~held)


def _check_differences(result: Result) -> Floats:
    return _differences_where(result, (result.point_kinds == "check")[:, np.newaxis])


def _differences_where(result: Result, which: np.ndarray) -> Floats:
    """Return (n, 3) adjusted minus supplied coordinates, NaN where not asked for or not supplied."""
    used = result.used_points[:, np.newaxis]
    differences: Floats = np.where(used & which, result.point_differences, np.nan)
    return differences


def _difference_table(result: Result, differences: Floats) -> list[str]:
    points = np.flatnonzero(np.isfinite(differences).any(axis=1))
    if len(points) == 0:
        return []
    axes = ("dlon", "dlat", "dh") if result.block.geographic else ("dX", "dY", "dZ")
    units = _difference_units(result)
    lines = [
        f"{'point':<10}" + "".join(f"{f'{axis} {unit}':>16}" for axis, unit in zip(axes, units, strict=True))
    ]
    for point, values in zip(points, differences[points] * _outward(result), strict=True):
        lines.append(f"{result.block.point_ids[point]:<10}" + "".join(_number(value, 5) for value in values))
    return lines


def _check_points(result: Result) -> list[str]:
    """List differences with the standard deviations of both, T or F, and p."""
    checks, (axes, units, factors) = result.check_points, outward(result.block)
    statistic = "F" if result.unit_variance != "unity" else "T"
    head = "".join(f"{f'd {axis} {unit}':>18}" for axis, unit in zip(axes, units, strict=True))
    lines = [f"{'point':<10}{'':<14}{head}{statistic:>12}{'p':>10}"] if len(checks.rows) else []
    for k, name in enumerate(checks.names):
        value, p = (float(each[k]) for each in checks.statistics)
        for first, what, values, rest in (
            (name, "difference", checks.differences[k], f"{value:>12.2f}{p:>10.2g}"),
            ("", "sd adjusted", checks.sd[k], ""),
            ("", "sd assumed" if checks.assumed[k] else "sd given", checks.given_sd[k], ""),
        ):
            cells = "".join(f"{_number(each, 5):>18}" for each in values * factors)
            lines.append(f"{first:<10}{what:<14}{cells}{rest}")
    return lines


def _control(result: Result) -> list[str]:
    columns = [f"{axis} {unit}" for axis, unit in zip(axes(result), _difference_units(result), strict=True)]
    return observed_lines("point", result.block.point_ids, columns, _outward(result), result.control)


def _stations(result: Result) -> list[str]:
    columns = [f"{axis} {unit}" for axis, unit in zip(axes(result), _difference_units(result), strict=True)]
    columns += ["omega arcsec", "phi arcsec", "kappa arcsec"]
    outward = np.append(_outward(result), [1.0 / ARCSEC] * 3)
    return observed_lines("photo", result.block.photo_ids, columns, outward, result.stations)


def _images(result: Result) -> list[str]:
    block = result.block
    return image_lines(result, block.image_photos, block.photo_ids, block.point_ids, *image_unit(result))


def _datum(result: Result) -> list[str]:
    """Say what standard deviations refer to, where they would be others in another datum."""
    return [f"standard deviations: {result.datum}"] if result.datum.is_chosen else []


def _photos(result: Result) -> list[str]:
    (position, sd_position), long = _position_formats(result), _long_format(result)
    lines = [
        *_datum(result),
        f"{'photo':<10}{_position_head(result)}{'omega deg':>15}{'phi deg':>15}{'kappa deg':>15}",
        f"{'':<10}{_sd_head(result)}{'sd arcsec':>15}{'sd arcsec':>15}{'sd arcsec':>15}{_long_head(result)}",
    ]
    rows = zip(
        result.block.photo_ids,
        result.photo_positions.tolist(),
        np.degrees(result.photo_attitudes).tolist(),
        result.photo_sd.tolist(),
        strict=True,
    )
    for name, values, angles, sd in rows:
        lines.append(f"{name:<10}{position(values)}" + "".join(f"{angle:>15.7f}" for angle in angles))
        turns = "".join(f"{each / ARCSEC:>15.3f}" for each in sd[3:])
        lines.append(f"{'':<10}{sd_position(sd[:3])}{turns}{long(sd)}")
    return lines


def _held_cameras(result: Result) -> list[str]:
    return [
        f"{each.name:<16}{each.camera.model}, {each.photos} photos: "
        + ", ".join(f"{name} {value:.8g}" for name, value in each.camera.parameters.items() if value != 0)
        for each in result.cameras
        if each.given.is_held
    ]


def _points(result: Result) -> list[str]:
    (position, sd_position), long = _position_formats(result), _long_format(result)
    lines = [
        *_datum(result),
        f"{'point':<10}{_position_head(result)}  rays  kind",
        f"{'':<10}{_sd_head(result)}{_long_head(result)}",
    ]
    rows = zip(
        result.block.point_ids,
        result.point_positions.tolist(),
        result.point_sd.tolist(),
        result.point_rays.tolist(),
        result.point_kinds,
        strict=True,
    )
    for name, values, sd, rays, kind in rows:
        if rays:
            lines.append(f"{name:<10}{position(values)}  {rays:>4}  {kind}")
            lines.append(f"{'':<10}{sd_position(sd)}{long(sd)}")
    return lines


def _work(result: Result) -> list[str]:
    order = _ORDERINGS[result.ordering]
    lines = [f"photos eliminated {order}; normal equations formed {result.formations} times"]
    lines += [
        f"{f'multiply-adds if {_ORDERINGS[name]}':<36}{count:.3e}"
        for name, count in result.predictions.items()
        if name != result.ordering
    ]
    head, figures = bandwidths(result)
    lines += [head, *(f"{f'  {name}':<36}{value}" for name, value in figures)]
    lines += [f"{f'multiply-adds of one {name}':<36}{count:.3e}" for name, count in result.operations.items()]
    return lines


def bandwidths(result: Result) -> tuple[str, list[tuple[str, str]]]:
    """Return what the 1987 program would have needed, for the order of the input and for the one chosen.

    A sentence, and names with values.
    """
    images = result.block.image_photos, result.block.image_points
    figures = []
    for name, order in (("of the input", None), ("chosen", result.photo_order)):
        found = structure(*images, order)
        value = f"{found.effective_bandwidth} effective, {found.naive_bandwidth} without sharing"
        figures.append((f"in the order {name}", value))
    return "bandwidth of the normal equations in sets of three unknowns (GIANT guide, Appendix A)", figures


def _rms(values: Floats) -> float:
    return math.sqrt(float(np.mean(values**2))) if values.size else math.nan


def image_unit(result: Result) -> tuple[str, float]:
    """Return the unit in which image residuals are written, and what leads to it."""
    return ("um", 1000.0) if result.block.image_unit == "mm" else ("px", 1.0)


def _outward(result: Result) -> Floats:
    """Return the factors from inner units to those of the report: arcsec for angles."""
    return outward(result.block)[2]


def _difference_units(result: Result) -> tuple[str, str, str]:
    return outward(result.block)[1]


def _differences(result: Result, values: Iterable[float]) -> list[str]:
    outward = np.array(list(values)) * _outward(result)
    triples = zip(axes(result), outward, _difference_units(result), _beside(result, outward), strict=True)
    return [f"{axis} {value:.5f} {unit}{long}" for axis, value, unit, long in triples if math.isfinite(value)]


def _beside(result: Result, outward: Floats) -> list[str]:
    """Return what three differences in the units of the report are as lengths, where they are angles."""
    lengths = (outward / _outward(result) * _lengths(result)).tolist()
    unit = result.block.linear_unit
    return [f" ({each:.4f} {unit})" if result.block.geographic else "" for each in lengths[:2]] + [""]


def _long_format(result: Result) -> Callable[[Sequence[float]], str]:
    """How standard deviations in plan are written as lengths, where they are angles."""
    if not result.block.geographic:
        return lambda sd: ""
    by_x, by_y, _ = _lengths(result).tolist()
    return lambda sd: f"{sd[0] * by_x:>15.4f}{sd[1] * by_y:>15.4f}"


def _lengths(result: Result) -> Floats:
    """Return (3,) the lengths of the units of the coordinates in the middle of the block."""
    middle = result.photo_positions.mean(axis=0, keepdims=True)
    found: Floats = lengths_of_units(middle, result.block.spheroid)[0]
    return found


def _position_head(result: Result) -> str:
    unit = result.block.linear_unit
    planimetry = ("longitude", "latitude") if result.block.geographic else (f"X {unit}", f"Y {unit}")
    names = (*planimetry, f"height {unit}" if result.block.geographic else f"Z {unit}")
    return "".join(f"{name:>20}" for name in names)


def _sd_head(result: Result) -> str:
    return "".join(f"{f'sd {unit}':>20}" for unit in _difference_units(result))


def _long_head(result: Result) -> str:
    unit = result.block.linear_unit
    return (
        "".join(f"{f'sd {axis} {unit}':>15}" for axis in ("east", "north")) if result.block.geographic else ""
    )


def _position_formats(
    result: Result,
) -> tuple[Callable[[Sequence[float]], str], Callable[[Sequence[float]], str]]:
    """How positions and their standard deviations are written."""
    geographic = result.block.geographic

    def position(values: Sequence[float]) -> str:
        x, y, z = values
        if geographic:
            return f"{_dms(x, 5):>20}{_dms(y, 5):>20}{z:>20.4f}"
        return f"{x:>20.4f}{y:>20.4f}{z:>20.4f}"

    by_x, by_y, by_z = _outward(result).tolist()

    def deviations(values: Sequence[float]) -> str:
        x, y, z = values
        return f"{x * by_x:>20.5f}{y * by_y:>20.5f}{z * by_z:>20.5f}"

    return position, deviations


def _dms(angle: float, decimals: int) -> str:
    degrees, minutes, seconds = degrees_minutes_seconds(angle, decimals)
    sign = "-" if angle < 0 else ""
    return f"{sign}{degrees} {minutes:02d} {seconds:0{decimals + 3}.{decimals}f}"


def _number(value: float, decimals: int) -> str:
    return f"{value:>16.{decimals}f}" if math.isfinite(value) else f"{'-':>16}"
