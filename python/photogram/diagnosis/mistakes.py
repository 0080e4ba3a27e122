"""Mistakes of whole sets of data: proposals, evaluated by adjustment.

A proposal changes a block to the one without a possible mistake. The likelihood ratio of the adjustments of
both blocks decides (:mod:`photogram.statistics.likelihood`). A parameter that a proposal estimates must gain
ln f more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Self

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.diagnosis.findings import Finding, Level, finding
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.motion import kept_images
from photogram.network.rays import seen_without_lenses
from photogram.results.result import Result
from photogram.statistics.likelihood import Judged, judged
from photogram.words import Phrase, phrase

KEPT = 2  # Adjustments that are always stored
STORED = 500_000  # Image observations of the blocks of all stored adjustments, if there are more
CLEARLY = 2 * math.log(20)  # Additional cost of single wrong members of a set (likelihood ratio of 20)
MOST = 0.8  # Part of a rejected test that a mistake explains
WORST = 1e6  # Assumed ratio to the worst proposal of a block that cannot be adjusted

Change = Callable[[Block], Block]


class Adjuster:
    """Adjusts blocks with the same options, and stores the last results."""

    def __init__(self, options: dict[str, Any], *known: tuple[Block, Result | AdjustmentError]) -> None:
        self.options = options
        self._known = [*known]

    def __call__(self, block: Block) -> Result:
        """Adjust a block; raise the same error for the same block."""
        result = next((result for known, result in self._known if known == block), None)
        if result is None:
            try:
                result = adjust(block, **self.options)
            except AdjustmentError as error:
                result = error
            self._known.append((block, result))
            while len(self._known) > KEPT and sum(len(own.image_xy) for own, _ in self._known) > STORED:
                del self._known[0]
        if isinstance(result, AdjustmentError):
            raise result
        return result

    @classmethod
    def of(cls, result: Result) -> Self:
        """Return an adjuster that has this result."""
        return cls({}, (result.block, result))

    def tried(self, block: Block) -> Result | None:
        """Adjust a block; None if that fails."""
        try:
            return self(block)
        except AdjustmentError:
            return None

    def converged(self, block: Block) -> Result | None:
        """Adjust a block; None if that fails or does not converge."""
        result = self.tried(block)
        return result if result is not None and result.converged else None


@dataclass(frozen=True, eq=False)
class Proposal:
    """A possible mistake, and its correction."""

    name: str
    message: Phrase
    change: Change  # Returns the block without the mistake
    exact: bool = True  # Whether the correction has no rough values
    parameters: int = 0  # Estimated by the adjustment of the changed block
    points: Sequence[str] = ()  # Points that it concerns; empty if it concerns all


@dataclass(frozen=True, eq=False)
class Explained:
    """The proposals that explain the residuals best; several if the data do not decide."""

    best: list[Proposal]
    results: list[Result | None]  # Their adjustments
    judged: Judged

    @property
    def is_certain(self) -> bool:
        """Whether one proposal explains the residuals, and no other does."""
        return self.judged.explained and len(self.best) == 1

    def message(self, of: str = "residuals") -> Phrase:
        """Return the message on the mistake; `of` are the residuals that it explains."""
        effect = phrase(f"mistake.{of}", times=self.judged.fall)
        causes = [each.message for each in self.best]
        if len(causes) == 1:
            return phrase("mistake.likely", cause=causes[0], effect=effect)
        return phrase("mistake.one-of", causes=causes, effect=effect)

    def finding(self, kind: str, of: str = "residuals") -> Finding:
        """Return the finding on the mistake; see :meth:`message`."""
        values = {"likelihood_ratio": self.judged.likelihood, "times_smaller": self.judged.fall}
        first = self.best[0]
        if first.points:
            return finding("grave", first.message, points=first.points, values=values)
        level: Level = "grave" if self.judged.explained else "look"
        return finding(level, self.message(of), kind=kind, values=values)


def explain(
    block: Block,
    proposals: Iterable[Proposal],
    adjusted: Adjuster,
    members: Callable[[Block], float] | None = None,
) -> Explained | None:
    """Return the proposals that explain the residuals of a block, if any.

    `members` returns the cost of an explanation by single wrong members of the set, in terms of the sum of
    squares. Such errors hide a mistake in the set. If no proposal is clearly better, both are compared with
    this cost.
    """
    tried = list(proposals)
    blocks = [each.change(block) for each in tried]
    results = [*map(adjusted.converged, blocks)]
    freedom = next((each.degrees_of_freedom for each in results if each is not None), 0)
    if freedom < 1:
        return None
    counts = [each.parameters for each in tried]
    given, omegas = omega(adjusted.converged(block)), [*map(omega, results)]

    def best_of(given: float) -> Judged | None:
        # A block that cannot be adjusted is worse than all that can.
        given = min(given, WORST * max(each for each in omegas if math.isfinite(each)))
        return judged(given, omegas, freedom, parameters=counts, known_weight=True)

    found = best_of(given)
    if members is not None:
        single = members(block)
        if found is None or min(omegas) + CLEARLY > single:
            # A mistake in the set is larger than errors of its members: its correction reduces the sum.
            pairs = zip(omegas, blocks, strict=True)
            omegas = [min(own, members(each)) if own < given else own for own, each in pairs]
            found = best_of(min(single, given))
    if found is None:
        return None
    return Explained([tried[row] for row in found.best], [results[row] for row in found.best], found)


def omega(result: Result | None) -> float:
    """Return the sum of squares of an adjustment; infinite without one."""
    return math.inf if result is None else result.sums_of_squares.total


@dataclass(frozen=True, eq=False)
class View:
    """A block and its observations without lens distortion."""

    block: Block  # The block to adjust, without observations that no camera can have made
    # Without distortion, and without photos on frames, which lack poses of their own. Photos and points are
    # the same as in `block`
    seen: Block

    @classmethod
    def of(cls, block: Block) -> Self:
        """Return the view of a block whose photos have poses."""
        if not block.cameras and not block.mounts:
            return cls(block, block)
        plain, visible = seen_without_lenses(block)
        block = block if visible.all() else kept_images(block, np.flatnonzero(visible))
        mounted = np.isin(block.photo_ids, [each.photo for each in block.mounts])
        rows = np.flatnonzero(~mounted[block.image_photos])
        return cls(block, kept_images(plain.replace(mounts=()), rows))

    def changed(self, change: Change) -> Self:
        """Return the view of the corrected block.

        If image coordinates change for cameras with lenses, the new block has no lenses, because distortions
        would not fit.
        """
        meant = change(self.seen)
        if meant is self.seen:
            return self
        same = meant.image_xy is self.seen.image_xy or np.array_equal(meant.image_xy, self.seen.image_xy)
        same = same and np.array_equal(meant.known_distances("checks"), self.seen.known_distances("checks"))
        if self.seen is self.block or not same:
            return replace(self, block=meant, seen=meant)
        return replace(self, block=change(self.block), seen=meant)
