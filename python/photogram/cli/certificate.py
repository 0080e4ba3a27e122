"""`photogram certificate`: check the certificate of a camera, and take marks and lens from it."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from photogram.cli.console import output
from photogram.cli.html import HtmlFile, NoHtml, html_files, html_place
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import JsonFile, Quiet, out_option

__all__ = ["certificate"]

EXAMPLE = ("certificate", "rc10.toml")
"""The packaged example, in photogram.examples."""


@with_job
def certificate(
    job: Job,
    path: Annotated[
        Path | None,
        Reads.FILE,
        typer.Argument(
            metavar="FILE",
            help="Certificate as TOML, or a table of fiducials (*.csv).",
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        bool, typer.Option("--example", help="Check the packaged example instead: a camera of eight marks.")
    ] = False,
    camera: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Which camera of a table of several.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None, Writes.DIRECTORY, out_option("Directory for the report for the browser.")
    ] = None,
    json: JsonFile = None,
    html: HtmlFile = None,
    no_html: NoHtml = False,
    quiet: Quiet = False,
) -> None:
    """Check a camera's certificate: typing errors, marks from distances, lens from its table.

    Distances are compared with coordinates; of distances alone the marks are adjusted; a table of distortion
    becomes a lens: all with covariance. A distance that differs from its coordinates by more than 0.010 mm,
    with what single change of a figure would explain it, ends with exit code 4.
    """
    with job:
        from photogram.film import Certificate
        from photogram.show.methods import page_of

        found = Certificate.read(job.packaged(*EXAMPLE) if path is None else path, camera)
        place = html_place(html, no_html, out)
        written = html_files(job, "certificate", place, html is not None, partial(page_of, found))
        documents = {} if json is None else {json: found.to_json()}
        job.finish(
            written,
            documents,
            summary=lambda: output.print(escape(found.report()), end=""),
            code=found.verdict.exit,
        )
