"""Output and errors of all commands."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.console import Console
from rich.markup import escape

from photogram.cli.process import stream_fault
from photogram.extras import EXTRAS, missing
from photogram.messages import printable
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.show.page import Document

INPUT_ERROR = 1
NOT_CONVERGED = 3
NOT_USABLE = 4
SHOWN = 40  # Maximum number of lines of a section in the summary of a command

SUMMARY = ("remarks", "components", "removed", "features", "tests", "worst")
"""Sections of the document of a network in the summary of a command."""


class Output(Console):
    """Standard output: blocks of lines with blank lines between them."""

    _stream: object = None  # of the last block; tests run several commands with one stream each

    def print_block(self, *lines: str) -> None:
        """Print lines below a blank line, unless they are the first."""
        if self._stream is self.file:
            self.print()
        self._stream = self.file
        self.print(*lines, sep="\n")


errors = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)
output = Output(highlight=False, soft_wrap=True, emoji=False)


def print_sections(document: Document, whole: str, keys: Collection[str] | None = None) -> None:
    """Print verdict and sections, all or with these keys, shortened; `whole` names the complete file."""
    from photogram.show.forms import titled_lines

    for title, lines in titled_lines(document, keys):
        shown = [*lines[:SHOWN]]
        if len(lines) > SHOWN:
            shown.append(f"and {len(lines) - SHOWN} more lines in {whole}")
        output.print_block(f"[bold]{escape(title)}[/]", *(f"  {escape(line)}".rstrip() for line in shown))


def print_document(document: Document, whole: str, *keys: str, remarks: Iterable[object] = ()) -> None:
    """Print verdict, advice, key figures, some sections and tables of a document, then remarks."""
    output.print_block(escape(": ".join(filter(None, (document.what, document.title)))))
    print_sections(document, whole, keys)
    for remark in remarks:
        print_remark(remark)


def print_text(document: Document) -> None:
    from photogram.show.forms import text

    output.print_block(escape(text(document).removesuffix("\n")))


def print_written(paths: Iterable[Path]) -> None:
    """Print the names of written files; the last line of a command is the report to open."""
    names = [escape(printable(str(path))) for path in paths]
    pages = [name for name in names if name.endswith(".html")]
    if names:
        output.print_block(f"written: {', '.join(names)}")
    if pages:
        output.print(f"open in a browser: {', '.join(pages)}")


def print_remark(text: object) -> None:
    errors.print(f"[yellow]remark:[/] {escape(str(text))}")


@contextmanager
def failures() -> Iterator[None]:
    """Convert errors of input and adjustment to a message and an exit code."""
    from photogram.errors import AdjustmentError, ContradictionError, PhotogramError

    code = INPUT_ERROR
    try:
        yield
        return
    except MemoryError as error:
        text = str(error) or str(phrase("command.memory"))
    except PhotogramError as error:
        codes = {AdjustmentError: NOT_CONVERGED, ContradictionError: NOT_USABLE}
        code = next((code for kind, code in codes.items() if isinstance(error, kind)), code)
        text = str(error)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        text = str(missing(package))
    except OSError as error:
        # Readers and writers name their files. Other errors concern the standard streams.
        if error.filename is None:
            raise typer.Exit(stream_fault(error)) from None
        text = f"{printable(str(error.filename))}: {error.strerror or error}"
    errors.print(f"[bold red]error:[/] {escape(text)}")
    raise typer.Exit(code)
