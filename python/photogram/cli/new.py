"""`photogram new`: a plain project to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from photogram.cli.job import Job, Writes, with_job
from photogram.cli.options import Quiet
from photogram.cli.projects import EXAMPLE

Kind = Literal["block", "metrology", "survey", "rolling", "archive", "night", "board"]
"""What a project begins with."""


SOURCES = {
    "block": EXAMPLE,
    "metrology": ("flange",),
    "survey": ("survey",),
    "rolling": ("rolling",),
    "archive": ("archive",),
    "night": ("exposures",),
    "board": ("board",),
}
"""Packaged examples, directories of photogram.examples."""


@with_job
def new(
    job: Job,
    out: Annotated[Path, Writes.DIRECTORY],
    kind: Kind = "block",
    overwrite: bool = False,
    quiet: Quiet = False,
) -> None:
    """Write a small real project as tables with comments on their contents.

    Replace the tables by your own. `photogram adjust DIR` adjusts the project, `photogram stellar-camera
    exposures DIR/night.toml` a night, `photogram calibrate DIR` views of a board.

    Kinds: block: photos of a drone with control. metrology: targets and scale bars without control. survey:
    enough check points for an accuracy statement. rolling: photos of a drone with a rolling shutter. archive:
    scanned film with fiducial marks. night: exposures of stars. board: corners of a chessboard.
    """
    with job:
        from photogram.errors import InputError

        own = ("project.toml", "night.toml", "board.toml")
        if any((out / name).exists() for name in own) and not overwrite:
            raise InputError("holds a project; --overwrite allows it to be replaced", file=out)
        source = job.packaged(*SOURCES[kind])
        files = {out / each.name: each.read_bytes() for each in sorted(source.iterdir()) if each.is_file()}
        job.finish(files)
