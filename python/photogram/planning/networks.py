"""Networks side by side: predicted, then shown as table, text, JSON and picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from photogram.adjustment.adjustment import Progress
from photogram.adjustment.prediction import predict
from photogram.arguments.annotations import check_arguments
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
    """Patterns of a network side by side.

    Attributes
    ----------
    patterns
        One or more, in the order in which they were given.
    """

    patterns: tuple[Pattern, ...]

    def table(self) -> pd.DataFrame:
        """Return the quality of new points: a row for each pattern and group of points.

        Columns are those of :class:`photogram.planning.PointQuality`, standard deviations one for each axis
        (`rms_sd_X`, `max_sd_X`, ...); groups without points in any pattern are left out.
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
        """Plot the patterns in plan, with the expected standard deviation in height as colour.

        Raises
        ------
        PhotogramError
            The plan has no new points.
        """
        from photogram.planning.document import plan_sketch

        return plan_sketch(self.patterns)


def plan(
    patterns: Mapping[str, Block],
    *,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Plan:
    """Predict networks and put them side by side.

    Parameters
    ----------
    patterns
        Planned blocks by name, ready for :func:`photogram.predict`: the same photos with different control,
        for instance, or different overlaps.
    threads, progress
        As for :func:`photogram.adjust`.

    Raises
    ------
    InputError
        No block, blocks whose lengths have different units or whose axes differ, or whatever
        :func:`photogram.predict` refuses.
    RankError
        A pattern that does not determine all unknowns; its message begins with the name of the pattern.
    """
    if len({(block.linear_unit, block.geographic) for block in patterns.values()}) != 1:
        raise InputError(phrase("plan.spaces"))
    made = []
    for name, block in patterns.items():
        tied = np.isfinite(block.point_sd).any() or np.isfinite(block.photo_position_sd).any()
        # Of trajectories, what is given of them.
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


check_arguments(globals(), ["plan"])
