"""CAMERAS (unit 1): the camera systems (GIANT guide, section II.B.2)."""

from __future__ import annotations

from collections.abc import Iterable

from photogram.giant.fields import format_name, format_principal_distance
from photogram.giant.records import Record, Source
from photogram.lazy_dataclasses import dataclass, field
from photogram.words import phrase


@dataclass
class Camera:
    """One camera system.

    Attributes
    ----------
    name
        At most 8 characters; blank is a name too, of use where there is one camera only.
    principal_distance
        Millimetres; negative for the positive (diapositive) plane, positive for the negative plane.
    record
        Where the camera was read.
    """

    name: str
    principal_distance: float
    record: Record | None = field(default=None, compare=False, repr=False)


def parse_cameras(source: Source) -> list[Camera]:
    """Read CAMERAS."""
    cameras: list[Camera] = []
    spellings: dict[str, Record] = {}
    for record in source.records():
        name = record.identification(spellings)
        first = spellings[name]
        if first is not record:
            raise record.error(phrase("giant.camera-repeated", camera=name, record=first.number))
        principal_distance = record.real(11, 20)
        if principal_distance == 0:
            raise record.error(phrase("giant.principal-distance", camera=name))
        cameras.append(Camera(name, principal_distance, record))
    return cameras


def camera_records(cameras: Iterable[Camera]) -> list[str]:
    """Write CAMERAS."""
    return [
        f"{format_name(camera.name)}  {format_principal_distance(camera.principal_distance)}"
        for camera in cameras
    ]
