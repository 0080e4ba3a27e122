"""Options of commands that read what files of photographs carry."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.job import Reads

__all__ = ["MrkAntenna", "PhotosCrs", "PhotosFolder"]

PhotosFolder = Annotated[
    Path | None,
    Reads.FILE,
    typer.Option(
        "--photos-dir",
        metavar="DIR",
        help="Photographs: positions in their files (EXIF, XMP, .MRK, geo.txt) are observations.",
        show_default=False,
    ),
]
PhotosCrs = Annotated[
    str | None,
    typer.Option(
        "--photos-crs",
        metavar="CRS",
        help="System of these, also of heights, where it is not said: EPSG:4326+geoid=46.5.",
        show_default=False,
    ),
]
MrkAntenna = Annotated[
    bool,
    typer.Option("--mrk-antenna", help=".MRK positions are of antennas."),
]
