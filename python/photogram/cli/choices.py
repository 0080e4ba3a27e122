"""Options of `photogram adjust` that override the settings of a project."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from photogram.cli.command_classes import misuse
from photogram.cli.components import MaxBiasRatio, UnitVarianceName
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from photogram.adjustment.options import AdjustOptions
    from photogram.cli.job import Job
    from photogram.formats import Project

LossName = Literal["none", "huber", "cauchy"]


@dataclass(frozen=True)
class Choices:
    """Options that override the settings of a project."""

    datum: Literal["control", "minimum", "inner"] | None = None
    hold: str | None = None
    loss: LossName | None = None
    unit_variance: UnitVarianceName | None = None
    iterations: Annotated[int | None, typer.Option(min=1)] = None
    max_bias_ratio: MaxBiasRatio = None
    self_calibrate: str | None = None

    def options(self, options: AdjustOptions) -> AdjustOptions:
        """Return the options of a project with the options of the user."""
        return replace(
            options,
            datum=self.datum or (None if self.hold else options.datum),
            unit_variance=self.unit_variance or options.unit_variance,
            loss=options.loss if self.loss is None else None if self.loss == "none" else self.loss,
            max_iterations=self.iterations or options.max_iterations,
            max_bias_ratio=self.max_bias_ratio or options.max_bias_ratio,
        )

    def source(self, job: Job, project: Project, name: str) -> str:
        """Return the source of `datum` or `loss`: option, or key and line of a file."""
        if getattr(self, name) is not None:
            return f"--{name} {getattr(self, name)}"
        key = f"adjust.{name}"
        if key in job.given.get("--set", ""):
            return f"--set {key}={getattr(project.options, name)}"
        settings = project.path / "project.toml" if project.path.is_dir() else project.path
        if settings.suffix != ".toml" or not settings.is_file():
            return f"{project.path}: {name}"
        from photogram.io.toml import TomlFile

        record = TomlFile(settings).place(name, "adjust").record
        return f"{settings}, record {record}: {name} in [adjust]"

    def of(self, project: Project) -> Project:
        """Return the project with the chosen options."""
        from photogram.formats.supplements import held_points, self_calibrated

        wanted = [name.strip() for name in self.self_calibrate.split(",")] if self.self_calibrate else []
        project = self_calibrated(project, wanted)
        project = held_points(project, [each.strip() for each in self.hold.split(",")] if self.hold else [])
        if self.hold and self.datum in ("inner", "minimum"):
            raise misuse("--datum", "conflict", options="--hold")
        return project.replace(options=self.options(project.options))
