"""`photogram giant check`: look for errors in a GIANT project."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from photogram.cli.console import NOT_CONVERGED, errors, failures, output
from photogram.cli.options import JsonFile, Quiet

__all__ = ["check"]


def check(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Directory of the five files, as for adjusting.")
    ],
    json: JsonFile = None,
    limits: Annotated[
        str | None,
        typer.Option(metavar="N1=..,N6=..", help="Limits of the 1987 program.", show_default=False),
    ] = None,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Threads. Default: all.", show_default=False)
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Look for errors in a GIANT project: blunders, wrong names, stations and control that do not fit.

    Nothing is changed. The exit code is 3 when something grave is found.
    """
    with failures():
        from photogram.files import write_whole
        from photogram.giant import Limits, read_project
        from photogram.giant.checks import check as check_project
        from photogram.giant.files import spare_input

        if json is not None:
            spare_input(json, directory)
        project = read_project(directory)
        allowed = Limits.parse(limits) if limits else None
        with errors.status("checking", spinner="line") if not quiet else nullcontext():
            found = check_project(project, limits=allowed, threads=threads)
        if json is not None:
            write_whole({json: found.to_json()})
        if not quiet:
            output.print(escape(found.report()), end="")
    if found.grave:
        raise typer.Exit(NOT_CONVERGED)
