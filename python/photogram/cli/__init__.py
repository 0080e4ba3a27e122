"""The command line. Only modules that end it cleanly are imported at first."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from photogram.cli.process import end_by_signals, finish, ignore_signals, open_streams, stream_fault

if TYPE_CHECKING:
    from typer import Typer

    app: Typer

__all__ = ["app", "main"]

NEW_OBJECTS = 500_000  # Threshold of the garbage collector: the default of 700 takes 5 % of a command's time


def main() -> None:
    """Run the command line: every end is an exit code, see `docs/command-line.md`."""
    end_by_signals()
    import gc

    gc.set_threshold(NEW_OBJECTS)
    open_streams()
    code: int | str | None = 0
    try:
        from photogram.cli.commands import application

        # A shell that completes may ask for any command.
        completing = "_PHOTOGRAM_COMPLETE" in os.environ
        application(None if completing else " ".join(sys.argv[1:2]))()
    except SystemExit as end:
        code = end.code
    except OSError as error:
        # Commands report errors of their own files. Other errors concern the standard streams, used for help.
        code = stream_fault(error)
    code = finish(code)
    ignore_signals()
    gc.freeze()  # The final garbage collection would take 60 ms for 1,000 photos
    sys.exit(code)


def __getattr__(name: str) -> object:
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from photogram.cli.commands import application

    globals()[name] = application()
    return globals()[name]
