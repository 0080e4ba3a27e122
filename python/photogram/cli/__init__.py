"""The command line: `photogram giant`, `photogram absolute-orientation`, `photogram simulate`.

Results go to files and standard output, errors and progress to standard error. Heavy modules are imported by
the commands that need them, so that `photogram --help` is quick.
"""

from __future__ import annotations

from importlib.metadata import version as version_of
from typing import Annotated

import typer

from photogram.cli import absolute_orientation, giant, simulate
from photogram.cli.console import output
from photogram.cli.groups import GroupWithMain

__all__ = ["app", "main"]

app = typer.Typer(
    name="photogram",
    help="Photogrammetric least-squares adjustment with the covariance of every result.",
    epilog="Exit codes: 0 converged, 1 input or output at fault, 2 usage, 3 not converged or diverged.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
giant_app = typer.Typer(name="giant", cls=GroupWithMain, help="Adjust or check a GIANT project.")
giant_app.command("adjust")(giant.giant)
app.add_typer(giant_app)
orientation_app = typer.Typer(
    name="absolute-orientation", cls=GroupWithMain, help="Orient a model absolutely, or transform its points."
)
orientation_app.command("orient")(absolute_orientation.orient)
orientation_app.command("transform")(absolute_orientation.transform)
app.add_typer(orientation_app)
app.command()(simulate.simulate)


def main() -> None:
    """Run the command line."""
    app()


def _version(asked: bool) -> None:
    if asked:
        output.print(f"photogram {version_of('photogram')}")
        raise typer.Exit


@app.callback()
def _photogram(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Photogrammetric least-squares adjustment with the covariance of every result."""
