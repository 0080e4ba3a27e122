"""`photogram stellar-camera`: calibrate a camera by stars."""

from __future__ import annotations

from contextlib import ExitStack
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.console import NOT_CONVERGED, failures, print_sections, print_written
from photogram.cli.options import JsonFile, Quiet

if TYPE_CHECKING:
    from photogram.stellar.problem import Problem
    from photogram.stellar.result import Result

__all__ = ["stellar_camera"]


def stellar_camera(
    deck: Annotated[
        Path | None,
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
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT",
            help="Directory for listing, camera and plots. Default: DECK-calibrated, here.",
            show_default=False,
        ),
    ] = None,
    json: JsonFile = None,
    as_published: Annotated[
        bool, typer.Option("--as-published", help="Iterate with the report's partials and stop rules.")
    ] = False,
    plots: Annotated[bool, typer.Option("--plots", help="Draw the plots (needs matplotlib).")] = False,
    quiet: Quiet = False,
) -> None:
    """Calibrate a camera by its images of stars (NOAA Technical Report NOS 55)."""
    if example == (deck is not None):
        raise typer.BadParameter("give a deck, or --example", param_hint="DECK")
    with failures(), ExitStack() as resources:
        from dataclasses import replace

        from photogram.files import write_whole
        from photogram.stellar import calibrate
        from photogram.stellar.listing import summary

        if deck is None:
            directory = resources.enter_context(as_file(files("photogram") / "examples" / "stellar"))
            deck = directory / "plate.toml"
        problems = _read(deck)
        target = out or Path(f"{deck.stem}-calibrated")
        written: dict[Path, bytes] = {}
        converged = True
        for number, problem in enumerate(problems, 1):
            if as_published:
                problem = replace(problem, options=replace(problem.options, as_published=True))
            result = calibrate(problem)
            converged = converged and result.converged
            mark = f"-{number}" if len(problems) > 1 else ""
            written |= _files(result, target, mark, json, plots)
            if not quiet:
                print_sections(summary(result), "the listing")
        write_whole(written)
        if not quiet:
            print_written(written)
    if not converged:
        raise typer.Exit(NOT_CONVERGED)


def _read(deck: Path) -> list[Problem]:
    from photogram.stellar.deck import read_deck
    from photogram.stellar.plain import read_plain

    return [read_plain(deck)] if deck.suffix.lower() == ".toml" else read_deck(deck)


def _files(result: Result, out: Path, mark: str, json: Path | None, plots: bool) -> dict[Path, bytes]:
    """Make everything that is written for one problem."""
    from photogram.stellar.document import camera_document, to_json
    from photogram.stellar.listing import listing, plate_list

    made = {
        out / f"listing{mark}.txt": listing(result).encode(),
        out / f"camera{mark}.json": camera_document(result),
    }
    if result.problem.options.plate_list:
        made[out / f"plate{mark}.txt"] = plate_list(result)
    if json is not None:
        made[json.with_stem(json.stem + mark)] = to_json(result)
    if plots:
        from photogram.stellar.plots import figures

        made |= {
            out / name.replace(".png", f"{mark}.png"): content for name, content in figures(result).items()
        }
    return made
