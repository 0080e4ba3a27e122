"""`photogram perspective-center`: perspective centres of projectors from a deck of grid measurements."""

from __future__ import annotations

from contextlib import ExitStack
from enum import StrEnum
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from photogram.cli.console import NOT_CONVERGED, output, print_remark, print_written
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import JsonFile, Quiet

if TYPE_CHECKING:
    from photogram.perspective_center import Run

__all__ = ["perspective_center"]

EXAMPLE = ("perspective_center", "grid.deck")
"""The packaged example, in photogram.examples."""


class Weights(StrEnum):
    """How the points are weighted."""

    EQUAL = "equal"
    READINGS = "readings"
    DEVIATIONS = "deviations"


@with_job
def perspective_center(
    job: Job,
    deck: Annotated[
        Path | None,
        Reads.FILE,
        typer.Argument(metavar="DECK", help="Deck of cards: a text file.", show_default=False),
    ] = None,
    example: Annotated[
        bool, typer.Option("--example", help="Run the packaged example instead: a grid at two heights.")
    ] = False,
    json: JsonFile = None,
    listing: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(
            metavar="FILE", help="Write the listing of the 1969 program, item by item.", show_default=False
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(
            metavar="FILE",
            help="Draw residual vectors and radial distortion (png, pdf, svg).",
            show_default=False,
        ),
    ] = None,
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help="Iterate and form residuals as the 1969 program does: six cycles at most, until the position"
            " moves less than the tolerance of the deck.",
        ),
    ] = False,
    weights: Annotated[
        Weights,
        typer.Option(help="Of the points: equal, number of readings, or standard deviations of readings."),
    ] = Weights.EQUAL,
    quiet: Quiet = False,
) -> None:
    """Determine perspective centre, attitude and distortion of projectors from grid measurements.

    The run stops at the first set that cannot be read or solved; what was solved before is written.
    """
    if example == (deck is not None):
        raise typer.BadParameter("give a deck, or --example", param_hint="DECK")
    with job, ExitStack() as resources:
        from photogram.perspective_center import run_deck

        if deck is None:
            deck = resources.enter_context(as_file(files("photogram").joinpath("examples", *EXAMPLE)))
            job.reads(deck)
        run = run_deck(deck, as_published=as_published, weights=weights.value)
        written = _files(run, json, listing, plot)
        job.write(written)
        if not quiet:
            _summarize(run)
            print_written(written)
        if run.stop is not None:
            raise run.stop.error
    if not run.converged:
        raise typer.Exit(NOT_CONVERGED)


def _files(run: Run, json: Path | None, listing: Path | None, plot: Path | None) -> dict[Path, bytes]:
    """Make everything that is asked for, before anything is written."""
    made = {}
    if json is not None:
        from photogram.perspective_center.document import to_json

        made[json] = to_json(run)
    if listing is not None:
        from photogram.perspective_center.listing import listing as listed

        made[listing] = listed(run).encode()
    if plot is not None and run.results:
        made[plot] = _drawn(run, plot)
    return made


def _drawn(run: Run, path: Path) -> bytes:
    from photogram.perspective_center.plot import draw

    return draw(run.results, path)


def _summarize(run: Run) -> None:
    from photogram.perspective_center.summary import summary

    for result in run.results:
        for line in summary(result):
            output.print(escape(line))
    for message in run.messages:
        print_remark(message)
