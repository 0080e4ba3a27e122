"""`photogram info`: what lies at a path."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.cli.console import print_sections
from photogram.cli.job import InputFile, Job, OutputFile, with_job
from photogram.cli.options import Quiet
from photogram.cli.projects import Additions, described, project_path, read_project
from photogram.messages import counted, listed

if TYPE_CHECKING:
    from photogram.formats import Project
    from photogram.show.sections import Section

CLASSES = {"h": "horizontal", "v": "vertical", "3d": "3D"}
"""What accuracy classes are of."""


@with_job
def info(
    job: Job,
    *,
    path: InputFile = None,
    example: bool = False,
    json: OutputFile = None,
    added: Additions,
    quiet: Quiet = False,
) -> None:
    """Describe a project without adjustment: sizes, cameras, rays, units, frame, missing data.

    If the project requests an accuracy statement, the command describes the subject of the statement.
    """
    with job:
        from photogram.io.json import to_json

        project = read_project(job, project_path(job, path), added)
        sections = [*described(project), *_asked(project)]
        job.finish(
            {} if json is None else {json: to_json(dict(sections))},
            summary=lambda: print_sections(sections, "--json FILE"),
        )


def _asked(project: Project) -> list[Section]:
    """Return what an accuracy statement would be about, in a line; nothing where none is asked for."""
    if not project.statement:
        return []
    from photogram.results.statement.request import Asked
    from photogram.results.statement.texts import Texts

    asked, texts = Asked.checked(**project.statement), Texts(unit=project.block.linear_unit)
    classes = [f"{CLASSES[name]} {texts.size(size)}" for name, size in asked.classes.items()]
    budgets = "three that are chosen" if asked.budgets is None else listed(list(asked.budgets)) or "none"
    said = [
        ", ".join(asked.standards),
        f"classes: {', '.join(classes) or 'none'}",
        counted(len(project.checks), "check point"),
        *([counted(len(asked.lengths), "calibrated length")] if asked.lengths else []),
        f"budgets: {budgets}",
    ]
    return [("Accuracy statement", ["; ".join(said)])]
