"""Image transformations in addition to pose, point and camera, e.g. boards that bend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, elements, names, shaped
from photogram.arguments.fields import check_fields
from photogram.arguments.objects import kind_error
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.unknowns import Numbers, Unknown


class Bend(Numbers):
    """Deflection w of a board, two lengths: at its centre along x and along y."""

    KIND = "bend"


@dataclass(frozen=True, eq=False)
class Passage:
    """Base class of image transformations."""

    KIND: ClassVar[str] = ""
    """Name of the type in the core."""

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Unknowns of the transformation."""
        raise NotImplementedError

    def of(self, points: Mapping[str, int], photos: Mapping[str, int]) -> list[int]:
        """Return the rows of the points, photos or cameras concerned.

        Raises
        ------
        InputError
            If a point or photo is not in the block.
        """
        raise NotImplementedError

    def numbers(self) -> Floats:
        """Return the numbers for the core that are not unknowns."""
        return np.zeros(0)


@dataclass(frozen=True, eq=False)
class Figure(Passage):
    """Points with given positions that are displaced by `w_1 e_1 + w_2 e_2`.

    Parameters
    ----------
    bend
        Unknown w, one object for all points.
    points
        n names. The given coordinates are fixed (`point_sd` 0) in rectangular space. The points are observed
        in images only.
    shifts
        (n, 2, 3) e_1 and e_2 of each point, in the axes of the block.
    """

    KIND = "figure"

    bend: Bend
    points: Sequence[str]
    shifts: ArrayLike

    def __post_init__(self) -> None:
        check_fields(self, "a figure")
        points = tuple(names("points of a figure", self.points))
        shifts = shaped(f"shifts of the {self.title}", self.shifts, (len(points), 2, 3), "finite")
        vars(self).update(points=points, shifts=shifts)

    @property
    def title(self) -> str:
        """Title in reports and messages."""
        return f"{self.KIND} {self.bend.name}"

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Unknowns of the transformation."""
        return (self.bend,)

    def of(self, points: Mapping[str, int], photos: Mapping[str, int]) -> list[int]:
        """Return the rows of the points."""
        if missing := [name for name in self.points if name not in points]:
            raise argument_error(f"figure {self.bend.name}", "absent", kind="point", name=missing[0])
        return [points[name] for name in self.points]

    def numbers(self) -> Floats:
        """Return the shifts, point by point."""
        return np.asarray(self.shifts, dtype=float).ravel()


def checked_passages(passages: object) -> tuple[Passage, ...]:
    """Return validated image transformations."""
    checked = elements("passages", passages, Passage)
    for row, each in enumerate(checked):
        if not each.KIND:
            raise kind_error(f"passages[{row}]", "a Figure or a Scan", each)
    return checked
