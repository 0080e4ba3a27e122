"""The process of the command line: its standard streams, and its end by signals."""

from __future__ import annotations

import errno
import os
import signal
import sys
from contextlib import suppress
from io import TextIOWrapper
from types import FrameType

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
SHOW_CURSOR = b"\x1b[?25h\r\x1b[K"  # Ends a status line: rich hides the cursor meanwhile


def end_by_signals() -> None:
    """End the process on SIGINT, SIGTERM and SIGHUP with 128 + signal.

    Exceptions are not used: one that is raised inside a destructor or a callback would be lost.
    """
    for name in _NAMES:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _end)


def ignore_signals() -> None:
    """Ignore signals after the end of a run, which would change its exit code."""
    for name in _NAMES:
        number = getattr(signal, name, None)
        if number is not None:
            signal.signal(number, signal.SIG_IGN)


def _end(number: int, _frame: FrameType | None) -> None:
    # If the writer is not loaded yet, no output has been started.
    abandon_all = getattr(sys.modules.get("photogram.io.writing"), "abandon_all", None)
    if abandon_all is not None:
        abandon_all()
    try:
        if os.isatty(2):
            os.write(2, SHOW_CURSOR)
    finally:
        os._exit(128 + number)


OUTPUT_FAULT = 1
STREAM_FAULTS = (errno.ENOSPC, errno.EIO, errno.EFBIG, errno.EBADF)


def open_streams() -> None:
    """Ensure that three descriptors are open, and that any text is printable.

    Without this a file might be opened as descriptor 1, and a file name that is not in the encoding of the
    terminal could not be printed; such characters are printed as escapes.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def stream_fault(error: OSError) -> int:
    """Report an error of a standard stream; return the exit code."""
    if error.errno != errno.EPIPE:
        of = "standard output: " if error.errno in STREAM_FAULTS else ""
        with suppress(OSError):
            print(f"error: {of}{error.strerror or error}", file=sys.stderr)
    return OUTPUT_FAULT


def finish(code: int | str | None) -> int | str | None:
    """Flush the standard streams; return the exit code."""
    for descriptor, stream in ((1, sys.stdout), (2, sys.stderr)):
        try:
            if stream is not None:
                stream.flush()
        except OSError as error:
            code = code or stream_fault(error)
            # The interpreter flushes the stream again at exit: redirect it to the null device.
            with suppress(OSError):
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, descriptor)
                os.close(nowhere)
    return code
