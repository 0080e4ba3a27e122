"""`photogram metadata`: where photos were taken, and how well, by what their files carry."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from photogram.cli.console import print_sections
from photogram.cli.job import Job, OutputFile, Reads, with_job
from photogram.cli.options import Quiet


@with_job
def metadata(
    job: Job,
    path: Annotated[Path, Reads.FILE],
    out: OutputFile = None,
    photos_crs: str | None = None,
    mrk_antenna: bool = False,
    sd: list[str] | None = None,
    quiet: Quiet = False,
) -> None:
    """List positions of photographs from their files: EXIF, XMP, .MRK, geo.txt ...; write a table.

    Only metadata are read. Sources in order of priority: table geo.txt or of references, .MRK, XMP, EXIF. The
    order holds for positions and standard deviations separately.
    """
    with job:
        from photogram.formats import read_metadata
        from photogram.formats.metadata.systems import gnss_files
        from photogram.formats.supplements import deviations

        given = deviations(sd or [])
        found = read_metadata(path, mrk_antenna=mrk_antenna)
        job.reads(*found.tables)
        job.spares(*found.pictures)
        files = {} if out is None else gnss_files(found, out, photos_crs, given.get("gnss"))
        job.finish(files, summary=lambda: print_sections(found.sections(), "--out FILE"))
