"""`photogram giant check`: look for errors in a GIANT project."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from photogram.cli.console import NOT_CONVERGED, errors, output
from photogram.cli.job import Job, Reads, with_job
from photogram.cli.options import JsonFile, Quiet, Threads

__all__ = ["check"]


@with_job
def check(
    job: Job,
    directory: Annotated[
        Path,
        Reads.PROJECT,
        typer.Argument(metavar="DIR", help="Directory of the five files, as for adjusting."),
    ],
    json: JsonFile = None,
    limits: Annotated[
        str | None,
        typer.Option(metavar="N1=..,N6=..", help="Limits of the 1987 program.", show_default=False),
    ] = None,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Look for errors in a GIANT project: blunders, wrong names, stations and control that do not fit.

    Nothing is changed. The exit code is 3 when something grave is found.
    """
    with job:
        from photogram.giant import Limits, read_project
        from photogram.giant import check as check_project

        project = read_project(directory)
        allowed = Limits.parse(limits) if limits else None
        with errors.status("checking", spinner="line") if not quiet else nullcontext():
            found = check_project(project, limits=allowed, threads=threads)
        if json is not None:
            job.write({json: found.to_json()})
        if not quiet:
            output.print(escape(found.report()), end="")
    if found.grave:
        raise typer.Exit(NOT_CONVERGED)
