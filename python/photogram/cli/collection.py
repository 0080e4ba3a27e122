"""`photogram collection`: adjust a collection of photos of unknown cameras."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.cli.components import (
    COMPONENTS,
    Components,
    cleaned,
    estimated,
    with_components,
    with_components_page,
    with_weights,
)
from photogram.cli.console import ON_TOP, print_sections
from photogram.cli.documents import NONE_ASKED, Documents
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import (
    Ordering,
    OrderingName,
    Quiet,
    Snoop,
    SnoopLevel,
    SnoopRate,
    Strict,
    Threads,
    UnitWeight,
    example_out,
    out_option,
)
from photogram.cli.progress import shown
from photogram.cli.projects import with_options

if TYPE_CHECKING:
    from photogram.adjustment import robust
    from photogram.show.page import Page

__all__ = ["collection"]

EXAMPLE = ("collection", "ring.txt")
"""The packaged example, in photogram.examples."""
PACKED = (".bz2", ".gz")


class Loss(StrEnum):
    """What is minimised."""

    SQUARES = "squares"
    HUBER = "huber"
    CAUCHY = "cauchy"


_LOSSES: dict[Loss, robust.Loss | None] = {Loss.SQUARES: None, Loss.HUBER: "huber", Loss.CAUCHY: "cauchy"}


@with_job
@with_options("documents", Documents, "xlsx", "crs", "map")
def collection(
    job: Job,
    problem: Annotated[
        Path | None,
        Reads.FILE,
        typer.Argument(
            metavar="FILE",
            help='Problem of "Bundle Adjustment in the Large" or Bundle file (0.3), plain, .bz2 or .gz.',
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        bool,
        typer.Option("--example", help="Adjust the packaged example instead: 8 photos around 60 points."),
    ] = False,
    out: Annotated[
        Path | None,
        Writes.DIRECTORY,
        out_option(
            "Directory for report.html, report.txt and the adjusted collection: adjusted.txt, or"
            " adjusted.out for a Bundle"
            " file, packed as FILE is."
            " Default: no files."
        ),
    ] = None,
    documents: Documents = NONE_ASKED,
    loss: Annotated[
        Loss, typer.Option(help="What is minimised: squares, or a robust loss of them.")
    ] = Loss.SQUARES,
    scale: Annotated[
        float | None,
        typer.Option(
            help="Where the loss sets in, in standard deviations. Default: 1.50 (huber), 2.55 (cauchy).",
            show_default=False,
        ),
    ] = None,
    sd: Annotated[float, typer.Option(help="Standard deviation of image coordinates, pixels.")] = 1.0,
    tolerance: Annotated[
        float | None,
        typer.Option(
            help="Stop when a step lowers the cost by less than this fraction."
            " Default: 1e-8, with a loss 1e-6.",
            show_default=False,
        ),
    ] = None,
    max_iterations: Annotated[int, typer.Option(min=1, help="Iterations at the most.")] = 200,
    covariance: Annotated[
        bool, typer.Option("--covariance/--no-covariance", help="Compute covariances and redundancy numbers.")
    ] = True,
    components: Components = None,
    ordering: Ordering = OrderingName.AUTO,
    threads: Threads = None,
    snoop: Snoop = False,
    level: SnoopLevel = 0.05,
    fdr: SnoopRate = None,
    unit_weight: Annotated[
        UnitWeight,
        typer.Option(help="With --snoop: whether --sd is right, or but for a common factor."),
    ] = UnitWeight.UNKNOWN,
    strict: Strict = False,
    quiet: Quiet = False,
) -> None:
    """Adjust photos of unknown cameras by Levenberg-Marquardt steps, however far the start."""
    if out is not None and out.suffix in (".txt", *PACKED) and not out.exists():
        raise typer.BadParameter("names a directory; adjusted.txt goes there", param_hint="--out")
    with job:
        from photogram.adjustment import snooping
        from photogram.collection import AdjustedCollection, adjust, to_bytes
        from photogram.collection.formats import recognised
        from photogram.collection.report import summary
        from photogram.show.ways import page_of

        if problem is None:
            problem = job.packaged(*EXAMPLE)
            out = example_out(out, documents.plots, "example-adjusted")
            job.reads(problem)
        packing = problem.suffix if problem.suffix in PACKED else ""
        photos, found = recognised(problem)
        names = [] if out is None else [out / "report.txt", out / f"adjusted{found.suffix}{packing}"]
        if components and out is not None:
            names.append(out / COMPONENTS)
        place = documents.place(out)
        job.writes(*names, *([place] if place else []))
        pictures = documents.pictures(job, out)
        photos = photos.replace(image_sd=sd)
        if snoop and loss is not Loss.SQUARES:
            raise typer.BadParameter("not with a robust loss", param_hint="--snoop")
        log, made = None, None
        with job.status("adjusting") as status:
            options: dict[str, Any] = {
                "tolerance": tolerance,
                "max_iterations": max_iterations,
                "ordering": ordering.value,
                "threads": threads,
                "progress": shown(status, "cost", 0.5) if status is not None else None,
            }
            if snoop:
                options |= {"level": level, "fdr": fdr, "unit_weight": unit_weight.value}
                if components:
                    made = cleaned(photos, components, options.pop("threads"), options)
                log = made.snooped if made else snooping.snoop(photos, **options)
                if not isinstance(log.result, AdjustedCollection):
                    raise TypeError("a collection gives the result of a collection")
                result = log.result
            else:
                result = adjust(photos, loss=_LOSSES[loss], scale=scale, covariance=covariance, **options)
        told = log or result
        estimates = None if made else estimated(job, photos, components, threads)
        weights = made or estimates
        written = pictures.of(result)
        if names:
            written[names[0]] = told.report().encode()
            written[names[1]] = to_bytes(result.adjusted(), packing, found.name)
        if weights is not None and out is not None:
            written[out / COMPONENTS] = weights.report().encode()

        def page() -> Page:
            return with_components_page(replace(page_of(told), title=problem.name), estimates, made)

        written |= documents.page(job, "collection", out, page)
        written |= documents.as_json(told)
        sections = [
            ("File", [f"{job.shown(problem)}: {found.title}"]),
            *with_weights(log.sections() if log else [], made),
            *with_components(summary(result), estimates)[ON_TOP if log else 0 :],
        ]
        job.finish(
            written,
            documents.data(result),
            documents.charts(result),
            summary=lambda: print_sections(sections, "the report"),
            code=(estimates or told).verdict.exit_code(strict=strict),
        )
