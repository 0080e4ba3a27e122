"""`photogram film`: a block on film in one step, and in two."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.markup import escape

from photogram.cli.adjust import adjusted_block, started_block
from photogram.cli.check import text_files
from photogram.cli.console import output
from photogram.cli.html import HtmlFile, NoHtml, html_files, html_place
from photogram.cli.job import Job, Writes, with_job
from photogram.cli.options import JsonFile, Quiet, Strict, Threads, default_out, out_option
from photogram.cli.projects import NOTHING, Additions, Example, ProjectPath, read_project, with_additions
from photogram.lazy_dataclasses import replace

if TYPE_CHECKING:
    from photogram import Result

__all__ = ["film"]

EXAMPLE = ("archive",)
"""The packaged example, in photogram.examples."""


@with_job
@with_additions()
def film(
    job: Job,
    path: ProjectPath = None,
    example: Example = False,
    out: Annotated[
        Path | None,
        Writes.DIRECTORY,
        out_option("Directory for report.txt and report.html. Default: PATH-film."),
    ] = None,
    json: JsonFile = None,
    html: HtmlFile = None,
    no_html: NoHtml = False,
    added: Additions = NOTHING,
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
        from photogram.show.methods import page_of

        found = compare_steps(*(_adjusted(job, source, added, how, threads) for how in ("inside", "before")))
        place = html_place(html, no_html, target)
        job.finish(
            text_files(target, found.report()),
            {} if json is None else {json: found.to_json()},
            html_files(job, "film", place, html is not None, partial(page_of, found)),
            summary=lambda: output.print(escape(found.report()), end=""),
            code=found.inside.verdict.exit_code(strict=strict),
        )


def _adjusted(job: Job, path: Path, added: Additions, interior: str, threads: int | None) -> Result:
    """Return the block with its films as they are asked for."""
    from photogram import InputError

    settings = [*(added.settings or []), f"film.interior={interior}"]
    project = read_project(job, path, replace(added, settings=settings))
    if not project.block.passages:
        raise InputError("has no photo on film: a column `film` of its photos says which are", file=path)
    block, started = started_block(project, keep_all=False)
    return adjusted_block(job, project, started or block, threads=threads)
