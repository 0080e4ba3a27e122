"""Comparison of predicted networks as table, text, JSON and plot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from photogram.adjustment.adjustment import Progress
from photogram.adjustment.prediction import predict
from photogram.errors import InputError, RankError, message_of
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.motion import on_shared
from photogram.planning.pattern import Pattern, with_known_readout
from photogram.show.methods import Documented
from photogram.words import phrase

if TYPE_CHECKING:
    import pandas as pd

    from photogram.show.page import Document
    from photogram.show.sketch.plot import Plot


@dataclass(frozen=True)
class Plan(Documented):
    """Predicted patterns of a network for comparison.

    Attributes
    ----------
    patterns
        One or more, in the given order.
    """

    patterns: tuple[Pattern, ...]

    def table(self) -> pd.DataFrame:
        """Return the quality of new points, one row per pattern and group of points.

        Columns are the attributes of :class:`photogram.planning.PointQuality`, with one standard deviation
        per axis (`rms_sd_X`, `max_sd_X`, ...). Groups without points in any pattern are omitted.
        """
        import pandas as pd  # pandas takes long to import

        from photogram.planning.document import points_table

        frames = {pattern.name: points_table(pattern).frame() for pattern in self.patterns}
        table = pd.concat(frames, names=["pattern"]).reset_index(level="pattern")
        present = table.groupby("group")["points"].transform("max") > 0
        return table[present].reset_index(drop=True)

    def document(self) -> Document:
        """Return the document of the plan."""
        from photogram.planning.document import plan_document

        return plan_document(self.patterns)

    def plot(self) -> Plot:
        """Plot patterns in plan, with expected height deviations as colours.

        Raises
        ------
        PhotogramError
            If the plan lacks new points.
        """
        from photogram.planning.document import plan_sketch

        return plan_sketch(self.patterns)


def plan(
    patterns: Mapping[str, Block],
    *,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Plan:
    """Predict several networks for comparison.

    Parameters
    ----------
    patterns
        Planned blocks by name, as for :func:`photogram.predict`, for example the same photos with different
        control, or different overlaps.
    threads, progress
        As in :func:`photogram.adjust`.

    Raises
    ------
    InputError
        If there is no block, units or axes of blocks differ, or :func:`photogram.predict` raises it.
    RankError
        If a pattern does not determine all unknowns; the message begins with the name of the pattern.
    """
    spaces = {(block.linear_unit, block.geographic): name for name, block in patterns.items()}
    if len(spaces) != 1:
        raise InputError(phrase("plan.spaces", n=len(spaces), blocks=list(spaces.values())))
    made = []
    for name, block in patterns.items():
        tied = np.isfinite(block.point_sd).any() or np.isfinite(block.photo_position_sd).any()
        # For trajectories, their given values.
        if not (tied or on_shared(block).any()):
            raise RankError(
                phrase("error.at", what=name, message=phrase("plan.datum")), list(block.photo_ids), []
            )
        try:
            result = predict(block, threads=threads, progress=progress)
            other = with_known_readout(block)
            known = None if other is None else predict(other, threads=threads, progress=progress)
            made.append(Pattern(name, result, known))
        except RankError as error:
            raise RankError(
                phrase("error.at", what=name, message=message_of(error)), error.photos, error.points
            ) from None
    return Plan(tuple(made))
