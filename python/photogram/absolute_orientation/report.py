"""The listing of an orientation as text: problems, then how good it is, then values with their deviations."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.absolute_orientation.cards import restart_record, transformation_records
from photogram.absolute_orientation.orientation import Orientation
from photogram.arguments.types import Floats
from photogram.show.angles import ARCSEC
from photogram.show.sections import Section, composed, headline, problems_or_none, verdict_sections
from photogram.show.ways import report_of

__all__ = ["report", "summary"]


AXES = ("X", "Y", "Z")


@report_of.register(Orientation)
def report(result: Orientation) -> str:
    """Return the listing of an orientation."""
    sections = [
        *summary(result),
        ("Residuals in the model: v = s A X + B - x", _model_residuals(result)),
        ("Rejected control: given minus transformed", _rejected(result)),
        ("Iterations", _iterations(result)),
        ("Points", _points(result)),
        ("Transformation, as part II reads it", transformation_records(result.similarity, "0")),
        ("Parameters, as a new solution starts from them", [restart_record(result.similarity, "0")]),
    ]
    return composed(headline("absolute orientation"), sections)


def summary(result: Orientation) -> list[Section]:
    """Return what a reader wants first, as titled sections, the verdict first."""
    return [
        *verdict_sections(result.verdict),
        ("Problems", problems_or_none(result.problems, result.verdict)),
        ("Orientation", _figures(result)),
        ("Parameters: x = s A X + B", _parameters(result)),
        ("Control: residuals u = s X - A^T (x - B), known components", _control(result)),
    ]


def _figures(result: Orientation) -> list[str]:
    stations = result.stations
    given = result.used.sum(axis=0)
    sigma0 = "undefined"
    if result.sigma0 is not None:
        sigma0 = f"{result.sigma0:.6g}"
        if not result.weighted:
            ground = result.sigma0 / result.similarity.scale
            sigma0 += f" {stations.model_unit} ({ground:.6g} {stations.ground_unit})"
    ground_rms = result.rms / result.similarity.scale
    starts = {
        "restart": "a former result",
        "report": "the first two stations",
        "closed-form": "the closed form",
    }
    done = len(result.iterations) if result.cycles is None else len(result.cycles)
    rows = [
        ("status", f"{result.status} after {done} iterations ({result.method})"),
        ("initial values", starts[result.started]),
        ("stations", f"{int(result.took_part.sum())} of {len(stations.ids)} took part"),
        ("known coordinates", f"{result.known}: {given[0]} X, {given[1]} Y, {given[2]} Z"),
        ("degrees of freedom", f"{result.degrees_of_freedom}"),
        (
            "rms of residuals",
            f"{result.rms:.6g} {stations.model_unit} ({ground_rms:.6g} {stations.ground_unit})",
        ),
        ("standard deviation of unit weight", sigma0),
        ("condition number", f"{result.condition:.1f}"),
    ]
    return [f"{name:<36}{value}" for name, value in rows]


def _parameters(result: Orientation) -> list[str]:
    similarity, stations = result.similarity, result.stations
    covariance = similarity.covariance
    sd = np.full(7, np.nan) if covariance is None else np.sqrt(np.diag(covariance))
    unit = f"{stations.model_unit}"
    lines = [f"{'':<8}{'value':>20}{'sd':>16}"]
    for k, name in enumerate(("omega", "phi", "kappa")):
        angle = f"{math.degrees(similarity.angles[k]):>20.8f}"
        lines.append(f"{name:<8}{angle}{_number(sd[k] / ARCSEC, 16, 3)}  deg, sd arcsec")
    scale = f"{unit} / {stations.ground_unit}"
    lines.append(
        f"{'s':<8}{similarity.scale:>20.12g}{'held' if result.scale_held else _general(sd[3]):>16}  {scale}"
    )
    lines += [
        f"{f'b{k + 1}':<8}{similarity.translation[k]:>20.10g}{_general(sd[4 + k])}  {unit}" for k in range(3)
    ]
    return [*lines, *(f"{'A' if k == 0 else '':<8}" + _row(row) for k, row in enumerate(similarity.rotation))]


def _row(values: Floats) -> str:
    return "".join(f"{value:>20.12f}" for value in values)


def _control(result: Orientation) -> list[str]:
    unit, ground = result.stations.model_unit, result.stations.ground_unit
    columns = {"redundancy": (result.redundancy, 3), "studentized": (result.studentized, 2)}
    if result.weighted:
        columns["standardized"] = (result.standardized, 2)
    lines = [f"{'station':<12}   {unit:>14} {ground:>14}" + "".join(f"{name:>14}" for name in columns)]
    outliers = set(result.outliers)
    for row in np.flatnonzero(result.took_part).tolist():
        for axis in np.flatnonzero(result.used[row]).tolist():
            mark = "  <--" if (row, axis) in outliers else ""
            values = "".join(_number(values[row, axis], 14, places) for values, places in columns.values())
            lines.append(
                f"{result.stations.ids[row]:<12} {AXES[axis]} {result.residuals[row, axis]:>14.5g}"
                f" {result.residuals_ground[row, axis]:>14.5g}{values}{mark}"
            )
    return [*lines, _limit(result)]


def _limit(result: Orientation) -> str:
    if not math.isfinite(result.limit):
        return "no test: it takes two degrees of freedom"
    tests = int(np.isfinite(result.tested).sum())
    kind = (
        "standardized residual, normal distribution"
        if result.decided_by_w
        else f"studentized residual, Student with {result.degrees_of_freedom - 1} degrees of freedom"
    )
    return f"tested: {kind}; limit {result.limit:.2f} (5 percent for all {tests} tests together)"


def _model_residuals(result: Orientation) -> list[str]:
    unit = result.stations.model_unit
    lines = [f"{'station':<12}" + "".join(f"{f'v{axis} {unit}':>16}" for axis in "xyz")]
    for row in np.flatnonzero(result.took_part).tolist():
        values = "".join(f"{value:>16.5g}" for value in result.model_residuals[row])
        lines.append(f"{result.stations.ids[row]:<12}{values}")
    return lines


def _rejected(result: Orientation) -> list[str]:
    left_out = result.stations.given & ~result.used
    if not left_out.any():
        return []
    differences = np.where(left_out, result.differences, np.nan)
    unit = result.stations.ground_unit
    lines = [f"{'station':<12}" + "".join(f"{f'd{axis} {unit}':>16}" for axis in AXES)]
    for row in np.flatnonzero(left_out.any(axis=1)).tolist():
        values = "".join(
            f"{value:>16.5g}" if math.isfinite(value) else f"{'-':>16}" for value in differences[row]
        )
        lines.append(f"{result.stations.ids[row]:<12}{values}")
    return lines


def _iterations(result: Orientation) -> list[str]:
    if result.cycles is not None:
        head = f"{'cycle':>6} {'largest correction of an angle, rad':>36}"
        return [head, *(f"{k:>6} {value:>36.3e}" for k, value in enumerate(result.cycles, 1))]
    lines = [f"{'number':>6} {'weighted sum of squares':>24} {'largest change / sd':>20} {'damping':>9}"]
    return lines + [
        f"{i.number:>6} {i.weighted_sum_of_squares:>24.6g} {i.largest_change:>20.3e} {i.damping:>9.1e}"
        for i in result.iterations
    ]


def _points(result: Orientation) -> list[str]:
    ids, positions, covariances = result.transform_points()
    if not ids:
        return []
    unit = result.stations.ground_unit
    lines = [
        f"{'point':<12}"
        + "".join(f"{f'{axis} {unit}':>18}" for axis in AXES)
        + "".join(f"{f'sd {axis}':>11}" for axis in AXES)
    ]
    for name, position, covariance in zip(ids, positions, covariances, strict=True):
        sd = np.sqrt(np.diag(covariance))
        lines.append(f"{name:<12}" + "".join(f"{value:>18.5f}" for value in position) + _deviations(sd))
    return lines


def _deviations(sd: Sequence[float] | Floats) -> str:
    return "".join(_number(value, 11, 5) for value in sd)


def _number(value: float, width: int, decimals: int) -> str:
    if not math.isfinite(value):
        return f"{'-':>{width}}"
    return f"{value:>{width}.{decimals}f}" if abs(value) < 1e6 else f"{value:>{width}.4g}"


def _general(value: float) -> str:
    return f"{value:>16.4g}" if math.isfinite(value) else f"{'-':>16}"
