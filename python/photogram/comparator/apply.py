"""Corrections applied to tables of measurements."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.readings import LARGEST_UM
from photogram.errors import InputError
from photogram.io.rows import cells

if TYPE_CHECKING:
    from photogram.comparator.correction import Correction
    from photogram.comparator.csvfile import Table

__all__ = ["correct_table"]

CORRECTED = ("corrected_x_um", "corrected_y_um", "sd_x_um", "sd_y_um")
READINGS = ("reading_x_um", "reading_y_um")


def correct_table(correction: Correction, table: Table, *, invert: bool = False) -> bytes:
    """Return a table with corrected coordinates and their standard deviations behind its columns.

    The standard deviations are what the calibration contributes; those of the readings come on top.

    Parameters
    ----------
    correction
        The correction.
    table
        Its coordinates are readings; with `invert` they are corrected coordinates, and readings are added.

    Raises
    ------
    InputError
        A row without coordinates, or no row.
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
        values = correction.invert(xy_um)
    else:
        columns = CORRECTED
        with np.errstate(over="ignore", invalid="ignore"):
            variances = np.diagonal(correction.covariance_of(xy_um), axis1=1, axis2=2)
            # Rounding may leave a variance of zero below it.
            values = np.hstack([correction.apply(xy_um), np.sqrt(np.maximum(variances, 0.0))])
    if not np.isfinite(values).all():
        place = table.records.records[int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])]
        raise place.error("the correction gives no finite coordinates here")
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*table.columns, *columns])
    for place, own in zip(table.records.records, values.tolist(), strict=True):
        writer.writerow([*cells(place), *(f"{value:.4f}" for value in own)])
    return buffer.getvalue().encode()
