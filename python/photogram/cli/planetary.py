"""Options for control networks of planetary images."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.job import Reads

__all__ = ["CubesFile", "JigsawSettings"]

CubesFile = Annotated[
    Path | None,
    Reads.FILE,
    typer.Option(
        "--cubes",
        metavar="LIST",
        help="Images of a control network: cubes, or serial numbers and ISDs.",
        show_default=False,
    ),
]
JigsawSettings = Annotated[
    str | None,
    typer.Option(
        "--jigsaw",
        metavar="NAME=VALUE ...",
        help="Settings of jigsaw, in quotes, or a file of them.",
        show_default=False,
    ),
]
