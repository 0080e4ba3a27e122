"""The status line of an adjustment that is running."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.status import Status

    from photogram import Progress

__all__ = ["shown"]


_PHASES = {
    "form": "normal equations",
    "solve": "solution",
    "invert": "standard deviations",
}
"""What the phases of the core are for."""


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
