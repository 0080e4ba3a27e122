"""`photogram convert`: from one format to another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from photogram.cli.console import print_sections
from photogram.cli.job import InputFile, Job, Writes, with_job
from photogram.cli.options import Quiet
from photogram.cli.projects import Additions, described, project_path, read_project


@with_job
def convert(
    job: Job,
    *,
    path: InputFile = None,
    out: Annotated[Path | None, Writes.EITHER] = None,
    example: bool = False,
    to: str | None = None,
    added: Additions,
    quiet: Quiet = False,
) -> None:
    """Write a project in another format and list the data that the format cannot contain."""
    assert out is not None
    with job:
        from photogram.formats import cannot_hold, target

        chosen = target(out, to)
        project = read_project(job, project_path(job, path), added)
        lost = cannot_hold(project, chosen.format.name)
        sections = [
            *described(project),
            ("Written", [f"{out}: {chosen.format.title} (--to {chosen.format.name})"]),
            ("Lost, as the format has no place for it", lost or ["nothing"]),
        ]
        job.finish(chosen.files(project), summary=lambda: print_sections(sections, "`photogram info`"))
