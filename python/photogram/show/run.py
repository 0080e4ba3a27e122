"""Reproducibility of a report: program, options, inputs and times."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

from photogram import _photocore
from photogram.lazy_dataclasses import dataclass
from photogram.messages import printable
from photogram.show.page import Fact, Facts, Part, Section, about
from photogram.show.quantity import Axis, Quantity, Table, of_each

LISTED = 200  # Maximum number of listed input files
BYTES, SECONDS = (Axis.of("", "bytes"),), (Axis.of("", "s"),)


@dataclass(frozen=True)
class InputFile:
    """A file that was read."""

    path: Path
    size: int
    sha256: str


@dataclass(frozen=True)
class Run:
    """A run of a command."""

    command: str  # With options
    options: Mapping[str, str]  # All options with their values
    inputs: Sequence[InputFile]  # The files that were read
    began: datetime
    seconds: float  # Up to the report
    others: int = 0  # Number of read files that are not in `inputs`


def input_files(paths: Iterable[Path]) -> tuple[list[InputFile], int]:
    """Return at most `LISTED` files with sizes and SHA-256, and the rest's number."""
    found = []
    every = [each for each in dict.fromkeys(paths) if each.is_file()]
    for path in every[:LISTED]:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
            found.append(InputFile(path, file.tell(), digest))
    return found, len(every) - len(found)


def reproducibility(run: Run | None, phases: Mapping[str, float]) -> Section:
    """Return the last report section: a command's run, and engine seconds."""
    made = [Fact("photogram", _photocore.__version__), Fact("Python", platform.python_version())]
    if run is not None:
        made.append(Fact("Command", printable(run.command)))
        made.append(Fact("Began", run.began.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S"), "UTC"))
        made.append(Fact.of("Time up to this report", run.seconds, "s", decimals=2))
    inputs, options = (run.inputs, run.options) if run else ((), dict[str, str]())
    files = [
        Quantity([printable(str(each.path)) for each in inputs], kind="name", head="File"),
        of_each(inputs, "size", BYTES, "deviation", head="Size", decimals=0),
        of_each(inputs, "sha256", (), "name", head="SHA-256"),
    ]
    values = [
        Quantity([*options], kind="name", head="Option"),
        Quantity([*map(printable, options.values())], kind="name", head="Value"),
    ]
    times = [
        Quantity([*phases], kind="name", head="Phase"),
        Quantity([*phases.values()], SECONDS, "deviation", head="Time", decimals=3),
    ]
    parts: list[Part] = [
        Facts("Made by", made),
        Table("", "Input files", files, f"and {run.others} more" if run and run.others else ""),
        Table("", "Options", values, about("run.options")),
        Table("", "Time spent in the adjustment", times),
    ]
    return Section("reproducibility", "Reproducibility", parts, about("reproducibility"))
