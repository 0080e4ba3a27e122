"""`photogram adjust` with a clock on its phases: python benches/peers/probe.py BEGAN RECORD ARGUMENT ...

BEGAN is the reading of the monotonic clock when the process was asked for. What each phase took, without the
phases inside it, is written to RECORD; the arguments are those of the command.
"""

from __future__ import annotations

import functools
import json
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


class Clock:
    """Seconds by the names of phases; a phase inside another is taken from that."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._inside = [0.0]

    def watch(self, owner: object, name: str, phase: str) -> None:
        """Replace a function of a module or class by one whose calls are timed."""
        function: Callable[..., Any] = getattr(owner, name)

        @functools.wraps(function)
        def timed(*arguments: Any, **named: Any) -> Any:
            self._inside.append(0.0)
            began = time.perf_counter()
            try:
                return function(*arguments, **named)
            finally:
                seconds = time.perf_counter() - began
                self.seconds[phase] = self.seconds.get(phase, 0.0) + seconds - self._inside.pop()
                self._inside[-1] += seconds

        setattr(owner, name, timed)


def watched() -> Clock:
    """Put the clock on the phases of the command."""
    from photogram.cli.documents import Documents
    from photogram.cli.job import Job
    from photogram.diagnosis import after_adjustment
    from photogram.show.methods import Judged

    # By its name: the package has a function that is called so, too.
    command = import_module("photogram.cli.adjust")
    clock = Clock()
    clock.watch(command, "read_project", "read")
    clock.watch(command, "adjusted_block", "adjust")
    clock.watch(after_adjustment, "diagnosed", "verdict")
    # A property that is kept when it is first read: what computes it is watched.
    clock.watch(vars(Judged)["verdict"], "func", "verdict")
    clock.watch(import_module("photogram.formats.results"), "project_files", "tables")
    clock.watch(Job, "write", "tables")
    clock.watch(import_module("photogram.show.forms"), "text", "report")
    clock.watch(Documents, "page", "page with pictures")
    return clock


def main() -> None:
    """Run the command and write what its phases took."""
    began, record = float(sys.argv[1]), Path(sys.argv[2])
    clock = watched()
    from photogram.cli import main as command_line

    clock.seconds["start of Python and imports"] = time.monotonic() - began
    sys.argv[1:] = ["adjust", *sys.argv[3:]]
    try:
        command_line()
    finally:
        record.write_text(json.dumps(clock.seconds))


if __name__ == "__main__":
    main()
