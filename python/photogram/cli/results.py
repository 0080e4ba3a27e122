"""Results that commands begin with: read from a folder, or adjusted from a project."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from photogram.cli.adjust import adjusted_block, started_block
from photogram.cli.job import Job
from photogram.cli.projects import Additions, read_project

if TYPE_CHECKING:
    from photogram import Result
    from photogram.formats import Project

__all__ = ["result_at"]


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
