"""`photogram metadata`: where photos were taken, and how well, by what their files carry."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.console import print_sections
from photogram.cli.job import Job, OutputFile, Reads, with_job
from photogram.cli.options import Quiet
from photogram.cli.projects import Deviations, MrkAntenna, PhotosCrs


@with_job
def metadata(
    job: Job,
    path: Annotated[Path, Reads.FILE, typer.Argument(metavar="DIR", help="Folder of the photographs.")],
    out: Annotated[
        OutputFile,
        typer.Option(
            "--out",
            metavar="FILE",
            help="Table gnss of a plain project; gnss_groups.csv goes beside it, where a receiver had"
            " corrections in real time.",
        ),
    ] = None,
    photos_crs: PhotosCrs = None,
    mrk_antenna: MrkAntenna = False,
    sd: Deviations = None,
    quiet: Quiet = False,
) -> None:
    """Say where photos were taken by their files: EXIF, XMP, .MRK, geo.txt ...; write a table.

    Heads of pictures are read, nothing is decoded. A table geo.txt or of references counts before .MRK files,
    these before XMP, and that before EXIF, for positions and standard deviations apart.
    """
    with job:
        from photogram.formats import read_metadata
        from photogram.formats.metadata.adding import gnss_files
        from photogram.formats.supplements import deviations

        given = deviations(sd or [])
        found = read_metadata(path, mrk_antenna=mrk_antenna)
        job.reads(*found.tables)
        job.spares(*found.pictures)
        files = {} if out is None else gnss_files(found, out, photos_crs, given.get("gnss"))
        job.finish(files, summary=lambda: print_sections(found.sections(), "--out FILE"))
