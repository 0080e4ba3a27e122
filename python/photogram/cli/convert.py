"""`photogram convert`: from one format to another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.console import print_sections
from photogram.cli.job import InputFile, Job, Writes, with_job
from photogram.cli.options import Quiet
from photogram.cli.projects import Additions, Example, described, project_path, read_project


@with_job
def convert(
    job: Job,
    *,
    path: Annotated[InputFile, typer.Argument(metavar="IN", help="A project: a folder or file.")] = None,
    out: Annotated[
        Path | None,
        Writes.EITHER,
        typer.Argument(
            metavar="OUT",
            help="Folder for the files, which is made if need be, or the name of the file. Its name says the"
            " format: block.xml, bundle.out, sparse/0, model-colmap ...",
        ),
    ] = None,
    example: Example = False,
    to: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="The format to write, by its name: docs/formats.md lists them. Default: what OUT is called,"
            " else `plain`.",
        ),
    ] = None,
    added: Additions,
    quiet: Quiet = False,
) -> None:
    """Write a project in another format, and say what that has no place for."""
    assert out is not None
    with job:
        from photogram.formats import cannot_hold, target

        chosen = target(out, to)
        project = read_project(job, project_path(job, path), added)
        lost = cannot_hold(project, chosen.format.name)
        sections = [
            *described(project),
            ("Written", [f"{out}: {chosen.format.title} (--to {chosen.format.name})"]),
            ("Lost, as the format has no place for it", lost or ["nothing"]),
        ]
        job.finish(chosen.files(project), summary=lambda: print_sections(sections, "`photogram info`"))
