"""`photogram check`: look for mistakes and gross errors in whatever lies at a path."""

from __future__ import annotations

from pathlib import Path

from rich.markup import escape

from photogram.cli.check import CheckedOut, text_files
from photogram.cli.console import output, print_sections
from photogram.cli.html import HtmlFile, NoHtml, html_files, html_place
from photogram.cli.job import Job, with_job
from photogram.cli.options import JsonFile, Quiet, Threads, default_out
from photogram.cli.projects import (
    NOTHING,
    Additions,
    Example,
    ProjectPath,
    described,
    project_path,
    read_project,
    with_additions,
)

__all__ = ["check_project"]


@with_job
@with_additions()
def check_project(
    job: Job,
    path: ProjectPath = None,
    example: Example = False,
    out: CheckedOut = None,
    json: JsonFile = None,
    html: HtmlFile = None,
    no_html: NoHtml = False,
    added: Additions = NOTHING,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Look for mistakes and gross errors: wrong units and axes, blunders, control that does not fit.

    The project is not changed. The exit code is 3 when something grave is found.
    """
    with job:
        from photogram import diagnose
        from photogram.show.methods import page_of

        path = project_path(job, path)
        out = out or (Path("example-checked") if example else default_out(path, "-checked"))
        place = html_place(html, no_html, out)
        project = read_project(job, path, added)
        if not quiet:
            print_sections(described(project), "`photogram info`")
        with job.status("checking"):
            found = diagnose(project.block, threads=threads)
        job.finish(
            text_files(out, found.report()),
            {} if json is None else {json: found.to_json()},
            html_files(job, "check", place, html is not None, lambda: page_of(found)),
            summary=lambda: output.print(escape(found.report()), end=""),
            code=found.verdict.exit,
        )
