"""Options that several commands share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

__all__ = ["JsonFile", "Ordering", "OrderingName", "Quiet", "Threads"]

JsonFile = Annotated[
    Path | None,
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
