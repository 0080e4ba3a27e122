"""`photogram adjust` of a project that is read batch by batch: in parts, and never whole in memory."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from photogram.cli.console import NOT_CONVERGED, output, print_sections
from photogram.cli.job import Job
from photogram.cli.progress import shown

if TYPE_CHECKING:
    from photogram.cli.choices import Choices
    from photogram.cli.division import Parts

__all__ = ["adjusted_on_disk"]

TAKEN = frozenset(
    (
        *("PATH", "--out", "--no-html", "--quiet", "--threads", "--unit-variance", "--loss", "--keep-all"),
        *("--cluster", "--workers", "--parts", "--memory", "--run", "--plan"),
    )
)
"""Options that such a project takes. Any other is refused: nothing is left out without a word."""


def adjusted_on_disk(
    job: Job,
    path: Path,
    target: Path,
    divided: Parts,
    choices: Choices,
    threads: int | None,
) -> bool:
    """Plan or adjust a project that is read batch by batch; False where it has to be read whole."""
    division = divided.division
    if division is None:
        return False
    from photogram.formats import Wishes
    from photogram.formats.plain.batches import streamable

    if not streamable(path):
        return False
    _check_options(job)
    from photogram.formats import in_parts

    wishes, folder = Wishes(), divided.run or target / "run"
    unit_variance = choices.unit_variance and choices.unit_variance.value
    chosen: Any = {"unit_variance": unit_variance, "loss": choices.loss_of}
    if divided.plan:
        plan = in_parts.planned_on_disk(path, wishes, folder, division, **chosen)
        output.print("\n".join(plan.lines()))
        plan.check()
        return True
    with job.status("adjusting") as status:
        told = shown(status, "weighted sum of squares", 1.0) if status is not None else None
        found = in_parts.adjusted_on_disk(
            path, wishes, folder, division, **chosen, threads=threads, progress=told
        )
    lines = [*found.lines(), f"what was found of each node: {folder / 'results'}"]
    report = {target / "report.txt": ("\n".join(lines) + "\n").encode()}
    code = 0 if found.outcome.status == "converged" else NOT_CONVERGED
    job.finish(
        report, summary=lambda: print_sections([("adjusted in parts", lines)], "report.txt"), code=code
    )
    return True


def _check_options(job: Job) -> None:
    """Refuse what is asked for and not done of such a project."""
    for name in job.given:
        if name not in TAKEN:
            raise typer.BadParameter(
                "is not done of a project whose images are read batch by batch from Parquet, in parts: it"
                " goes without --cluster, --parts, --memory and --run, or with images in CSV, which are read"
                " whole",
                param_hint=name,
            )
