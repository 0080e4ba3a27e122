"""The standard streams: open whatever happens, and whole or a failure."""

from __future__ import annotations

import errno
import os
import sys
from contextlib import suppress
from io import TextIOWrapper

OUTPUT_FAULT = 1
STREAM_FAULTS = (errno.ENOSPC, errno.EIO, errno.EFBIG, errno.EBADF)
"""What writing to a standard stream ends in."""


def open_streams() -> None:
    """Make sure that the three descriptors are open, and that any text can be printed.

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
    """Say what an error that names no file is about, unless the reader of the output has gone.

    Returns
    -------
    The exit code.
    """
    if error.errno != errno.EPIPE:
        of = "standard output: " if error.errno in STREAM_FAULTS else ""
        with suppress(OSError):
            print(f"error: {of}{error.strerror or error}", file=sys.stderr)
    return OUTPUT_FAULT


def finish(code: int | str | None) -> int | str | None:
    """Write out what is still to be printed; return the exit code."""
    for descriptor, stream in ((1, sys.stdout), (2, sys.stderr)):
        try:
            if stream is not None:
                stream.flush()
        except OSError as error:
            code = code or stream_fault(error)
            # The interpreter writes it out once more at its end: now to where it always can.
            with suppress(OSError):
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, descriptor)
                os.close(nowhere)
    return code
