"""`photogram info`: what lies at a path."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.console import print_sections
from photogram.cli.job import Job, Reads, with_job
from photogram.cli.options import JsonFile, Quiet
from photogram.cli.projects import NOTHING, Additions, described, read_project, with_additions

__all__ = ["info"]


@with_job
@with_additions("images", "names")
def info(
    job: Job,
    path: Annotated[Path, Reads.FILE, typer.Argument(metavar="PATH", help="A project: a folder or file.")],
    json: JsonFile = None,
    added: Additions = NOTHING,
    quiet: Quiet = False,
) -> None:
    """Say what lies at a path without adjusting it: sizes, cameras, rays, units, frame, what lacks."""
    with job:
        from photogram.io.json import to_json

        project = read_project(job, path, added)
        sections = described(project)
        job.finish(
            {} if json is None else {json: to_json(dict(sections))},
            summary=lambda: print_sections(sections, "--json FILE"),
        )
