"""Warnings of the 1987 program on points and control (guide, III)."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from photogram.giant.limits import Limits
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block

if TYPE_CHECKING:
    from photogram.giant import Project


@dataclass(frozen=True)
class ErrorWarning:
    """One warning: a heading and its points.

    Attributes
    ----------
    heading
        Text of the guide.
    names
        The points, in the order of the input.
    general
        Whether the printout has the line ERROR WARNINGS above the heading.
    """

    heading: str
    names: list[str]
    general: bool = False


def error_warnings(project: Project, block: Block, limits: Limits | None = None) -> list[ErrorWarning]:
    """Return the warnings of section III of the guide, in its order.

    A control point on one photograph that loses its control is listed there only, not with the pass points.

    Parameters
    ----------
    project, block
        The project and `project.to_block()`, with or without limits.
    limits
        Only the number of photographs of a point (N4) is used.
    """
    limit = (limits or Limits()).photos_per_point
    control = {point.name: point for point in project.ground}
    missing = {name: point.held.count(False) for name, point in control.items()}
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    single = [block.point_ids[row] for row in np.flatnonzero(rays == 1).tolist()]
    photographed = set(block.point_ids)
    warnings = [
        ErrorWarning(
            "CONTROL POINTS APPEARING ON ONE PHOTOGRAPH",
            [name for name in single if missing.get(name, 0) > 1],
        ),
        ErrorWarning(
            "PASS POINTS APPEARING ON ONE PHOTOGRAPH", [name for name in single if name not in control]
        ),
        ErrorWarning(
            f"PASS POINTS APPEARING ON MORE THAN {limit} PHOTOGRAPHS",
            _on_more_photos(project, block, limit) if limit is not None else [],
        ),
        ErrorWarning("POINTS NOT PHOTOGRAPHED", [name for name in control if name not in photographed], True),
        ErrorWarning("DUPLICATE CONTROL POINTS", _repeated(project), True),
    ]
    return [warning for warning in warnings if warning.names]


def _on_more_photos(project: Project, block: Block, limit: int) -> list[str]:
    """Return the points with more than `limit` images, before the limit was applied."""
    photos = set(block.photo_ids)
    rays: Counter[str] = Counter()
    for frame in project.images:
        if frame.name in photos:
            rays.update(set(frame.points))
    return [name for name in block.point_ids if rays[name] > limit]


def _repeated(project: Project) -> list[str]:
    """Return the points with several records in GROUND."""
    records: Counter[str] = Counter()
    for point in project.ground:
        records[point.name] += 1 + point.repeats
    return [name for name, count in records.items() if count > 1]
