"""`photogram convert`: from one format to another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.console import print_sections
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import Quiet
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

__all__ = ["convert"]


@with_job
def convert(
    job: Job,
    path: Annotated[Path, Reads.FILE, typer.Argument(metavar="IN", help="A project: a folder or file.")],
    out: Annotated[
        Path,
        Writes.DIRECTORY,
        typer.Argument(metavar="OUT", help="Folder for the files; it is made if need be."),
    ],
    to: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="The format to write, by its name: docs/formats.md lists them.",
        ),
    ] = "plain",
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
    quiet: Quiet = False,
) -> None:
    """Write a project in another format, and say what that has no place for."""
    with job:
        from photogram.formats import cannot_hold, to_files

        project = read_project(
            job,
            path,
            Additions(
                file_format, control, control_crs, images, names, camera, sd, pixel_origin, model, angles
            ),
        )
        lost = cannot_hold(project, to)
        files = {out / name: content for name, content in to_files(project, to).items()}
        sections = [*described(project), ("Lost, as the format has no place for it", lost or ["nothing"])]
        job.finish(files, summary=lambda: print_sections(sections, "`photogram info`"))
