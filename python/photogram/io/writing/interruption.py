"""Signals wait while files are put in place."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

__all__ = ["ENDING", "deferred"]

ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""The signals that ask a process to end."""


@contextmanager
def deferred() -> Iterator[None]:
    """Let the signals that ask to end wait until the block is done; then they do what they did before.

    Only the main thread runs handlers of signals: in any other nothing is to be deferred.
    """
    caught: list[int] = []
    former: dict[int, Any] = {}

    def wait(number: int, _frame: FrameType | None) -> None:
        caught.append(number)

    try:
        if threading.current_thread() is threading.main_thread():
            for number in ENDING:
                handler = signal.getsignal(number)
                if handler is not None and handler != signal.SIG_IGN:
                    former[number] = handler
                    signal.signal(number, wait)
        yield
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)
        for number in dict.fromkeys(caught):
            signal.raise_signal(number)
