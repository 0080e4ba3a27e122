"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["JsonFile", "Quiet"]

JsonFile = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Write the whole result as one JSON document.", show_default=False),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
