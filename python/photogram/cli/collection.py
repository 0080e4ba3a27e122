"""`photogram collection`: adjust a collection of photos of unknown cameras."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.cli.command_classes import misuse
from photogram.cli.components import COMPONENTS, AdjustmentOutcome, Basis, MaxBiasRatio, snooped
from photogram.cli.console import OF_NETWORKS, print_document, print_sections
from photogram.cli.documents import TEXT, Documents
from photogram.cli.job import Input, Job, OutputFolder, Without, adjustment_status, with_job
from photogram.cli.options import OrderingName, Threads, check_alone
from photogram.lazy_dataclasses import dataclass, replace
from photogram.results.snooping_options import SnoopOptions, UnitWeight

if TYPE_CHECKING:
    from photogram.adjustment import robust
    from photogram.collection import AdjustedCollection, Collection

PACKED = (".bz2", ".gz")


@dataclass(frozen=True)
class CollectionFit:
    """Options for the loss function and its minimization."""

    loss: Literal["squares", "huber", "cauchy"] = "squares"
    scale: float | None = None
    sd: float = 1.0
    tolerance: float | None = None
    max_iterations: Annotated[int, typer.Option(min=1)] = 200
    covariance: Annotated[bool, typer.Option("--covariance/--no-covariance")] = True
    max_bias_ratio: MaxBiasRatio = None

    @property
    def robust(self) -> robust.Loss | None:
        """The loss with its scale; None for squares."""
        if self.loss != "squares":
            return self.loss if self.scale is None else (self.loss, self.scale)
        if self.scale is not None:
            raise misuse("--scale", "requires", options="--loss")
        return None


@with_job(example=("collection", "ring.txt"))
def collection(
    job: Job,
    *,
    problem: Input,
    out: OutputFolder = None,
    documents: Annotated[Documents, Without("xlsx", "crs", "map")],
    fit: CollectionFit,
    components: list[Basis] | None = None,
    ordering: OrderingName = "auto",
    threads: Threads = None,
    snoop: bool = False,
    snooping: Annotated[SnoopOptions, Without("robust", "parts", "max_rounds", "unit_weight")],
    unit_weight: UnitWeight = "unknown",
    strict: bool = False,
) -> None:
    """Adjust photos of unknown cameras by Levenberg-Marquardt steps from any initial values."""
    if out is not None and out.suffix in (".txt", *PACKED) and not out.exists():
        raise misuse("--out", "folder", name="adjusted.txt")
    from photogram.collection import to_bytes
    from photogram.collection.formats import recognised
    from photogram.show.forms import text

    if job.is_example and documents.plots:
        out = out or Path("example-adjusted")
    packing = problem.suffix if problem.suffix in PACKED else ""
    photos, found = recognised(problem)
    adjusted = f"adjusted{found.suffix}{packing}"
    documents.announce(job, out, TEXT, adjusted, *([COMPONENTS] if components else []))
    documents.check_plots(job, out)
    photos = photos.replace(image_sd=fit.sd)
    if snoop:
        check_alone(job, "--snoop", ("--loss", "--scale"))
    # The value of --sd is not verified, so the default differs from blocks.
    snooping = replace(snooping, unit_weight=unit_weight)
    result = _adjusted(job, photos, fit, snooping if snoop else None, components, ordering, threads)
    result = result.with_max_bias_ratio(fit.max_bias_ratio)
    result = result.estimated(job, photos, components, threads)
    written = documents.plots_of(result.result, out)
    if out is not None:
        written[out / TEXT] = text(result.document).encode()
        written[out / adjusted] = to_bytes(result.result.adjusted(), packing, found.name)
        written |= result.files(out)
    title = problem.name
    written |= documents.page(job, "collection", out, lambda: replace(result.document, title=title))
    written |= documents.as_json(result.subject)

    def summarize() -> None:
        print_sections([("File", [f"{job.shown(problem)}: {found.title}"])], "the report")
        print_document(result.document, "the report", *OF_NETWORKS)

    job.finish(
        written,
        documents.data(result.result),
        documents.charts(result.result),
        summary=summarize,
        code=result.verdict.exit_code(strict=strict),
    )


def _adjusted(
    job: Job,
    photos: Collection,
    fit: CollectionFit,
    snooping: SnoopOptions | None,
    components: list[Basis] | None,
    ordering: OrderingName,
    threads: int | None,
) -> AdjustmentOutcome[AdjustedCollection]:
    """Adjust a collection, with removal of gross errors on request."""
    from photogram.collection import AdjustedCollection, adjust

    with adjustment_status(job, name="cost", factor=0.5) as progress:
        options: dict[str, Any] = {
            "tolerance": fit.tolerance,
            "max_iterations": fit.max_iterations,
            "ordering": ordering,
            "progress": progress,
        }
        if snooping is None:
            return AdjustmentOutcome(
                adjust(photos, loss=fit.robust, covariance=fit.covariance, threads=threads, **options)
            )
        log, made = snooped(photos, components, threads, snooping, options)
        if not isinstance(log.result, AdjustedCollection):
            raise TypeError("a collection gives the result of a collection")
        return AdjustmentOutcome(log.result, log, made)
