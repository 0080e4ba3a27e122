"""`photogram giant`: adjust a GIANT project."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from photogram.cli.check import GALVESTON
from photogram.cli.command_classes import misuse
from photogram.cli.components import (
    COMPONENTS,
    AdjustmentOutcome,
    Basis,
    MaxBiasRatio,
    UnitVarianceName,
    snooped,
)
from photogram.cli.console import OF_NETWORKS, SHOWN, errors, print_document
from photogram.cli.documents import Documents, check_maps
from photogram.cli.job import (
    Folder,
    Job,
    OutputFile,
    Reads,
    Without,
    adjustment_status,
    with_job,
)
from photogram.cli.options import (
    AirModel,
    OrderingName,
    Snooping,
    Threads,
    WaterModel,
    check_alone,
)
from photogram.lazy_dataclasses import dataclass, replace
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Block, Progress, Result
    from photogram.adjustment.options import UnitVariance
    from photogram.giant import Limits, Project
    from photogram.giant.common import Common
    from photogram.results.snooping_options import SnoopOptions

RESULTS = ("FRAMES", "GROUND", "RESTART", "report.txt")


@dataclass(frozen=True)
class GiantOptions:
    """How a GIANT project is adjusted if COMMON does not specify it."""

    as_published: bool = False
    unit_variance: UnitVarianceName | None = None
    components: list[Basis] | None = None
    ordering: OrderingName = "auto"
    air_refraction: AirModel | None = None
    water_refraction: WaterModel | None = None
    water_index: Annotated[float | None, typer.Option(min=1)] = None
    max_bias_ratio: MaxBiasRatio = None

    def basis(self, common: Common) -> UnitVariance:
        """Return the basis of the variance of unit weight."""
        said = common.unit_variance if self.as_published else common.unbiased_variance
        return self.unit_variance or said


@with_job(example=(GALVESTON,), ending="-adjusted", name=GALVESTON)
def giant(
    job: Job,
    *,
    directory: Annotated[Path, Reads.PROJECT],
    out: Folder,
    documents: Annotated[Documents, Without("xlsx", "crs")],
    listing: OutputFile = None,
    how: GiantOptions,
    threads: Threads = None,
    snoop: bool = False,
    snooping: Snooping,
    limits: str | None = None,
    strict: bool = False,
    overwrite: bool = False,
) -> None:
    """Adjust a GIANT project: photographs, points and their covariances.

    Writes FRAMES and GROUND (adjusted, if converged), RESTART (stations of the last iteration), report.html
    and report.txt.
    """
    from photogram.show.forms import text

    check_maps(documents.map)
    _check_output(out, overwrite)
    documents.announce(job, out, *RESULTS, *([COMPONENTS] if how.components else []))
    documents.check_plots(job, out)
    project, block, allowed = _project_and_block(job, directory, limits, how)
    if snoop:
        check_alone(job, "--snoop", ("--as-published",))
        if project.common.intersection_only:
            raise misuse("--snoop", "intersection-only")
    found = _adjusted_project(job, project, block, how, threads, snooping if snoop else None)
    written = _result_files(project, block, found, out, how.as_published)
    found = found.estimated(job, block, how.components, threads)
    written |= found.files(out) | documents.plots_of(found.result, out)
    written[out / "report.txt"] = text(found.document).encode()
    asked = documents.page(job, "giant", out, lambda: found.document) | documents.as_json(found.subject)
    if listing is not None:
        from photogram.giant import listing as printout

        pages = printout(project, block, found.result, as_published=how.as_published, limits=allowed)
        asked[listing] = pages.encode()
    job.finish(
        written,
        asked,
        documents.data(found.result),
        documents.charts(found.result, quiet=job.quiet),
        summary=lambda: print_document(found.document, "report.txt", *OF_NETWORKS),
        code=found.verdict.exit_code(strict=strict),
    )


def _check_output(out: Path, overwrite: bool) -> None:
    """Reject the folder of another project as output folder."""
    from photogram.errors import InputError
    from photogram.giant.files import present_files

    if not out.is_dir():
        return
    present = present_files(out)
    inputs = [path.name for name in ("COMMON", "CAMERAS", "IMAGES") for path in present[name]]
    if inputs and not overwrite:
        raise InputError(phrase("command.other-project", names=inputs), file=out)
    for name in set(RESULTS) & set(present):
        others = [path for path in present[name] if path.name != name]
        if inputs and others:
            raise InputError(phrase("command.second-file", name=name), file=others[0])


def _result_files(
    project: Project, block: Block, found: AdjustmentOutcome[Result], out: Path, as_published: bool
) -> dict[Path, bytes]:
    """Return all files of the output folder."""
    from photogram.giant.export import adjusted_records
    from photogram.giant.files import to_bytes
    from photogram.messages import Message

    result = found.result
    records = adjusted_records(
        project,
        block,
        photo_positions=result.photo_positions,
        photo_attitudes=result.photo_attitudes,
        point_positions=result.point_positions,
        converged=result.converged,
        as_published=as_published,
    )
    if "RESTART" not in records:
        result.messages.append(Message.of("giant.no-restart"))
    return {out / name: to_bytes(lines) for name, lines in records.items()}


def _project_and_block(
    job: Job, directory: Path, limits: str | None, how: GiantOptions
) -> tuple[Project, Block, Limits | None]:
    """Read a project with its remarks, its block, and the limits of 1987."""
    from photogram.formats.planes import plane_remarks
    from photogram.giant import Limits, read_project

    project = read_project(directory)
    allowed = Limits.parse(limits) if limits else None
    block = _refracted(project.to_block(allowed), project.common, how)
    remarks = job.told([*project.messages, *plane_remarks(block, directory)])
    return replace(project, messages=remarks), block, allowed


def _refracted(block: Block, common: Common, how: GiantOptions) -> Block:
    """Give the block of a project the refraction of COMMON and the options."""
    from photogram.giant.assembly import job_refraction

    air, water, index = how.air_refraction, how.water_refraction, how.water_index
    refraction = job_refraction(common, air=air, water=water, index=index)
    if index is not None and (refraction is None or refraction.water is None):
        raise misuse("--water-index", "requires", options="--water-refraction")
    return block.replace(refraction=refraction)


def _adjusted_project(
    job: Job,
    project: Project,
    block: Block,
    how: GiantOptions,
    threads: int | None,
    snooping: SnoopOptions | None,
) -> AdjustmentOutcome[Result]:
    """Adjust or snoop the block as in COMMON, with requested components."""
    from photogram.diagnosis.after_adjustment import errors_explained
    from photogram.errors import AdjustmentError

    try:
        with adjustment_status(job) as progress, errors_explained(block):
            found = (
                _snooped(project, block, how, threads, snooping, progress)
                if snooping is not None
                else _adjusted(project, block, how, threads, progress)
            )
    except AdjustmentError:
        # Remarks on the input are often the reason.
        for message in project.messages[:SHOWN]:
            errors.print(escape(str(message)))
        raise
    result = replace(found.result, messages=[*project.messages, *found.result.messages])
    log = None if found.log is None else replace(found.log, result=result)
    return replace(found, result=result, log=log).with_max_bias_ratio(how.max_bias_ratio)


def _snooped(
    project: Project,
    block: Block,
    how: GiantOptions,
    threads: int | None,
    snooping: SnoopOptions,
    progress: Callable[[Progress], None] | None,
) -> AdjustmentOutcome[Result]:
    """Remove gross errors, and estimate variance components if requested."""
    from photogram import Result
    from photogram.diagnosis.after_adjustment import diagnosed

    options = {"unit_variance": how.basis(project.common), "progress": progress}
    log, made = snooped(block, how.components, threads, snooping, options)
    if not isinstance(log.result, Result):
        raise TypeError("a block gives the result of a block")
    return AdjustmentOutcome(diagnosed(log.result), log, made)


def _adjusted(
    project: Project,
    block: Block,
    how: GiantOptions,
    threads: int | None,
    progress: Callable[[Progress], None] | None,
) -> AdjustmentOutcome[Result]:
    """Adjust the block by present rules or by the rules of 1987."""
    from photogram import AsPublished, adjust
    from photogram.diagnosis.after_adjustment import diagnosed

    common = project.common
    rules: dict[str, Any] = {}
    if how.as_published:
        rules["tolerance"] = AsPublished(common.convergence_percent)
        rules["max_iterations"] = common.max_iterations
    result = adjust(
        block.with_fixed_photos() if common.intersection_only else block,
        unit_variance=how.basis(common),
        ordering=how.ordering,
        progress=progress,
        threads=threads,
        covariance="verdict",
        **rules,
    )
    return AdjustmentOutcome(diagnosed(result))
