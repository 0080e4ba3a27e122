"""Observations of every kind, as reports list and test them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.results.network import AdjustedNetwork
from photogram.statistics.outliers import Observations
from photogram.statistics.reliability import TESTABLE

__all__ = ["control_lines", "image_lines", "station_lines", "tested"]

LISTED = 10_000
"""Image points that a report lists at most; tables and documents have every one."""


def tested(
    result: AdjustedNetwork,
    image_photos: Indices,
    photos: Sequence[str],
    points: Sequence[str],
    unknowns: Sequence[str],
    axes: Sequence[str],
) -> list[Observations]:
    """Return all observations with their standardized residuals, where these say something.

    Parameters
    ----------
    image_photos
        (m,) the photo of each image.
    photos, points
        Their names.
    unknowns, axes
        What the unknowns of a photo and the coordinates of a point are called.
    """

    def image(index: tuple[int, ...]) -> str:
        point, photo = result.image_points[index[0]], image_photos[index[0]]
        return f"{'xy'[index[1]]} of point {points[point]} on photo {photos[photo]}"

    def kind(
        what: str, standardized: Floats, redundancy: Floats, named: Callable[[tuple[int, ...]], str]
    ) -> Observations:
        return Observations(what, np.where(redundancy > TESTABLE, standardized, np.nan), named)

    return [
        kind("image coordinates", result.standardized, result.redundancy, image),
        kind(
            "components of control",
            result.point_standardized,
            result.point_redundancy,
            lambda index: f"{axes[index[1]]} of control point {points[index[0]]}",
        ),
        kind(
            "components of stations",
            result.photo_standardized,
            result.photo_redundancy,
            lambda index: f"{unknowns[index[1]]} of photo {photos[index[0]]}",
        ),
    ]


def image_lines(
    result: AdjustedNetwork,
    image_photos: Indices,
    photos: Sequence[str],
    points: Sequence[str],
    unit: str,
    factor: float = 1.0,
) -> list[str]:
    """List the image observations, one point a line: what `tested` has, and residuals times `factor`."""
    used = np.flatnonzero(result.used_images)
    parts = (result.residuals * factor, result.redundancy, result.standardized)
    heads = (f"{axis} {head}" for axis in "xy" for head in (f"residual {unit}", "redundancy", "standardized"))
    lines = [f"{'photo':<10} {'point':<10}" + "".join(f"{head:>16}" for head in heads)]
    for image in used[:LISTED].tolist():
        name = f"{photos[image_photos[image]]:<10} {points[result.image_points[image]]:<10}"
        figures = "".join(
            "".join(
                f"{f'{part[image, axis]:.{decimals}f}' if math.isfinite(part[image, axis]) else '-':>16}"
                for part, decimals in zip(parts, (2, 3, 2), strict=True)
            )
            for axis in (0, 1)
        )
        lines.append(name + figures)
    if len(used) > LISTED:
        lines.append(f"and {len(used) - LISTED} more; the JSON document and the table of images have all")
    return lines if len(used) else []


def control_lines(
    result: AdjustedNetwork, points: Sequence[str], columns: Sequence[str], factors: Floats
) -> list[str]:
    """List control as observations; `factors` lead to the units of the columns."""
    held = result.held_points
    return _observed_lines(
        "point",
        [points[row] for row in np.flatnonzero(held).tolist()],
        columns,
        result.point_given_sd[held] * factors,
        result.point_residuals[held] * factors,
        result.point_redundancy[held],
        result.point_standardized[held],
    )


def station_lines(
    result: AdjustedNetwork, photos: Sequence[str], columns: Sequence[str], factors: Floats
) -> list[str]:
    """List photos as observations of their own unknowns; `factors` lead to the units of the columns."""
    known = result.known_photos
    return _observed_lines(
        "photo",
        [photos[row] for row in np.flatnonzero(known).tolist()],
        columns,
        result.photo_given_sd[known] * factors,
        result.photo_residuals[known] * factors,
        result.photo_redundancy[known],
        result.photo_standardized[known],
    )


def _observed_lines(
    kind: str,
    names: Sequence[str],
    columns: Sequence[str],
    sd: Floats,
    residuals: Floats,
    redundancy: Floats,
    standardized: Floats,
) -> list[str]:
    """Four lines for each of some observed positions: what was observed, and how it fits."""
    if not names:
        return []
    lines = [f"{kind:<10}{'':<14}" + "".join(f"{column:>18}" for column in columns)]
    held = np.isfinite(sd)
    weighted = held & (sd > 0)
    for row, name in enumerate(names):
        deviations = [
            "free" if math.isinf(each) else "fixed" if each == 0 else f"{each:.5f}" for each in sd[row]
        ]
        parts = (
            ("sd", deviations),
            ("residual", _cells(residuals[row], held[row], 5)),
            ("redundancy", _cells(redundancy[row], weighted[row], 3)),
            ("standardized", _cells(standardized[row], weighted[row], 2)),
        )
        lines += [
            f"{name if part == 'sd' else '':<10}{part:<14}" + "".join(f"{cell:>18}" for cell in cells)
            for part, cells in parts
        ]
    return lines


def _cells(values: Floats, there: Bools, decimals: int) -> list[str]:
    return [
        f"{value:.{decimals}f}" if use and math.isfinite(value) else "-"
        for value, use in zip(values, there, strict=True)
    ]
