"""A plan as a picture: the patterns in plan, the expected standard deviation in height as colour."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.errors import PhotogramError
from photogram.lazy_dataclasses import replace
from photogram.show.sketch.declared import Panel, around
from photogram.show.sketch.layout import labelled
from photogram.show.sketch.marks import NOWHERE, Mark, Markers, Shades
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, VERMILION
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.planning.pattern import Pattern

_PANEL_INCHES = 6.0  # Longer side of a panel
_MAX_SIDE_BY_SIDE = 2.5  # Width over height of a block; panels of wider blocks are stacked
_KINDS = (("full control", "^"), ("height control", "o"), ("plane control", "s"))


def plan_sketch(patterns: Sequence[Pattern]) -> Plot:
    """Return a picture with a panel for each pattern, in one scale of lengths and one of colours."""
    heights = np.concatenate([pattern.point_sd[pattern.new_points, 2] for pattern in patterns])
    if heights.size == 0:
        raise PhotogramError(phrase("plan.new-points"))
    plan = np.vstack([pattern.point_plan[pattern.result.used_points] for pattern in patterns])
    photos = np.vstack([pattern.photo_plan for pattern in patterns])
    limits = around(np.vstack([plan, photos]), 0.05)
    label = f"expected standard deviation in height, {patterns[0].block.linear_unit}"
    shades = Shades(float(heights.min()), float(heights.max()), label)
    panels = [_panel(pattern, limits, shades) for pattern in patterns]
    panels[-1] = _with_legend(panels)
    width, height = np.maximum(np.ptp(plan, axis=0), 1e-9).tolist()
    stacked = width > _MAX_SIDE_BY_SIDE * height
    rows, columns = (len(panels), 1) if stacked else (1, len(panels))
    across = max(2 * _PANEL_INCHES if stacked else min(_PANEL_INCHES, _PANEL_INCHES * width / height), 3.5)
    up = min(across * height / width, _PANEL_INCHES)
    size = columns * (across + 0.5) + 3.0, rows * (up + 1.0) + 0.4
    return Plot(*size, panels, columns, shades)


def _with_legend(panels: Sequence[Panel]) -> Panel:
    *_, last = panels
    known = {mark.label for mark in labelled(last)}
    every = {mark.label: mark for panel in panels for mark in labelled(panel) if isinstance(mark, Markers)}
    more = [replace(mark, places=NOWHERE) for label, mark in every.items() if label not in known]
    return replace(last, marks=[*last.marks, *more], legend="beside")


def _panel(pattern: Pattern, limits: Floats, shades: Shades) -> Panel:
    new, unit, plan = pattern.new_points, pattern.block.linear_unit, pattern.point_plan
    sd = pattern.point_sd[new, 2]
    size = float(np.sqrt(np.clip(2e4 / max(1, len(sd)), 2, 30)))
    marks: list[Mark] = [
        # The worst on top: where points are dense, they are what a planner looks for.
        Markers(plan[new], "o", size, values=sd, shades=shades, rising=True, layer=1.0),
        Markers(pattern.photo_plan, "+", 4.0, FAINT, label="photo"),
    ]
    held = np.isfinite(pattern.block.point_sd) & pattern.result.used_points[:, np.newaxis]
    plane, height = held[:, :2].any(axis=1), held[:, 2]
    chosen = plane & height, height & ~plane, plane & ~height
    marks += [
        Markers(plan[rows], shape, 7.7, VERMILION, "white", 1.6, label=name)
        for (name, shape), rows in zip(_KINDS, chosen, strict=True)
        if rows.any()
    ]
    quality = pattern.points[-1]
    figures = f"rms {quality.rms_sd[2]:#.3g} {unit}, largest {quality.max_sd[2]:#.3g} {unit}"
    across, up = (f"{axis}, {unit}" for axis in pattern.axes[:2])
    return Panel(limits, marks, f"{pattern.name}\n{figures}", across, up, equal=True)
