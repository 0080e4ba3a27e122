"""A network as snooping asks it: what the core finds without some observations, and what falls with them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.statistics.snooping.suspects import (
    LostSupportError,
    Out,
    Prediction,
    Standing,
    Suspects,
    Tests,
)

__all__ = ["ATTITUDE", "CONTROL", "IMAGE", "KINDS", "OBSERVATION", "POSITION", "NetworkTrial"]

KINDS = ("image", "control", "position", "attitude", "observation", "camera", "unknown")
"""What the suspects of the core are of, by their numbers."""
IMAGE, CONTROL, POSITION, ATTITUDE, OBSERVATION = range(5)

WHOLE = 1500
"""Rows up to which R of all of them is had: an exact round takes as many solutions."""
SUPPORT = 3
"""Images that a photo whose pose is free needs."""
HUBER, CAUCHY = 1.50, 2.55
"""Scales of the losses of a robust start, in standard deviations of an image point."""
ROBUST_ITERATIONS = 20


class NetworkTrial:
    """A network tried without some of its observations.

    Parameters
    ----------
    core
        The network in the core.
    suspects
        Its groups of observations.
    images
        (m, 2) photo and point of each image.
    supported
        (P,) whether what is known of the pose of a photo determines it without images.
    touched
        Points that each observation beside images is of.
    tolerance
        When the adjustment of a round is over; see the core.
    """

    def __init__(
        self,
        core: _photocore.NetworkTrial,
        suspects: Suspects,
        images: Indices,
        supported: Bools,
        tolerance: float | None,
    ) -> None:
        self.core, self.suspects, self.tolerance = core, suspects, tolerance
        self.deviations: Floats = core.deviations
        self._supported = supported
        kinds, subjects = core.subjects
        self._subjects = subjects
        self._image_groups = np.flatnonzero(kinds == IMAGE)
        self._photos = np.where(kinds == IMAGE, images[np.minimum(subjects, len(images) - 1), 0], -1)
        self._held = {
            int(point): int(group)
            for group, point in zip(np.flatnonzero(kinds == CONTROL), subjects[kinds == CONTROL], strict=True)
        }
        starts = suspects.row_starts
        sizes = np.diff(starts)
        self._block_starts = np.concatenate([[0], np.cumsum(sizes**2)])
        row = np.arange(starts[-1]) - np.repeat(starts[:-1], sizes)
        self._diagonal = np.repeat(self._block_starts[:-1], sizes) + row * (np.repeat(sizes, sizes) + 1)
        self._tests: dict[str, np.ndarray] = {}

    @cached_property
    def _on_point(self) -> dict[int, list[int]]:
        """The image groups of every point."""
        found: dict[int, list[int]] = {}
        for group in self._image_groups.tolist():
            found.setdefault(int(self.suspects.points[group]), []).append(group)
        return found

    @cached_property
    def _on_photo(self) -> dict[int, list[int]]:
        found: dict[int, list[int]] = {}
        for group in self._image_groups.tolist():
            found.setdefault(int(self.suspects.photos[group]), []).append(group)
        return found

    @property
    def whole(self) -> bool:
        """Whether R of all rows together is small enough to be had."""
        return int(self.suspects.row_starts[-1]) <= WHOLE

    def adjust(self, out: Out) -> Standing:
        """Adjust without what is out, from where the last adjustment has ended."""
        try:
            standing = self.core.adjust(
                out.rows, sorted(out.points), sorted(out.photos), tolerance=self.tolerance, progress=None
            )
        except (_photocore.BlockError, _photocore.CollectionError) as error:
            kind, _, combinations, points = error.args
            if kind == "undetermined points":
                raise LostSupportError(points, []) from error
            if kind == "undetermined photos":
                raise LostSupportError(
                    [], sorted({photo for each in combinations for photo in each[0]})
                ) from error
            raise
        status, _, omega, freedom, collapsed = standing
        if collapsed:
            raise LostSupportError(collapsed, [])
        return Standing(status, omega, freedom)

    def tests(self) -> Tests:
        """Test all groups."""
        found = self._tests = self.core.tests()
        inside = ~np.isnan(found["residual"])
        return Tests(
            active=found["active"],
            rank=found["rank"],
            statistic=found["statistic"],
            least=found["least"],
            shared=found["shared"],
            residual=found["residual"],
            redundancy=np.where(inside, found["cofactors"][self._diagonal], math.nan),
            error=found["error"],
            error_sd=found["error_sd"],
        )

    def predictions(self, groups: Sequence[int]) -> list[Prediction | None]:
        """Test what is out of groups against the rest."""
        found = self.core.predictions(list(groups))
        return [
            None
            if own is None
            else Prediction(
                own[0],
                tuple(int(self.suspects.row_starts[group]) + row for row in own[1]),
                tuple(own[2]),
                tuple(own[3]),
            )
            for group, own in zip(groups, found, strict=True)
        ]

    def blocks(self, groups: Sequence[int]) -> list[tuple[list[int], Floats, Floats]]:
        """Return, for the points of some groups, all groups there with residuals and R."""
        points = [int(self.suspects.points[group]) for group in groups]
        on_points = iter(self.core.on_points([point for point in points if point >= 0]))
        found = []
        for group, point in zip(groups, points, strict=True):
            own: tuple[list[int], Floats, Floats] = next(on_points) if point >= 0 else ([], None, None)  # type: ignore[assignment]
            found.append(self._without_out(*own) if own[0] else self._alone(group))
        return found

    def _without_out(
        self, groups: list[int], residuals: Floats, response: Floats
    ) -> tuple[list[int], Floats, Floats]:
        rows = np.concatenate([self.suspects.rows(group) for group in groups])
        out = np.isnan(self._tests["residual"][rows])
        response[out] = 0.0
        response[:, out] = 0.0
        return groups, np.where(out, 0.0, residuals), response

    def _alone(self, group: int) -> tuple[list[int], Floats, Floats]:
        rows = self.suspects.rows(group)
        start, end = self._block_starts[group : group + 2]
        response = self._tests["cofactors"][start:end].reshape(len(rows), len(rows))
        return [group], np.nan_to_num(self._tests["residual"][rows]), response

    def response(self) -> tuple[Floats, Floats]:
        """Return residuals of unit weight and R of all rows; zero for those that are out."""
        residuals = self._tests["residual"]
        out = np.isnan(residuals)
        response = self.core.responses(list(range(len(self.suspects))))
        response[out] = 0.0
        response[:, out] = 0.0
        return np.where(out, 0.0, residuals), response

    def resist(self, scale: float) -> Floats:
        """Adjust by Huber's loss, then by Cauchy's from there."""
        self.core.resist("huber", HUBER * scale, iterations=ROBUST_ITERATIONS, progress=None)
        return self.core.resist("cauchy", CAUCHY * scale, iterations=ROBUST_ITERATIONS, progress=None)

    def consequences(self, out: Out, group: int) -> tuple[set[int], set[int]]:
        """Return points left with too few rays, and photos left without support, when a group is out."""
        point = int(self.suspects.points[group])
        photo = int(self._photos[group])
        points: set[int] = set()
        photos = {photo} if photo >= 0 else set()
        if point >= 0 and point not in out.points:
            images = self._on_point.get(point, [])
            rays = [image for image in images if self._is_in(out, image)]
            held = self._held.get(point)
            components = 0 if held is None else int((~out.rows[self.suspects.rows(held)]).sum())
            if not rays or (len(rays) == 1 and components <= 1):
                points = {point}
                photos |= {int(self._photos[image]) for image in rays}
        return points, {each for each in photos if self._falls(out, each, points)}

    def _is_in(self, out: Out, image: int) -> bool:
        return not out.rows[self.suspects.row_starts[image]]

    def _falls(self, out: Out, photo: int, leaving: set[int]) -> bool:
        if self._supported[photo] or photo in out.photos:
            return False
        used = 0
        for image in self._on_photo[photo]:
            point = int(self.suspects.points[image])
            if self._is_in(out, image) and point not in leaving and point not in out.points:
                used += 1
                if used >= SUPPORT:
                    return False
        return True


def image_loads(points: Indices, photos: Indices) -> Callable[[int], Indices]:
    """Return a function that tells from which photos a point is seen, its images being given by both."""
    order = np.argsort(points, kind="stable")
    sorted_points, sorted_photos = points[order], photos[order]

    def of(point: int) -> Indices:
        first, last = np.searchsorted(sorted_points, [point, point + 1])
        return np.asarray(sorted_photos[first:last])

    return of
