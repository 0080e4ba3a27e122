"""`photogram film`: a block on film in one step, and in two; fiducial marks of MicMac and for it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.adjust import adjusted_block, started_block
from photogram.cli.console import print_sections
from photogram.cli.documents import PageAndJson
from photogram.cli.job import Job, OutputFolder, Reads, with_job
from photogram.cli.options import Quiet, Strict, Threads, default_out, out_option
from photogram.cli.projects import NOTHING, Additions, Example, ProjectPath, read_project
from photogram.lazy_dataclasses import replace
from photogram.messages import counted

if TYPE_CHECKING:
    from photogram import Result
    from photogram.show.sections import Section

EXAMPLE = ("archive",)
"""The packaged example, in photogram.examples."""


@with_job
def film(
    job: Job,
    *,
    path: ProjectPath = None,
    example: Example = False,
    out: Annotated[
        OutputFolder, out_option("Directory for report.txt and report.html. Default: PATH-film.")
    ] = None,
    documents: PageAndJson,
    added: Additions,
    threads: Threads = None,
    strict: Strict = False,
    quiet: Quiet = False,
) -> None:
    """Adjust a block on film in one step and in two: what films that are fitted before leave out.

    PATH is a plain project with films. It is adjusted with films inside, and with films that are fitted to
    their marks and then errorless: by how much points and their standard deviations differ.
    The verdict and the exit code are those of the one step, as `photogram adjust` has it.
    --example is that of `photogram new --kind archive`.
    """
    source = job.packaged(*EXAMPLE) if path is None else path
    target = out or (Path("example-film") if example else default_out(source, "-film"))
    with job:
        from photogram.film import compare_steps

        found = compare_steps(*(_adjusted(job, source, added, how, threads) for how in ("inside", "before")))
        code = found.inside.verdict.exit_code(strict=strict)
        documents.conclude(job, "film", found, target, code=code)


def _adjusted(job: Job, path: Path, added: Additions, interior: str, threads: int | None) -> Result:
    """Return the block with its films as they are asked for."""
    from photogram import InputError

    settings = [*(added.settings or []), f"film.interior={interior}"]
    project = read_project(job, path, replace(added, settings=settings))
    if not project.block.passages:
        raise InputError("has no photo on film: a column `film` of its photos says which are", file=path)
    block, started = started_block(project, keep_all=False)
    return adjusted_block(job, project, started or block, threads=threads)


@with_job
def marks(
    job: Job,
    *,
    path: Annotated[
        Path,
        Reads.PROJECT,
        typer.Argument(metavar="DIR", help="Folder of MicMac with Ori-InterneScan, or a project with films."),
    ],
    out: Annotated[OutputFolder, out_option("Directory for the tables, or for the files of MicMac.")] = None,
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
