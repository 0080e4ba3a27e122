"""The table of knots of splined cameras: where they are, and how well known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.plain.tables import Tables
from photogram.messages import quoted
from photogram.network.cameras import Camera

__all__ = ["knots_table", "with_knots"]

_SD = ("sd_radial", "sd_tangential")


def knots_table(cameras: Sequence[Camera]) -> dict[str, Any]:
    """Return the columns of the knots of cameras, row by row; nothing without any."""
    own = [(each.name, *both) for each in cameras if (both := _both(each)) is not None]
    if not own:
        return {}
    places = [np.indices(knots.shape[:2]).reshape(2, -1) for _, knots, _ in own]
    values = np.concatenate([knots.reshape(-1, 2) for _, knots, _ in own])
    sd = np.concatenate([each.reshape(-1, 2) for _, _, each in own])
    return {
        "camera": [name for (name, *_), place in zip(own, places, strict=True) for _ in place[0]],
        "i": np.concatenate([place[1] for place in places]),
        "j": np.concatenate([place[0] for place in places]),
        **dict(zip(("dx", "dy"), values.T, strict=True)),
        **dict(zip(_SD, sd.T, strict=True)),
    }


def with_knots(tables: Tables, cameras: Sequence[Camera]) -> list[Camera]:
    """Return cameras with the knots that the table has of them; those that are missing are 0 and held.

    Raises
    ------
    InputError
        Knots of a camera that has none there, or twice.
    """
    table = tables.read("knots")
    if table is None:
        return list(cameras)
    splined = {each.name: both for each in cameras if (both := _both(each)) is not None}
    values, sd = ({name: np.zeros_like(both[0]) for name, both in splined.items()} for _ in range(2))
    seen = set[tuple[str, float, float]]()
    given = {name: table.numbers(name, 0.0, infinite=name in _SD) for name in ("dx", "dy", *_SD)}
    where = zip(table.texts("camera"), table.numbers("i").tolist(), table.numbers("j").tolist(), strict=True)
    for row, (name, i, j) in enumerate(where):
        if name not in splined:
            raise table.error(row, f"column camera: there is no splined camera {quoted(name)}")
        rows, columns, _ = values[name].shape
        if not (i in range(columns) and j in range(rows)):
            raise table.error(row, f"{name} has {columns} x {rows} knots, from 0: none is {i:g}, {j:g}")
        if (name, i, j) in seen:
            raise table.error(row, f"the knot {i:g}, {j:g} of {name} is there twice")
        seen.add((name, i, j))
        values[name][int(j), int(i)] = [given["dx"][row], given["dy"][row]]
        sd[name][int(j), int(i)] = [given[each][row] for each in _SD]
    try:
        return [
            each.replace(knots=values[each.name], knot_sd=sd[each.name]) if each.name in splined else each
            for each in cameras
        ]
    except InputError as error:
        raise InputError(error.message, file=tables.settings.path) from None


def _both(camera: Camera) -> tuple[Floats, Floats] | None:
    """Return (ny, nx, 2) knots and their standard deviations; None of a camera without knots."""
    if camera.knots is None or camera.knot_sd is None:
        return None
    return camera.knots, camera.knot_sd
