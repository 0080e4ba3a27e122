"""A result in a coordinate reference system on the report for the browser: control and check points."""

from __future__ import annotations

import numpy as np

from photogram.arguments.naming import natural_order
from photogram.formats.crs_results import Placed
from photogram.show.page import Column, Row, Section, Table, decimals_of

__all__ = ["placed_section"]

MOST = 500
"""Points that are listed; the tables have all."""


def placed_section(found: Placed) -> Section:
    """Return adjusted control and check points in the system of a client, with standard deviations.

    Standard deviations are along east, north and up of the system, in metres.
    """
    names, kinds = found.result.block.point_ids, found.result.point_kinds
    own = [k for k, row in enumerate(found.rows.tolist()) if kinds[row] != "pass"]
    own.sort(key=lambda k: natural_order(names[int(found.rows[k])]))
    sd = np.sqrt(np.diagonal(found.point_covariances, axis1=1, axis2=2))
    decimals = decimals_of(sd)
    columns = [
        Column("Point", text=True),
        Column("Kind", text=True),
        *(
            Column(name.capitalize(), unit, 8 if unit == "deg" else decimals)
            for name, unit in zip(found.names, found.units, strict=True)
        ),
        *(Column(f"sd {axis}", "m", decimals) for axis in ("east", "north", "up")),
    ]
    rows: list[Row] = []
    for k in own[:MOST]:
        row = int(found.rows[k])
        rows.append([names[row], str(kinds[row]), *found.points[k].tolist(), *sd[k].tolist()])
    left = len(own) - len(rows)
    note = "Tables of all photos and points are in `in_crs`" + (f"; {left} more there." if left else ".")
    title = f"Control and check points in {found.crs}"
    return Section("in-crs", title, [Table(title, columns, rows, note)] if rows else [])
