"""`photogram adjust` in parts, without loading the whole project."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from photogram.cli.console import NOT_CONVERGED, print_text
from photogram.cli.job import Job, adjustment_status
from photogram.lazy_dataclasses import replace
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.distributed import Division

DIVIDING = ("--cluster", "--workers", "--parts", "--memory", "--run")
"""Options that divide an adjustment into parts."""
TAKEN = frozenset(
    (
        *("PATH", "--out", "--no-html", "--quiet", "--threads", "--unit-variance", "--loss", "--keep-all"),
        *(*DIVIDING, "--iterations", "--plan"),
    )
)
"""Options for a project on disk; any other option is rejected."""


def adjusted_on_disk(
    job: Job,
    path: Path,
    target: Path,
    division: Division,
    choices: Mapping[str, Any],
    threads: int | None,
    *,
    is_plan: bool,
) -> bool:
    """Plan or adjust a project batch by batch; False if this is impossible."""
    from photogram.formats import ReadOptions
    from photogram.formats.in_parts import streamable

    if not streamable(path, None if division.cluster else division.memory_bytes):
        return False
    job.only(TAKEN, "in-batches", options=[each for each in job.given if each in DIVIDING])
    from photogram.formats import in_parts
    from photogram.show.forms import text
    from photogram.show.page import Section, Text

    reading, folder = ReadOptions(), Path(division.folder or target / "run")
    change = partial(replace, **choices)
    threads = None if is_plan else threads
    opened = in_parts.on_disk(path, reading, folder, division, change=change, threads=threads)
    if is_plan:
        with opened as run:
            planned = run.plan()
            print_text(planned.document())
            planned.check()
        return True
    with adjustment_status(job) as progress, opened as run:
        outcome = run.adjust(progress)
        document = in_parts.document(run, outcome)
    place = Text(str(phrase("command.node-results", folder=folder / "results")))
    document = document.with_sections(Section("files", "Files", [place]))
    job.finish(
        {target / "report.txt": text(document).encode()},
        summary=lambda: print_text(document),
        code=0 if outcome.status == "converged" else NOT_CONVERGED,
    )
    return True
