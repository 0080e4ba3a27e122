"""Observations of every kind, as reports list and test them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.results.network import AdjustedNetwork, Observed
from photogram.statistics.outliers import Observations
from photogram.statistics.reliability import TESTABLE

__all__ = ["image_lines", "observed_lines", "tested"]

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
    listed = used[:LISTED]
    figures = np.stack([part[listed] for part in parts], axis=2).reshape(len(listed), -1)
    whole = "{:>16.2f}{:>16.3f}{:>16.2f}" * 2
    rows = zip(
        image_photos[listed].tolist(),
        result.image_points[listed].tolist(),
        figures.tolist(),
        np.atleast_1d(np.isfinite(figures).all(axis=1)).tolist(),
        strict=True,
    )
    for photo, point, row, finite in rows:
        cells = whole.format(*row) if finite else "".join(map(_image_cell, row, (2, 3, 2) * 2))
        lines.append(f"{photos[photo]:<10} {points[point]:<10}{cells}")
    if len(used) > LISTED:
        lines.append(f"and {len(used) - LISTED} more; the JSON document and the table of images have all")
    return lines if len(used) else []


def _image_cell(value: float, decimals: int) -> str:
    return f"{f'{value:.{decimals}f}' if math.isfinite(value) else '-':>16}"


def observed_lines(
    kind: str, names: Sequence[str], columns: Sequence[str], factors: Floats, given: Observed
) -> list[str]:
    """List observed components, four lines for each point or photo: what was observed, and how it fits.

    Parameters
    ----------
    kind
        `point` or `photo`.
    names
        Of all points or photos.
    columns, factors
        The components with their units, and what leads to these.
    given
        The observations.
    """
    if not len(given.rows):
        return []
    sd, differences = given.sd * factors, given.differences * factors
    lines = [f"{kind:<10}{'':<14}" + "".join(f"{column:>18}" for column in columns)]
    held = np.isfinite(sd)
    weighted = held & (sd > 0)
    for row, name in enumerate(names[index] for index in given.rows.tolist()):
        deviations = [
            "free" if math.isinf(each) else "fixed" if each == 0 else f"{each:.5f}" for each in sd[row]
        ]
        parts = (
            ("sd", deviations),
            ("difference", _cells(differences[row], held[row], 5)),
            ("redundancy", _cells(given.redundancy[row], weighted[row], 3)),
            ("standardized", _cells(given.tests[row], weighted[row], 2)),
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
