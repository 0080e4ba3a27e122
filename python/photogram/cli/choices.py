"""What a user of `photogram adjust` chooses where a project says it otherwise, or not at all."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.components import UnitVarianceName
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from photogram.adjustment.robust import Loss
    from photogram.formats import Project

__all__ = ["AS_SAID", "Choices", "DatumName", "LossName"]


class DatumName(StrEnum):
    """What coordinates refer to."""

    CONTROL = "control"
    MINIMUM = "minimum"
    INNER = "inner"


class LossName(StrEnum):
    """What is minimised."""

    NONE = "none"
    HUBER = "huber"
    CAUCHY = "cauchy"


@dataclass(frozen=True)
class Choices:
    """What a user chooses where a project says it otherwise, or not at all, with the options that say it."""

    datum: Annotated[
        DatumName | None,
        typer.Option(
            help="What coordinates refer to. Default: what PATH says, else control, or minimum constraints.",
            show_default=False,
        ),
    ] = None
    hold: Annotated[
        str | None,
        typer.Option(
            metavar="POINT=AXES,...",
            help="Held coordinates, in the place of control: A=XYZ,B=YZ,C=Z (3-2-1).",
            show_default=False,
        ),
    ] = None
    loss: Annotated[
        LossName | None,
        typer.Option(help="Robust loss of image coordinates. Default: what PATH says.", show_default=False),
    ] = None
    unit_variance: Annotated[
        UnitVarianceName | None,
        typer.Option(
            metavar="NAME",
            help="What the variance of unit weight is based on: `constrained` (all weighted values),"
            " `redundancy` (numbers), or `unity`: 1. Default: what PATH says, else constrained.",
            show_default=False,
        ),
    ] = None
    self_calibrate: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME",
            help="Parameters of cameras that are unknown (f,cx,cy,k1 ...), or `all`.",
            show_default=False,
        ),
    ] = None

    def datum_of(self, project: Project) -> str | None:
        """Return the name of the datum: what is chosen, else that of the project."""
        return self.datum.value if self.datum is not None else project.options.datum

    def loss_of(self, project: Project) -> Loss | None:
        """Return the robust loss: what is chosen, else that of the project; None for least squares."""
        if self.loss is None:
            return project.options.loss
        losses: dict[LossName, Loss | None] = {LossName.HUBER: "huber", LossName.CAUCHY: "cauchy"}
        return losses.get(self.loss)

    def of(self, project: Project) -> Project:
        """Return the project with what is chosen of cameras, coordinates and the variance of unit weight."""
        from photogram.formats.supplements import held_points, self_calibrated

        wanted = [name.strip() for name in self.self_calibrate.split(",")] if self.self_calibrate else []
        project = self_calibrated(project, wanted)
        project = held_points(project, [each.strip() for each in self.hold.split(",")] if self.hold else [])
        if self.unit_variance is None:
            return project
        return project.replace(options=replace(project.options, unit_variance=self.unit_variance.value))


AS_SAID = Choices()
"""As the project says."""
