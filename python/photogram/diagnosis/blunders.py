"""One observation that does not fit: its test value, and what is said of it."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.diagnosis.findings import Finding, finding, small_unit
from photogram.diagnosis.rivals import ODDS, rival_images
from photogram.diagnosis.robust import critical
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.results.observation_kinds import ObservedKind
from photogram.results.result import Result
from photogram.show.angles import ARCSEC
from photogram.words import Phrase, phrase

TESTABLE, TESTABLE_PRIOR = 0.01, 1e-5
"""Redundancy numbers below which image coordinates, and control or stations, are not checked by the others.

Precise control at the edge of a block, or a precise distance, has a redundancy of a thousandth; its test
value still means something.
"""
BESIDE = "beside images: "  # Before the names of further kinds of observations


@dataclass(frozen=True)
class Suspect:
    """One observation: its kind, its place in the arrays of the block, and its test value."""

    kind: str
    row: int
    axis: int
    test: float


def tests(result: Result) -> dict[str, Floats]:
    """Test values by kind, in standard deviations of the residuals; 0 where nothing checks."""
    images = np.where(result.redundancy > TESTABLE, np.abs(result.standardized), 0.0)
    others = {
        "control": (result.point_redundancy, result.point_standardized),
        "station": (result.photo_redundancy, result.photo_standardized),
        **{f"{BESIDE}{name}": (each.redundancy, each.standardized) for name, each in result.kinds.items()},
    }
    return {
        "image": np.nan_to_num(images),
        **{
            name: np.where(redundancy > TESTABLE_PRIOR, np.nan_to_num(np.abs(values)), 0.0)
            for name, (redundancy, values) in others.items()
        },
    }


def kind_of(result: Result, suspect: Suspect) -> ObservedKind:
    """Return the observations of its kind, beside images."""
    return result.kinds[suspect.kind.removeprefix(BESIDE)]


def finding_of(result: Result, suspect: Suspect, spread: float) -> Finding:
    """Say that an observation does not fit; `spread` is that of the test values of its adjustment."""
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
    """Name the control whose error would leave nearly the same residuals: odds below 20."""
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
    """Say that an observation beside images does not fit."""
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
    """Say that a component of control does not fit; `error` is that of the given value."""
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
