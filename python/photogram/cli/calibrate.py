"""`photogram calibrate`: adjust cameras that see a board."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.cli.choices import LossName
from photogram.cli.console import print_remark, print_sections
from photogram.cli.documents import NONE_ASKED, OF_NETWORKS, Documents
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import KEPT, Quiet, Snooping, Strict, Threads, default_out, out_option, pair
from photogram.cli.progress import shown
from photogram.cli.projects import Deviations, OriginName, with_options
from photogram.cli.uncertainty import AS_USUAL, Uncertainty
from photogram.declared import dataclass

if TYPE_CHECKING:
    from photogram.targets import Board, Calibrated, Calibration

__all__ = ["calibrate"]


EXAMPLE = ("board",)
"""The packaged example, a directory of photogram.examples."""


class ShapeName(StrEnum):
    """What of a board is unknown."""

    HELD = "held"
    BEND = "bend"
    POINTS = "points"


class ViewName(StrEnum):
    """What tells which images are of one view."""

    NAME = "name"
    TIME = "time"


class SyncName(StrEnum):
    """Whether images of one view were taken at one time."""

    KNOWN = "known"
    NONE = "none"
    OFFSET = "offset"


class PriorName(StrEnum):
    """Whose priors cameras have."""

    MRCAL = "mrcal"


PLAIN_GOES = "--shape, --sd, --regularise, --offset alone"
"""Options that go with a plain project."""


@dataclass(frozen=True)
class Seen:
    """What a user says of the board, of images and of the lens, with the options that say it."""

    board: Annotated[
        str | None,
        typer.Option(
            metavar="CxR|FILE",
            help="Corners along x and y of a chessboard, or its description: board.toml, Kalibr's target."
            " Default: what lies in PATH.",
            show_default=False,
        ),
    ] = None
    spacing: Annotated[
        float | None,
        typer.Option(metavar="S", help="With --board CxR: from corner to corner.", show_default=False),
    ] = None
    unit: Annotated[
        str | None, typer.Option(metavar="UNIT", help="Unit of the board. Default: m.", show_default=False)
    ] = None
    shape: Annotated[
        ShapeName | None,
        typer.Option(
            help="What of the board is unknown. Default: points with 8 views or more, else held.",
            show_default=False,
        ),
    ] = None
    cameras: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATTERN",
            help="Names of the images of a camera, 'left*.jpg'; again for each camera. What is left of a name"
            " is its view.",
            show_default=False,
        ),
    ] = None
    size: Annotated[
        str | None,
        typer.Option(
            metavar="WxH", help="Width and height of the pictures, where no file says it.", show_default=False
        ),
    ] = None
    views: Annotated[ViewName, typer.Option(help="What tells the images of one view.")] = ViewName.NAME
    within: Annotated[
        float, typer.Option(min=0.0, metavar="S", help="With --views time: seconds between them at most.")
    ] = 0.005
    sync: Annotated[
        SyncName,
        typer.Option(
            help="Whether images of one view were taken at one time; offset: by clocks of their cameras,"
            " whose offsets are unknown."
        ),
    ] = SyncName.KNOWN
    offsets: Annotated[
        list[str] | None,
        typer.Option(
            "--offset",
            metavar="CAMERA=S[,SD]",
            help="What is known of the offset of a camera's clock, s; SD 0: held. Again for each.",
            show_default=False,
        ),
    ] = None
    pixel_origin: Annotated[OriginName, typer.Option(help="Corner or center of the first pixel is 0, 0.")] = (
        OriginName.CENTER
    )
    model: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="The lens: opencv4, opencv5, opencv8, opencv12, or a model of docs/cameras.md. Default:"
            " opencv5 below 90 degrees of field, opencv8 above.",
            show_default=False,
        ),
    ] = None
    knots: Annotated[
        str | None,
        typer.Option(
            metavar="CxR",
            help="With --model splined_stereographic: knots along columns and rows. Default: 30x20.",
            show_default=False,
        ),
    ] = None
    knot_sd: Annotated[
        str | None,
        typer.Option(
            metavar="R,T",
            help="Standard deviations with which knots are 0, radial and tangential, in units of the"
            " stereographic image. Default: 1,0.1.",
            show_default=False,
        ),
    ] = None
    sd: Deviations = None
    regularise: Annotated[
        PriorName | None,
        typer.Option(
            help="Weak priors of the lens and of its centre, as mrcal has them.", show_default=False
        ),
    ] = None

    def read(self, path: Path, progress: Callable[[str], None] | None = None) -> Calibration:
        """Read what lies at a path; `progress` is told which photograph is searched."""
        from photogram.targets import read

        if (path / "project.toml").exists():
            return self._of_project(path)
        given: dict[str, Any] = {
            "views": self.views.value,
            "sync": self.sync.value,
            "pixel_origin": self.pixel_origin.value,
            "shape": self.shape and self.shape.value,
            "regularise": self.regularise and self.regularise.value,
        }
        return read(
            path,
            board=self._board(),
            unit=self.unit,
            model=self.model,
            knots=None if self.knots is None else pair(self.knots, "--knots"),
            knot_sd=None if self.knot_sd is None else _deviations(self.knot_sd),
            cameras=self.cameras or [],
            within=self.within,
            size=None if self.size is None else pair(self.size, "--size"),
            sd0=self._sd0(),
            offsets=_offsets(self.offsets or []),
            progress=progress,
            **given,
        )

    def _of_project(self, path: Path) -> Calibration:
        """Return the calibration that a plain project is, with what a user says otherwise."""
        from photogram import formats
        from photogram.formats.targets.calibrations import calibration_of

        found = calibration_of(formats.read(path))
        if self != Seen(shape=self.shape, sd=self.sd, regularise=self.regularise, offsets=self.offsets):
            raise typer.BadParameter("a project has board, views and lens", param_hint=PLAIN_GOES)
        changes: dict[str, Any] = {"regularise": self.regularise and self.regularise.value}
        if self.shape is not None:
            changes["board"] = found.board.replace(shape=self.shape.value)
        if self.sd is not None:
            changes["sd0"] = self._sd0()
        found = found.replace(**changes)
        return found.with_offsets(_offsets(self.offsets)) if self.offsets else found

    def _board(self) -> Board | Path | None:
        """Return the board of `--board` and `--spacing`, or the file that describes it."""
        from photogram.targets import Board

        if self.board is None or Path(self.board).is_file():
            if self.spacing is not None:
                raise typer.BadParameter("goes with --board CxR", param_hint="--spacing")
            return None if self.board is None else Path(self.board)
        columns, rows = pair(self.board, "--board")
        if self.spacing is None:
            raise typer.BadParameter("needs --spacing", param_hint="--board")
        return Board(columns=columns, rows=rows, spacing=self.spacing)

    def _sd0(self) -> float | None:
        from photogram.formats.additions import deviations

        found = deviations(self.sd or [])
        if found.keys() - {"images"} or len(found.get("images", (1.0,))) > 1:
            raise typer.BadParameter("is images=S here: of a corner in x and y", param_hint="--sd")
        return found["images"][0] if found else None


AS_FOUND = Seen()
"""As the files say."""


def _deviations(text: str) -> tuple[float, float]:
    """Return two standard deviations with a comma between them."""
    try:
        radial, tangential = map(float, text.split(","))
    except ValueError:
        raise typer.BadParameter(f"is two numbers, 1,0.1, not {text}", param_hint="--knot-sd") from None
    return radial, tangential


def _offsets(given: list[str]) -> dict[str, tuple[float, float]]:
    """Return offsets of clocks with their standard deviations by cameras, from words as `right=0,0.01`."""
    found = {}
    for each in given:
        camera, _, numbers = each.rpartition("=")
        try:
            offset, sd = map(float, (numbers if "," in numbers else f"{numbers},inf").split(","))
        except ValueError:
            offset = sd = math.nan
        if not (camera and math.isfinite(offset) and sd >= 0):
            raise typer.BadParameter(f"is CAMERA=S or CAMERA=S,SD, not {each}", param_hint="--offset")
        found[camera] = offset, sd
    return found


@with_job
@with_options("snooping", Snooping)
@with_options("uncertainty", Uncertainty)
@with_options("seen", Seen)
@with_options("documents", Documents, *OF_NETWORKS)
def calibrate(
    job: Job,
    path: Annotated[
        Path | None,
        Reads.FILE,
        typer.Argument(
            metavar="PATH",
            show_default=False,
            help="Corners of a board: a file of mrcal, OpenCV or Kalibr, a table, or a folder with one and a"
            " board.toml; or a folder with photographs of it (docs/targets.md).",
        ),
    ] = None,
    example: Annotated[
        bool, typer.Option("--example", help="Calibrate the packaged example instead: twenty pictures.")
    ] = False,
    out: Annotated[
        Path | None,
        Writes.DIRECTORY,
        out_option("Directory for reports, tables, and the adjusted project. Default: PATH-calibrated."),
    ] = None,
    documents: Documents = NONE_ASKED,
    seen: Seen = AS_FOUND,
    loss: Annotated[LossName, typer.Option(help="Robust loss of image coordinates.")] = LossName.NONE,
    snooping: Snooping = KEPT,
    outliers: Annotated[
        PriorName | None,
        typer.Option(help="Take corners out as mrcal does, to reproduce its results.", show_default=False),
    ] = None,
    to: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FORMAT",
            help="Write the cameras as opencv_yaml, ros_camera_info, kalibr_camchain or mrcal, too; again for"
            " each.",
            show_default=False,
        ),
    ] = None,
    uncertainty: Uncertainty = AS_USUAL,
    threads: Threads = None,
    strict: Strict = False,
    quiet: Quiet = False,
) -> None:
    """Calibrate cameras and rigs with pictures of a board: cameras with their uncertainty.

    Needs no start values. The report, tables of views, points, corners and cameras, and the adjusted project
    go to --out.
    """
    with job:
        if path is None:
            path = job.packaged(*EXAMPLE)
        target = out or (Path("example-calibrated") if example else default_out(path, "-calibrated"))
        documents.place(target)
        pictures = documents.pictures(job, target)
        if path.is_dir():
            job.reads(*(each for each in sorted(path.iterdir()) if each.is_file()))
        with job.status("reading corners, finding first values") as status:
            calibration = seen.read(path, None if status is None else status.update)
        for message in calibration.messages if not quiet else ():
            print_remark(str(message))
        how: dict[str, Any] = {
            "loss": None if loss is LossName.NONE else loss.value,
            "outliers": outliers and outliers.value,
        }
        uncertainty.asked()
        found = uncertainty.told(
            job,
            _adjusted(job, calibration, how, threads, snooping),
            lambda other: seen.read(other).adjust(**how, threads=threads),
        )
        files = _files(found) | _cameras(found, to or [], uncertainty.need)
        page = documents.page(job, "calibrate", target, partial(_page, found))
        drawn = pictures.of(found.result) | pictures.of_worth(found.worth)
        job.finish(
            {target / name: content for name, content in files.items()} | drawn | page,
            documents.as_json(found),
            summary=lambda: _summarise(found),
            code=uncertainty.exit_code(found, found.verdict.exit_code(strict=strict)),
        )


def _adjusted(
    job: Job, calibration: Calibration, how: dict[str, Any], threads: int | None, snooping: Snooping
) -> Calibrated:
    """Adjust a calibration, without gross errors where they are looked for."""
    if snooping.snoop and (how["loss"] or how["outliers"]):
        raise typer.BadParameter("goes without --loss and --outliers", param_hint="--snoop")
    with job.status("adjusting") as status:
        progress = None if status is None else shown(status, "weighted sum of squares", 1.0)
        if snooping.snoop:
            return calibration.snoop(**snooping.options, threads=threads, progress=progress)
        return calibration.adjust(**how, threads=threads, progress=progress)


def _files(found: Calibrated) -> dict[str, bytes]:
    """Make everything that goes to the directory, before anything is written."""
    from photogram.formats import to_files
    from photogram.formats.adjusted import table_files
    from photogram.formats.targets.calibrations import adjusted_project
    from photogram.io.csv_text import csv_text
    from photogram.show.quantity import frame
    from photogram.targets.tables import views
    from photogram.targets.worth_files import worth_files

    files = {"report.txt": found.report().encode(), **table_files(found.result)}
    files["views.csv"] = csv_text(frame(views(found)))
    plain = to_files(adjusted_project(found), "plain")
    files |= {f"adjusted/{name}": content for name, content in plain.items()}
    if found.worth is not None:
        files |= worth_files(found.worth)
    if found.snooped is not None:
        files["removed.csv"] = found.snooped.table().to_csv(index=False).encode()
    return files


def _cameras(found: Calibrated, formats: list[str], need: float | None) -> dict[str, bytes]:
    """Make the files of the cameras in the formats of other programs, and their joint covariance."""
    from photogram.targets import camera_files
    from photogram.targets.output.covariances import FILE, cameras_covariance

    made = {
        f"{name}/{file}": content
        for name in formats
        for file, content in camera_files(found, name, need if name == "mrcal" else None).items()
    }
    return made | {FILE: cameras_covariance(found)}


def _page(found: Calibrated) -> Any:
    from photogram.show.ways import page_of

    return page_of(found)


def _summarise(found: Calibrated) -> None:
    from photogram.targets.report import calibration_summary

    print_sections(calibration_summary(found), "report.txt")
