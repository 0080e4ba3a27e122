"""The report for the browser of every command: where it goes, and what it says of the run."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.console import print_remark
from photogram.cli.job import Job, Writes

if TYPE_CHECKING:
    from photogram.show.page import Page

__all__ = ["HTML", "HtmlFile", "NoHtml", "html_files", "html_place"]

HTML = "report.html"
"""Its name in a directory of results."""
NEEDED = ("jinja2", "matplotlib")
"""What makes it: the extra `report`."""

HtmlFile = Annotated[
    Path | None,
    Writes.FILE,
    typer.Option(
        "--html",
        metavar="FILE",
        help="Where the report for the browser goes. Default: report.html in --out, if there is one.",
        show_default=False,
    ),
]
NoHtml = Annotated[bool, typer.Option("--no-html", help="Write no report for the browser.")]


def html_place(html: Path | None, no_html: bool, out: Path | None) -> Path | None:
    """Return where the report for the browser goes; None where there is to be none."""
    if no_html:
        if html is not None:
            raise typer.BadParameter("goes without --html", param_hint="--no-html")
        return None
    return html or (out / HTML if out is not None else None)


def html_files(
    job: Job, command: str, place: Path | None, asked: bool, make: Callable[[], Page], mark: str = ""
) -> dict[Path, bytes]:
    """Return the report of a run; nothing, with a remark, where what makes it is absent and nobody asked.

    Parameters
    ----------
    job
        The run.
    command
        Its name, after `photogram`.
    place
        Where it goes; None: nowhere.
    asked
        Whether the user named the place: then what is absent is an error.
    make
        Makes what it says, without its last section.
    mark
        Stands in the name of the file, before its ending.

    Raises
    ------
    ModuleNotFoundError
        jinja2 or matplotlib is absent, and the report was asked for.
    """
    if place is None:
        return {}
    if not asked and not all(map(find_spec, NEEDED)):
        if not job.quiet:
            print_remark(f"no {HTML}: pip install 'photogram[report]'")
        return {}
    from photogram.show.html import page_html
    from photogram.show.run import reproducibility

    with job.status("drawing the report"):
        page = make()
        content = page_html(page.with_sections(reproducibility(job.run(command), page.phases)))
    return {place.with_stem(place.stem + mark): content}
