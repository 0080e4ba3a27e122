"""Application of a correction to tables of measurements."""

from __future__ import annotations

import csv
import io

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.correction import Correction
from photogram.comparator.csvfile import Table
from photogram.comparator.readings import LARGEST_UM
from photogram.errors import InputError
from photogram.io.delimited import cells
from photogram.io.places import at_place
from photogram.messages import Message
from photogram.words import phrase

CORRECTED = ("corrected_x_um", "corrected_y_um", "sd_x_um", "sd_y_um", "in_range")
READINGS = ("reading_x_um", "reading_y_um", "in_range")
EDGE = 1.25  # extrapolation limit for a warning, in half ranges from the centre
ROUNDING = 1e-6  # of readings on the edge, in half ranges


def correct_table(
    correction: Correction, table: Table, *, invert: bool = False, extrapolate: bool = False
) -> tuple[bytes, list[Message]]:
    """Return a table with corrected coordinates and standard deviations, and warnings.

    Standard deviations are propagated from the correction without the readings. The column `in_range` is yes
    inside the calibrated range. With `invert`, readings are computed from corrected coordinates.
    """
    xy_um = table.xy_um
    sizes = np.abs(xy_um).max(axis=1, initial=0.0)
    for row in np.flatnonzero(~(sizes <= LARGEST_UM))[:1].tolist():
        code = "error.empty" if np.isnan(sizes[row]) else "error.most"
        with at_place(table.records.place(row), "x, y"):
            raise InputError(phrase(code, value=float(sizes[row]), high=LARGEST_UM))
    if not len(xy_um):
        raise InputError(phrase("error.empty-file", content="measurements"), file=table.records.path)
    if invert:
        columns: tuple[str, ...] = READINGS
        values = readings = correction.invert(xy_um)
    else:
        columns, readings = CORRECTED, xy_um
        with np.errstate(over="ignore", invalid="ignore"):
            variances = np.diagonal(correction.covariance_of(xy_um), axis1=1, axis2=2)
            # Rounding may make a zero variance negative.
            values = np.hstack([correction.apply(xy_um), np.sqrt(np.maximum(variances, 0.0))])
    if not np.isfinite(values).all():
        worst = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
        raise table.records.error(worst, phrase("comparators.infinite"))
    reach = correction.reach(readings)
    remarks = _outside(correction, table, readings, reach, extrapolate=extrapolate)
    in_range = ["" if np.isnan(far) else "yes" if far <= 1 + ROUNDING else "no" for far in reach.tolist()]
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*table.records.columns, *columns])
    for row, (numbers, within) in enumerate(zip(values.tolist(), in_range, strict=True)):
        texts = [f"{number:.4f}" for number in numbers]
        writer.writerow([*cells(table.records.place(row), table.records.delimiter), *texts, within])
    return buffer.getvalue().encode(), remarks


def _outside(
    correction: Correction, table: Table, readings: Floats, reach: Floats, *, extrapolate: bool
) -> list[Message]:
    """Return a warning on readings outside the calibrated range; reject distant ones."""
    if np.isnan(reach).all():
        return [Message(phrase("comparators.unknown-range"))]
    outside = int((reach > 1 + ROUNDING).sum())
    if not outside:
        return []
    worst = int(reach.argmax())
    x, y = readings[worst].tolist()
    identity, place = correction.identity, table.records.place(worst)
    farthest = {"x": x, "y": y, "reach": float(reach[worst])}
    farthest["range"] = f" ({identity.range_text})" if identity else ""
    if reach[worst] > EDGE and not extrapolate:
        raise place.error(phrase("comparators.far-outside", limit=EDGE, **farthest))
    return [place.message(phrase("comparators.outside", n=outside, count=len(reach), **farthest))]
