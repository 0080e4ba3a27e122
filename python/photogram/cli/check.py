"""`photogram giant check`: look for errors in a GIANT project."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from photogram.cli.console import output
from photogram.cli.html import HtmlFile, html_files
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
    html: HtmlFile = None,
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
        from photogram.show.ways import page_of

        project = read_project(directory)
        allowed = Limits.parse(limits) if limits else None
        with job.status("checking"):
            found = check_project(project, limits=allowed, threads=threads)
        job.finish(
            {} if json is None else {json: found.to_json()},
            html_files(job, "giant check", html, True, lambda: page_of(found)),
            summary=lambda: output.print(escape(found.report()), end=""),
            code=found.verdict.exit,
        )
