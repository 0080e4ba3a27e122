"""The commands of all programs, each loaded at its first call."""

from __future__ import annotations

from importlib import import_module
from typing import Annotated, Any

import typer

from photogram.cli.command_classes import Command, Group, GroupWithMain
from photogram.cli.console import output
from photogram.cli.options import declarations

ADJUST = (
    "Examples: `photogram adjust --example`,"
    " `photogram adjust sparse/0 --control control.csv --control-crs EPSG:25832`,"
    " `photogram adjust quarry --self-calibrate f,cx,cy,k1,k2 --map quarry.gpkg`"
)

COMMANDS: dict[str, str | dict[str, str]] = {
    "adjust": "adjust.adjust",
    "calibrate": "calibrate.calibrate",
    "check": "check.check_project",
    "info": "project_commands.info",
    "convert": "project_commands.convert",
    "convert-lens": "convert_lens.convert_lens",
    "metadata": "project_commands.metadata",
    "features": "features.features",
    "statement": "statement.statement",
    "new": "project_commands.new",
    "collection": "collection.collection",
    "perspective-center": "perspective_center.perspective_center",
    "plan": "plan.plan",
    "simulate": "simulate.simulate",
    "certificate": "camera.certificate",
    "film": {"compare": "film.film", "marks": "film.marks"},
    "giant": {"adjust": "giant.giant", "check": "check.check"},
    "absolute-orientation": {
        "orient": "absolute_orientation.absolute_orientation",
        "transform": "absolute_orientation.transform",
        "relative": "absolute_orientation.relative",
    },
    "comparator": {
        "calibrate": "comparator.comparator",
        "correct": "comparator.correct",
        "compare": "comparator.compare_calibrations",
    },
    "camera": {"compare": "camera.compare_certificates"},
    "stellar-camera": {
        "plate": "stellar_camera.stellar_camera",
        "exposures": "stellar_camera.exposures",
        "places": "stellar_camera.places",
    },
}
"""File and function of each command; a group lists its commands, the main command first."""


def application(word: str | None = None) -> typer.Typer:
    """Return the command line."""
    made = typer.Typer(
        name="photogram",
        cls=Group,
        help="Photogrammetric least-squares adjustment with the covariance of every result.",
        epilog="Exit codes: 0 converged, 1 input or output at fault, 2 usage, 3 not converged, diverged or"
        " something grave found, 4 a result that cannot be used as it is, 129, 130, 143 ended by a signal.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
    )
    for name, home in COMMANDS.items():
        _, _, purpose = declarations()[f"command.{name}"]
        if word not in (None, name):
            made.command(name, cls=Command, help=purpose)(_not_loaded)
        elif isinstance(home, str):
            made.command(name, cls=Command, epilog=ADJUST if name == "adjust" else None)(_function(home))
        else:
            group = typer.Typer(name=name, cls=GroupWithMain, help=purpose)
            for part, function in home.items():
                group.command(part, cls=Command)(_function(function))
            made.add_typer(group)
    made.callback()(_photogram)
    return made


def _function(home: str) -> Any:
    file, _, function = home.partition(".")
    return getattr(import_module(f"photogram.cli.{file}"), function)


def _not_loaded() -> None:
    """Replace a command that is not loaded."""


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version as version_of  # Import is slow

        output.print(f"photogram {version_of('photogram')}")
        raise typer.Exit


def _photogram(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Photogrammetric least-squares adjustment with the covariance of every result."""
    from photogram.words import on_command_line  # the help has no messages

    context.with_resource(on_command_line())
