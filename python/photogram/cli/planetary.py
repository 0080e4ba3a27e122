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
        help="The images of a control network: a line each, the path of a cube, or serial number, comma and"
        " path of an ISD.",
        show_default=False,
    ),
]
JigsawSettings = Annotated[
    str | None,
    typer.Option(
        "--jigsaw",
        metavar="NAME=VALUE ...",
        help="With --cubes: settings as on the command line of jigsaw, in quotes (CAMSOLVE=all RADIUS=yes),"
        " or the path of a file with them.",
        show_default=False,
    ),
]
