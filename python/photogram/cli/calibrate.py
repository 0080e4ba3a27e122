"""`photogram calibrate`: adjust cameras that see a board."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.arguments.fields import option
from photogram.cli.calibration_options import (
    NOT_GOOD_ENOUGH,
    appraised,
    read_calibration,
)
from photogram.cli.choices import LossName
from photogram.cli.command_classes import misuse
from photogram.cli.components import COMPONENTS, MaxBiasRatio
from photogram.cli.console import OF_NETWORKS, print_document, print_remark
from photogram.cli.documents import Documents, OfPrograms
from photogram.cli.job import (
    Folder,
    Input,
    InputFile,
    Job,
    Without,
    adjustment_status,
    estimation_status,
    with_job,
)
from photogram.cli.options import Snooping, Threads, check_alone
from photogram.lazy_dataclasses import dataclass, replace
from photogram.targets.calibration_options import CalibrationOptions
from photogram.targets.choices import Regularisation
from photogram.targets.worth_options import WorthOptions, distances_of

if TYPE_CHECKING:
    from photogram.results.components import VarianceComponents
    from photogram.results.snooping_options import SnoopOptions
    from photogram.show.page import Document
    from photogram.targets import Board, Calibrated, Calibration, ViewPlan


class CornerBasisName(StrEnum):
    """Criteria for groups of corners."""

    KIND = "kind"
    CAMERA = "camera"
    LEVEL = "level"
    PHOTO = "photo"
    COMPONENT = "component"
    RAYS = "rays"


CORNER_SD = 0.3  # Default standard deviation of corners (px)
TAKEN = (
    "--plan --field --focal --away --board --spacing --unit --shape --size --model --knots --sd --distance"
    " --need --out --json --html --no-html --plots --plot-format --quiet"
)
"""Options that go with `--plan`."""


@dataclass(frozen=True)
class Planned:
    """Options for a plan of views with a nominal camera."""

    plan_views: Annotated[int | None, typer.Option("--plan", min=4)] = None
    view_field: Annotated[float | None, typer.Option("--field")] = None
    focal: float | None = None
    away: Sequence[float] = option((), kind=str, parse=distances_of)

    @property
    def asked(self) -> bool:
        """Whether views are to be planned."""
        if self.plan_views is None and self != Planned():
            raise misuse("--field, --focal, --away", "requires", options="--plan")
        return self.plan_views is not None

    def made(self, job: Job, seen: CalibrationOptions, worth: WorthOptions, need: float | None) -> ViewPlan:
        """Return the plan of views of a board for a nominal camera."""
        from photogram.targets import nominal_camera, plan_views

        for name in job.given:
            if name not in TAKEN.split():
                raise misuse(name, "conflict", options="--plan")
        size = seen.size
        if size is None or (self.view_field is None) == (self.focal is None):
            raise misuse("--plan", "requires", options="--size, and --field or --focal")
        more = {} if (knots := seen.knots) is None else {"knots": knots}
        camera = nominal_camera(size, seen.model, field=self.view_field, focal=self.focal, **more)
        with job.status("planning views") as status:
            return plan_views(
                camera,
                _board(seen),
                size,
                worth.distances,
                sd0=seen.sd0 or CORNER_SD,
                views=self.plan_views or 0,
                need=need or 0.0,
                away=self.away,
                progress=None if status is None else status.update,
            )

    def run(
        self,
        job: Job,
        seen: CalibrationOptions,
        worth: WorthOptions,
        need: float | None,
        documents: Documents,
        out: Path | None,
    ) -> None:
        """Plan views, write and print the plan."""
        target = out or Path("planned-views")
        documents.check_plots(job, target)
        plan = self.made(job, seen, worth, need)
        from photogram.io.csv_text import csv_text
        from photogram.show.quantity import frame
        from photogram.targets.page import worth_files

        document, made = plan.document(), plan.calibrated.worth
        assert made is not None

        views = csv_text(frame(document.table("views").columns))
        texts = {"report.txt": plan.report().encode(), "views.csv": views, **worth_files(made)}
        job.finish(
            {target / name: content for name, content in texts.items()}
            | documents.drawings(document.drawings, target)
            | documents.page(job, "calibrate", target, lambda: document),
            documents.as_json(plan),
            summary=lambda: print_document(document, "report.txt", "views", "parameters"),
            code=0 if plan.enough else NOT_GOOD_ENOUGH,
        )


def _board(seen: CalibrationOptions) -> Board:
    """Return the board of `--board`."""
    from photogram.targets import Board
    from photogram.targets.board_files import read_board

    if isinstance(seen.board, tuple):
        board = Board(columns=seen.board[0], rows=seen.board[1], spacing=seen.spacing or 0.0)
    elif isinstance(seen.board, Path):
        board = read_board(seen.board)
    else:
        raise misuse("--plan", "requires", options="--board")
    changes = {"unit": seen.unit, "shape": seen.shape}
    return board.replace(**{name: value for name, value in changes.items() if value})


@with_job(example=("board",), ending="-calibrated")
def calibrate(
    job: Job,
    *,
    path: Input,
    out: Folder,
    documents: OfPrograms,
    seen: CalibrationOptions,
    loss: LossName = "none",
    snoop: bool = False,
    snooping: Snooping,
    outliers: Regularisation | None = None,
    to: list[str] | None = None,
    components: list[CornerBasisName] | None = None,
    max_bias_ratio: MaxBiasRatio = None,
    worth: Annotated[WorthOptions, Without("grid")],
    need: Annotated[float | None, typer.Option(min=0.0)] = None,
    compare_with: Annotated[InputFile, typer.Option("--compare")] = None,
    planned: Planned,
    threads: Threads = None,
    strict: bool = False,
) -> None:
    """Calibrate cameras and rigs with images of a board: cameras with their uncertainty.

    No initial values are necessary. --out receives the report, the tables of views, points, corners and
    cameras, and the adjusted project. --plan suggests views before the first photograph.
    """
    if planned.asked:
        planned.run(job, seen, worth, need, documents, out)
        return
    from photogram.show.forms import text
    from photogram.targets.page import drawings

    documents.place(out)
    documents.check_plots(job, out)
    job.reads_inside(path)
    with job.status("reading corners, finding first values") as status:
        calibration = read_calibration(path, seen, None if status is None else status.update)
    for message in calibration.messages if not job.quiet else ():
        print_remark(str(message))
    how: dict[str, Any] = {"loss": None if loss == "none" else loss, "outliers": outliers}
    found = appraised(
        job,
        _adjusted(job, calibration, how, threads, snooping if snoop else None, max_bias_ratio),
        worth,
        need,
        compare_with,
        lambda other: read_calibration(other, seen).adjust(**how, threads=threads),
    )
    weights = _weights(job, found, components or [], threads)
    document = _document(found, weights)
    files = _files(found, text(document)) | _cameras(found, to or [], need)
    files |= {} if weights is None else {COMPONENTS: weights.report().encode()}
    page = documents.page(job, "calibrate", out, lambda: document)
    drawn = documents.plots_of(found.result, out)
    if found.worth is not None:
        drawn |= documents.drawings(partial(drawings, found.worth), out)
    job.finish(
        {out / name: content for name, content in files.items()} | drawn | page,
        documents.as_json(found),
        summary=lambda: print_document(document, "report.txt", *OF_NETWORKS, "uncertainty", "board", "views"),
        code=found.verdict.exit_code(strict=strict),
    )


def _adjusted(
    job: Job,
    calibration: Calibration,
    how: dict[str, Any],
    threads: int | None,
    snooping: SnoopOptions | None,
    max_bias_ratio: float | None,
) -> Calibrated:
    """Adjust a calibration, without gross errors on request."""
    if snooping is not None:
        check_alone(job, "--snoop", ("--loss", "--outliers"))
    with adjustment_status(job) as progress:
        if snooping is not None:
            found = calibration.snoop(snooping, threads=threads, progress=progress)
        else:
            found = calibration.adjust(**how, threads=threads, progress=progress)
    return replace(found, result=found.result.with_max_bias_ratio(max_bias_ratio))


def _files(found: Calibrated, report: str) -> dict[str, bytes]:
    """Return all files of the output folder."""
    from photogram.formats import to_files
    from photogram.formats.adjusted import table_files
    from photogram.formats.targets.calibrations import adjusted_project
    from photogram.io.csv_text import csv_text
    from photogram.show.quantity import frame
    from photogram.targets.page import worth_files
    from photogram.targets.tables import views

    files = {"report.txt": report.encode(), **table_files(found.result)}
    files["views.csv"] = csv_text(frame(views(found)))
    plain = to_files(adjusted_project(found), "plain")
    files |= {f"adjusted/{name}": content for name, content in plain.items()}
    if found.worth is not None:
        files |= worth_files(found.worth)
    if found.snooped is not None:
        files["removed.csv"] = found.snooped.table().to_csv(index=False).encode()
    return files


def _cameras(found: Calibrated, formats: list[str], need: float | None) -> dict[str, bytes]:
    """Make the camera files for other programs, and their joint covariance."""
    from photogram.targets import camera_files
    from photogram.targets.output.formats import FILE, cameras_covariance

    made = {
        f"{name}/{file}": content
        for name in formats
        for file, content in camera_files(found, name, need if name == "mrcal" else None).items()
    }
    return made | {FILE: cameras_covariance(found)}


def _weights(
    job: Job, found: Calibrated, bases: list[CornerBasisName], threads: int | None
) -> VarianceComponents | None:
    """Estimate the requested variance components."""
    if not bases:
        return None
    from photogram.targets import corner_components

    with estimation_status(job) as progress:
        by: list[Any] = [each.value for each in bases]
        return corner_components(found, by, threads=threads, progress=progress)


def _document(found: Calibrated, weights: VarianceComponents | None) -> Document:
    from photogram.results.components import components_section

    document = found.document()
    more = [] if weights is None else [components_section(weights)]
    return replace(document, sections=[*document.sections[:1], *more, *document.sections[1:]])
