"""The commands: one for each program, and `plan` and `simulate`.

Results go to files and standard output, errors and progress to standard error. Heavy modules are imported by
the commands that need them, so that `photogram --help` is quick.
"""

from __future__ import annotations

from typing import Annotated

import typer

from photogram.cli import (
    absolute_orientation,
    adjust,
    check,
    check_project,
    collection,
    comparator,
    convert,
    features,
    giant,
    info,
    new,
    perspective_center,
    plan,
    relative_orientation,
    simulate,
    stellar_camera,
)
from photogram.cli.console import output
from photogram.cli.groups import GroupWithMain
from photogram.cli.panels import Command

__all__ = ["app"]

ADJUST = (
    "Examples: `photogram adjust --example`,"
    " `photogram adjust sparse/0 --control control.csv --control-crs EPSG:25832`,"
    " `photogram adjust quarry --self-calibrate f,cx,cy,k1,k2 --map quarry.gpkg`"
)

app = typer.Typer(
    name="photogram",
    help="Photogrammetric least-squares adjustment with the covariance of every result.",
    epilog="Exit codes: 0 converged, 1 input or output at fault, 2 usage, 3 not converged, diverged or"
    " something grave found, 4 a result that cannot be used as it is, 129, 130, 143 ended by a signal.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
giant_app = typer.Typer(name="giant", cls=GroupWithMain, help="Adjust or check a GIANT project.")
giant_app.command("adjust", cls=Command)(giant.giant)
giant_app.command("check", cls=Command)(check.check)
comparator_app = typer.Typer(
    name="comparator",
    cls=GroupWithMain,
    help="Calibrate a comparator, correct measurements, compare calibrations.",
)
comparator_app.command("calibrate", cls=Command)(comparator.comparator)
comparator_app.command("correct", cls=Command)(comparator.correct)
comparator_app.command("compare", cls=Command)(comparator.compare)
orientation_app = typer.Typer(
    name="absolute-orientation", cls=GroupWithMain, help="Orient a model absolutely, or transform its points."
)
orientation_app.command("orient", cls=Command)(absolute_orientation.absolute_orientation)
orientation_app.command("transform", cls=Command)(absolute_orientation.transform)
orientation_app.command("relative", cls=Command)(relative_orientation.relative)
stellar_app = typer.Typer(
    name="stellar-camera",
    cls=GroupWithMain,
    help="Calibrate a camera by a plate with stars, or by exposures of the sky.",
)
stellar_app.command("plate", cls=Command)(stellar_camera.stellar_camera)
stellar_app.command("exposures", cls=Command)(stellar_camera.exposures)
stellar_app.command("places", cls=Command)(stellar_camera.places)
app.command(cls=Command, epilog=ADJUST)(adjust.adjust)
app.command("check", cls=Command)(check_project.check_project)
app.command(cls=Command)(info.info)
app.command(cls=Command)(convert.convert)
app.command(cls=Command)(features.features)
app.command(cls=Command)(new.new)
app.add_typer(giant_app)
app.add_typer(orientation_app)
app.add_typer(comparator_app)
app.command("collection", cls=Command)(collection.collection)
app.command("perspective-center", cls=Command)(perspective_center.perspective_center)
app.add_typer(stellar_app)
app.command(cls=Command)(plan.plan)
app.command(cls=Command)(simulate.simulate)


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version as version_of  # takes long to import

        output.print(f"photogram {version_of('photogram')}")
        raise typer.Exit


@app.callback()
def _photogram(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Photogrammetric least-squares adjustment with the covariance of every result."""
