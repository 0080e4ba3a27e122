"""The eight prints of TB 19 under sense switches."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore

if TYPE_CHECKING:
    from photogram import Orientation
    from photogram.absolute_orientation.orientation import Trace


def trace_text(result: Orientation) -> str:
    """Return intermediate results with the names and statements of the bulletin."""
    rows = np.flatnonzero(result.took_part).tolist()
    names = [result.stations.ids[row] for row in rows]
    parts = [f"photogram {_photocore.__version__}  absolute orientation  prints under sense switches"]
    kappa, scale = float(result.initial.angles[2]), result.initial.scale
    for number, trace in enumerate(result.traces, 1):
        title = f"Iteration {number}"
        parts.append("\n".join([title, "-" * len(title), *_cycle(trace, names, kappa, scale)]))
        kappa, scale = trace.parameters[2], trace.parameters[3]
    return "\n\n".join(parts) + "\n"


def _cycle(trace: Trace, names: list[str], kappa: float, scale: float) -> list[str]:
    places, rows = trace.equations
    normal, auxiliary = trace.normal, trace.auxiliary
    omega, phi, kappa_after, *others = trace.parameters
    width = max([12, *(1 + len(names[station]) for station, _ in places)])
    return [
        *_print(1, "after statement 2", "tan K", [[math.tan(kappa)]]),
        *_print(2, "before 10", "sin K, S", [[math.sin(kappa), scale]]),
        *_print(3, "after 8", "rotation matrix A", trace.rotation),
        f"sense switch 4, after 27: the eight P-values of {len(places)} equations",
        *(
            f"  {names[station]:<{width}} {'123'[axis]}" + _numbers(row)
            for (station, axis), row in zip(places, rows.tolist(), strict=True)
        ),
        *_print(
            5,
            "after 29",
            "seven diagonal terms and last term of the normal equations",
            [[*np.diag(normal[:, :7]).tolist(), float(normal[6, 7])]],
        ),
        *_print(6, "after 33", "bottom row of the auxiliary table", [auxiliary[6].tolist()]),
        *_print(7, "after 35", "seven results of the back solution", [trace.results]),
        *_print(
            8,
            "after 36",
            "seven corrected parameters: omega, phi, K (rad), S, B",
            [[omega, phi, kappa_after, *others]],
        ),
    ]


def _print(switch: int, statement: str, what: str, rows: Iterable[Iterable[float]]) -> list[str]:
    return [f"sense switch {switch}, {statement}: {what}", *(f"  {'':<14}{_numbers(row)}" for row in rows)]


def _numbers(values: Iterable[float]) -> str:
    return "".join(f"{value:>18.9e}" for value in values)
