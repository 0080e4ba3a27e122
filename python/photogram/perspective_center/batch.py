"""Processing of a whole deck: all sets in order, until one cannot be solved."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import get_args

from photogram.arguments.arrays import one_of, truth_value
from photogram.arguments.objects import path_of
from photogram.errors import InputError, PhotogramError
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.perspective_center.deck import Deck
from photogram.perspective_center.grid import Grid, joined
from photogram.perspective_center.solution import PerspectiveCenter, Weights, determine
from photogram.show.methods import Documented
from photogram.show.page import Document, Judgement
from photogram.words import phrase


@dataclass(frozen=True)
class Stop:
    """State of a run that stopped before the end of the deck.

    Attributes
    ----------
    error
        Reason.
    title, number
        Title of the current job and number of the current set; None and 0 before the first.
    grid
        The set that could not be solved; None if it was not read.
    """

    error: PhotogramError
    title: str | None
    number: int
    grid: Grid | None


@dataclass(repr=False)
class Run(Documented):
    """Result of processing a deck.

    Attributes
    ----------
    results
        The solved sets, in the order of the deck.
    messages
        Warnings on the cards and the solutions.
    stop
        None if the whole deck was processed.
    """

    results: list[PerspectiveCenter] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)
    stop: Stop | None = None

    @property
    def converged(self) -> bool:
        """Whether all sets of the deck were solved and converged."""
        return self.stop is None and all(result.converged for result in self.results)

    def document(self) -> Document:
        """Return the document of the run; each set is a layer of its sections."""
        from photogram.perspective_center.document import run_document

        stop = self.stop
        end = None if stop is None else Judgement("Stopped", str(stop.error), (), "bad", f"set {stop.number}")
        return run_document(self.results, self.messages, end)


def run_deck(
    path: Path,
    *,
    as_published: bool = False,
    weights: Weights = "equal",
    together: bool = False,
    unknown: Sequence[str] = (),
) -> Run:
    """Process a deck like the program, up to the first unreadable or unsolved set.

    A set that does not converge does not stop the run. Earlier results are returned.

    Parameters
    ----------
    path
        The deck.
    as_published, weights, unknown
        As in :func:`photogram.perspective_center.determine`.
    together
        True if all sets of a job are of one projector, at several heights, and solved as one.

    Raises
    ------
    InputError
        If the deck cannot be read at all, or `together` and `as_published` are combined.
    """
    truth_value("as_published", as_published)
    truth_value("together", together)
    path = path_of("path", path)
    one_of("weights", weights, get_args(Weights))
    if together and as_published:
        raise InputError(phrase("projector.published-sets"))
    deck = Deck(path)
    run = Run()
    grid: Grid | None = None
    try:
        for grid in _jobs(deck.grids()) if together else deck.grids():
            result = determine(grid, as_published=as_published, weights=weights, unknown=unknown)
            run.results.append(result)
            grid = None
    except PhotogramError as error:
        run.stop = Stop(error, deck.title, deck.number, grid)
    run.messages = [*deck.messages, *(message for result in run.results for message in result.messages)]
    return run


def _jobs(grids: Iterable[Grid]) -> Iterator[Grid]:
    job: list[Grid] = []
    for grid in grids:
        if grid.number == 1 and job:
            yield joined(job)
            job = []
        job.append(grid)
    if job:
        yield joined(job)
