"""`photogram statement`: an accuracy statement for a client."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from photogram.cli.adjust import result_at
from photogram.cli.console import print_document
from photogram.cli.job import Job, with_job
from photogram.cli.options import Input, OutputFolder, Threads
from photogram.cli.projects import Choices, Unknowns
from photogram.cli.statement_output import StatementOptions, stated, statement_files
from photogram.formats.read_options import ReadOptions
from photogram.lazy_dataclasses import replace
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result
    from photogram.formats import Project


@with_job("statement", example=("survey",), ending="-statement", json=False)
def statement(
    job: Job,
    *,
    path: Input,
    out: OutputFolder = None,
    wanted: StatementOptions,
    crs: str | None = None,
    reading: ReadOptions,
    choices: Choices,
    unknowns: Unknowns,
    keep_all: bool = False,
    threads: Threads = None,
    strict: bool = False,
) -> None:
    """Write an accuracy statement of a block by published standards: page, PDF, JSON document, tables.

    PATH is a result of `photogram adjust --parquet`, or a project that is adjusted first. A result in the
    folder of its project uses the settings of the project. Check points need standard deviations of their
    survey, in the table of control or by --sd check=0.01. --example is the project of `photogram new --kind
    survey`.
    """
    assert out is not None
    chosen: dict[str, Any] = {"choices": choices, "unknowns": unknowns, "keep_all": keep_all}
    result, project = result_at(job, path, reading, threads, **chosen)
    project = project or _project_beside(job, path, result)
    asked = wanted.asked(project, reading, result.block.linear_unit)
    assumed = () if project is None else project.lacks
    with job.status("stating"):
        found = stated(job, result, asked, crs=crs, strict=strict, assumed=assumed)
        files = statement_files(job, found, out)
    job.finish(
        files,
        summary=lambda: print_document(replace(found.document(), head=()), "statement.json", "remarks"),
        code=found.exit,
    )


def _project_beside(job: Job, folder: Path, result: Result) -> Project | None:
    from photogram.formats import read

    settings = folder.resolve().with_name("project.toml")
    if not settings.is_file():
        return None
    # Only the settings concern the statement: all figures are from the result.
    job.reads(settings)
    project = read(settings.parent, file_format="plain")
    own, block = result.block, project.block
    if set(own.photo_ids) == set(block.photo_ids) and set(own.point_ids) == set(block.point_ids):
        return project
    job.remark(phrase("command.other-block", settings=settings, folder=folder))
    return None
