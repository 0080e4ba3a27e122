"""Options that several commands share."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from photogram.cli.job import Job
from photogram.lazy_dataclasses import dataclass

PictureFormat = Literal["png", "pdf", "svg"]
UnitWeight = Literal["known", "unknown"]
OrderingName = Literal["auto", "input", "rcm", "amd", "dissection", "graph-dissection"]
AirModel = Literal["giant", "standard", "none"]
WaterModel = Literal["giant", "snell", "none"]

Quiet = Annotated[bool, typer.Option("--quiet", "-q")]
Threads = Annotated[int | None, typer.Option(min=1)]


@dataclass(frozen=True)
class Snooping:
    """Whether and how gross errors are taken out, with the options that say it."""

    snoop: bool = False
    level: Annotated[float, typer.Option(min=1e-09, max=0.5)] = 0.05
    fdr: Annotated[float | None, typer.Option(min=1e-09, max=0.5)] = None
    unit_weight: UnitWeight = "known"

    @property
    def options(self) -> dict[str, Any]:
        """As :func:`photogram.snoop` takes them."""
        return {"level": self.level, "fdr": self.fdr, "unit_weight": self.unit_weight}


def check_alone(job: Job, option: str, others: Collection[str]) -> None:
    """Reject an option beside others; the message names those of them that the user typed."""
    if typed := [name for name in job.given if name in others]:
        raise typer.BadParameter(f"cannot be combined with {', '.join(typed)}", param_hint=option)


def out_option(help: str) -> Any:  # noqa: A002  # as typer calls it
    """Return the option `--out DIR`; `help` says what goes there, and what the default is."""
    return typer.Option("--out", metavar="DIR", help=help)


def example_out(out: Path | None, plots: bool, name: str) -> Path | None:
    """Return the directory for results of a packaged example: one of its own where pictures need one."""
    return out or (Path(name) if plots else None)


def default_out(source: Path, ending: str) -> Path:
    """Return the directory for the results where no option names one: the name of the input with an ending.

    It is beside the input, or, as published data are often read-only, else where the command is given.
    """
    place = Path(os.path.realpath(source))
    parent = place.parent if os.access(place.parent, os.W_OK) else Path()
    return parent / f"{place.name if place.is_dir() else place.stem}{ending}"


def pair(text: str, option: str) -> tuple[int, int]:
    """Return two numbers with an x between them."""
    first, x, second = text.lower().partition("x")
    if not (x and first.strip().isdecimal() and second.strip().isdecimal()):
        raise typer.BadParameter(
            f"is two numbers, 10x7, or a file that is there, not {text}"
            if option == "--board"
            else f"is two numbers, 10x7, not {text}",
            param_hint=option,
        )
    return int(first), int(second)
