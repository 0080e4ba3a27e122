"""`photogram calibrate`: adjust cameras that see a board."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.adjustment.options import AdjustOptions
from photogram.arguments.fields import option
from photogram.cli.console import NOT_USABLE
from photogram.cli.documents import Documents, OfPrograms
from photogram.cli.job import Job, adjustment_status, estimation_status, with_job
from photogram.cli.options import Changes, Input, InputFile, OfSnooping, Threads, Without, misuse
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.snooping_options import SnoopOptions
from photogram.targets.options import (
    CalibrationOptions,
    CornerBasis,
    Regularisation,
    WorthOptions,
    distances_of,
)

if TYPE_CHECKING:
    from photogram.targets import Board, Calibrated, Calibration

CORNER_SD = 0.3  # Default standard deviation of corners (px)
WITH_PLAN = (
    "--plan --field --focal --away --board --spacing --unit --shape --size --model --knots --sd --distance"
    " --need --out --json --html --no-html --plots --plot-format --quiet"
)
WITH_PROJECT = "--shape, --sd, --regularise, --sync offset, --offset alone"


@dataclass(frozen=True)
class Planned:
    """Options for a plan of views with a nominal camera."""

    plan_views: Annotated[int | None, typer.Option("--plan", min=4)] = None
    view_field: Annotated[float | None, typer.Option("--field")] = None
    focal: float | None = None
    away: Sequence[float] = option((), kind=str, parse=distances_of)


@with_job("calibrate", example=("board",), ending="-calibrated")
def calibrate(
    job: Job,
    *,
    path: Input,
    documents: OfPrograms,
    seen: CalibrationOptions,
    choices: Annotated[Mapping[str, Any], Changes(AdjustOptions, "loss", "max_bias_ratio")],
    snoop: bool = False,
    snooping: Annotated[SnoopOptions, OfSnooping],
    outliers: Regularisation | None = None,
    to: list[str] | None = None,
    components: list[CornerBasis] | None = None,
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
    if planned.plan_views is not None:
        _plan(job, replace(documents, out=documents.out or Path("planned-views")), planned, seen, worth, need)
        return
    if planned != Planned():
        raise misuse("--field, --focal, --away", "requires", options="--plan")
    from photogram.targets import Calibrated, corner_components
    from photogram.targets.page import drawings

    documents.declare(job, pictures=None)
    job.reads_inside(path)
    if snoop:
        job.alone("--snoop", ("--loss", "--outliers"))
    with job.status("reading corners, finding first values") as progress:
        calibration = _read(path, seen, progress)
    job.remark(*calibration.messages)
    snooped = None
    options: dict[str, Any] = {"loss": choices.get("loss"), "outliers": outliers, "threads": threads}
    with adjustment_status(job) as adjusting:
        if snoop:
            snooped = calibration.snoop(snooping, threads=threads, progress=adjusting)
        adjusted = snooped.result if snooped else calibration.adjust(**options, progress=adjusting)
    assert isinstance(adjusted, Calibrated)
    found = adjusted.with_max_bias_ratio(choices.get("max_bias_ratio"))
    second = None if compare_with is None else lambda: _read(compare_with, seen).adjust(**options)
    found = _appraised(job, found, worth, need, second)
    snooped = snooped and replace(snooped, result=found)
    document, files = (snooped or found).document(), _files(found, to or [], need)
    if snooped is not None:
        files["removed.csv"] = snooped.table().to_csv(index=False).encode()
    if components:
        from photogram.results.components import components_section

        with estimation_status(job) as estimated:
            weights = corner_components(found, components, threads=threads, progress=estimated)
        first, *others = document.sections
        document = replace(document, sections=[first, components_section(weights), *others])
        files["components.txt"] = weights.report().encode()
    plots = drawings(found.worth) if found.worth is not None else []
    documents.conclude(
        job,
        snooped or found,
        files,
        document=document,
        network=found,
        plots=lambda: {each.name: each.sketch() for each in plots},
        tables=("uncertainty", "board", "views"),
        code=found.verdict.exit_code(strict=strict),
    )


def _plan(
    job: Job,
    documents: Documents,
    planned: Planned,
    seen: CalibrationOptions,
    worth: WorthOptions,
    need: float | None,
) -> None:
    job.only(WITH_PLAN.split(), "conflict", options="--plan")
    documents.declare(job)
    from photogram.io.csv_text import csv_text
    from photogram.show.quantity import frame
    from photogram.targets import nominal_camera, plan_views
    from photogram.targets.page import worth_files

    size = seen.size
    if size is None or (planned.view_field is None) == (planned.focal is None):
        raise misuse("--plan", "requires", options="--size, and --field or --focal")
    knots = {} if seen.knots is None else {"knots": seen.knots}
    camera = nominal_camera(size, seen.model, field=planned.view_field, focal=planned.focal, **knots)
    with job.status("planning views") as progress:
        plan = plan_views(
            camera,
            _board(seen),
            size,
            worth.distances,
            sd0=seen.sd0 or CORNER_SD,
            views=planned.plan_views or 0,
            need=need or 0.0,
            away=planned.away,
            progress=progress,
        )

    document, maps = plan.document(), plan.calibrated.worth
    assert maps is not None
    documents.conclude(
        job,
        plan,
        {"views.csv": csv_text(frame(document.table("views").columns)), **worth_files(maps)},
        document=document,
        plots=lambda: {each.name: each.sketch() for each in document.drawings()},
        tables=("views", "parameters"),
        code=0 if plan.enough else NOT_USABLE,
    )


def _board(seen: CalibrationOptions) -> Board:
    from photogram.targets.reading import board_of

    board = board_of(seen, [seen.board] if isinstance(seen.board, Path) else [])
    if board is None:
        raise misuse("--plan", "requires", options="--board")
    changes = {"unit": seen.unit, "shape": seen.shape}
    return board.replace(**{name: value for name, value in changes.items() if value})


def _read(
    path: Path, options: CalibrationOptions, progress: Callable[[str], None] | None = None
) -> Calibration:
    """Read corners or photos of a path; `progress` receives the current photo."""
    from photogram.targets import read

    if not (path / "project.toml").exists():
        return read(path, options, progress=progress)
    from photogram import formats
    from photogram.formats.targets import calibration_of

    found = calibration_of(formats.read(path))
    names = ("shape", "sd0", "regularise", "offsets", "sync")
    given = {name: getattr(options, name) for name in names}
    if options != CalibrationOptions(**given) or options.sync == "none":
        raise misuse(WITH_PROJECT, "project-views")
    shape, offsets = given.pop("shape"), given.pop("offsets")
    changes = {name: value for name, value in given.items() if value not in (None, "known")}
    if shape is not None:
        changes["board"] = found.board.replace(shape=shape)
    found = found.replace(**changes)
    return found.with_offsets(offsets) if offsets else found


def _appraised(
    job: Job,
    found: Calibrated,
    options: WorthOptions,
    need: float | None,
    compared: Callable[[], Calibrated] | None,
) -> Calibrated:
    """Return an adjusted calibration with its uncertainty, and its differences from another one."""
    from photogram.targets import appraise, difference

    with job.status("uncertainty") as progress:
        worth = appraise(found, options, progress)
    if compared is not None:
        second = compared()
        count = min(len(found.cameras), len(second.cameras))
        distances = options.distances or [math.inf]
        apart = [difference(found, second, distances, camera=number) for number in range(count)]
        worth = replace(worth, differences=tuple(apart))
    return found.with_worth(worth, need)


def _files(found: Calibrated, formats: Sequence[str], need: float | None) -> dict[str, bytes]:
    """Return all files of the output folder, also the cameras for other programs."""
    from photogram.formats import to_files
    from photogram.formats.results import table_files
    from photogram.formats.targets import adjusted_project
    from photogram.io.csv_text import csv_text
    from photogram.show.quantity import frame
    from photogram.targets import camera_files
    from photogram.targets.camera_formats import FILE, cameras_covariance
    from photogram.targets.grouping import views
    from photogram.targets.page import worth_files

    files = {**table_files(found), "views.csv": csv_text(frame(views(found)))}
    plain = to_files(adjusted_project(found), "plain")
    files |= {f"adjusted/{name}": content for name, content in plain.items()}
    if found.worth is not None:
        files |= worth_files(found.worth)
    for name in formats:
        cameras = camera_files(found, name, need if name == "mrcal" else None)
        files |= {f"{name}/{file}": content for file, content in cameras.items()}
    return files | {FILE: cameras_covariance(found)}
