"""The status line of an adjustment that is running."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from photogram.cli.job import Job

if TYPE_CHECKING:
    from rich.status import Status

    from photogram import Progress

_PHASES = {"form": "normal equations", "solve": "solution", "invert": "standard deviations"}
"""What the phases of the core are for."""


@contextmanager
def adjustment_status(
    job: Job, text: str = "adjusting", name: str = "weighted sum of squares", factor: float = 1.0
) -> Iterator[Callable[[Progress], None] | None]:
    """Show how an adjustment goes on by the function that is given; see :func:`shown`."""
    with job.status(text) as status:
        yield None if status is None else shown(status, name, factor)


@contextmanager
def estimation_status(job: Job) -> Iterator[Callable[[int, object], None]]:
    """Show how many adjustments the estimation of variance components has taken."""
    with job.status("variance components") as status:

        def show(number: int, _: object) -> None:
            if status is not None:
                status.update(f"variance components, adjustment {number + 1}")

        yield show


def shown(status: Status, name: str, factor: float) -> Callable[[Progress], None]:
    """Return a function that keeps the status line at the phase and the last iteration.

    `name` is what the sum that is minimised is called, `factor` what it is multiplied by.
    """
    last = ""

    def show(progress: Progress) -> None:
        nonlocal last
        if progress.iteration is not None:
            size = factor * progress.iteration.weighted_sum_of_squares
            last = f"iteration {progress.iteration.number}: {name} {size:.6g}; "
        elif progress.total:
            phase = _PHASES.get(progress.phase, progress.phase)
            status.update(f"{last}{phase} {100 * progress.done // progress.total} %")

    return show
