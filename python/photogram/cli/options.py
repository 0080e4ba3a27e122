"""Options that several commands share."""

from __future__ import annotations

import os
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.job import Writes

__all__ = ["JsonFile", "Ordering", "OrderingName", "Quiet", "Threads", "default_out"]

JsonFile = Annotated[
    Path | None,
    Writes.FILE,
    typer.Option(metavar="FILE", help="Write the whole result as one JSON document.", show_default=False),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]


class OrderingName(StrEnum):
    """How the photographs are ordered in the normal equations."""

    AUTO = "auto"
    INPUT = "input"
    RCM = "rcm"
    AMD = "amd"
    DISSECTION = "dissection"
    GRAPH_DISSECTION = "graph-dissection"


Ordering = Annotated[OrderingName, typer.Option(help="Order of the photographs in the normal equations.")]
Threads = Annotated[
    int | None,
    typer.Option(min=1, help="Threads; the results do not depend on it. Default: all.", show_default=False),
]


def default_out(source: Path, ending: str) -> Path:
    """Return the directory for the results where no option names one: the name of the input with an ending.

    It is beside the input, or, as published data are often read-only, else where the command is given.
    """
    place = source.resolve()
    parent = place.parent if os.access(place.parent, os.W_OK) else Path()
    return parent / f"{place.name if place.is_dir() else place.stem}{ending}"
