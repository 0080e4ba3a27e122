"""Options of `photogram calibrate`: board, images, lens, uncertainty."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.cli.command_classes import misuse
from photogram.cli.job import Job
from photogram.cli.options import pair
from photogram.cli.projects import OriginName
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from photogram.targets import Board, Calibrated, Calibration
    from photogram.targets.worth_options import WorthOptions


ShapeName = Literal["held", "bend", "points"]


ViewName = Literal["name", "time"]


SyncName = Literal["known", "none", "offset"]  # Whether images of one view were taken at one time


PriorName = Literal["mrcal"]  # Whose priors cameras have


PLAIN_GOES = "--shape, --sd, --regularise, --sync offset, --offset alone"
"""Options that go with a plain project."""


@dataclass(frozen=True)
class CalibrationInput:
    """Options for board, images and lens."""

    board: str | None = None
    spacing: float | None = None
    unit: str | None = None
    shape: ShapeName | None = None
    cameras: list[str] | None = None
    size: str | None = None
    views: ViewName = "name"
    within: Annotated[float, typer.Option(min=0.0)] = 0.005
    sync: SyncName = "known"
    offsets: Annotated[list[str] | None, typer.Option("--offset")] = None
    pixel_origin: OriginName = "center"
    model: str | None = None
    knots: str | None = None
    knot_sd: str | None = None
    sd: list[str] | None = None
    regularise: PriorName | None = None

    @property
    def size_of_pictures(self) -> tuple[int, int] | None:
        """Width and height, pixels."""
        return None if self.size is None else pair(self.size, "--size")

    @property
    def knots_of_lens(self) -> tuple[int, int] | None:
        """Along columns and rows."""
        return None if self.knots is None else pair(self.knots, "--knots")

    def read(self, path: Path, progress: Callable[[str], None] | None = None) -> Calibration:
        """Read corners or photos of a path; `progress` receives the current photo."""
        from photogram.targets import read

        if (path / "project.toml").exists():
            return self._of_project(path)
        given: dict[str, Any] = {
            "views": self.views,
            "sync": self.sync,
            "pixel_origin": self.pixel_origin,
            "shape": self.shape,
            "regularise": self.regularise,
        }
        return read(
            path,
            board=self.given_board(),
            unit=self.unit,
            model=self.model,
            knots=self.knots_of_lens,
            knot_sd=None if self.knot_sd is None else _deviations(self.knot_sd),
            cameras=self.cameras or [],
            within=self.within,
            size=self.size_of_pictures,
            sd0=self.sd0(),
            offsets=_offsets(self.offsets or []),
            progress=progress,
            **given,
        )

    def _of_project(self, path: Path) -> Calibration:
        """Return the calibration of a plain project with the options of the user."""
        from photogram import formats
        from photogram.formats.targets.calibrations import calibration_of

        found = calibration_of(formats.read(path))
        said = CalibrationInput(
            shape=self.shape, sd=self.sd, regularise=self.regularise, offsets=self.offsets, sync=self.sync
        )
        if self != said or self.sync == "none":
            raise misuse(PLAIN_GOES, "project-views")
        changes: dict[str, Any] = {}
        if self.sync == "offset":
            changes["sync"] = self.sync
        if self.regularise is not None:
            changes["regularise"] = self.regularise
        if self.shape is not None:
            changes["board"] = found.board.replace(shape=self.shape)
        if self.sd is not None:
            changes["sd0"] = self.sd0()
        found = found.replace(**changes)
        return found.with_offsets(_offsets(self.offsets)) if self.offsets else found

    def given_board(self) -> Board | Path | None:
        """Return the board of `--board` and `--spacing`, or the file that describes it."""
        from photogram.targets import Board

        if self.board is None or Path(self.board).is_file():
            if self.spacing is not None:
                raise misuse("--spacing", "requires", options="--board CxR")
            return None if self.board is None else Path(self.board)
        columns, rows = pair(self.board, "--board")
        if self.spacing is None:
            raise misuse("--board", "requires", options="--spacing")
        return Board(columns=columns, rows=rows, spacing=self.spacing)

    def sd0(self) -> float | None:
        """Return the standard deviation of a corner, pixels, of `--sd images=S`."""
        from photogram.formats.supplements import deviations

        found = deviations(self.sd or [])
        if found.keys() - {"images"} or len(found.get("images", (1.0,))) > 1:
            raise misuse("--sd", "form", form="images=S for x and y of a corner", value=self.sd)
        return found["images"][0] if found else None


def _deviations(text: str) -> tuple[float, float]:
    """Return two standard deviations with a comma between them."""
    try:
        radial, tangential = map(float, text.split(","))
    except ValueError:
        raise misuse("--knot-sd", "form", form="two numbers, such as 1,0.1", value=text) from None
    return radial, tangential


def _offsets(given: list[str]) -> dict[str, tuple[float, float]]:
    """Return clock offsets with standard deviations from `right=0,0.01`."""
    found = {}
    for each in given:
        camera, _, numbers = each.rpartition("=")
        try:
            offset, sd = map(float, (numbers if "," in numbers else f"{numbers},inf").split(","))
        except ValueError:
            offset = sd = math.nan
        if not (camera and math.isfinite(offset) and sd >= 0):
            raise misuse("--offset", "form", form="CAMERA=S or CAMERA=S,SD", value=each)
        found[camera] = offset, sd
    return found


NOT_GOOD_ENOUGH = 4  # Exit code, as of results that should not be used


def appraised(
    job: Job,
    found: Calibrated,
    options: WorthOptions,
    need: float | None,
    compare_with: Path | None,
    calibrated: Callable[[Path], Calibrated],
) -> Calibrated:
    """Return an adjusted calibration with its uncertainty, and its differences from another one."""
    from photogram.targets.appraisal import appraise
    from photogram.targets.findings import judged
    from photogram.targets.uncertainty import difference

    with job.status("uncertainty") as status:
        worth = appraise(found, options, None if status is None else status.update)
    if compare_with is not None:
        second = calibrated(compare_with)
        count = min(len(found.cameras), len(second.cameras))
        distances = options.distances or [math.inf]
        apart = [difference(found, second, distances, camera=number) for number in range(count)]
        worth = replace(worth, differences=tuple(apart))
    return judged(found, worth, need)
