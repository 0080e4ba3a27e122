"""`photogram stellar-camera`: calibrate a camera by stars, on a plate or on digital exposures."""

from __future__ import annotations

from contextlib import AbstractContextManager, ExitStack
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.console import NOT_CONVERGED, print_sections, print_written
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import JsonFile, Quiet, Threads

if TYPE_CHECKING:
    from photogram.stellar.night import CalibratedNight
    from photogram.stellar.problem import Problem
    from photogram.stellar.result import Result

__all__ = ["exposures", "stellar_camera"]

Out = Annotated[
    Path | None,
    Writes.DIRECTORY,
    typer.Option(
        metavar="OUT",
        help="Directory for listing, camera and plots. Default: INPUT-calibrated, here.",
        show_default=False,
    ),
]
Plots = Annotated[bool, typer.Option("--plots", help="Draw the plots (needs matplotlib).")]


@with_job
def stellar_camera(
    job: Job,
    deck: Annotated[
        Path | None,
        Reads.FILE,
        typer.Argument(
            metavar="DECK",
            help="Card deck, or a calibration in plain form (a .toml file).",
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        bool,
        typer.Option("--example", help="Calibrate the packaged example instead: 75 stars in three groups."),
    ] = False,
    out: Out = None,
    json: JsonFile = None,
    as_published: Annotated[
        bool, typer.Option("--as-published", help="Iterate with the report's partials and stop rules.")
    ] = False,
    plots: Plots = False,
    quiet: Quiet = False,
) -> None:
    """Calibrate a camera by a plate with images of stars (NOAA Technical Report NOS 55).

    `photogram stellar-camera exposures` does so by digital exposures of the sky.
    """
    if example == (deck is not None):
        raise typer.BadParameter("give a deck, or --example", param_hint="DECK")
    with job, ExitStack() as resources:
        from dataclasses import replace

        from photogram.stellar import calibrate
        from photogram.stellar.document import to_json
        from photogram.stellar.listing import summary

        if deck is None:
            deck = resources.enter_context(_example("stellar")) / "plate.toml"
        problems, inputs = _read(deck)
        job.reads(*inputs)
        target = out or Path(f"{deck.stem}-calibrated")
        written: dict[Path, bytes] = {}
        documents: dict[Path, bytes] = {}
        converged = True
        for number, problem in enumerate(problems, 1):
            if as_published:
                problem = replace(problem, options=replace(problem.options, as_published=True))
            result = calibrate(problem)
            converged = converged and result.converged
            mark = f"-{number}" if len(problems) > 1 else ""
            written |= _files(result, target, mark, plots)
            if json is not None:
                documents[json.with_stem(json.stem + mark)] = to_json(result)
            if not quiet:
                print_sections(summary(result), "the listing")
        job.write(written, documents)
        if not quiet:
            print_written([*written, *documents])
    if not converged:
        raise typer.Exit(NOT_CONVERGED)


@with_job
def exposures(
    job: Job,
    night: Annotated[
        Path | None,
        Reads.FILE,
        typer.Argument(
            metavar="FILE",
            help="TOML file that names station, camera, times, rough attitudes and the table of star images.",
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        bool,
        typer.Option("--example", help="Calibrate the packaged example instead: five exposures of a night."),
    ] = False,
    out: Out = None,
    json: JsonFile = None,
    plots: Plots = False,
    threads: Threads = None,
    quiet: Quiet = False,
) -> None:
    """Calibrate a digital camera by exposures of the sky: pinhole and Brown distortion (needs pyerfa)."""
    if example == (night is not None):
        raise typer.BadParameter("give a file, or --example", param_hint="FILE")
    with job, ExitStack() as resources:
        from photogram.stellar.night import calibrate_night
        from photogram.stellar.night_document import to_json
        from photogram.stellar.night_file import inputs, read_night
        from photogram.stellar.night_report import summary

        if night is None:
            night = resources.enter_context(_example("exposures")) / "night.toml"
        job.reads(*inputs(night))
        result = calibrate_night(read_night(night), threads)
        written = _night_files(result, out or Path(f"{night.stem}-calibrated"), plots)
        documents = {json: to_json(result)} if json is not None else {}
        if not quiet:
            print_sections(summary(result), "the report")
        job.write(written, documents)
        if not quiet:
            print_written([*written, *documents])
    if not result.usable:
        raise typer.Exit(NOT_CONVERGED)


def _example(name: str) -> AbstractContextManager[Path]:
    return as_file(files("photogram") / "examples" / name)


def _read(deck: Path) -> tuple[list[Problem], list[Path]]:
    """Return the problems, and the files that they are read from."""
    from photogram.stellar.deck import read_deck
    from photogram.stellar.plain import inputs, read_plain

    return ([read_plain(deck)], inputs(deck)) if deck.suffix.lower() == ".toml" else (read_deck(deck), [deck])


def _files(result: Result, out: Path, mark: str, plots: bool) -> dict[Path, bytes]:
    """Make everything that is written for one problem."""
    from photogram.stellar.cameras import camera_document
    from photogram.stellar.listing import listing, plate_list

    made = {
        out / f"listing{mark}.txt": listing(result).encode(),
        out / f"camera{mark}.json": camera_document(result),
    }
    if result.problem.options.plate_list:
        made[out / f"plate{mark}.txt"] = plate_list(result)
    if plots:
        from photogram.stellar.plots import figures

        made |= {
            out / name.replace(".png", f"{mark}.png"): content for name, content in figures(result).items()
        }
    return made


def _night_files(result: CalibratedNight, out: Path, plots: bool) -> dict[Path, bytes]:
    """Make everything that is written for a night."""
    from photogram.stellar.night_report import report

    made = {out / "report.txt": report(result).encode(), out / "camera.json": result.camera.to_json()}
    if plots:
        from photogram.stellar.night_plots import figures

        made |= {out / name: content for name, content in figures(result).items()}
    return made
