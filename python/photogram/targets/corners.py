"""Board corners in images: common output of readers and detectors."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fnmatch import translate
from pathlib import Path
from typing import Any, Self

import numpy as np

from photogram.arguments.arrays import (
    argument_error,
    frozen,
    names,
    repeated_pairs,
    value_field,
    whole_number,
)
from photogram.arguments.equality import Valued
from photogram.arguments.fields import array, check_arrays
from photogram.arguments.types import (
    ALL,
    NONE,
    ONE,
    Array,
    BoolArray,
    Bools,
    Floats,
    IndexArray,
    Indices,
    OptionalArray,
)
from photogram.errors import InputError
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import converting_dataclass, dataclass, field, replace
from photogram.messages import Message
from photogram.summaries import Brief, Rows, few
from photogram.targets.board import Board
from photogram.targets.options import CalibrationOptions
from photogram.words import Phrase, phrase

MIN_CORNERS_PER_VIEW = 6
_MAX_WIDTH_OF_LINE = 1e-3  # ratio of width and length of collinear corners of a view


@converting_dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Corners(Valued, Brief):
    """Corners of a board in P images of K cameras and V views; n corners.

    Parameters
    ----------
    pictures
        P image names.
    cameras
        (P,) camera of each image.
    views
        (P,) view of each image, from 0. Images of one view show the board in one pose.
    times
        (P,) seconds; None if unknown.
    camera_names
        K camera names.
    sizes
        Image width and height of each camera, pixels; None if unknown.
    picture, point
        (n,) image of each corner, and number of the board point.
    xy
        (n, 2) pixels from 0 at the centre of the first pixel: x to the right, y down.
    sd
        (n,) standard deviation of each corner relative to level 0: 1, 2, 4 ...
    use
        (n,) whether a corner is used; the source excluded the others.

    Raises
    ------
    InputError
        If arrays have other shapes, indices are out of range, names repeat, values are not finite, or
        standard deviations are not positive. If a corner repeats in an image, or if one view has two images
        of one camera.
    """

    pictures: Sequence[str]
    cameras: IndexArray = field(metadata=array("pictures", index="cameras"))
    views: IndexArray = field(metadata=array("pictures", index="pictures"))
    camera_names: Sequence[str]
    sizes: Sequence[tuple[int, int] | None]
    picture: IndexArray = field(metadata=array("corners", index="pictures"))
    point: IndexArray = field(metadata=array("corners", index="places"))
    xy: Array = field(metadata=array("corners", 2))
    sd: Array = field(default=ONE, metadata=array("corners"))
    use: BoolArray = field(default=ALL)
    times: OptionalArray = field(default=NONE, metadata=array("pictures"))

    def __post_init__(self) -> None:
        for name in ("pictures", "camera_names"):
            given = names(name, getattr(self, name))
            if len(set(given)) < len(given):
                repeated = next(each for each in given if given.count(each) > 1)
                raise InputError(phrase("error.repeated", kind=name, name=repeated))
            self._set(name, tuple(given))
        self._set("sizes", tuple(map(_size, self.sizes)))
        if len(self.sizes) != len(self.camera_names):
            fields = {"count": len(self.camera_names), "actual": len(self.sizes)}
            raise argument_error("sizes", "count", **fields)
        cameras = len(self.camera_names)
        check_arrays(self, pictures=len(self.pictures), cameras=cameras, places=2**31)
        self._set("use", frozen(np.broadcast_to(np.asarray(self.use, dtype=bool), self.sd.shape).copy()))
        for code, rows in (
            ("position", np.flatnonzero(~np.isfinite(self.xy).all(axis=1))),
            ("deviation", np.flatnonzero(~((self.sd > 0) & np.isfinite(self.sd)))),
            ("repeated-corner", repeated_pairs(self.picture, self.point, 2**31)),
        ):
            if rows.size:
                raise InputError(phrase(f"targets.{code}", corner=self.title(int(rows[0]))))
        if rows := repeated_pairs(self.views, self.cameras, len(self.camera_names)).tolist():
            fields = {"picture": self.pictures[rows[0]], "camera": self.camera_names[self.cameras[rows[0]]]}
            raise InputError(phrase("targets.second-picture", **fields))

    def title(self, row: int) -> str:
        """Return the name of a corner with its image."""
        return f"corner {self.point[row]} of {self.pictures[self.picture[row]]}"

    @property
    def view_count(self) -> int:
        """Number of views."""
        return int(self.views.max(initial=-1)) + 1

    def view_names(self) -> list[str]:
        """Return V names: the first image name of each view."""
        found = [""] * self.view_count
        for name, view in zip(reversed(self.pictures), self.views[::-1].tolist(), strict=True):
            found[view] = name
        return found

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the corners."""
        return "Corners", [
            ("pictures", few(list(self.pictures))),
            ("cameras", few(list(self.camera_names))),
            ("views", str(self.view_count)),
            ("corners", f"{len(self.xy):,}, {np.count_nonzero(~self.use)} of them left out"),
        ]

    def replace(self, **changes: Any) -> Self:
        """Return corners with some fields replaced and validated."""
        return replace(self, **changes)

    def of_pictures(self, keep: Bools) -> Corners:
        """Return the corners of some images (P,), with views renumbered."""
        pictures = np.flatnonzero(keep).tolist()
        place = np.full(len(self.pictures), -1)
        place[pictures] = np.arange(len(pictures))
        own = keep[self.picture]
        return self.replace(
            pictures=[self.pictures[row] for row in pictures],
            cameras=self.cameras[pictures],
            views=np.unique(self.views[pictures], return_inverse=True)[1].reshape(-1),
            times=None if self.times is None else self.times[pictures],
            picture=place[self.picture[own]],
            point=self.point[own],
            xy=self.xy[own],
            sd=self.sd[own],
            use=self.use[own],
        )

    def poor(self, places: Floats) -> dict[str, Phrase]:
        """Return images that do not determine a camera, with reasons.

        They have too few corners, or collinear ones in the image or among the board points (b, 3).
        """
        reasons = {}
        for row, name in enumerate(self.pictures):
            rows = np.flatnonzero(self.use & (self.picture == row))
            if len(rows) < MIN_CORNERS_PER_VIEW:
                reasons[name] = phrase("targets.few", count=len(rows), least=MIN_CORNERS_PER_VIEW)
            elif _on_a_line(self.xy[rows]) or _on_a_line(places[self.point[rows]]):
                reasons[name] = phrase("targets.line")
        return reasons


