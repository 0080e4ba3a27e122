"""`photogram calibrate`: adjust cameras that see a board."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.cli.calibration_input import AS_FOUND, PriorName, Seen
from photogram.cli.calibration_plan import UNPLANNED, Planned
from photogram.cli.choices import LossName
from photogram.cli.components import COMPONENTS
from photogram.cli.console import print_remark, print_sections
from photogram.cli.documents import NONE_ASKED, OF_NETWORKS, Documents
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import KEPT, Quiet, Snooping, Strict, Threads, default_out, out_option
from photogram.cli.progress import shown
from photogram.cli.projects import with_options
from photogram.cli.uncertainty import AS_USUAL, Uncertainty
from photogram.lazy_dataclasses import replace

if TYPE_CHECKING:
    from photogram.results.components import VarianceComponents
    from photogram.show.page import Page
    from photogram.targets import Calibrated, Calibration

__all__ = ["calibrate"]


EXAMPLE = ("board",)
"""The packaged example, a directory of photogram.examples."""


class CornerBasisName(StrEnum):
    """What groups of corners are made by."""

    KIND = "kind"
    CAMERA = "camera"
    LEVEL = "level"
    PHOTO = "photo"
    COMPONENT = "component"
    RAYS = "rays"


@with_job
@with_options("snooping", Snooping)
@with_options("planned", Planned)
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
    components: Annotated[
        list[CornerBasisName] | None,
        typer.Option(
            help="Estimate variance components of corners: by which factors their standard deviations are"
            " wrong. Given more than once: of all combinations; level goes with camera alone.",
            show_default=False,
        ),
    ] = None,
    uncertainty: Uncertainty = AS_USUAL,
    planned: Planned = UNPLANNED,
    threads: Threads = None,
    strict: Strict = False,
    quiet: Quiet = False,
) -> None:
    """Calibrate cameras and rigs with pictures of a board: cameras with their uncertainty.

    Needs no start values. The report, tables of views, points, corners and cameras, and the adjusted project
    go to --out. With --plan it says which pictures to take, before there is one.
    """
    with job:
        if planned.asked:
            planned.run(job, seen, uncertainty, documents, out)
            return
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
        weights = _weights(job, found, components or [], threads)
        files = _files(found) | _cameras(found, to or [], uncertainty.need)
        files |= {} if weights is None else {COMPONENTS: weights.report().encode()}
        page = documents.page(job, "calibrate", target, partial(_page, found, weights))
        drawn = pictures.of(found.result) | pictures.of_worth(found.worth)
        job.finish(
            {target / name: content for name, content in files.items()} | drawn | page,
            documents.as_json(found),
            summary=lambda: _summarise(found, weights),
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
    from photogram.targets.document import worth_files
    from photogram.targets.tables import views

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
    """Estimate the variance components that are asked for."""
    if not bases:
        return None
    from photogram.targets import corner_components

    by: list[Any] = [each.value for each in bases]
    with job.status("variance components") as status:

        def tell(number: int, _: object) -> None:
            if status is not None:
                status.update(f"variance components, adjustment {number + 1}")

        return corner_components(found, by, threads=threads, progress=tell)


def _page(found: Calibrated, weights: VarianceComponents | None) -> Page:
    from photogram.results.page.weights import components_section
    from photogram.show.methods import page_of

    page = page_of(found)
    more = [] if weights is None else [components_section(weights)]
    return replace(page, sections=[*page.sections[:1], *more, *page.sections[1:]])


def _summarise(found: Calibrated, weights: VarianceComponents | None) -> None:
    from photogram.results.components import statement_lines
    from photogram.targets.report import calibration_summary

    sections = calibration_summary(found)
    more = [] if weights is None else [("Variance components", statement_lines(weights))]
    print_sections([*sections[:1], *more, *sections[1:]], "report.txt")
