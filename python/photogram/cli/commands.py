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
    giant,
    info,
    new,
    perspective_center,
    plan,
    simulate,
    stellar_camera,
)
from photogram.cli.console import output
from photogram.cli.groups import GroupWithMain

__all__ = ["app"]

app = typer.Typer(
    name="photogram",
    help="Photogrammetric least-squares adjustment with the covariance of every result.",
    epilog="Exit codes: 0 converged, 1 input or output at fault, 2 usage, 3 not converged, diverged or"
    " something grave found, 4 a result that cannot be used as it is, 129, 130, 143 ended by a signal.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
giant_app = typer.Typer(name="giant", cls=GroupWithMain, help="Adjust or check a GIANT project.")
giant_app.command("adjust")(giant.giant)
giant_app.command("check")(check.check)
comparator_app = typer.Typer(
    name="comparator", cls=GroupWithMain, help="Calibrate a comparator, or correct measurements."
)
comparator_app.command("calibrate")(comparator.comparator)
comparator_app.command("correct")(comparator.correct)
orientation_app = typer.Typer(
    name="absolute-orientation", cls=GroupWithMain, help="Orient a model absolutely, or transform its points."
)
orientation_app.command("orient")(absolute_orientation.absolute_orientation)
orientation_app.command("transform")(absolute_orientation.transform)
stellar_app = typer.Typer(
    name="stellar-camera",
    cls=GroupWithMain,
    help="Calibrate a camera by a plate with stars, or by exposures of the sky.",
)
stellar_app.command("plate")(stellar_camera.stellar_camera)
stellar_app.command("exposures")(stellar_camera.exposures)
stellar_app.command("places")(stellar_camera.places)
app.command()(adjust.adjust)
app.command("check")(check_project.check_project)
app.command()(info.info)
app.command()(convert.convert)
app.command()(new.new)
app.add_typer(giant_app)
app.add_typer(orientation_app)
app.add_typer(comparator_app)
app.command("collection")(collection.collection)
app.command("perspective-center")(perspective_center.perspective_center)
app.add_typer(stellar_app)
app.command()(plan.plan)
app.command()(simulate.simulate)


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
