"""Corrections applied to tables of measurements."""

from __future__ import annotations

import csv
import io

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.correction import Correction
from photogram.comparator.csvfile import Table
from photogram.comparator.readings import LARGEST_UM
from photogram.errors import InputError
from photogram.io.rows import cells
from photogram.messages import Message, counted

CORRECTED = ("corrected_x_um", "corrected_y_um", "sd_x_um", "sd_y_um", "in_range")
READINGS = ("reading_x_um", "reading_y_um", "in_range")
EDGE = 1.25  # In half ranges from the middle: nearer than this polynomials extrapolate with a remark
ROUNDING = 1e-6  # Of places on the edge, in half ranges


def correct_table(
    correction: Correction, table: Table, *, invert: bool = False, extrapolate: bool = False
) -> tuple[bytes, list[Message]]:
    """Return a table with corrected coordinates and their standard deviations added, and remarks.

    The standard deviations are what the calibration contributes; those of the readings come on top. The
    column `in_range` says whether the calibration measured there. With `invert` coordinates are corrected
    ones, and readings are added; `extrapolate` corrects points far outside the calibrated range, too.
    """
    places = []
    for row in table.records.rows():
        xy = table.coordinates_um(row)
        if xy is None:
            raise row.place.error("the coordinates are blank")
        if max(map(abs, xy)) > LARGEST_UM:
            raise row.place.error(f"a coordinate is beyond every comparator ({LARGEST_UM:g} um)")
        places.append(xy)
    if not places:
        raise InputError("holds no measurements", file=table.path)
    xy_um = np.array(places)
    if invert:
        columns: tuple[str, ...] = READINGS
        values = readings = correction.invert(xy_um)
    else:
        columns, readings = CORRECTED, xy_um
        with np.errstate(over="ignore", invalid="ignore"):
            variances = np.diagonal(correction.covariance_of(xy_um), axis1=1, axis2=2)
            # Rounding may leave a variance of zero below it.
            values = np.hstack([correction.apply(xy_um), np.sqrt(np.maximum(variances, 0.0))])
    if not np.isfinite(values).all():
        place = table.records.records[int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])]
        raise place.error("the correction gives no finite coordinates here")
    reach = correction.reach(readings)
    remarks = _outside(correction, table, readings, reach, extrapolate=extrapolate)
    there = ["" if np.isnan(own) else "yes" if own <= 1 + ROUNDING else "no" for own in reach.tolist()]
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*table.columns, *columns])
    for place, own, within in zip(table.records.records, values.tolist(), there, strict=True):
        writer.writerow([*cells(place, table.records.delimiter), *(f"{value:.4f}" for value in own), within])
    return buffer.getvalue().encode(), remarks


def _outside(
    correction: Correction, table: Table, readings: Floats, reach: Floats, *, extrapolate: bool
) -> list[Message]:
    """Remark on places that were not calibrated; refuse those far away."""
    if np.isnan(reach).all():
        return [Message("the correction does not say where it was calibrated: no range is checked")]
    outside = reach > 1 + ROUNDING
    if not outside.any():
        return []
    worst = int(reach.argmax())
    x, y = readings[worst].tolist()
    identity = correction.identity
    where = f" ({identity.range_text})" if identity else ""
    text = (
        f"{counted(int(outside.sum()), 'point')} of {len(reach)} outside the calibrated range{where}, the"
        f" furthest here: {x:.0f}, {y:.0f} um is {reach[worst]:.3g} half ranges from its middle"
    )
    place = table.records.records[worst]
    if reach[worst] > EDGE and not extrapolate:
        raise place.error(f"{text}; --extrapolate corrects them nevertheless")
    return [place.message(f"{text}: the correction extrapolates")]
