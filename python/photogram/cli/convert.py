"""`photogram convert`: from one format to another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.console import print_sections
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import Quiet
from photogram.cli.projects import NOTHING, Additions, described, read_project, with_additions

__all__ = ["convert"]


@with_job
@with_additions()
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
    added: Additions = NOTHING,
    quiet: Quiet = False,
) -> None:
    """Write a project in another format, and say what that has no place for."""
    with job:
        from photogram.formats import cannot_hold, to_files

        project = read_project(job, path, added)
        lost = cannot_hold(project, to)
        files = {out / name: content for name, content in to_files(project, to).items()}
        sections = [*described(project), ("Lost, as the format has no place for it", lost or ["nothing"])]
        job.finish(files, summary=lambda: print_sections(sections, "`photogram info`"))
