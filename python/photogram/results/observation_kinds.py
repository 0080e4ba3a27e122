"""Additional observations after the adjustment, by type."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import freeze_fields
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
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
    found = iter(solution.adjusted_observations)
    kinds: dict[str, ObservedKind] = {}
    for columns in block.observations.columns:
        first, rows = columns.objects[0], columns.rows
        kind = columns.label
        components = first.components(geographic=block.geographic)
        observed = np.ones((len(rows), len(components)), dtype=bool)
        if first.MISSING:
            observed = ~np.isnan(columns.table["observed"])
        tables = np.full((3, *observed.shape), np.nan)
        single = np.full((2, len(rows)), np.nan)
        adjusted = [next(found) for _ in rows]
        taken = np.array([each is not None for each in adjusted])
        some = [each for each in adjusted if each is not None]
        if some:
            parts = zip(*some, strict=True)
            tables[:, observed & taken[:, np.newaxis]] = [np.concatenate(next(parts)) for _ in range(3)]
            single[:, taken] = list(parts)
        variances = np.diagonal(np.asarray(columns.table["precision"]), axis1=1, axis2=2)
        own = ObservedKind(
            kind=kind,
            rows=rows,
            names=[" - ".join(each.of) for each in columns.objects],
            components=components,
            units=first.units(block.linear_unit),
            sd=np.sqrt(np.where(observed, variances, np.nan)),
            residuals=tables[0].copy(),
            redundancy=tables[1].copy(),
            standardized=tables[2].copy(),
            squares=single[0].copy(),
            weights=single[1].copy(),
        )
        kinds[kind] = _together(kinds[kind], own) if kind in kinds else own
    return kinds


def _together(first: ObservedKind, second: ObservedKind) -> ObservedKind:
    """Return observations of one type with different numbers of unknowns, in order."""
    rows = np.concatenate([first.rows, second.rows])
    order = np.argsort(rows)
    names = [*first.names, *second.names]

    def joined(name: str) -> Floats:
        found: Floats = np.concatenate([getattr(first, name), getattr(second, name)])[order]
        return found

    numbers = ("sd", "residuals", "redundancy", "standardized", "squares", "weights")
    return ObservedKind(
        kind=first.kind,
        rows=rows[order],
        names=[names[row] for row in order.tolist()],
        components=first.components,
        units=first.units,
        **{name: joined(name) for name in numbers},
    )


def named_observation(kind: str, of: str) -> Phrase:
    """Return the name of an observation: type, and points, photos or unknowns."""
    return Phrase("named.observation", {"one": kind_words(kind), "of": of})


def kind_words(kind: str) -> list[Phrase]:
    """Return the words of a type, such as `prior, lever arm`."""
    return [Phrase(f"one.{each}") for each in kind.split(", ")]


def parts_of(components: Iterable[str], name: Phrase) -> Phrase:
    """Return the name of some components of an observation."""
    return Phrase("named.parts", {"axes": [Phrase(f"axis.{each}") for each in components], "named": name})
