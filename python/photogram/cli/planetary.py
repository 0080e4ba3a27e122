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
        help="Cubes or ISDs of a control network.",
        show_default=False,
    ),
]
JigsawSettings = Annotated[
    str | None,
    typer.Option(
        "--jigsaw",
        metavar="NAME=VALUE ...",
        help="Settings of jigsaw, in quotes, or a file.",
        show_default=False,
    ),
]
