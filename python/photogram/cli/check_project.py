"""`photogram check`: look for mistakes and gross errors in whatever lies at a path."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from photogram.cli.console import NOT_CONVERGED, output, print_sections
from photogram.cli.job import Job, Reads, with_job
from photogram.cli.options import JsonFile, Quiet, Threads
from photogram.cli.projects import (
    Additions,
    Angles,
    CamerasFile,
    ControlCrs,
    ControlFile,
    Deviations,
    FormatName,
    ImagesFile,
    Model,
    NamesFile,
    PixelOrigin,
    described,
    read_project,
)

__all__ = ["check_project"]


@with_job
def check_project(
    job: Job,
    path: Annotated[Path, Reads.FILE, typer.Argument(metavar="PATH", help="A project: a folder or file.")],
    json: JsonFile = None,
    file_format: FormatName = None,
    control: ControlFile = None,
    control_crs: ControlCrs = None,
    images: ImagesFile = None,
    names: NamesFile = None,
    camera: CamerasFile = None,
    sd: Deviations = None,
    pixel_origin: PixelOrigin = None,
    model: Model = None,
    angles: Angles = None,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Look for mistakes and gross errors: wrong units and axes, blunders, control that does not fit.

    Nothing is changed. The exit code is 3 when something grave is found.
    """
    with job:
        from photogram import check

        project = read_project(
            job,
            path,
            Additions(
                file_format, control, control_crs, images, names, camera, sd, pixel_origin, model, angles
            ),
        )
        if not quiet:
            print_sections(described(project), "`photogram info`")
        with job.status("checking"):
            found = check(project.block, threads=threads)
        job.finish(
            {} if json is None else {json: found.to_json()},
            summary=lambda: output.print(escape(found.report()), end=""),
            code=NOT_CONVERGED if found.grave else 0,
        )
