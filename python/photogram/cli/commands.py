"""The commands of all programs, each loaded at its first call."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.cli.command_classes import Command, Group, GroupWithMain
from photogram.cli.console import output

if TYPE_CHECKING:
    app: typer.Typer

ADJUST = (
    "Examples: `photogram adjust --example`,"
    " `photogram adjust sparse/0 --control control.csv --control-crs EPSG:25832`,"
    " `photogram adjust quarry --self-calibrate f,cx,cy,k1,k2 --map quarry.gpkg`"
)

COMMANDS: dict[str, tuple[str, str | dict[str, str]]] = {
    "adjust": (
        "Adjust a block of any supported format: tables, COLMAP, OpenDroneMap, BlocksExchange, GIANT ...",
        "adjust.adjust",
    ),
    "calibrate": (
        "Calibrate cameras and rigs with images of a board: cameras with their uncertainty.",
        "calibrate.calibrate",
    ),
    "check": (
        "Search for mistakes and gross errors: wrong units and axes, blunders, control that does not fit.",
        "check.check_project",
    ),
    "info": (
        "Describe a project without adjustment: sizes, cameras, rays, units, frame, missing data.",
        "project_commands.info",
    ),
    "convert": (
        "Write a project in another format and list the data that the format cannot contain.",
        "project_commands.convert",
    ),
    "convert-lens": (
        "Fit a lens of another model to a camera and report the differences.",
        "convert_lens.convert_lens",
    ),
    "metadata": (
        "List positions of photographs from their files: EXIF, XMP, .MRK, geo.txt ...; write a table.",
        "project_commands.metadata",
    ),
    "features": (
        "Fit distances, lines, planes, circles, spheres and cylinders to adjusted points, with k and U.",
        "features.features",
    ),
    "statement": (
        "Write an accuracy statement of a block by published standards: page, PDF, JSON document, tables.",
        "statement.statement",
    ),
    "new": ("Write a small real project as tables with comments on their contents.", "project_commands.new"),
    "collection": (
        "Adjust photos of unknown cameras by Levenberg-Marquardt steps from any initial values.",
        "collection.collection",
    ),
    "perspective-center": (
        "Determine perspective centre, attitude and distortion of projectors from grid measurements.",
        "perspective_center.perspective_center",
    ),
    "plan": (
        "Predict the accuracy of a network before the flight for two patterns of control.",
        "plan.plan",
    ),
    "simulate": (
        "Write a simulated block as a GIANT project, or as tables if cameras move, with its truth.",
        "simulate.simulate",
    ),
    "certificate": (
        "Check a camera's certificate: typing errors, marks from distances, lens from its table.",
        "camera.certificate",
    ),
    "film": (
        "Adjust a block on film in one step and in two; take marks from MicMac.",
        {"compare": "film.film", "marks": "film.marks"},
    ),
    "giant": ("Adjust or check a GIANT project.", {"adjust": "giant.giant", "check": "check.check"}),
    "absolute-orientation": (
        "Orient a model absolutely, or transform its points.",
        {
            "orient": "absolute_orientation.absolute_orientation",
            "transform": "absolute_orientation.transform",
            "relative": "absolute_orientation.relative",
        },
    ),
    "comparator": (
        "Calibrate a comparator, correct measurements, compare calibrations.",
        {
            "calibrate": "comparator.comparator",
            "correct": "comparator.correct",
            "compare": "comparator.compare_calibrations",
        },
    ),
    "camera": ("Compare calibrations of cameras over years.", {"compare": "camera.compare_certificates"}),
    "stellar-camera": (
        "Calibrate a camera by a plate with stars, or by exposures of the sky.",
        {
            "plate": "stellar_camera.stellar_camera",
            "exposures": "stellar_camera.exposures",
            "places": "stellar_camera.places",
        },
    ),
}
"""Purpose of each command, and file and function; a group lists its commands, the main command first."""


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
    for name, (purpose, home) in COMMANDS.items():
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


def __getattr__(name: str) -> object:
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = application()
    return globals()[name]
