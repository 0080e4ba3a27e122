"""Networks side by side: predicted, then shown as table, text, JSON and picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress
from photogram.adjustment.prediction import predict
from photogram.arguments.annotations import check_arguments
from photogram.errors import InputError, RankError
from photogram.io import json
from photogram.lazy_dataclasses import asdict, dataclass
from photogram.network.block import Block
from photogram.network.motion import on_shared
from photogram.planning.pattern import Pattern
from photogram.planning.statistics import with_known_readout
from photogram.planning.text import report, what_next
from photogram.show.methods import Paged
from photogram.statistics.reliability import TESTABLE, noncentrality

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure, SubFigure


@dataclass(frozen=True)
class Plan(Paged):
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

        rows = []
        for pattern in self.patterns:
            for quality in pattern.points:
                row = {"pattern": pattern.name, **asdict(quality)}
                for name in ("rms_sd", "max_sd"):
                    values = row.pop(name)
                    row |= {f"{name}_{axis}": sd for axis, sd in zip(pattern.axes, values, strict=True)}
                rows.append(row)
        table = pd.DataFrame(rows)
        present = table.groupby("group")["points"].transform("max") > 0
        return table[present].reset_index(drop=True)

    def report(self) -> str:
        """Return the tables a planner needs as text."""
        return report(self.patterns)

    @overload
    def plot(self) -> Figure: ...

    @overload
    def plot(self, figure: Figure | SubFigure) -> Figure | SubFigure: ...

    def plot(self, figure: Figure | SubFigure | None = None) -> Figure | SubFigure:
        """Draw the patterns in plan, the expected standard deviation in height as colour; return the figure.

        `figure` is one of your own, or a part of one (SubFigure); None makes one that belongs to no window.

        Needs matplotlib (`pip install 'photogram[plots]'`).

        Raises
        ------
        PhotogramError
            There are no new points to be shown.
        """
        from photogram.planning.plot import plan_sketch
        from photogram.show.pictures import new_figure
        from photogram.show.sketch.on_axes import on_axes

        made = new_figure(1.0, 1.0) if figure is None else figure
        on_axes(plan_sketch(self.patterns), made)
        return made

    def to_json(self) -> bytes:
        """Return the figures of the plan as a JSON document (UTF-8); what is not a number is null."""
        linear = self.patterns[0].block.linear_unit
        document = {
            "program": f"photogram {_photocore.__version__}",
            "units": {
                "scale": f"{linear} on the ground for 1 mm in the photo",
                "unit": f"{linear}: the standard deviation of image coordinates on the ground",
                "points": f"standard deviations {linear}, detectable mm, effect standard deviations",
                "photos": f"positions {linear}, angles rad",
                "control": f"sd and detectable {linear}, effect standard deviations",
                **({"motion": "as each says"} if any(each.motion for each in self.patterns) else {}),
            },
            "noncentrality": noncentrality(),
            "unchecked_below": TESTABLE,
            "next": what_next(self.patterns),
            "patterns": [_pattern(pattern) for pattern in self.patterns],
        }
        return json.to_json(document)


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
        raise InputError("a plan needs one block, or several with the same linear unit and kind of space")
    made = []
    for name, block in patterns.items():
        tied = np.isfinite(block.point_sd).any() or np.isfinite(block.photo_position_sd).any()
        # Of trajectories, what is given of them.
        if not (tied or on_shared(block).any()):
            raise RankError(
                f"{name}: the observations leave position and scale open: a plan needs control, or standard"
                " deviations for the positions of photos",
                list(block.photo_ids),
                [],
            )
        try:
            result = predict(block, threads=threads, progress=progress)
            other = with_known_readout(block)
            known = None if other is None else predict(other, threads=threads, progress=progress)
            made.append(Pattern(name, result, known))
        except RankError as error:
            raise RankError(f"{name}: {error}", error.photos, error.points) from None
    return Plan(tuple(made))


def _pattern(pattern: Pattern) -> dict[str, Any]:
    return {
        "name": pattern.name,
        "title": pattern.block.title,
        "messages": [str(message) for message in pattern.result.messages],
        "axes": pattern.axes,
        "photo_count": len(pattern.block.photo_ids),
        "image_count": int(pattern.result.used_images.sum()),
        "scale": pattern.scale,
        "unit": pattern.unit,
        "points": [asdict(quality) for quality in pattern.points if quality.points],
        "photos": [asdict(quality) for quality in pattern.photos],
        "control": [asdict(quality) for quality in pattern.control],
        **({"motion": [asdict(quality) for quality in pattern.motion]} if pattern.motion else {}),
        **({"rms_sd_known_readout": known} if (known := pattern.known_rms_sd) else {}),
    }


check_arguments(globals(), ["plan"])
