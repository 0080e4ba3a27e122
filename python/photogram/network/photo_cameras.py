"""The cameras of a block, and which photo has which."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.arrays import shown
from photogram.arguments.types import Indices
from photogram.errors import InputError
from photogram.network.cameras import Camera

__all__ = ["checked_cameras", "photo_indices"]


def checked_cameras(cameras: object) -> tuple[Camera, ...]:
    """Return the cameras of a block.

    Raises
    ------
    InputError
        What is no list of cameras, equal names, different units.
    """
    if not isinstance(cameras, Sequence):
        raise InputError(f"cameras is no list: {shown(cameras)}")
    for each in cameras:
        if not isinstance(each, Camera):
            raise InputError(f"cameras holds what is no Camera: {shown(each)}")
    names = [each.name for each in cameras if each.name]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"cameras: {twice!r} stands there more than once")
    units = {each.unit for each in cameras}
    if len(units) > 1:
        raise InputError("cameras: image coordinates of one block are in one unit, mm or px")
    return tuple(cameras)


def photo_indices(given: object, cameras: Sequence[Camera], photos: int) -> Indices:
    """Return (P,) which camera each photo has.

    Parameters
    ----------
    given
        (P,) indices or names of cameras, one for all photos, or None: the only camera there is, or one for
        each photo.
    cameras
        The cameras.
    photos
        P.

    Raises
    ------
    InputError
        Cameras that are not there, another number of photos, None where it does not say which.
    """
    if given is None:
        if len(cameras) not in (1, photos):
            raise InputError("photo_cameras must say which photo has which camera")
        return np.zeros(photos, dtype=np.int64) if len(cameras) == 1 else np.arange(photos)
    whole = [given] * photos if isinstance(given, str | int) else given
    try:
        listed = list(whole)  # type: ignore[call-overload]
    except TypeError:
        raise InputError(f"photo_cameras is no list of cameras: {shown(given)}") from None
    if len(listed) != photos:
        raise InputError(f"photo_cameras has {len(listed)} rows, but there are {photos} photos")
    places: dict[object, int] = {each.name: row for row, each in enumerate(cameras) if each.name}
    found = np.empty(photos, dtype=np.int64)
    for row, each in enumerate(listed):
        place = places.get(each) if isinstance(each, str) else _index(each, len(cameras))
        if place is None:
            raise InputError(f"photo_cameras: there is no camera {shown(each)}")
        found[row] = place
    return found


def _index(each: object, count: int) -> int | None:
    if isinstance(each, bool | np.bool_) or not isinstance(each, int | np.integer):
        return None
    return int(each) if 0 <= each < count else None
