"""`photogram camera`: calibrations of cameras over years."""

from __future__ import annotations

import math
from datetime import date
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from photogram.cli.console import output, print_sections
from photogram.cli.html import HtmlFile, NoHtml, html_files, html_place
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import JsonFile, Quiet, default_out, out_option

if TYPE_CHECKING:
    from photogram.film import Certificate
    from photogram.film.years import DatedCamera

__all__ = ["compare"]


@with_job
def compare(
    job: Job,
    calibrations: Annotated[
        list[Path] | None,
        Reads.FILE,
        typer.Argument(
            metavar="FILE...",
            help="Certificates (TOML), or camera.json of `photogram stellar-camera`.",
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        bool,
        typer.Option("--example", help="Compare six simulated certificates instead: a focal length steps."),
    ] = False,
    day: Annotated[
        list[str] | None,
        typer.Option(
            metavar="DATE",
            help="1983-05-11: of a file that says none; again for each of these, in their order.",
            show_default=False,
        ),
    ] = None,
    name: Annotated[
        str, typer.Option(metavar="NAME", help="What the camera of a file that does not name it is called.")
    ] = "1",
    angle: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            max=89.0,
            metavar="DEG",
            help="Compare images up to this angle from the axis. Default: as far as all certificates reach.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        Writes.DIRECTORY,
        out_option("Directory for the report. Default: FILE-compared beside the first FILE."),
    ] = None,
    json: JsonFile = None,
    html: HtmlFile = None,
    no_html: NoHtml = False,
    quiet: Quiet = False,
) -> None:
    """Compare calibrations of cameras over years: drift, steps, control charts.

    Images of directions are compared, not parameters, which share what they explain. What has changed is
    named, and the exit code is 4.
    """
    with job:
        from photogram.film.years import compare_cameras
        from photogram.show.methods import page_of
        from photogram.show.sections import verdict_sections

        if example:
            from photogram.film.years.example import simulated_certificates

            read: list[Certificate | DatedCamera] = [*simulated_certificates()]
            folder = out or Path("camera-compared")
        else:
            paths = calibrations or []
            read = _read(paths, day or [], name)
            folder = out or default_out(paths[0], "-compared")
        found = compare_cameras(read, angle=None if angle is None else math.radians(angle))
        place = html_place(html, no_html, folder)
        written = html_files(job, "camera compare", place, html is not None, partial(page_of, found))

        def summarize() -> None:
            print_sections(verdict_sections(found.verdict), "the report")
            output.print(escape(found.report()), end="")

        documents = {} if json is None else {json: found.to_json()}
        job.finish(written, documents, summary=summarize, code=found.verdict.exit)


def _read(paths: list[Path], days: list[str], name: str) -> list[Certificate | DatedCamera]:
    """Read certificates, and cameras of other programs with the days that are given for them."""
    from photogram.errors import InputError
    from photogram.film import Certificate
    from photogram.film.years import DatedCamera
    from photogram.stellar.cameras import camera_from

    found: list[Certificate | DatedCamera] = []
    left = list(days)
    for path in paths:
        if path.suffix.lower() == ".toml":
            found.append(Certificate.read(path))
            continue
        if not left:
            raise InputError("says no day: give it with --day 1983-05-11", file=path)
        found.append(DatedCamera(_day(left.pop(0)), camera_from(path, name), source=path.stem))
    if left:
        raise typer.BadParameter(f"{left[0]} is of no file: all others say theirs", param_hint="--day")
    return found


def _day(text: str) -> date:
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is no day such as 1983-05-11", param_hint="--day") from None
