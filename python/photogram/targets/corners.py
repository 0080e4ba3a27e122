"""Board corners in images: common output of readers and detectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from photogram.arguments.arrays import (
    argument_error,
    frozen,
    indices,
    length,
    names,
    repeated_pairs,
    shaped,
    value_field,
    whole_number,
)
from photogram.arguments.equality import Valued
from photogram.arguments.types import (
    ALL,
    NONE,
    ONE,
    Array,
    BoolArray,
    Bools,
    Floats,
    IndexArray,
    OptionalArray,
)
from photogram.errors import InputError
from photogram.lazy_dataclasses import converting_dataclass, field, replace
from photogram.summaries import Brief, Rows, few
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
    cameras: IndexArray
    views: IndexArray
    camera_names: Sequence[str]
    sizes: Sequence[tuple[int, int] | None]
    picture: IndexArray
    point: IndexArray
    xy: Array
    sd: Array = field(default=ONE)
    use: BoolArray = field(default=ALL)
    times: OptionalArray = field(default=NONE)

    def __post_init__(self) -> None:
        for name in ("pictures", "camera_names"):
            given = names(name, getattr(self, name))
            if len(set(given)) < len(given):
                repeated = next(each for each in given if given.count(each) > 1)
                raise InputError(phrase("error.repeated", kind=name, name=repeated))
            self._set(name, tuple(given))
        pictures, corners = len(self.pictures), length("picture", self.picture)
        self._set("sizes", tuple(map(_size, self.sizes)))
        if len(self.sizes) != len(self.camera_names):
            fields = {"count": len(self.camera_names), "actual": len(self.sizes)}
            raise argument_error("sizes", "count", **fields)
        self._set("cameras", indices("cameras", self.cameras, pictures, len(self.camera_names)))
        self._set("views", indices("views", self.views, pictures, pictures))
        self._set("picture", indices("picture", self.picture, corners, pictures))
        self._set("point", indices("point", self.point, corners, 2**31))
        self._set("xy", shaped("xy", self.xy, (corners, 2)))
        self._set("sd", shaped("sd", self.sd, (corners,)))
        self._set("use", frozen(np.broadcast_to(np.asarray(self.use, dtype=bool), (corners,)).copy()))
        if self.times is not None:
            self._set("times", shaped("times", self.times, (pictures,)))
        for code, rows in (
            ("position", np.flatnonzero(~np.isfinite(self.xy).all(axis=1))),
            ("deviation", np.flatnonzero(~((self.sd > 0) & np.isfinite(self.sd)))),
            ("repeated-corner", repeated_pairs(self.picture, self.point, 2**31)),
        ):
            for row in rows.tolist()[:1]:
                raise InputError(phrase(f"targets.{code}", corner=self.title(row)))
        for row in repeated_pairs(self.views, self.cameras, len(self.camera_names)).tolist():
            fields = {"picture": self.pictures[row], "camera": self.camera_names[self.cameras[row]]}
            raise InputError(phrase("targets.second-picture", **fields))

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

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
