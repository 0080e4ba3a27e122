"""Corners of files, and assignment of images to cameras and views."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fnmatch import translate
from pathlib import Path
from typing import Literal

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.targets.board import Board
from photogram.targets.choices import ViewBy
from photogram.targets.corners import Corners
from photogram.words import phrase

Size = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Measured:
    """Corners (n) in I images of files of one format."""

    path: Path  # the file or folder
    images: Sequence[str]  # I names, unique per camera
    image: Indices  # (n,) the image of each corner, and the number of the board point
    point: Indices
    xy: Floats  # as in :class:`Corners`, in the pixel convention of the file
    sd: Floats = field(default_factory=lambda: np.array(1.0))
    use: Bools = field(default_factory=lambda: np.array(True))
    cameras: Sequence[str] | None = None  # I names; None if the file does not contain them
    views: Sequence[str] | None = None
    times: Floats | None = None  # (I,) seconds
    # Width and height by camera name, or of all cameras by ""
    sizes: Mapping[str, Size] = field(default_factory=dict)
    picture_sizes: Sequence[Size] = ()  # I widths and heights, if read from image files
    board: Board | None = None
    messages: Sequence[Message] = ()

    def __post_init__(self) -> None:
        for name in ("sd", "use"):
            object.__setattr__(self, name, np.broadcast_to(getattr(self, name), len(self.point)))


@dataclass(frozen=True)
class Grouping:
    """Cameras and views of images as specified by the user."""

    cameras: Sequence[str] = ()  # a pattern (`left*.jpg`) of image names for each camera
    views: ViewBy = "name"  # criterion for images of one view
    within: float = 0.005  # largest time difference within a view, seconds
    apart: bool = False  # whether every image is a separate view: not synchronised
    size: Size | None = None  # width and height of all images
    # Location of coordinates 0, 0: center or upper-left corner of the first pixel
    origin: Literal["center", "corner"] = "center"


def grouped(measured: Measured, how: Grouping) -> tuple[Corners, list[Message]]:
    """Return corners by cameras and views, and warnings."""
    names, keys, keep, messages = _cameras_and_views(measured, how)
    # Images without corners are not used.
    keep &= np.bincount(measured.image, minlength=len(keep)) > 0
    if not keep.any():
        raise InputError(phrase("targets.no-corners"), file=measured.path)
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
    with at_place(Place(measured.path)):
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
    return corners, messages


def _sizes_of_pictures(
    measured: Measured, names: Sequence[str], rows: list[int], how: Grouping
) -> dict[str, Size]:
    """Return the common size of the images of each camera, if known."""
    found: dict[str, Size] = {}
    for row in rows if measured.picture_sizes else ():
        width, height = measured.picture_sizes[row]
        wide, high = how.size or found.setdefault(names[row], (width, height))
        if (wide, high) != (width, height):
            fields = {"width": width, "height": height, "wide": wide, "high": high}
            message = phrase("targets.sizes", picture=measured.images[row], **fields)
            raise InputError(message, file=measured.path)
    return found


def _cameras_and_views(
    measured: Measured, how: Grouping
) -> tuple[list[str], list[str], Bools, list[Message]]:
    """Return camera names, view keys and use of images, and messages."""
    images = measured.images
    keep = np.ones(len(images), dtype=bool)
    if how.cameras:
        names, keys = [""] * len(images), [""] * len(images)
        patterns = [re.compile(_with_groups(each)) for each in how.cameras]
        for row, image in enumerate(images):
            found = [(k, match) for k, each in enumerate(patterns) if (match := each.fullmatch(image))]
            if len(found) > 1:
                raise InputError(phrase("targets.two-cameras", image=image), file=measured.path)
            keep[row] = bool(found)
            for k, match in found:
                names[row] = _name_of(how.cameras[k], k)
                keys[row] = "".join(match.groups())
        left = [images[row] for row in np.flatnonzero(~keep).tolist()]
        messages = [Message(phrase("targets.no-pattern", names=left))] if left else []
        return names, _views_or(measured, keys), keep, messages
    if measured.cameras is None:
        return ["camera"] * len(images), _views_or(measured, images), keep, []
    names = list(measured.cameras)
    several = len(set(names)) > 1
    keys = list(images)
    if several:  # the digits of a name, or the full name without digits
        rests = [image.replace(name, "", 1) for image, name in zip(images, names, strict=True)]
        keys = ["-".join(re.findall(r"\d+", rest)) or rest for rest in rests]
    return names, _views_or(measured, keys), keep, []


def _views_or(measured: Measured, keys: Sequence[str]) -> list[str]:
    return list(keys if measured.views is None else measured.views)


def _with_groups(pattern: str) -> str:
    """Convert a name pattern to a regular expression with groups for wildcards."""
    parts = re.split(r"(\*|\?|\[[^]]*\])", pattern)
    return "".join(
        f"({translate(part).removeprefix('(?s:').removesuffix(')' + chr(92) + 'Z')})"
        if k % 2
        else re.escape(part)
        for k, part in enumerate(parts)
    )


def _name_of(pattern: str, number: int) -> str:
    bare = re.sub(r"\*|\?|\[[^]]*\]", "", pattern.rpartition(".")[0] or pattern).strip(" ._-/")
    return bare or f"camera {number}"


def _by_time(measured: Measured, rows: Indices, names: Sequence[str], within: float) -> Indices:
    if measured.times is None:
        raise InputError(phrase("targets.no-times"), file=measured.path)
    times = measured.times[rows]
    views = np.empty(len(rows), dtype=np.int64)
    view, begin, seen = -1, -np.inf, set[str]()
    for row in np.argsort(times, kind="stable").tolist():
        if times[row] - begin > within or names[row] in seen:
            view, begin, seen = view + 1, times[row], set()
        views[row] = view
        seen.add(names[row])
    return views
