"""Groups of observations that may hold a gross error together, and what is asked of a network of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.statistics.reliability import TESTABLE
from photogram.words import Phrase


class Suspects(ABC):
    """G groups of observations with M rows in all, one group after the other."""

    def __init__(
        self,
        row_starts: Indices,
        kinds: Indices,
        kind_names: Sequence[str],
        subjects: Indices,
        points: Indices,
        photos: Indices,
        removable: Bools,
    ) -> None:
        self.row_starts = row_starts  # (G + 1,) first row of each group
        self.kinds, self.kind_names = (
            kinds,
            kind_names,
        )  # (G,) types by their numbers: `image`, `control`, ...
        self.subjects = subjects  # (G,) number of the image, point, observation, ... of a group
        # (G,) point and photo of a group, or -1; tests of groups of one point depend on each other
        self.points, self.photos = points, photos
        self.removable = removable  # (G,) whether snooping may remove it

    @abstractmethod
    def loads(self, group: int) -> Indices:
        """Return the photos that a group concerns: those that observe its point."""

    @abstractmethod
    def parts(self, group: int) -> Sequence[Sequence[int]] | None:
        """Return the rows that may go alone, of a group by its number; None if it goes as a whole."""

    @abstractmethod
    def name(self, group: int) -> Phrase: ...

    @abstractmethod
    def row_name(self, row: int) -> str: ...

    @abstractmethod
    def unit(self, row: int) -> str: ...

    @abstractmethod
    def photo_name(self, photo: int) -> Phrase: ...

    def __len__(self) -> int:
        return len(self.kinds)

    def kind(self, group: int) -> str:
        return self.kind_names[int(self.kinds[group])]

    def rows(self, group: int) -> Indices:
        return np.arange(self.row_starts[group], self.row_starts[group + 1])

    @cached_property
    def _by_point(self) -> tuple[Indices, Indices]:
        order = np.argsort(self.points, kind="stable")
        return order, self.points[order]

    @cached_property
    def _by_photo(self) -> tuple[Indices, Indices]:
        order = np.argsort(self.photos, kind="stable")
        return order, self.photos[order]

    def on_point(self, point: int) -> Indices:
        """Return the groups of a point, in their order."""
        return _at(self._by_point, point)

    def on_photo(self, photo: int) -> Indices:
        """Return the groups of a photo, in their order."""
        return _at(self._by_photo, photo)


def _at(by: tuple[Indices, Indices], value: int) -> Indices:
    order, sorted_values = by
    first, last = np.searchsorted(sorted_values, [value, value + 1])
    return np.asarray(order[first:last])


@dataclass(eq=False)
class Out:
    """What takes no part."""

    rows: Bools  # (M,) which rows are out
    # Excluded points and photos, with all their observations
    points: set[int] = field(default_factory=set)
    photos: set[int] = field(default_factory=set)

    def copy(self) -> Out:
        """Return the same, to be changed."""
        return Out(self.rows.copy(), set(self.points), set(self.photos))


@dataclass(frozen=True)
class Standing:
    """How a network stands without what is out."""

    status: str  # `converged`, or what else came of the iteration
    # weighted_sum_of_squares, degrees_of_freedom: Omega and f of what takes part
    weighted_sum_of_squares: float
    degrees_of_freedom: int


@dataclass(frozen=True, eq=False)
class Tests:
    """Tests of all groups; NaN for what is out."""

    active: Bools  # (G,) whether any row takes part
    rank: Indices  # (G,) directions in which an error shows
    statistic: Floats  # (G,) T, by which Omega falls without the group
    least: Floats  # (G,) the smallest redundancy of a direction that shows
    # (G,) h: |correlation| of two groups of different points is no more than the root of the product
    shared: Floats
    residual: Floats  # (M,) of unit weight
    redundancy: Floats  # (M,) redundancy numbers
    # error, error_sd: (M,) estimated error and its standard deviation, in the units of the rows
    error: Floats
    error_sd: Floats

    def testable(self, row_starts: Indices) -> Bools:
        """Return (G,) which groups have a direction whose errors show notably in their own residuals."""
        largest = np.maximum.reduceat(np.nan_to_num(self.redundancy), row_starts[:-1])
        return np.asarray(self.active & (self.rank > 0) & (largest > TESTABLE))


@dataclass(frozen=True)
class Prediction:
    """What is out of a group against what the rest predicts."""

    statistic: float  # d' C^-1 d: chi-square; its degrees of freedom are the number of excluded rows
    rows: tuple[int, ...]  # These, of all
    # error, error_sd: Observed minus predicted of each, and its standard deviation, in its unit
    error: tuple[float, ...]
    error_sd: tuple[float, ...]


@dataclass(frozen=True)
class Aside:
    """What a consensus does without, from which a network was started anew."""

    # The groups, by their numbers, that do not meet where most of their point and photo do
    images: tuple[int, ...]
    photos: dict[int, str | Phrase]  # Photos whose images agree with no pose, with the reason
    found_by: str | Phrase = Phrase("snooping.by-consensus")  # The origin of the start


class LostSupportError(Exception):
    """What is out leaves unknowns undetermined: of these points and photos."""

    def __init__(self, points: Sequence[int], photos: Sequence[int]) -> None:
        super().__init__(f"undetermined: points {list(points)}, photos {list(photos)}")
        self.points = tuple(points)
        self.photos = tuple(photos)


class Trial(Protocol):
    """What snooping asks of a network."""

    @property
    def suspects(self) -> Suspects:
        """The groups."""

    @property
    def deviations(self) -> Floats:
        """(M,) standard deviations a priori, in the units of the rows."""

    @property
    def whole(self) -> bool:
        """Whether R of all rows together is small enough to be had."""

    def adjust(self, out: Out) -> Standing:
        """Adjust without what is out; raises LostSupportError."""

    def tests(self) -> Tests:
        """Test all groups."""

    def predictions(self, groups: Sequence[int]) -> list[Prediction | None]:
        """Test what is out of groups; None if it cannot be predicted."""

    def blocks(self, groups: Sequence[int]) -> list[tuple[list[int], Floats, Floats]]:
        """Return, for the points of some groups, all groups there, residuals of unit weight, and R."""

    def response(self) -> tuple[Floats, Floats]:
        """Return residuals of unit weight (M,) and R (M, M) of all rows; zero for those that are out."""

    def gone_blocks(self, points: Sequence[int]) -> list[tuple[list[int], Floats, Floats]]:
        """Return, for points that are out, all groups there with residuals and R as if they took part.

        Each point by itself, against what the others determine; empty if that is not known.
        """

    def resist(self, scale: float) -> Floats | None:
        """Adjust robustly, errors beyond some `scale` standard deviations losing weight.

        Returns (G,) the lengths of the residuals of unit weight, zero for what no loss is applied to; None
        where that leads nowhere, and nothing has changed.
        """

    def consequences(self, out: Out, group: int) -> tuple[set[int], set[int]]:
        """Return points that are left with too few rays, and photos without support, when a group is out."""
