"""Calls of the system that are made to fail, for the modules of the writer."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from contextlib import contextmanager

from photogram.io import writing

CALLS = ("open", "write", "fsync", "replace", "mkdir", "link", "unlink", "rmdir")
"""Calls of the system by which the writer changes something."""


class Faulty:
    """The module `os`, of which one call fails, or all calls of a name from one on.

    Parameters
    ----------
    at
        Number of the call that fails, from 1, among those of `CALLS`; 0 for none.
    lasting
        Whether later calls of the same name fail too.
    number
        The error.
    """

    def __init__(self, at: int, *, lasting: bool = False, number: int = errno.ENOSPC) -> None:
        self.at, self.lasting, self.number = at, lasting, number
        self.calls: list[str] = []
        self.failed: str | None = None

    def __getattr__(self, name: str) -> object:
        real = getattr(os, name)
        return self._watched(name, real) if name in CALLS else real

    def _watched(self, name: str, real: Callable[..., object]) -> Callable[..., object]:
        def call(*arguments: object, **options: object) -> object:
            self.calls.append(name)
            if len(self.calls) == self.at:
                self.failed = name
            if len(self.calls) == self.at or (self.lasting and name == self.failed):
                raise OSError(self.number, os.strerror(self.number))
            if name == "fsync":
                # The disk has no part in what is asked here, and takes its time.
                return None
            return real(*arguments, **options)

        return call


@contextmanager
def faulty(monkeypatch, at, **options):
    """Let the writer run on a system of which a call fails."""
    system = Faulty(at, **options)
    with monkeypatch.context() as patch:
        patch.setattr(writing, "os", system)
        yield system
