"""What `photogram calibrate` is asked of the uncertainty of cameras: options, computing, files, exit code."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer

from photogram.cli.job import InputFile, Job
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from photogram.targets import Calibrated
    from photogram.targets.calibration_result import WorthOptions
    from photogram.targets.cross_validation import Into

NOT_GOOD_ENOUGH = 4
"""Exit code, as of results that should not be used."""


DatumName = Literal["corners", "mean-frames", "image", "axes"]
"""What holds still while a calibration is uncertain."""


@dataclass(frozen=True)
class Uncertainty:
    """What a user wants to know of the uncertainty of cameras, with the options that ask for it."""

    map_distance: Annotated[
        str | None,
        typer.Option(
            "--distance",
            metavar="D,D,..",
            help="Distances of maps of uncertainty, 1,inf. Default: infinity, and the boards' median.",
        ),
    ] = None
    map_datum: Annotated[
        DatumName, typer.Option("--datum", help="What holds still in them (docs/targets.md).")
    ] = "corners"
    noise_only: Annotated[
        bool, typer.Option("--noise-only", help="Errors of corners alone, not of priors, as mrcal has it.")
    ] = False
    need: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            metavar="PX",
            help="End with exit code 4 where a map is above it within the area where the board was seen.",
        ),
    ] = None
    cross_validate: Annotated[
        str,
        typer.Option(
            metavar="odd|halves|K|none", help="How views are split to be adjusted against each other."
        ),
    ] = "odd"
    compare_with: Annotated[
        InputFile, typer.Option("--compare", metavar="PATH", help="Another calibration, to be compared.")
    ] = None
    suggest: Annotated[
        int, typer.Option(min=0, metavar="K", help="Find the K views that would help most.")
    ] = 0

    def asked(self) -> WorthOptions:
        """Return what is asked of a calibration."""
        from photogram.targets.calibration_result import WorthOptions

        return WorthOptions(
            distances=self.distances,
            datum=self.map_datum,
            noise_only=self.noise_only,
            cross_validate=self._split(),
            suggest=self.suggest,
        )

    @property
    def distances(self) -> list[float]:
        """Of maps; none: the usual ones."""
        return distances_of(self.map_distance, "--distance")

    def _split(self) -> Into | None:
        if self.cross_validate == "none":
            return None
        if self.cross_validate in ("odd", "halves"):
            return cast("Into", self.cross_validate)
        if not (self.cross_validate.isdecimal() and int(self.cross_validate) > 1):
            raise typer.BadParameter(
                f"is odd, halves, none, or a number from 2, not {self.cross_validate}",
                param_hint="--cross-validate",
            )
        return int(self.cross_validate)

    def told(self, job: Job, found: Calibrated, calibrated: Callable[[Path], Calibrated]) -> Calibrated:
        """Return an adjusted calibration with what it is worth.

        Parameters
        ----------
        job, found
            The job, and the calibration.
        calibrated
            Reads and adjusts another one, with the options of this.
        """
        from photogram.targets.appraisal import appraise
        from photogram.targets.findings import judged
        from photogram.targets.uncertainty import difference

        with job.status("uncertainty") as status:
            own = appraise(found, self.asked(), None if status is None else status.update)
        if self.compare_with is None:
            return judged(found, own)
        other = calibrated(self.compare_with)
        distances = self.distances or [math.inf]
        apart = [
            difference(found, other, distances, camera=number)
            for number in range(min(len(found.cameras), len(other.cameras)))
        ]
        return judged(found, replace(own, differences=tuple(apart)))

    def exit_code(self, found: Calibrated, code: int) -> int:
        """Return the exit code: 4 where a map is above what is needed, or there is none to say so."""
        worth = found.worth
        if self.need is None or worth is None or code:
            return code
        return code if worth.largest <= self.need else NOT_GOOD_ENOUGH


def distances_of(text: str | None, option: str) -> list[float]:
    """Return distances with commas between them."""
    try:
        found = [float(each) for each in (text or "").split(",") if each.strip()]
    except ValueError:
        found = [math.nan]
    if not all(each > 0 for each in found):
        raise typer.BadParameter(f"is a list of distances, 1,inf, not {text}", param_hint=option)
    return found
