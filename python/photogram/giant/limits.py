"""Limits N1 to N6 of the 1987 program, and its warnings on points and control (GIANT guide, I.E and III)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Self

import numpy as np

from photogram.arguments.types import Bools, Indices
from photogram.errors import InputError
from photogram.giant.records import error_at, message_at
from photogram.lazy_dataclasses import dataclass, fields
from photogram.messages import Message
from photogram.network.block import Block
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.giant import Project
    from photogram.giant.contents import Frame, GroundPoint
    from photogram.network.structuring import Structure

SHOWN = 40  # Largest number of point names in a message


@dataclass(frozen=True)
class Limits:
    """Limits of a job; None (default) means no limit.

    Parameters
    ----------
    stations
        N1: camera stations.
    points
        N2: different points with images.
    control
        N3: records of GROUND.
    photos_per_point
        N4: photographs of one point; images in further photographs are dropped.
    cameras
        N5: camera systems.
    bandwidth
        N6: effective bandwidth of the normal equations, in sets of three parameters.

    Raises
    ------
    InputError
        If a limit is not a positive integer.
    """

    stations: int | None = None
    points: int | None = None
    control: int | None = None
    photos_per_point: int | None = None
    cameras: int | None = None
    bandwidth: int | None = None

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if value is not None and (not isinstance(value, int) or value < 1):
                raise InputError(phrase("giant.limit", name=each.name, value=repr(value)))

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read limits with the names of the guide: `N1=300,N4=8`.

        Raises
        ------
        InputError
            If a name is unknown, or a limit is not a positive integer.
        """
        names = {f"N{number}": each.name for number, each in enumerate(fields(cls), 1)}
        values: dict[str, int] = {}
        for each in text.split(","):
            name, _, value = (part.strip() for part in each.partition("="))
            if name.upper() not in names or not (value.isascii() and value.isdigit()):
                raise InputError(phrase("giant.limits", value=each.strip()))
            values[names[name.upper()]] = int(value)
        return cls(**values)


def check_count(
    what: str, count: int, limit: int | None, items: Sequence[Frame] | Sequence[GroundPoint] = ()
) -> None:
    """Reject more items than a limit allows; the error has the record of the first one beyond it."""
    if limit is not None and count > limit:
        record = items[limit].record if len(items) > limit else None
        raise error_at(record, phrase("giant.exceeded", subject=what, limit=limit, count=count))


def allowed_images(image_points: Indices, names: list[str], limits: Limits, messages: list[Message]) -> Bools:
    """Return images below the limit N4 of photographs per point.

    `image_points` (m,) are indices of points, photo by photo; `messages` gets the warning of the guide.
    """
    limit = limits.photos_per_point
    if limit is None:
        return np.ones(len(image_points), dtype=bool)
    by_point = np.argsort(image_points, kind="stable")
    ordered = image_points[by_point]
    number = np.arange(len(ordered)) - np.searchsorted(ordered, ordered)
    allowed = np.empty(len(ordered), dtype=bool)
    allowed[by_point] = number < limit
    over = np.unique(image_points[~allowed]).tolist()
    if over:
        names_over = [names[point] for point in over]
        messages.append(Message.of("giant.many-photographs", limit=limit, names=names_over))
    return allowed


def check_bandwidth(
    structure: Structure,
    frames: list[Frame],
    points: list[str],
    limit: int,
    intersection_only: bool,
    messages: list[Message],
) -> None:
    """Reject a block whose effective bandwidth in input order exceeds a limit (N6).

    Intersection needs no normal equations of stations: then the point that exceeds the limit causes a remark
    only.
    """
    overflow = structure.overflow(limit)
    if overflow is None:
        return
    frame, point = frames[overflow.photo], points[overflow.point]
    remark = phrase("giant.bandwidth", limit=limit, point=point, frame=frame.name)
    if intersection_only:
        messages.append(message_at(frame.record, remark))
        return
    stored = [f"{photo + 1:4d}" for photo in overflow.photos]
    lines = [f"VARIABLES {' '.join(stored[first : first + 5])}" for first in range(0, len(stored), 5)]
    head = ["**ERROR IN SUBROUTINE MODID", f"ADDING VARIABLE {overflow.photo + 1}", *lines]
    raise error_at(frame.record, phrase("giant.modid", head="\n".join(head), remark=remark))


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
