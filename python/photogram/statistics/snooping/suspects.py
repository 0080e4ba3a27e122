"""Groups that may contain a joint gross error, and their network interface."""

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
    """G groups of observations with M rows in all, in the order of the groups."""

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
        self.removable = removable  # (G,) whether data snooping may remove it

    @abstractmethod
    def loads(self, group: int) -> Indices:
        """Return the photos that a group affects: the ones that observe its point."""

    @abstractmethod
    def parts(self, group: int) -> Sequence[Sequence[int]] | None:
        """Return the rows of a group that may be removed alone; None if only all together."""

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
        """Return the groups of a point."""
        return _at(self._by_point, point)

    def on_photo(self, photo: int) -> Indices:
        """Return the groups of a photo."""
        return _at(self._by_photo, photo)


def _at(by: tuple[Indices, Indices], value: int) -> Indices:
    order, sorted_values = by
    first, last = np.searchsorted(sorted_values, [value, value + 1])
    return np.asarray(order[first:last])


@dataclass(eq=False)
class Out:
    """Excluded observations."""

    rows: Bools  # (M,) excluded rows
    # Excluded points and photos, with all their observations
    points: set[int] = field(default_factory=set)
    photos: set[int] = field(default_factory=set)

    def copy(self) -> Out:
        """Return a copy to be changed."""
        return Out(self.rows.copy(), set(self.points), set(self.photos))


@dataclass(frozen=True)
class Standing:
    """State of a network without the excluded observations."""

    status: str  # `converged`, or another end of the iteration
    # weighted_sum_of_squares, degrees_of_freedom: Omega and f of the included observations
    weighted_sum_of_squares: float
    degrees_of_freedom: int

    @property
    def sum_and_freedom(self) -> tuple[float, float]:
        return self.weighted_sum_of_squares, self.degrees_of_freedom


@dataclass(frozen=True, eq=False)
class Tests:
    """Tests of all groups; NaN if excluded."""

    active: Bools  # (G,) whether any row is included
    rank: Indices  # (G,) directions in which an error is visible
    statistic: Floats  # (G,) T, the decrease of Omega without the group
    least: Floats  # (G,) the smallest redundancy of a visible direction
    # (G,) h: the absolute correlation of two groups of different points is bounded by the root of the product
    shared: Floats
    residual: Floats  # (M,) of unit weight
    redundancy: Floats  # (M,) redundancy numbers
    # error, error_sd: (M,) estimated error and its standard deviation, in the units of the rows
    error: Floats
    error_sd: Floats

    def testable(self, row_starts: Indices) -> Bools:
        """Return (G,) groups with a direction of notable errors in own residuals."""
        largest = np.maximum.reduceat(np.nan_to_num(self.redundancy), row_starts[:-1])
        return np.asarray(self.active & (self.rank > 0) & (largest > TESTABLE))


@dataclass(frozen=True)
class Prediction:
    """Excluded rows of a group compared with the prediction from the rest."""

    statistic: float  # d' C^-1 d: chi-square; its degrees of freedom are the number of excluded rows
    rows: tuple[int, ...]  # These rows, numbered among all
    # error, error_sd: observed minus predicted of each, and its standard deviation, in its unit
    error: tuple[float, ...]
    error_sd: tuple[float, ...]


@dataclass(frozen=True)
class Aside:
    """Exclusions by the consensus from which a network was restarted."""

    # Groups, by number, that do not agree with most of their point and photo
    images: tuple[int, ...]
    photos: dict[int, str | Phrase]  # Photos whose observations agree with no pose, with the reason
    found_by: str | Phrase = Phrase("snooping.by-consensus")  # The origin of the start


class LostSupportError(Exception):
    """The exclusions make unknowns of these points and photos undetermined."""

    def __init__(self, points: Sequence[int], photos: Sequence[int]) -> None:
        super().__init__(f"undetermined: points {list(points)}, photos {list(photos)}")
        self.points = tuple(points)
        self.photos = tuple(photos)


class Trial(Protocol):
    """The interface of a network for data snooping."""

    @property
    def suspects(self) -> Suspects:
        """The groups."""

    @property
    def deviations(self) -> Floats:
        """(M,) standard deviations a priori, in the units of the rows."""

    @property
    def whole(self) -> bool:
        """Whether R of all rows together is small enough to be computed."""

    def adjust(self, out: Out, *, exact: bool = False) -> Standing:
        """Adjust without exclusions; raise LostSupportError if undetermined.

        `exact`: whether the result is required for hypotheses on sets.
        """

    def tests(self) -> Tests:
        """Test all groups."""

    def predictions(self, groups: Sequence[int]) -> list[Prediction | None]:
        """Test the excluded rows of groups; None if they cannot be predicted."""

    def blocks(self, groups: Sequence[int]) -> list[tuple[list[int], Floats, Floats]]:
        """Return all groups at points of some groups, unit-weight residuals, and R."""

    def response(self) -> tuple[Floats, Floats]:
        """Return residuals of unit weight (M,) and R (M, M) of all rows; zero if excluded."""

    def gone_blocks(self, points: Sequence[int]) -> list[tuple[list[int], Floats, Floats]]:
        """Return all groups at excluded points with residuals and R as if included.

        Each point is separate, based on the unknowns from the others; empty if these are undetermined.
        """

    def resist(self, scale: float) -> Floats | None:
        """Adjust robustly; errors beyond `scale` standard deviations lose weight.

        Returns (G,) lengths of the residuals of unit weight, zero for groups without loss; None if the
        adjustment fails, with the state unchanged.
        """

    def consequences(self, out: Out, group: int) -> tuple[set[int], set[int]]:
        """Return points with few rays, and unsupported photos, without a group."""
