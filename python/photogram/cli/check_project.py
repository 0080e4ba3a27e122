"""`photogram check`: look for mistakes and gross errors in whatever lies at a path."""

from __future__ import annotations

from rich.markup import escape

from photogram.cli.console import output, print_sections
from photogram.cli.html import HtmlFile, html_files
from photogram.cli.job import Job, with_job
from photogram.cli.options import JsonFile, Quiet, Threads
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
    json: JsonFile = None,
    html: HtmlFile = None,
    added: Additions = NOTHING,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Look for mistakes and gross errors: wrong units and axes, blunders, control that does not fit.

    Nothing is changed. The exit code is 3 when something grave is found.
    """
    with job:
        from photogram import check
        from photogram.show.ways import page_of

        project = read_project(job, project_path(job, path), added)
        if not quiet:
            print_sections(described(project), "`photogram info`")
        with job.status("checking"):
            found = check(project.block, threads=threads)
        job.finish(
            {} if json is None else {json: found.to_json()},
            html_files(job, "check", html, True, lambda: page_of(found)),
            summary=lambda: output.print(escape(found.report()), end=""),
            code=found.verdict.exit,
        )
