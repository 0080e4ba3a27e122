"""Additional observations after the adjustment, by type."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import freeze_fields
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.observations import Observation
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import _photocore


@dataclass(frozen=True, eq=False)
class ObservedKind:
    """The k additional observations of one type, with r components each.

    Unobserved components and observations of excluded points are NaN. Arrays are read-only.
    """

    kind: str
    rows: Indices  # (k,) their indices in the block
    names: list[str]  # names of the observed items
    # components, units: Names and units of the r components: the linear unit of the object space, or radians
    components: tuple[str, ...]
    units: tuple[str, ...]
    sd: Floats  # (k, r) standard deviations a priori
    residuals: Floats  # (k, r) observed minus computed
    # (k, r) redundancy numbers; single ones may leave 0 to 1 where components are correlated
    redundancy: Floats
    # (k, r) standardized residuals, a priori unit weight: with W the inverse of the covariance matrix S of an
    # observation, `(W v)_i / sqrt((W Qvv W)_ii)`, which without correlations is Baarda's w; NaN without
    # redundancy
    standardized: Floats
    squares: Floats  # (k,) v' W v, weights after the loss
    weights: Floats  # (k,) weight factors by the loss; 1 without a loss

    def __post_init__(self) -> None:
        freeze_fields(self)

    @property
    def used(self) -> int:
        """The number of used observations."""
        return int(np.isfinite(self.squares).sum())

    @property
    def sum_of_squares(self) -> float:
        """The weighted sum of squares of used observations."""
        return float(np.nansum(self.squares))


def observed_kinds(block: Block, solution: _photocore.BlockSolution) -> dict[str, ObservedKind]:
    """Return the adjusted observations of a block by the names of their types."""
    counts, values, sums = solution.adjusted_observations
    all_columns = block.observations.columns
    starts = np.cumsum([0, *(len(columns.rows) for columns in all_columns)])
    ends = np.concatenate([[0], np.cumsum(counts)])[starts]
    parts: dict[str, list[tuple[Observation, Indices, list[str], tuple[Floats, ...]]]] = {}
    for columns, (start, stop), (begin, end) in zip(
        all_columns, pairwise(starts), pairwise(ends), strict=True
    ):
        first, rows = columns.first, columns.rows
        observed = np.ones((len(rows), len(first.components(geographic=block.geographic))), dtype=bool)
        if first.MISSING:
            observed = ~np.isnan(columns.table["observed"])
        tables = np.full((3, *observed.shape), np.nan)
        tables[:, observed & (counts[start:stop, np.newaxis] > 0)] = values[:, begin:end]
        variances = np.diagonal(np.asarray(columns.table["precision"]), axis1=1, axis2=2)
        sd = np.sqrt(np.where(observed, variances, np.nan))
        parts.setdefault(columns.label, []).append(
            (first, rows, columns.names, (sd, *tables, *sums[:, start:stop]))
        )
    kinds = {}
    for kind, groups in parts.items():  # Groups of one type have different numbers of unknowns
        first = groups[0][0]
        every = np.concatenate([own for _, own, *_ in groups])
        names = [name for *_, own, _ in groups for name in own]
        order = np.argsort(every, kind="stable")
        arrays = zip(*(own for *_, own in groups), strict=True)
        kinds[kind] = ObservedKind(
            kind,
            every[order],
            [names[place] for place in order.tolist()],
            first.components(geographic=block.geographic),
            first.units(block.linear_unit),
            *(np.concatenate(each)[order] for each in arrays),
        )
    return kinds


def named_observation(kind: str, of: str) -> Phrase:
    """Return the name of an observation: type, and points, photos or unknowns."""
    return Phrase("named.observation", {"one": kind_words(kind), "of": of})


def kind_words(kind: str) -> list[Phrase]:
    """Return the words of a type, such as `prior, lever arm`."""
    return [Phrase(f"one.{each}") for each in kind.split(", ")]


def parts_of(components: Iterable[str], name: Phrase) -> Phrase:
    """Return the name of some components of an observation."""
    return Phrase("named.parts", {"axes": [Phrase(f"axis.{each}") for each in components], "named": name})
