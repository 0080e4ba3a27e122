"""Reading of projects by commands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from photogram.cli.job import Job
from photogram.formats.read_options import ReadOptions

if TYPE_CHECKING:
    from photogram.formats import Project

EXAMPLE = ("project",)  # The packaged example, a directory of photogram.examples


def read_project(job: Job, path: Path, options: ReadOptions) -> Project:
    """Read a project; its files become inputs of the job."""
    from photogram.formats import read

    job.reads_inside(path)
    project = read(path, options)
    job.reads(*project.details.get("further inputs", ()))
    job.spares(*project.details.get("photo pictures", ()))
    return project.replace(path=job.shown(project.path), messages=tuple(job.told(project.messages)))
