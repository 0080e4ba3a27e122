"""Results that commands begin with: read from a folder, or adjusted from a project."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from photogram.cli.adjust import adjusted_block, started_block
from photogram.cli.console import print_remark
from photogram.cli.job import Job
from photogram.cli.projects import Additions, read_project

if TYPE_CHECKING:
    from photogram import Result
    from photogram.formats import Project

__all__ = ["project_beside", "result_at"]

SETTINGS = "project.toml"


def result_at(
    job: Job, path: Path, added: Additions, threads: int | None, *, fitted: bool = True
) -> tuple[Result, Project | None]:
    """Return the result that lies at a path, or that of the project there, which is adjusted.

    Parameters
    ----------
    fitted
        Whether features that a project declares are fitted.

    Returns
    -------
    The result, and its project; None where it was read as data.
    """
    from photogram import Result, read_result
    from photogram.formats.results import is_result

    if is_result(path):
        job.reads(path)
        result = read_result(path)
        if not isinstance(result, Result):
            raise typer.BadParameter("is the result of a collection, not of a block", param_hint="PATH")
        return result, None
    project = read_project(job, path, added)
    block, started = started_block(project, keep_all=False)
    whole = project if fitted else project.replace(features={})
    return adjusted_block(job, whole, started or block, threads=threads), project


def project_beside(job: Job, folder: Path, result: Result) -> Project | None:
    """Return the plain project in whose folder a result lies that was read as data; None where there is none.

    One of another block is told, and not taken.
    """
    from photogram.formats import read

    place = folder.resolve().parent
    if not (place / SETTINGS).is_file():
        return None
    # Of its files only this one says something of the statement: the figures are those of the result.
    job.reads(place / SETTINGS)
    project = read(place, "plain")
    own, block = result.block, project.block
    if set(own.photo_ids) == set(block.photo_ids) and set(own.point_ids) == set(block.point_ids):
        return project
    print_remark(f"{place / SETTINGS} is of another block than {folder}: what it asks for is not taken")
    return None
