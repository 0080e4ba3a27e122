"""`photogram collection`: adjust a collection of photos of unknown cameras."""

from __future__ import annotations

from contextlib import ExitStack, nullcontext
from enum import StrEnum
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.console import NOT_CONVERGED, errors, print_sections, print_written
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import JsonFile, Ordering, OrderingName, Quiet, Threads
from photogram.cli.progress import shown

if TYPE_CHECKING:
    from photogram.adjustment import robust

__all__ = ["collection"]

EXAMPLE = "ring.txt"
"""The packaged example, a file of photogram.examples.collection."""


class Loss(StrEnum):
    """What is minimised."""

    SQUARES = "squares"
    HUBER = "huber"
    CAUCHY = "cauchy"


_LOSSES: dict[Loss, robust.Loss | None] = {Loss.SQUARES: None, Loss.HUBER: "huber", Loss.CAUCHY: "cauchy"}


@with_job
def collection(
    job: Job,
    problem: Annotated[
        Path | None,
        Reads.FILE,
        typer.Argument(
            metavar="FILE",
            help='Collection in the format of "Bundle Adjustment in the Large", plain, .bz2 or .gz.',
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        bool,
        typer.Option("--example", help="Adjust the packaged example instead: 8 photos around 60 points."),
    ] = False,
    out: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(
            metavar="OUT",
            help="Write the adjusted collection in the same format, packed if it ends in .bz2 or .gz.",
            show_default=False,
        ),
    ] = None,
    report: Annotated[
        Path | None, Writes.FILE, typer.Option(metavar="FILE", help="Write the report.", show_default=False)
    ] = None,
    json: JsonFile = None,
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
    ordering: Ordering = OrderingName.AUTO,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Adjust photos of unknown cameras by Levenberg-Marquardt steps, however far the start."""
    if example == (problem is not None):
        raise typer.BadParameter("give a file, or --example", param_hint="FILE")
    with job, ExitStack() as resources:
        from photogram.collection import adjust, read, to_bytes
        from photogram.collection.report import summary

        if problem is None:
            packaged = files("photogram") / "examples" / "collection" / EXAMPLE
            problem = resources.enter_context(as_file(packaged))
            job.reads(problem)
        photos = read(problem)
        photos = photos.replace(image_sd=sd)
        with errors.status("adjusting", spinner="line") if not quiet else nullcontext() as status:
            result = adjust(
                photos,
                tolerance=tolerance,
                max_iterations=max_iterations,
                loss=_LOSSES[loss],
                scale=scale,
                covariance=covariance,
                ordering=ordering.value,
                threads=threads,
                progress=shown(status, "cost", 0.5) if status is not None else None,
            )
        written = {}
        if out is not None:
            written[out] = to_bytes(result.adjusted(), out.suffix)
        if report is not None:
            written[report] = result.report().encode()
        if json is not None:
            written[json] = result.to_json()
        job.write(written)
        if not quiet:
            print_sections((section for section in summary(result) if section[1]), "the report")
            print_written(written)
    if not result.converged:
        raise typer.Exit(NOT_CONVERGED)
