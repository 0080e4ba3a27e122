"""`photogram perspective-center`: perspective centres of projectors from a deck of grid measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from photogram.cli.console import print_document, print_remark
from photogram.cli.documents import OfPrograms
from photogram.cli.job import Folder, Input, Job, with_job

if TYPE_CHECKING:
    from photogram.perspective_center import Run


@with_job(example=("perspective_center", "grid.deck"), ending="-resected")
def perspective_center(
    job: Job,
    *,
    deck: Input,
    out: Folder,
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
    from photogram.statistics.verdict import worst

    pictures = documents.announce(job, out, "listing.txt", picture="residuals")
    unknown = [name.strip() for name in calibrate.split(",")] if calibrate else []
    run = run_deck(
        deck,
        as_published=as_published,
        weights=weights,
        together=together or bool(unknown),
        unknown=unknown,
    )
    stopped = run.stop is not None
    job.finish(
        _files(run, documents.json, out, pictures),
        documents.page(job, "perspective-center", out, run.document) if run.results else {},
        summary=lambda: _summarize(run),
        code=0 if stopped else worst((each.verdict for each in run.results), strict=strict),
    )
    if run.stop is not None:
        raise run.stop.error


def _files(run: Run, json: Path | None, folder: Path, pictures: list[Path]) -> dict[Path, bytes]:
    """Make all files but the report for the browser, before anything is written."""
    made = {}
    if json is not None:
        made[json] = run.to_json()
    if run.results or run.stop is None:
        from photogram.perspective_center.listing import listing

        made[folder / "listing.txt"] = listing(run).encode()
    if pictures and run.results:
        from photogram.perspective_center.plot import run_sketch

        plot = run_sketch(run.results)
        made |= {path: plot.render(path.suffix[1:]) for path in pictures}
    return made


def _summarize(run: Run) -> None:
    from photogram.perspective_center.document import set_document

    for result in run.results:
        print_document(set_document(result), "listing.txt", "parameters")
    for message in run.messages:
        print_remark(message)
