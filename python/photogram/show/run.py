"""Reproducibility of a report: program, options, inputs and times."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

from photogram import _photocore
from photogram.io.seals import InputFile
from photogram.lazy_dataclasses import dataclass
from photogram.messages import printable
from photogram.show.page import Fact, Facts, Part, Section, about
from photogram.show.quantity import Axis, Quantity, Table, of_each

BYTES = (Axis.of("", "bytes"),)


@dataclass(frozen=True)
class Run:
    """A run of a command."""

    command: str  # With options
    options: Mapping[str, str]  # All options with their values
    inputs: Sequence[InputFile]  # The files that were read
    began: datetime
    seconds: float  # Up to the report
    others: int = 0  # Number of read files that are not in `inputs`


def reproducibility(run: Run | None, phases: Mapping[str, float]) -> Section:
    """Return the last report section: a command's run, and engine seconds."""
    made = [Fact("photogram", _photocore.__version__), Fact("Python", platform.python_version())]
    if run is not None:
        made.append(Fact("Command", printable(run.command)))
        made.append(Fact("Began", run.began.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S"), "UTC"))
        made.append(Fact.of("Time up to this report", run.seconds, "s", decimals=2))
    inputs, options = (run.inputs, run.options) if run else ((), dict[str, str]())
    values = [Fact(name, printable(value)) for name, value in options.items()]
    times = [Fact.of(phase, seconds, "s", decimals=3) for phase, seconds in phases.items()]
    files = [
        Quantity([printable(str(each.path)) for each in inputs], kind="name", head="File"),
        of_each(inputs, "size", BYTES, "deviation", head="Size", decimals=0),
        of_each(inputs, "sha256", (), "name", head="SHA-256"),
    ]
    parts: list[Part] = [
        Facts("Made by", made),
        Table("", "Input files", files, f"and {run.others} more" if run and run.others else ""),
        Facts(about("run.options"), values),
        Facts("Time spent in the adjustment", times),
    ]
    return Section("reproducibility", "Reproducibility", parts, about("reproducibility"))
