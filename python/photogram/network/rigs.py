"""Rigs: photos taken simultaneously by cameras on one frame."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.arguments.arrays import elements, object_name
from photogram.arguments.fields import check_fields
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.moving_photos import require_photos
from photogram.network.unknowns import Sensor
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Mount:
    """Mount of a photo: its sensor is fixed on a frame, A = A_f A_s, C = C_f + A_f c.

    The pose of the photo follows from frame and sensor; its pose in the block is only an approximation.

    Parameters
    ----------
    photo
        Name of the photo.
    frame
        Name of the photo that represents the frame: the photo of the first sensor. It may be without images.
    sensor
        Pose of the sensor in the frame, one object for all its photos.
    """

    photo: str = field(metadata={"check": object_name})
    frame: str = field(metadata={"check": object_name})
    sensor: Sensor

    def __post_init__(self) -> None:
        check_fields(self, "a mount")


def checked_mounts(mounts: object, photos: Sequence[str]) -> tuple[Mount, ...]:
    """Return validated mounts that are consistent with each other and with a block."""
    checked = elements("mounts", mounts, Mount)
    frames = {each.frame for each in checked}
    require_photos("mounts", [each.photo for each in checked], photos)
    require_photos("mounts", sorted(frames), photos)
    if both := sorted(frames & {each.photo for each in checked}):
        raise InputError(phrase("block.mounted-frame", photo=both[0]))
    return checked
