"""`--plots` of the commands that adjust networks: all pictures of the result, beside the report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from photogram.cli.job import Job
from photogram.cli.options import PictureFormat

if TYPE_CHECKING:
    from photogram.results.network import AdjustedNetwork
    from photogram.targets.worth import Worth

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
        if self._out is None or worth is None:
            return {}
        from photogram.targets.worth_files import worth_pictures

        return {self._out / name: content for name, content in worth_pictures(worth, self._ending).items()}
