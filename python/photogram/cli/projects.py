"""Reading of projects by commands, and options that override their settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from photogram.adjustment.options import AdjustOptions
from photogram.arguments.fields import option
from photogram.cli.job import Job
from photogram.cli.options import Changes, misuse, words_of
from photogram.formats.read_options import ReadOptions
from photogram.lazy_dataclasses import dataclass, fields, replace

if TYPE_CHECKING:
    from photogram.formats import Project

EXAMPLE = ("project",)  # The packaged example, a directory of photogram.examples

Choices = Annotated[
    Mapping[str, Any],
    Changes(AdjustOptions, *(each.name for each in fields(AdjustOptions) if each.metadata)),
]
"""Options of an adjustment with precedence over the project."""


@dataclass(frozen=True)
class Unknowns:
    """Fixed coordinates and free camera parameters of a block."""

    hold: Sequence[str] = option((), kind=str, parse=words_of)
    self_calibrate: Sequence[str] = option((), kind=str, parse=words_of)

    def of(self, project: Project, choices: Mapping[str, Any]) -> Project:
        """Return the project with these unknowns and the chosen options."""
        from photogram.formats.supplements import held_points, self_calibrated
        from photogram.io.places import Place, at_place

        with at_place(Place(), "--self-calibrate"):
            project = self_calibrated(project, list(self.self_calibrate))
        project = held_points(project, list(self.hold))
        if self.hold and choices.get("datum") in ("inner", "minimum"):
            raise misuse("--datum", "conflict", options="--hold")
        own = {"datum": None} if self.hold else {}
        return project.replace(options=replace(project.options, **{**own, **choices}))


def read_project(job: Job, path: Path, options: ReadOptions) -> Project:
    """Read a project; its files become inputs of the job."""
    from photogram.formats import read

    job.reads_inside(path)
    project = read(path, options)
    job.reads(*project.details.get("further inputs", ()))
    return project.replace(path=job.shown(project.path), messages=tuple(job.told(project.messages)))


def source(job: Job, project: Project, name: str) -> str:
    """Return the source of `datum` or `loss`: option, or key and line of a file."""
    if f"--{name}" in job.given:
        return f"--{name} {job.given[f'--{name}']}"
    key = f"adjust.{name}"
    if key in job.given.get("--set", ""):
        return f"--set {key}={getattr(project.options, name)}"
    settings = project.path / "project.toml" if project.path.is_dir() else project.path
    if settings.suffix != ".toml" or not settings.is_file():
        return f"{project.path}: {name}"
    from photogram.io.toml import TomlFile

    record = TomlFile(settings).place(name, "adjust").record
    return f"{settings}, record {record}: {name} in [adjust]"
