"""Options that several commands share."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Literal

import typer

from photogram.cli.command_classes import misuse
from photogram.cli.job import Job, Without
from photogram.results.snooping_options import SnoopOptions

PictureFormat = Literal["png", "pdf", "svg"]
OrderingName = Literal["auto", "input", "rcm", "amd", "dissection", "graph-dissection"]
AirModel = Literal["giant", "standard", "none"]
WaterModel = Literal["giant", "snell", "none"]

Quiet = Annotated[bool, typer.Option("--quiet", "-q")]
Threads = Annotated[int | None, typer.Option(min=1)]


Snooping = Annotated[SnoopOptions, Without("robust", "parts", "max_rounds")]


def check_alone(job: Job, option: str, others: Collection[str]) -> None:
    """Reject an option in combination with others; the message names them."""
    if typed := [name for name in job.given if name in others]:
        raise misuse(option, "conflict", options=typed)


def default_out(source: Path, ending: str, is_example: bool = False) -> Path:
    """Return the default output folder: name of the input with an ending.

    It is in the folder of the input, or in the current folder if that is read-only or the input is packaged.
    """
    if is_example:
        return Path(f"example{ending}")
    place = Path(os.path.realpath(source))
    parent = place.parent if os.access(place.parent, os.W_OK) else Path()
    return parent / f"{place.name if place.is_dir() else place.stem}{ending}"


def pair(text: str, option: str) -> tuple[int, int]:
    """Return two numbers with an x between them."""
    first, x, second = text.lower().partition("x")
    if not (x and first.strip().isdecimal() and second.strip().isdecimal()):
        form = "two numbers such as 10x7" + (", or an existing file" if option == "--board" else "")
        raise misuse(option, "form", form=form, value=text)
    return int(first), int(second)
