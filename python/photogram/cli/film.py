"""`photogram film`: a block on film in one step, and in two; fiducial marks of MicMac and for it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from photogram.cli.adjust import adjusted_block, started_block
from photogram.cli.console import print_document
from photogram.cli.documents import PageAndJson
from photogram.cli.job import Job, with_job
from photogram.cli.options import Input, OutputFolder, Reads, Threads
from photogram.cli.projects import read_project
from photogram.formats.read_options import ReadOptions
from photogram.lazy_dataclasses import replace
from photogram.messages import coded
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result


@with_job("film", example=("archive",), ending="-film")
def film(
    job: Job,
    *,
    path: Input,
    documents: PageAndJson,
    reading: ReadOptions,
    threads: Threads = None,
    strict: bool = False,
) -> None:
    """Adjust a block on film in one step and in two steps, and report the differences.

    PATH is a plain project with films. One adjustment contains the films. The other one uses films that were
    fitted to their marks before, without errors. The report lists the differences of points and standard
    deviations. Verdict and exit code are of one step.

    --example is the project of `photogram new --kind archive`.
    """
    from photogram.film import compare_steps

    found = compare_steps(*(_adjusted(job, path, reading, how, threads) for how in ("inside", "before")))
    documents.conclude(job, found, code=found.inside.verdict.exit_code(strict=strict))


def _adjusted(job: Job, path: Path, reading: ReadOptions, interior: str, threads: int | None) -> Result:
    from photogram import InputError

    settings = [*reading.settings, f"film.interior={interior}"]
    project = read_project(job, path, replace(reading, settings=settings))
    if not project.block.passages:
        raise InputError(phrase("command.no-film"), file=path)
    block, started = started_block(project, keep_all=False)
    return adjusted_block(job, project, started or block, threads=threads)


@with_job("film marks")
def marks(
    job: Job, *, path: Annotated[Path, Reads.PROJECT], out: OutputFolder = None, name: str = "1"
) -> None:
    """Write tables of the fiducial marks of MicMac, or MicMac files of the marks of a project.

    From MicMac the command reads `MeasuresCamera.xml`, `MeasuresIm-*.xml` and `id_fiducial.txt`, and writes
    `fiducials.csv` and `fiducial_images.csv` of a plain project. From a project it writes the same files of
    MicMac.
    """
    from photogram.formats.micmac import has_marks, read_marks, write_marks
    from photogram.io.csv_text import csv_text
    from photogram.show.judgement import remarks_section
    from photogram.show.page import Document, Fact

    if has_marks(path):
        job.reads(*(each for each in sorted(path.rglob("*")) if each.suffix in (".xml", ".txt")))
        found = read_marks(path)
        kind, remarks, readings = "Marks of MicMac", found.remarks, found.readings
        texts = [*map(str, remarks)]
        files = {f"{table}.csv": csv_text(columns, texts) for table, columns in found.tables(name).items()}
        counts = {
            "marks": len(found.places),
            "readings": sum(map(len, readings.values())),
            "photos": len(readings),
        }
    else:
        files = write_marks(read_project(job, path, ReadOptions()))
        kind, remarks, counts = "For MicMac", (), {"files": len(files)}
    figures = [Fact.of(key.capitalize(), count) for key, count in counts.items()]
    members = {**counts, "messages": coded(remarks)}
    sections = [remarks_section(remarks)]
    document = Document(kind, "", highlights=figures, sections=sections, members=members)
    written = {} if out is None else {out / file: content for file, content in files.items()}
    job.finish(written, document=document, summary=lambda: print_document(document, "--json FILE", "remarks"))
