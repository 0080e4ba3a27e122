"""`photogram check`, and `photogram giant check`: look for mistakes and gross errors."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from photogram.cli.console import print_sections
from photogram.cli.documents import TEXT, PageAndJson
from photogram.cli.job import Job, with_job
from photogram.cli.options import Input, Reads, Threads
from photogram.cli.projects import EXAMPLE, read_project
from photogram.formats.read_options import ReadOptions

GALVESTON = "galveston"  # The packaged example, a directory of photogram.examples


@with_job("check", example=EXAMPLE, ending="-checked")
def check_project(
    job: Job,
    *,
    path: Input,
    documents: PageAndJson,
    reading: ReadOptions,
    threads: Threads = None,
) -> None:
    """Search for mistakes and gross errors: wrong units and axes, blunders, control that does not fit.

    The project is not changed. Exit code 3: a serious mistake.
    """
    from photogram import diagnose
    from photogram.formats.description import described

    project = read_project(job, path, reading)
    if not job.quiet:
        print_sections(described(project), "`photogram info`")
    with job.status("checking"):
        found = diagnose(project.block, threads=threads)
    documents.conclude(job, found)


@with_job("giant check", example=(GALVESTON,), ending="-checked", example_name=GALVESTON)
def check(
    job: Job,
    *,
    directory: Annotated[Path, Reads.PROJECT],
    documents: PageAndJson,
    limits: str | None = None,
    threads: Threads = None,
) -> None:
    """Search for errors in a GIANT project: blunders, wrong names, stations and control that do not fit.

    The project is not changed. Exit code 3: a serious mistake.
    """
    from photogram.giant import Limits, read_project
    from photogram.giant.checking import check as checked

    documents.declare(job, TEXT)
    project = read_project(directory)
    allowed = Limits.parse(limits) if limits else None
    with job.status("checking"):
        found = checked(project, limits=allowed, threads=threads)
    # Paths of a packaged project are short.
    inside, shown = f"{directory}{os.sep}", f"{job.shown(directory)}{os.sep}"
    for section in found.sections:
        section.findings = [replace(each, text=each.text.replace(inside, shown)) for each in section.findings]
    documents.conclude(job, found)
