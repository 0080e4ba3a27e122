"""`photogram check`, and `photogram giant check`: look for mistakes and gross errors."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from photogram.cli.console import print_sections
from photogram.cli.documents import TEXT, PageAndJson
from photogram.cli.job import InputFile, Job, OutputFolder, Reads, with_job
from photogram.cli.options import Quiet, Threads, default_out
from photogram.cli.projects import Additions, described, project_path, read_project

if TYPE_CHECKING:
    from photogram.diagnosis.diagnosis import Diagnosis

EXAMPLE = "galveston"
"""The packaged example, a directory of photogram.examples."""


@with_job
def check_project(
    job: Job,
    *,
    path: InputFile = None,
    example: bool = False,
    out: OutputFolder = None,
    documents: PageAndJson,
    added: Additions,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Search for mistakes and gross errors: wrong units and axes, blunders, control that does not fit.

    The project is not changed. Exit code 3: a serious mistake.
    """
    with job:
        from photogram import diagnose

        path = project_path(job, path)
        out = out or (Path("example-checked") if example else default_out(path, "-checked"))
        documents.place(out)  # refused before anything is read
        project = read_project(job, path, added)
        if not quiet:
            print_sections(described(project), "`photogram info`")
        with job.status("checking"):
            found = diagnose(project.block, threads=threads)
        documents.conclude(job, "check", found, out)


@with_job
def check(
    job: Job,
    *,
    directory: Annotated[Path | None, Reads.PROJECT] = None,
    example: bool = False,
    out: OutputFolder = None,
    documents: PageAndJson,
    limits: str | None = None,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Search for errors in a GIANT project: blunders, wrong names, stations and control that do not fit.

    The project is not changed. Exit code 3: a serious mistake.
    """
    with job:
        from photogram.giant import Limits, read_project
        from photogram.giant.checking import check as checked

        if directory is None:
            directory = job.packaged(EXAMPLE)
            job.reads(directory)
            out = out or Path(f"{EXAMPLE}-checked")
        out = out or default_out(directory, "-checked")
        documents.announce(job, out, TEXT)
        project = read_project(directory)
        allowed = Limits.parse(limits) if limits else None
        with job.status("checking"):
            found = checked(project, limits=allowed, threads=threads)
        _shorten(found, f"{directory}{os.sep}", f"{job.shown(directory)}{os.sep}")
        documents.conclude(job, "giant check", found, out)


def _shorten(found: Diagnosis, inside: str, shown: str) -> None:
    """Write in the findings where a packaged project lies as people are told."""
    for section in found.sections:
        section.findings = [replace(each, text=each.text.replace(inside, shown)) for each in section.findings]
