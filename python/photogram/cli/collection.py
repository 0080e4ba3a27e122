"""`photogram collection`: adjust a collection of photos of unknown cameras."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from photogram.adjustment.options import AdjustOptions
from photogram.cli.components import Basis, outcome
from photogram.cli.documents import TEXT, Documents
from photogram.cli.job import Job, with_job
from photogram.cli.options import Changes, Input, Threads, Without, misuse
from photogram.lazy_dataclasses import replace
from photogram.results.snooping_options import SnoopOptions, UnitWeight

PACKED = (".bz2", ".gz")


@with_job("collection", example=("collection", "ring.txt"))
def collection(
    job: Job,
    *,
    problem: Input,
    documents: Annotated[Documents, Without("xlsx", "crs", "map")],
    loss: Literal["squares", "huber", "cauchy"] = "squares",
    scale: float | None = None,
    sd: float = 1.0,
    tolerance: float | None = None,
    max_iterations: Annotated[int, typer.Option(min=1)] = 200,
    covariance: Annotated[bool, typer.Option("--covariance/--no-covariance")] = True,
    choices: Annotated[Mapping[str, Any], Changes(AdjustOptions, "ordering", "max_bias_ratio")],
    components: list[Basis] | None = None,
    threads: Threads = None,
    snoop: bool = False,
    snooping: Annotated[SnoopOptions, Without("robust", "parts", "max_rounds", "unit_weight")],
    unit_weight: UnitWeight = "unknown",
    strict: bool = False,
) -> None:
    """Adjust photos of unknown cameras by Levenberg-Marquardt steps from any initial values."""
    from photogram.collection import adjust, to_bytes
    from photogram.collection.formats import recognised

    if (out := documents.out) is not None and out.suffix in (".txt", *PACKED) and not out.exists():
        raise misuse("--out", "folder", name="adjusted.txt")
    if job.is_example and documents.plots:
        documents = replace(documents, out=out or Path("example-adjusted"))
    packing = problem.suffix if problem.suffix in PACKED else ""
    photos, found = recognised(problem)
    adjusted = f"adjusted{found.SUFFIX}{packing}"
    documents.declare(job, TEXT, adjusted, pictures=None)
    photos = photos.replace(image_sd=sd)
    if snoop:
        job.alone("--snoop", ("--loss", "--scale"))
    if loss == "squares" and scale is not None:
        raise misuse("--scale", "requires", options="--loss")
    robust: Any = None if loss == "squares" else loss if scale is None else (loss, scale)
    options = {
        "tolerance": tolerance,
        "max_iterations": max_iterations,
        "ordering": choices.get("ordering", "auto"),
    }

    result = outcome(
        job,
        photos,
        partial(adjust, photos, loss=robust, covariance=covariance, **options),
        # The value of --sd is not verified, so the default differs from blocks.
        snooping=replace(snooping, unit_weight=unit_weight) if snoop else None,
        bases=components or (),
        threads=threads,
        options=options,
        max_bias_ratio=choices.get("max_bias_ratio"),
        name="cost",
        factor=0.5,
    )
    files = {adjusted: to_bytes(result.result.adjusted(), packing, found.NAME), **result.files}
    from photogram.show.page import Fact

    file = Fact("File", str(job.shown(problem)), note=found.TITLE)
    documents.conclude(
        job,
        result.subject,
        files if documents.out is not None else {},
        document=replace(result.document, title=problem.name, head=[file]),
        network=result.result,
        code=result.verdict.exit_code(strict=strict),
    )
