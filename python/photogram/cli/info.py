"""`photogram info`: what lies at a path."""

from __future__ import annotations

from photogram.cli.console import print_sections
from photogram.cli.job import Job, with_job
from photogram.cli.options import JsonFile, Quiet
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

__all__ = ["info"]


@with_job
@with_additions()
def info(
    job: Job,
    path: ProjectPath = None,
    example: Example = False,
    json: JsonFile = None,
    added: Additions = NOTHING,
    quiet: Quiet = False,
) -> None:
    """Say what lies at a path without adjusting it: sizes, cameras, rays, units, frame, what lacks."""
    with job:
        from photogram.io.json import to_json

        project = read_project(job, project_path(job, path), added)
        sections = described(project)
        job.finish(
            {} if json is None else {json: to_json(dict(sections))},
            summary=lambda: print_sections(sections, "--json FILE"),
        )
