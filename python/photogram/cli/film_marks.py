"""`photogram film marks`: fiducial marks of MicMac as tables, and those of a project for MicMac."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.console import print_sections
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import Quiet, out_option
from photogram.cli.projects import NOTHING, read_project
from photogram.messages import counted

if TYPE_CHECKING:
    from photogram.show.sections import Section

__all__ = ["marks"]


@with_job
def marks(
    job: Job,
    path: Annotated[
        Path,
        Reads.PROJECT,
        typer.Argument(metavar="DIR", help="Folder of MicMac with Ori-InterneScan, or a project with films."),
    ],
    out: Annotated[
        Path | None, Writes.DIRECTORY, out_option("Directory for the tables, or for the files of MicMac.")
    ] = None,
    name: Annotated[
        str, typer.Option(metavar="NAME", help="What the camera is called that MicMac does not name.")
    ] = "1",
    quiet: Quiet = False,
) -> None:
    """Make tables of the fiducial marks of MicMac, or files for MicMac of the marks of a project.

    Of MicMac `MeasuresCamera.xml`, `MeasuresIm-*.xml` and `id_fiducial.txt` are read, and `fiducials.csv` and
    `fiducial_images.csv` are tables of a plain project; of a project the same files of MicMac are written.
    """
    with job:
        from photogram.formats.micmac import has_marks, write_marks

        if has_marks(path):
            files, told = _tables(job, path, name)
        else:
            files = write_marks(read_project(job, path, NOTHING))
            told = [("For MicMac", [counted(len(files), "file")])]
        written = {} if out is None else {out / file: content for file, content in files.items()}
        job.finish(written, summary=lambda: print_sections(told, "--out DIR"))


def _tables(job: Job, folder: Path, camera: str) -> tuple[dict[str, bytes], list[Section]]:
    """Return the tables of the marks of MicMac by their files, and what is told of them."""
    from photogram.formats.micmac import read_marks
    from photogram.io.csv_text import csv_text

    job.reads(*(each for each in sorted(folder.rglob("*")) if each.suffix in (".xml", ".txt")))
    found = read_marks(folder)
    files = {
        f"{table}.csv": csv_text(columns, found.remarks) for table, columns in found.tables(camera).items()
    }
    read = sum(map(len, found.readings.values()))
    size = f"{counted(len(found.places), 'mark')}, {read} readings on {counted(len(found.readings), 'photo')}"
    return files, [("Marks of MicMac", [size]), ("Remarks", list(found.remarks))]
