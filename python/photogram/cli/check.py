"""`photogram giant check`: look for errors in a GIANT project."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from photogram.cli.console import output
from photogram.cli.html import HtmlFile, NoHtml, html_files, html_place
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import JsonFile, Quiet, Threads, default_out, out_option

if TYPE_CHECKING:
    from photogram.diagnosis.findings import Diagnosis

__all__ = ["EXAMPLE", "CheckedOut", "check", "text_files"]

EXAMPLE = "galveston"
"""The packaged example, a directory of photogram.examples."""
TEXT = "report.txt"
"""The report as text, in a directory of results."""

CheckedOut = Annotated[
    Path | None,
    Writes.DIRECTORY,
    out_option("Directory for report.html and report.txt. Default: the input with -checked, beside it."),
]


def text_files(out: Path, report: str) -> dict[Path, bytes]:
    """Return the report as text as a file of a directory of results."""
    return {out / TEXT: report.encode()}


def _shorten(found: Diagnosis, inside: str, shown: str) -> None:
    """Write in the findings where a packaged project lies as people are told."""
    for section in found.sections:
        section.findings = [replace(each, text=each.text.replace(inside, shown)) for each in section.findings]


@with_job
def check(
    job: Job,
    directory: Annotated[
        Path | None,
        Reads.PROJECT,
        typer.Argument(
            metavar="DIR", help="Directory of the five files, as for adjusting.", show_default=False
        ),
    ] = None,
    example: Annotated[
        bool,
        typer.Option(
            "--example", help="Check the packaged example instead: 20 photographs at Galveston Bay."
        ),
    ] = False,
    out: CheckedOut = None,
    json: JsonFile = None,
    html: HtmlFile = None,
    no_html: NoHtml = False,
    limits: Annotated[
        str | None,
        typer.Option(metavar="N1=..,N6=..", help="Limits of the 1987 program.", show_default=False),
    ] = None,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Look for errors in a GIANT project: blunders, wrong names, stations and control that do not fit.

    The project is not changed. The exit code is 3 when something grave is found.
    """
    with job:
        from photogram.giant import Limits, read_project
        from photogram.giant.checking import check as check_project
        from photogram.show.methods import page_of

        if directory is None:
            directory = job.packaged(EXAMPLE)
            job.reads(directory)
            out = out or Path(f"{EXAMPLE}-checked")
        out = out or default_out(directory, "-checked")
        place = html_place(html, no_html, out)
        job.writes(out / TEXT, *([place] if place else []))
        project = read_project(directory)
        allowed = Limits.parse(limits) if limits else None
        with job.status("checking"):
            found = check_project(project, limits=allowed, threads=threads)
        _shorten(found, f"{directory}{os.sep}", f"{job.shown(directory)}{os.sep}")
        job.finish(
            text_files(out, found.report()),
            {} if json is None else {json: found.to_json()},
            html_files(job, "giant check", place, html is not None, lambda: page_of(found)),
            summary=lambda: output.print(escape(found.report()), end=""),
            code=found.verdict.exit,
        )
