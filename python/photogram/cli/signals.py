"""How signals end the command line: at once, without temporary files and with an exit code of their own."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
SHOW_CURSOR = b"\x1b[?25h\r\x1b[K"
"""Ends a status line: rich hides the cursor meanwhile."""


def end_by_signals() -> None:
    """Let SIGINT, SIGTERM and SIGHUP end the process with 128 and their number, unless they are ignored.

    Not by an exception: one that is raised inside a destructor or a callback would be lost.
    """
    for name in _NAMES:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _end)


def ignore_signals() -> None:
    """Let signals no longer change the end of a run that is through: the interpreter would die of them."""
    for name in _NAMES:
        number = getattr(signal, name, None)
        if number is not None:
            signal.signal(number, signal.SIG_IGN)


def _end(number: int, _frame: FrameType | None) -> None:
    # If the writer is not loaded yet, it has begun nothing.
    abandon_all = getattr(sys.modules.get("photogram.io.writing.outputs"), "abandon_all", None)
    if abandon_all is not None:
        abandon_all()
    try:
        if os.isatty(2):
            os.write(2, SHOW_CURSOR)
    finally:
        os._exit(128 + number)
