"""The command line: `photogram giant`, `photogram simulate`, `photogram stellar-camera`.

Results go to files and standard output, errors and progress to standard error. Heavy modules are imported by
the commands that need them, so that `photogram --help` is quick.
"""

from __future__ import annotations

from importlib.metadata import version as version_of
from typing import Annotated

import typer

from photogram.cli import giant, simulate, stellar_camera
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
app.command()(simulate.simulate)
app.command("stellar-camera")(stellar_camera.stellar_camera)


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
