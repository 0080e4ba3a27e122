"""A single observation that does not fit: its test value and its finding."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.findings import Finding, finding, small_unit
from photogram.diagnosis.robust import critical
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.directions import without_lenses
from photogram.network.rays import Rays
from photogram.results.parts import ObservedKind
from photogram.results.result import Result
from photogram.show.angles import ARCSEC
from photogram.words import Phrase, phrase

ODDS = 20.0  # Likelihood ratio below which another observation is an alternative
ALIKE = 0.98  # Ratio of test values that cannot be distinguished, because poses are uncertain
INVISIBLE = 1e-6  # Eigenvalue of a block of R below which an error leaves no residual
TESTABLE, TESTABLE_PRIOR = 0.01, 1e-5
"""Redundancy numbers below which image coordinates, and control or stations, are not tested.

Precise control at the edge of a block, or a precise distance, has a redundancy of a thousandth. Its test
value is still meaningful."""
BESIDE = "beside images: "  # Prefix of the names of additional observations


@dataclass(frozen=True)
class Suspect:
    """An observation: type, row and column in the arrays of the block, test value."""

    kind: str
    row: int
    axis: int
    test: float


def tests(result: Result) -> dict[str, Floats]:
    """Return test values by type, in standard deviations of the residuals; 0 without redundancy."""
    values = {
        "image": (result.redundancy, result.standardized),
        "control": (result.point_redundancy, result.point_standardized),
        "station": (result.photo_redundancy, result.photo_standardized),
        **{f"{BESIDE}{name}": (each.redundancy, each.standardized) for name, each in result.kinds.items()},
    }
    least = {"image": TESTABLE}
    return {
        kind: np.where(redundancy > least.get(kind, TESTABLE_PRIOR), np.nan_to_num(np.abs(own)), 0.0)
        for kind, (redundancy, own) in values.items()
    }


def limit_of(values: dict[str, Floats], chance: float = 0.01) -> float:
    """Return the critical value of the largest of all test values."""
    return critical(sum(int((each > 0).sum()) for each in values.values()), chance)


def kind_of(result: Result, suspect: Suspect) -> ObservedKind:
    """Return all additional observations of the type of a suspect."""
    return result.kinds[suspect.kind.removeprefix(BESIDE)]


def finding_of(result: Result, suspect: Suspect, spread: float) -> Finding:
    """Return the finding on an observation; `spread` is the robust sd of test values."""
    if suspect.kind == "image":
        return _image_finding(result, suspect, spread)
    if suspect.kind == "control":
        row, axis = suspect.row, suspect.axis
        error = -float(result.point_differences[row, axis] / result.point_redundancy[row, axis])
        return control_finding(result.block, row, axis, error, suspect.test)
    if suspect.kind != "station":
        return _other_finding(result, suspect)
    name = result.block.photo_ids[suspect.row]
    code = f"check.station-misfit.{'coordinate' if suspect.axis < 3 else 'angle'}"
    message = phrase(code, photo=name, axis=suspect.axis % 3 + 1, test=suspect.test)
    return finding("look", message, [name], values={"test_value": suspect.test})


def with_rivals(misfit: Finding, result: Result, suspect: Suspect, spread: float) -> Finding:
    """Add control points with nearly equal residuals (likelihood ratio below 20)."""
    values = tests(result)["control"].max(axis=1) / spread
    near = (suspect.test / spread) ** 2 - values**2 < 2 * math.log(ODDS)
    near &= values > critical(int((values > 0).sum()))
    near[suspect.row] = False
    names = [result.block.point_ids[row] for row in np.flatnonzero(near).tolist()]
    if not names or misfit.phrase is None:
        return misfit
    fields = {**misfit.phrase.fields, "rivals": phrase("check.rival.control", points=names)}
    message = Phrase(misfit.phrase.code, fields)
    return replace(misfit, text=str(message), points=[*misfit.points, *names], phrase=message)


def _other_finding(result: Result, suspect: Suspect) -> Finding:
    kind = kind_of(result, suspect)
    observation = result.block.observations[int(kind.rows[suspect.row])]
    redundancy = float(kind.redundancy[suspect.row, suspect.axis])
    error, unit = float(kind.residuals[suspect.row, suspect.axis]) / redundancy, kind.units[suspect.axis]
    if unit == "rad":
        error, unit = error / ARCSEC, "arcsec"
    values = {"test_value": suspect.test, "redundancy": redundancy, f"error_{unit}".rstrip("_"): error}
    message = phrase(
        "check.observation-misfit",
        component=kind.components[suspect.axis],
        observation=observation.name,
        test=suspect.test,
        redundancy=redundancy,
        error=error,
        unit=unit,
    )
    return finding("look", message, observation.photos, observation.points, values=values)


def control_finding(block: Block, row: int, axis: int, error: float, test: float) -> Finding:
    """Return the finding on a control component; `error` is that of the given value."""
    angle = block.geographic and axis < 2
    unit, error = ("arcsec", float(np.degrees(error)) * 3600) if angle else (block.linear_unit, error)
    component = (("longitude", "latitude", "height") if block.geographic else ("X", "Y", "Z"))[axis]
    name = block.point_ids[row]
    values = {"component": float(axis), "test_value": test, f"error_{unit}": error}
    fields = {"component": component, "point": name, "test": test, "error": error, "unit": unit}
    return finding("look", phrase("check.control-misfit.component", **fields), [], [name], values=values)


def _image_finding(result: Result, suspect: Suspect, spread: float) -> Finding:
    block, row, axis = result.block, suspect.row, suspect.axis
    photo, point = int(block.image_photos[row]), int(block.image_points[row])
    redundancy = float(result.redundancy[row, axis])
    error = float(result.residuals[row, axis]) / redundancy
    others = [
        block.photo_ids[each] for each in block.image_photos[rival_images(result, row, spread)].tolist()
    ]
    two = np.count_nonzero(block.image_points == point) == 2
    rivals = phrase(f"check.rival.{'two-rays' if two else 'images'}", photos=others) if others else ""
    unit, factor = small_unit(block.image_unit)
    values = {f"error_{unit}": error * factor, "test_value": suspect.test, "redundancy": redundancy}
    message = phrase(
        "check.blunder.image",
        point=block.point_ids[point],
        photo=block.photo_ids[photo],
        axis="xy"[axis],
        error=error * factor,
        unit=unit,
        test=suspect.test,
        redundancy=redundancy,
        rivals=rivals,
    )
    photos = [block.photo_ids[photo], *others]
    values["axis"] = float(axis)
    return finding("look", message, photos, [block.point_ids[point]], values)


def rival_images(result: Result, row: int, spread: float) -> Indices:
    """Return other observations of a point that may be wrong instead of one row.

    With two rays, or three of photos in a row, errors of different observations leave the same residuals. The
    test of an observation as a group (x and y together) is T = v' R^- v. Its residuals v are in standard
    deviations, and R = I - A N^-1 A' is its block for fixed photos. A contains the partials of the
    observations of the point by its position. The likelihood ratio of two observations is exp((T_i - T_j) / 2
    - (m_i - m_j)), with m the rank of the block (Akaike weights).
    """
    block = result.block
    point = int(block.image_points[row])
    rows = np.flatnonzero((block.image_points == point) & result.used_images)
    plain = without_lenses(
        block.replace(photo_positions=result.photo_positions, photo_attitudes=result.photo_attitudes)
    )
    if len(rows) == 2:
        return np.asarray(rows[rows != row])
    if len(plain.image_xy) < len(block.image_xy):
        return rows[:0]
    rays = Rays.of(plain)
    design = rays.partials(rays.axes.positions(result.point_positions[[point]]), rows)
    design = (design / block.image_sd[rows][:, :, np.newaxis]).reshape(-1, 3)
    normal = design.T @ design
    held = np.isfinite(block.point_sd[point]) & (block.point_sd[point] > 0)
    per_unit = np.ones(3) if block.spheroid is None else np.array([block.spheroid.a, block.spheroid.a, 1.0])
    normal[held, held] += 1 / (per_unit * block.point_sd[point])[held] ** 2
    visible = np.eye(len(design)) - design @ np.linalg.pinv(normal, rcond=1e-12) @ design.T
    residuals = (result.residuals[rows] / block.image_sd[rows]).ravel() / spread
    tests = [_test(visible[i : i + 2, i : i + 2], residuals[i : i + 2]) for i in range(0, len(residuals), 2)]
    value, rank = tests[int(np.flatnonzero(rows == row)[0])]
    near = [(value - other) / 2 - (rank - m) < math.log(ODDS) or other > ALIKE * value for other, m in tests]
    return np.asarray(rows[np.array(near) & (rows != row)])


def _test(block: Floats, residuals: Floats) -> tuple[float, int]:
    sizes, axes = np.linalg.eigh(block)
    seen = sizes > INVISIBLE
    return float(((axes.T @ residuals)[seen] ** 2 / sizes[seen]).sum()), int(seen.sum())