def check_points(corners: Corners, board: Board) -> None:
    """Raise an InputError if a board lacks one of the points of corners."""
    beyond = np.flatnonzero(corners.point >= len(board.places))
    if len(beyond):
        fields = {"count": len(board.places), "board": board.described}
        raise InputError(phrase("targets.corner-beyond", corner=corners.title(int(beyond[0])), **fields))


def _on_a_line(places: Floats) -> bool:
    long, wide = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)[:2]
    return not wide > _MAX_WIDTH_OF_LINE * long


def _size(given: object) -> tuple[int, int] | None:
    if given is None:
        return None
    if not (isinstance(given, Sequence) and len(given) == 2):
        raise InputError(phrase("targets.size", value=value_field(given)))
    width, height = (whole_number("size of pictures", each) for each in given)
    if min(width, height) < 1:
        raise InputError(phrase("targets.size", value=f"{width} x {height}"))
    return width, height


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


def grouped(measured: Measured, how: CalibrationOptions) -> tuple[Corners, list[Message]]:
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
    if how.sync == "none":
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
    common: dict[str, Size] = {}  # of the images of each camera, if known
    for row in kept if measured.picture_sizes else ():
        width, height = measured.picture_sizes[row]
        wide, high = how.size or common.setdefault(names[row], (width, height))
        if (wide, high) != (width, height):
            fields = {"width": width, "height": height, "wide": wide, "high": high}
            message = phrase("targets.sizes", picture=measured.images[row], **fields)
            raise InputError(message, file=measured.path)
    sizes = {**measured.sizes, **common}
    shift = 0.5 if how.pixel_origin == "corner" else 0.0
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


def _cameras_and_views(
    measured: Measured, how: CalibrationOptions
) -> tuple[list[str], list[str], Bools, list[Message]]:
    images, messages = measured.images, list[Message]()
    names, keys, keep = ["camera"] * len(images), list(images), np.ones(len(images), dtype=bool)
    if how.cameras:
        patterns = [re.compile(_with_groups(each)) for each in how.cameras]
        for row, image in enumerate(images):
            found = [(k, match) for k, each in enumerate(patterns) if (match := each.fullmatch(image))]
            if len(found) > 1:
                raise InputError(phrase("targets.two-cameras", image=image), file=measured.path)
            keep[row] = bool(found)
            for k, match in found:
                names[row], keys[row] = _name_of(how.cameras[k], k), "".join(match.groups())
        if left := [images[row] for row in np.flatnonzero(~keep).tolist()]:
            messages.append(Message(phrase("targets.no-pattern", names=left)))
    elif measured.cameras is not None:
        names = list(measured.cameras)
        if len(set(names)) > 1:  # the digits of a name, or the full name without digits
            rests = [image.replace(name, "", 1) for image, name in zip(images, names, strict=True)]
            keys = ["-".join(re.findall(r"\d+", rest)) or rest for rest in rests]
    return names, keys if measured.views is None else list(measured.views), keep, messages


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
