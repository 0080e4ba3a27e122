"""`--plots` of the commands that adjust networks: all pictures of the result, beside the report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from photogram.cli.job import Job
from photogram.cli.options import PictureFormat

if TYPE_CHECKING:
    from photogram.results.network import AdjustedNetwork
    from photogram.show.page import Drawing
    from photogram.targets.calibration_result import Worth

__all__ = ["Pictures"]


class Pictures:
    """The pictures that a command has to draw, or none.

    Parameters
    ----------
    job
        Learns which files there may be.
    plots, ending
        Whether, and in which format.
    out
        The directory of the results.

    Raises
    ------
    BadParameter
        Pictures, but no directory.
    ModuleNotFoundError
        matplotlib is absent: said before anything is computed.
    """

    def __init__(self, job: Job, plots: bool, ending: PictureFormat, out: Path | None) -> None:
        self._out = out if plots else None
        self._ending = ending.value
        if not plots:
            return
        if out is None:
            raise typer.BadParameter("goes with --out DIR", param_hint="--plots")
        from photogram.plots import PICTURES
        from photogram.show.style import need_matplotlib

        need_matplotlib()
        job.writes(*(out / f"{name}.{self._ending}" for name in PICTURES))

    def of(self, result: AdjustedNetwork) -> dict[Path, bytes]:
        """Return the pictures of a result as files."""
        if self._out is None:
            return {}
        from photogram.plots import picture_files

        return picture_files(result, self._out, self._ending)

    def of_worth(self, worth: Worth | None) -> dict[Path, bytes]:
        """Return the pictures of what a calibration is worth as files."""
        if worth is None:
            return {}
        from photogram.targets.page import drawings

        return self.of_drawings(lambda: drawings(worth))

    def of_drawings(self, make: Callable[[], Sequence[Drawing]]) -> dict[Path, bytes]:
        """Return pictures that a page has, too, as files."""
        if self._out is None:
            return {}
        from photogram.show.pictures import drawn

        made = {self._out / f"{each.name}.{self._ending}": each.draw() for each in make()}
        return {path: drawn(figure, path) for path, figure in made.items() if figure is not None}
