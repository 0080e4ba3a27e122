"""How `photogram giant` reads and adjusts a GIANT project, and what it then has."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from photogram.cli.components import Components, Found, UnitVarianceName, cleaned
from photogram.cli.console import SHOWN, errors
from photogram.cli.job import Job
from photogram.cli.options import Ordering, OrderingName, Snooping
from photogram.cli.progress import shown
from photogram.cli.refraction import AirModel, WaterModel
from photogram.lazy_dataclasses import dataclass, replace

if TYPE_CHECKING:
    from photogram import Block, Progress, Result
    from photogram.adjustment.adjustment import UnitVariance
    from photogram.giant import Limits, Project
    from photogram.giant.common import Common

__all__ = ["AS_TOLD", "How", "adjusted_project", "project_and_block"]


@dataclass(frozen=True)
class How:
    """How a project is adjusted where COMMON does not say it, with the options that do."""

    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help="Stop by the percent criterion and the limit of iterations of COMMON; list as in 1987.",
        ),
    ] = False
    unit_variance: Annotated[
        UnitVarianceName | None,
        typer.Option(
            metavar="NAME",
            help="What the variance of unit weight is based on: all weighted values (`constrained`),"
            " redundancy numbers, or 1. Default: as COMMON says, with redundancy numbers for cameras that are"
            " free; with --as-published the rule of 1987 for these.",
            show_default=False,
        ),
    ] = None
    components: Components = None
    ordering: Ordering = OrderingName.AUTO
    air_refraction: Annotated[
        AirModel | None,
        typer.Option(
            help="Refraction in air by the guide (to 9,000 m), by a standard atmosphere, or none, whatever"
            " COMMON asks for. Default where it does: giant.",
            show_default=False,
        ),
    ] = None
    water_refraction: Annotated[
        WaterModel | None,
        typer.Option(
            help="Refraction in water by the guide or by Snell's law, below the level in COMMON, or none,"
            " whatever COMMON asks for. Default where it does: giant.",
            show_default=False,
        ),
    ] = None
    water_index: Annotated[
        float | None,
        typer.Option(min=1, help="Refractive index of the water. Default: 1.340.", show_default=False),
    ] = None


AS_TOLD = How()
"""As COMMON says."""


def project_and_block(
    job: Job, directory: Path, limits: str | None, how: How
) -> tuple[Project, Block, Limits | None]:
    """Read a project, with what is remarked on it, its block as it is adjusted, and the limits of 1987."""
    from photogram.formats.planes import plane_remarks
    from photogram.giant import Limits, read_project

    project = read_project(directory)
    allowed = Limits.parse(limits) if limits else None
    block = _refracted(project.to_block(allowed), project.common, how)
    remarks = job.told([*project.messages, *plane_remarks(block, directory)])
    return replace(project, messages=remarks), block, allowed


def _refracted(block: Block, common: Common, how: How) -> Block:
    """Give the block of a project the refraction of COMMON and the options."""
    from photogram.giant.assembly import job_refraction

    air, water, index = how.air_refraction, how.water_refraction, how.water_index
    refraction = job_refraction(
        common, air=air.value if air else None, water=water.value if water else None, index=index
    )
    if index is not None and (refraction is None or refraction.water is None):
        raise typer.BadParameter("there is no refraction in water", param_hint="--water-index")
    return block.replace(refraction=refraction)


def adjusted_project(
    job: Job, project: Project, block: Block, how: How, threads: int | None, snooping: Snooping
) -> Found[Result]:
    """Adjust the block as COMMON asks, or snoop it, and find the components that are asked for."""
    from photogram.diagnosis.after_adjustment import errors_explained
    from photogram.errors import AdjustmentError

    try:
        with job.status("adjusting") as status, errors_explained(block):
            progress = shown(status, "weighted sum of squares", 1.0) if status is not None else None
            found = (
                _snooped(project, block, how, threads, snooping, progress)
                if snooping.snoop
                else _adjusted(project, block, how, threads, progress)
            )
    except AdjustmentError:
        # What was remarked on while reading is often the reason.
        for message in project.messages[:SHOWN]:
            errors.print(escape(str(message)))
        raise
    result = replace(found.result, messages=[*project.messages, *found.result.messages])
    log = None if found.log is None else replace(found.log, result=result)
    return replace(found, result=result, log=log)


def _basis(common: Common, how: How) -> UnitVariance:
    """Return what the variance of unit weight is based on."""
    said = common.unit_variance if how.as_published else common.unbiased_variance
    return how.unit_variance.value if how.unit_variance else said


def _snooped(
    project: Project,
    block: Block,
    how: How,
    threads: int | None,
    snooping: Snooping,
    progress: Callable[[Progress], None] | None,
) -> Found[Result]:
    """Take gross errors out of the block, with its weights where components are asked for."""
    from photogram import Result, snoop
    from photogram.diagnosis.after_adjustment import diagnosed

    options = snooping.options | {"unit_variance": _basis(project.common, how), "progress": progress}
    made = cleaned(block, how.components, threads, options) if how.components else None
    log = made.snooped if made else snoop(block, threads=threads, **options)
    if not isinstance(log.result, Result):
        raise TypeError("a block gives the result of a block")
    return Found(diagnosed(log.result), log, made)


def _adjusted(
    project: Project, block: Block, how: How, threads: int | None, progress: Callable[[Progress], None] | None
) -> Found[Result]:
    """Adjust the block by the rules of today, or those of 1987."""
    from photogram import AsPublished, adjust
    from photogram.diagnosis.after_adjustment import diagnosed

    common = project.common
    rules: dict[str, Any] = {}
    if how.as_published:
        rules["tolerance"] = AsPublished(common.convergence_percent)
        rules["max_iterations"] = common.max_iterations
    result = adjust(
        block.with_fixed_photos() if common.intersection_only else block,
        unit_variance=_basis(common, how),
        ordering=how.ordering.value,
        progress=progress,
        threads=threads,
        covariance="verdict",
        **rules,
    )
    return Found(diagnosed(result))
