"""Corners as files have them, and which camera and which view each image is of."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fnmatch import translate
from pathlib import Path
from typing import Literal

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message, listed
from photogram.targets.board import Board
from photogram.targets.corners import Corners

ViewBy = Literal["name", "time"]
Size = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Measured:
    """What the files of one format hold: n corners in I images."""

    path: Path  # The file or folder
    images: Sequence[str]  # I names; the same may be there once for each camera
    image: Indices  # (n,) the image of each corner, and the number of the board's point
    point: Indices
    xy: Floats  # As of :class:`Corners`, but in the pixels of the file
    sd: Floats
    use: Bools
    cameras: Sequence[str] | None = None  # I names; None where the file does not say them
    views: Sequence[str] | None = None
    times: Floats | None = None  # (I,) seconds
    # Width and height by the name of a camera, of all by ""
    sizes: Mapping[str, Size] = field(default_factory=dict)
    picture_sizes: Sequence[Size] = ()  # I widths and heights, where pictures themselves say them
    board: Board | None = None  # The board, where the file says it
    messages: Sequence[Message] = ()  # Remarks


@dataclass(frozen=True)
class Grouping:
    """What a user says of cameras and views, where files or names of images do not."""

    cameras: Sequence[str] = ()  # A pattern (`left*.jpg`) for each camera, which names its images
    views: ViewBy = "name"  # Whether images of one view are known by their names or by their times
    within: float = 0.005  # Seconds that images of one view are apart at the most
    apart: bool = False  # Whether every image is a view of its own: they are not synchronised
    size: Size | None = None  # Width and height of all pictures
    # What is 0, 0: the `center` or the upper-left `corner` of the first pixel
    origin: Literal["center", "corner"] = "center"


def grouped(measured: Measured, how: Grouping) -> tuple[Corners, list[Message]]:
    """Return corners by cameras and views, and remarks."""
    names, keys, keep, messages = _cameras_and_views(measured, how)
    # An image without corners is no picture.
    keep &= np.bincount(measured.image, minlength=len(keep)) > 0
    if not keep.any():
        raise InputError("holds no corners of a board", file=measured.path)
    rows = np.flatnonzero(keep)
    kept = rows.tolist()
    patterns = [_name_of(each, k) for k, each in enumerate(how.cameras)]
    camera_names = list(dict.fromkeys(names[row] for row in kept))
    if patterns:
        camera_names.sort(key=patterns.index)
    if how.apart:
        views = np.arange(len(rows))
    elif how.views == "time":
        views = _by_time(measured, rows, [names[row] for row in kept], how.within)
    else:
        order: dict[str, int] = {}
        views = np.array([order.setdefault(keys[row], len(order)) for row in kept], dtype=np.int64)
    place = np.full(len(keep), -1)
    place[rows] = np.arange(len(rows))
    own = keep[measured.image]
    pictures = [measured.images[row] for row in kept]
    if len(set(pictures)) < len(pictures):
        pictures = [f"{names[row]}/{measured.images[row]}" for row in kept]
    sizes = {**measured.sizes, **_sizes_of_pictures(measured, names, kept, how)}
    shift = 0.5 if how.origin == "corner" else 0.0
    try:
        corners = Corners(
            pictures=pictures,
            cameras=[camera_names.index(names[row]) for row in kept],
            views=views,
            times=None if measured.times is None else measured.times[rows],
            camera_names=camera_names,
            sizes=[how.size or sizes.get(name) or sizes.get("") for name in camera_names],
            picture=place[measured.image[own]],
            point=measured.point[own],
            xy=measured.xy[own] - shift,
            sd=measured.sd[own],
            use=measured.use[own],
        )
    except InputError as error:
        raise InputError(error.message, file=measured.path) from None
    return corners, messages


def _sizes_of_pictures(
    measured: Measured, names: Sequence[str], rows: list[int], how: Grouping
) -> dict[str, Size]:
    """Return the size of the pictures of each camera, where pictures say it: they are alike."""
    found: dict[str, Size] = {}
    for row in rows if measured.picture_sizes else ():
        width, height = measured.picture_sizes[row]
        wide, high = how.size or found.setdefault(names[row], (width, height))
        if (wide, high) != (width, height):
            raise InputError(
                f"the picture {measured.images[row]} has {width} x {height} pixels, others of its camera"
                f" {wide} x {high}: what is calibrated is a camera whose pictures are alike",
                file=measured.path,
            )
    return found


def _cameras_and_views(
    measured: Measured, how: Grouping
) -> tuple[list[str], list[str], Bools, list[Message]]:
    """Return of each image the name of its camera, what names its view, and whether it is wanted."""
    images = measured.images
    keep = np.ones(len(images), dtype=bool)
    if how.cameras:
        names, keys = [""] * len(images), [""] * len(images)
        patterns = [re.compile(_with_groups(each)) for each in how.cameras]
        for row, image in enumerate(images):
            found = [(k, match) for k, each in enumerate(patterns) if (match := each.fullmatch(image))]
            if len(found) > 1:
                raise InputError(f"the image {image} belongs to two cameras of --cameras", file=measured.path)
            keep[row] = bool(found)
            for k, match in found:
                names[row] = _name_of(how.cameras[k], k)
                keys[row] = "".join(match.groups())
        left = [images[row] for row in np.flatnonzero(~keep).tolist()]
        told = [Message(f"left out, no pattern of --cameras names them: {listed(left)}")] if left else []
        return names, _views_or(measured, keys), keep, told
    if measured.cameras is None:
        return ["camera"] * len(images), _views_or(measured, images), keep, []
    names = list(measured.cameras)
    several = len(set(names)) > 1
    keys = list(images)
    if several:  # the digits of a name, or all of it without digits
        rests = [image.replace(name, "", 1) for image, name in zip(images, names, strict=True)]
        keys = ["-".join(re.findall(r"\d+", rest)) or rest for rest in rests]
    return names, _views_or(measured, keys), keep, []


def _views_or(measured: Measured, keys: Sequence[str]) -> list[str]:
    return list(keys if measured.views is None else measured.views)


def _with_groups(pattern: str) -> str:
    """Return a pattern of names as a regular expression whose groups are what its marks stand for."""
    parts = re.split(r"(\*|\?|\[[^]]*\])", pattern)
    return "".join(
        f"({translate(part).removeprefix('(?s:').removesuffix(')' + chr(92) + 'Z')})"
        if k % 2
        else re.escape(part)
        for k, part in enumerate(parts)
    )


def _name_of(pattern: str, number: int) -> str:
    """Return what a camera is called: what its pattern says beside its marks."""
    bare = re.sub(r"\*|\?|\[[^]]*\]", "", pattern.rpartition(".")[0] or pattern).strip(" ._-/")
    return bare or f"camera {number}"


def _by_time(measured: Measured, rows: Indices, names: Sequence[str], within: float) -> Indices:
    if measured.times is None:
        raise InputError("has no times, by which --views time goes", file=measured.path)
    times = measured.times[rows]
    views = np.empty(len(rows), dtype=np.int64)
    view, begin, seen = -1, -np.inf, set[str]()
    for row in np.argsort(times, kind="stable").tolist():
        if times[row] - begin > within or names[row] in seen:
            view, begin, seen = view + 1, times[row], set()
        views[row] = view
        seen.add(names[row])
    return views
