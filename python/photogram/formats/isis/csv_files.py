"""`images.csv`, `points.csv` and `residuals.csv` with the columns of jigsaw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.isis.network import POINT_TYPES
from photogram.formats.isis.outcome import Outcome
from photogram.formats.isis.parameters import KM, Parameter, parameters
from photogram.io.csv_text import csv_text

__all__ = ["accuracy", "csv_files", "rms"]


def csv_files(outcome: Outcome) -> Mapping[str, bytes]:
    """Return the three tables by the names of their files."""
    return {
        "images.csv": _images(outcome),
        "points.csv": _points(outcome),
        "residuals.csv": _residuals(outcome),
    }


def _table(heads: Sequence[Sequence[str]], columns: Sequence[Any]) -> bytes:
    """Return a table with a header of several lines; `heads` are those of each column."""
    lines = [",".join(line) for line in zip(*heads, strict=True)]
    _, rows = csv_text({str(k): column for k, column in enumerate(columns)}).split(b"\n", 1)
    return ("\n".join(lines) + "\n").encode() + rows


def rms(residuals: Floats) -> Floats:
    """Return (3,) root mean squares of (n, 2) residuals: of samples, of lines, of both; NaN without any."""
    if not len(residuals):
        return np.full(3, np.nan)
    squares = (residuals**2).mean(axis=0)
    return np.sqrt([squares[0], squares[1], squares.mean()])


def accuracy(value: float, unit: float = 1.0) -> str:
    """Return a standard deviation a priori as jigsaw has it: FREE, N/A where it is known, or a number."""
    return "N/A" if value == 0 else repr(value * unit) if np.isfinite(value) else "FREE"


def _images(outcome: Outcome) -> bytes:
    used = outcome.result.used_images
    trajectories = outcome.result.trajectories
    found = {
        image: {
            (each.name, each.power): each
            for each in parameters(image, trajectories[image.solving.trajectory.name])
        }
        for image in outcome.contents.different
        if image.solving.trajectory.name in trajectories
    }
    # Held images have fewer coefficients.
    names = max((list(own) for own in found.values()), key=len)
    rows = []
    for image, own in found.items():
        mine = outcome.rows[image]
        cells = [str(image.path), *rms(outcome.residuals[mine[used[mine]]]).tolist()]
        rows.append(cells + [cell for name in names for cell in _cells(own.get(name))])
    heads = [("Image", "Filename"), *(("rms", f"{what} res") for what in ("sample", "line", "total"))]
    heads += [(f"{name}(t{power})", what) for name, power in names for what in _CELLS]
    return _table(heads, list(zip(*rows, strict=True)))


_CELLS = ("initial", "correction", "final", "apriori sigma", "adj sigma")


def _cells(own: Parameter | None) -> list[Any]:
    """Return the cells of a coefficient; empty ones where an image has none."""
    if own is None:
        return [None] * len(_CELLS)
    adjusted = "N/A" if own.apriori == 0 else repr(own.adjusted)
    return [own.initial, own.correction, own.final, accuracy(own.apriori), adjusted]


def _points(outcome: Outcome) -> bytes:
    network, block = outcome.contents.network, outcome.result.block
    used = np.flatnonzero(outcome.result.used_points)
    rows = outcome.point_rows[used]
    of_points = network.point_of_measure
    rejected = np.bincount(of_points[outcome.rejected], minlength=len(network.points))[rows]
    taken = block.image_points[outcome.result.used_images]
    accepted = np.bincount(taken, minlength=len(block.point_ids))[used]
    places, xyz = outcome.latitudes[used], outcome.xyz[used]
    sd = np.sqrt(np.maximum(np.einsum("nkk->nk", outcome.covariances[used]), 0.0))
    degrees = np.rad2deg(places[:, :2]).T
    columns = [
        [network.points.ids[row] for row in rows.tolist()],
        [POINT_TYPES[code].upper() for code in network.points.types[rows].tolist()],
        accepted,
        rejected,
        outcome.point_rms[used],
        *degrees,
        places[:, 2] / KM,
        *outcome.local_sigmas[used].T,
        *outcome.corrections[used].T,
        *(xyz / KM).T,
        *sd.T,
    ]
    return _table(_POINT_HEADS, columns)


_AXES = ("Latitude", "Longitude", "Radius")
_POINT_HEADS = [
    ("", "Point", "Label"),
    ("", "Point", "Status"),
    ("", "Accepted", "Measures"),
    ("", "Rejected", "Measures"),
    ("", "Residual", "RMS"),
    *(("3-d", axis, unit) for axis, unit in zip(_AXES, ("(dd)", "(dd)", "(km)"), strict=True)),
    *(("Sigma", axis, "(m)") for axis in _AXES),
    *(("Correction", axis, "(m)") for axis in _AXES),
    *(("Coordinate", axis, "(km)") for axis in "XYZ"),
    *(("Sigma", axis, "(m)") for axis in "XYZ"),
]


def _residuals(outcome: Outcome) -> bytes:
    """Return measures that took part, then those that were rejected, which have no residuals."""
    network, images = outcome.contents.network, {each.serial: each for each in outcome.contents.different}
    measures, used = network.measures, outcome.result.used_images
    rejected = np.flatnonzero(outcome.rejected)
    rows = np.concatenate([outcome.measure_rows[used], rejected])
    serials = [measures.serials[row] for row in measures.serial[rows].tolist()]
    found = np.column_stack([outcome.focal, outcome.residuals])[used]
    found = np.vstack([found, np.full((len(rejected), 4), np.nan)])
    columns = [
        [network.points.ids[row] for row in network.point_of_measure[rows].tolist()],
        [str(images[serial].path) for serial in serials],
        serials,
        *found[:, :2].T,
        measures.sample[rows],
        measures.line[rows],
        *found[:, 2:].T,
        np.hypot(*found[:, 2:].T),
        [""] * (len(rows) - len(rejected)) + ["*"] * len(rejected),
    ]
    return _table(_RESIDUAL_HEADS, columns)


_RESIDUAL_HEADS = [
    ("", "Point", "Label"),
    ("", "Image", "Filename"),
    ("", "Image", "Serial Number"),
    ("x image", "coordinate", "(mm)"),
    ("y image", "coordinate", "(mm)"),
    ("Measured", "Sample", "(pixels)"),
    ("Measured", "Line", "(pixels)"),
    ("sample", "residual", "(pixels)"),
    ("line", "residual", "(pixels)"),
    ("Residual Vector", "Magnitude", "(pixels)"),
    ("", "", "Rejected"),
]
