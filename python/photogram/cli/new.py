"""`photogram new`: a plain project to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.job import Job, Writes, with_job
from photogram.cli.options import Quiet
from photogram.cli.projects import EXAMPLE

__all__ = ["new"]


@with_job
def new(
    job: Job,
    out: Annotated[
        Path,
        Writes.DIRECTORY,
        typer.Argument(metavar="DIR", help="Folder for the project; it is made if need be."),
    ],
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a project that is there already.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Write a small real project as tables, with comments that say what may stand there.

    Replace the tables by your own; `photogram adjust DIR` adjusts it.
    """
    with job:
        from photogram.errors import InputError

        if (out / "project.toml").exists() and not overwrite:
            raise InputError("holds a project; --overwrite allows it to be replaced", file=out)
        source = job.packaged(*EXAMPLE)
        files = {out / each.name: each.read_bytes() for each in sorted(source.iterdir()) if each.is_file()}
        job.finish(files)
