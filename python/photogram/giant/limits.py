"""Limits N1 to N6 of the 1987 program (GIANT guide, section I.E)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Self

import numpy as np

from photogram.arguments.types import Bools, Indices
from photogram.errors import InputError
from photogram.giant.records import error_at, message_at
from photogram.lazy_dataclasses import dataclass, fields
from photogram.messages import Message
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.giant import Project
    from photogram.giant.frames import Frame
    from photogram.giant.ground import GroundPoint
    from photogram.network.structuring import Structure

NAMES = {
    "N1": "stations",
    "N2": "points",
    "N3": "control",
    "N4": "photos_per_point",
    "N5": "cameras",
    "N6": "bandwidth",
}
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
        values: dict[str, int] = {}
        for each in text.split(","):
            name, _, value = (part.strip() for part in each.partition("="))
            if name.upper() not in NAMES or not (value.isascii() and value.isdigit()):
                raise InputError(phrase("giant.limits", value=each.strip()))
            values[NAMES[name.upper()]] = int(value)
        return cls(**values)


def check_files(project: Project, limits: Limits) -> None:
    """Reject more stations, control or cameras than the limits allow."""
    control = sum(1 + point.repeats for point in project.ground)
    _check("CAMERA STATIONS", project.frames, len(project.frames), limits.stations)
    _check("GROUND CONTROL", project.ground, control, limits.control)
    # The guide lacks a message for N5; this one follows the others.
    _check("CAMERA SYSTEMS", [], len(project.cameras), limits.cameras)


def check_points(names: Sequence[str] | dict[str, int], limits: Limits) -> None:
    """Reject more different points than the limits allow."""
    _check("IMAGE POINTS", [], len(names), limits.points)


def _check(what: str, items: Sequence[Frame] | Sequence[GroundPoint], count: int, limit: int | None) -> None:
    if limit is None or count <= limit:
        return
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
