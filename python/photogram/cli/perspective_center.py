"""`photogram perspective-center`: perspective centres of projectors from a deck of grid measurements."""

from __future__ import annotations

from typing import Literal

from photogram.cli.console import print_document, print_remark
from photogram.cli.documents import OfPrograms
from photogram.cli.job import Job, with_job
from photogram.cli.options import Input


@with_job("perspective-center", example=("perspective_center", "grid.deck"), ending="-resected")
def perspective_center(
    job: Job,
    *,
    deck: Input,
    documents: OfPrograms,
    as_published: bool = False,
    weights: Literal["equal", "readings", "deviations"] = "equal",
    together: bool = False,
    calibrate: str | None = None,
    strict: bool = False,
) -> None:
    """Determine perspective centre, attitude and distortion of projectors from grid measurements.

    The run stops at the first set that cannot be read or solved. The sets before it are written to --out.
    """
    from photogram.perspective_center import run_deck
    from photogram.perspective_center.document import run_sketch, set_document
    from photogram.perspective_center.listing import listing
    from photogram.statistics.verdict import worst

    documents.declare(job, "listing.txt", pictures=["residuals"])
    unknown = [name.strip() for name in calibrate.split(",")] if calibrate else []
    run = run_deck(
        deck,
        as_published=as_published,
        weights=weights,
        together=together or bool(unknown),
        unknown=unknown,
    )
    stopped, results = run.stop is not None, run.results

    def summarize() -> None:
        for result in results:
            print_document(set_document(result), "listing.txt", "parameters")
        for message in run.messages:
            print_remark(message)

    job.finish(
        job.as_json(run.to_json),
        documents.inside({"listing.txt": listing(run).encode()} if results or not stopped else {}),
        documents.pictures(lambda: {"residuals": run_sketch(run.results)}),
        documents.page(job, run.document) if results else {},
        summary=summarize,
        code=0 if stopped else worst((each.verdict for each in results), strict=strict),
    )
    if run.stop is not None:
        raise run.stop.error
