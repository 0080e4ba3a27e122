"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated, Literal

import typer

from photogram.cli.command_classes import misuse
from photogram.cli.job import Job, Without
from photogram.results.snooping_options import SnoopOptions

PictureFormat = Literal["png", "pdf", "svg"]
OrderingName = Literal["auto", "input", "rcm", "amd", "dissection", "graph-dissection"]
AirModel = Literal["giant", "standard", "none"]
WaterModel = Literal["giant", "snell", "none"]

Threads = Annotated[int | None, typer.Option(min=1)]


Snooping = Annotated[SnoopOptions, Without("robust", "parts", "max_rounds")]


def check_alone(job: Job, option: str, others: Collection[str]) -> None:
    """Reject an option in combination with others; the message names them."""
    if typed := [name for name in job.given if name in others]:
        raise misuse(option, "conflict", options=typed)
