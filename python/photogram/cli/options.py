"""Options that several commands share."""

from __future__ import annotations

import os
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.cli.job import Writes
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.io.writing import Content
    from photogram.results.network import AdjustedNetwork

__all__ = [
    "KEPT",
    "JsonFile",
    "Ordering",
    "OrderingName",
    "ParquetFolder",
    "PictureFormat",
    "PlotFormat",
    "Plots",
    "Quiet",
    "Snoop",
    "SnoopLevel",
    "SnoopRate",
    "Snooping",
    "Strict",
    "Threads",
    "UnitWeight",
    "UnitWeightOption",
    "as_data",
    "default_out",
    "example_out",
    "out_option",
    "pair",
    "picture_places",
]


JsonFile = Annotated[
    Path | None,
    Writes.FILE,
    typer.Option(metavar="FILE", help="Write the whole result as one JSON document.", show_default=False),
]
ParquetFolder = Annotated[
    Path | None,
    Writes.DIRECTORY,
    typer.Option(
        "--parquet",
        metavar="DIR",
        help="Write the whole result as Parquet, which photogram.read_result reads.",
        show_default=False,
    ),
]
Plots = Annotated[bool, typer.Option("--plots", help="Draw the pictures too, into --out (needs matplotlib).")]


Snoop = Annotated[
    bool,
    typer.Option(
        "--snoop", help="Take gross errors out one after the other, and write what was taken out and why."
    ),
]
SnoopLevel = Annotated[
    float,
    typer.Option(
        min=1e-9,
        max=0.5,
        metavar="P",
        help="With --snoop: chance that any good observation is taken out (Bonferroni).",
    ),
]
SnoopRate = Annotated[
    float | None,
    typer.Option(
        "--fdr",
        metavar="P",
        min=1e-9,
        max=0.5,
        help="With --snoop: a false discovery rate in place of --level.",
        show_default=False,
    ),
]


class UnitWeight(StrEnum):
    """What tests of observations rest on."""

    KNOWN = "known"
    UNKNOWN = "unknown"


UnitWeightOption = Annotated[
    UnitWeight,
    typer.Option(
        metavar="known|unknown",
        help="With --snoop: whether standard deviations are right, or but for a common factor.",
    ),
]


@dataclass(frozen=True)
class Snooping:
    """Whether and how gross errors are taken out, with the options that say it."""

    snoop: Snoop = False
    level: SnoopLevel = 0.05
    fdr: SnoopRate = None
    unit_weight: UnitWeightOption = UnitWeight.KNOWN

    @property
    def options(self) -> dict[str, Any]:
        """As :func:`photogram.snoop` takes them."""
        return {"level": self.level, "fdr": self.fdr, "unit_weight": self.unit_weight.value}


KEPT = Snooping()
"""Nothing is taken out."""


class PictureFormat(StrEnum):
    """How pictures are written."""

    PNG = "png"
    PDF = "pdf"
    SVG = "svg"


PlotFormat = Annotated[PictureFormat, typer.Option(help="Format of the pictures.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]

Strict = Annotated[
    bool, typer.Option("--strict", help="End with exit code 4 also where the verdict is a warning.")
]


class OrderingName(StrEnum):
    """How the photographs are ordered in the normal equations."""

    AUTO = "auto"
    INPUT = "input"
    RCM = "rcm"
    AMD = "amd"
    DISSECTION = "dissection"
    GRAPH_DISSECTION = "graph-dissection"


Ordering = Annotated[
    OrderingName,
    typer.Option(
        metavar="NAME", help=f"Order of the photographs: {', '.join(each.value for each in OrderingName)}."
    ),
]
Threads = Annotated[
    int | None,
    typer.Option(
        min=1, metavar="N", help="Threads; the results do not depend on it. Default: all.", show_default=False
    ),
]


def out_option(help: str) -> Any:  # noqa: A002  # as typer calls it
    """Return the option `--out DIR`; `help` says what goes there, and what the default is."""
    return typer.Option("--out", metavar="DIR", help=help, show_default=False)


def as_data(result: AdjustedNetwork, folder: Path | None) -> dict[Path, Content]:
    """Return the files of `--parquet DIR`; none without it."""
    if folder is None:
        return {}
    from photogram.show.methods import files_of

    return {folder / name: content for name, content in files_of(result).items()}


def picture_places(name: str, plots: bool, ending: PictureFormat, out: Path | None) -> list[Path]:
    """Return where a picture goes: to the results, or nowhere."""
    if plots and out is None:
        raise typer.BadParameter("goes with --out DIR", param_hint="--plots")
    return [out / f"{name}.{ending.value}"] if plots and out else []


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
