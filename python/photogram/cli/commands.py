"""The commands of all programs, each loaded at its first call; panels and main commands of their help."""

from __future__ import annotations

import os
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

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
    "simulate": "plan.simulate",
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


class _Params:
    """Options and arguments without conversion, which would import pydantic (80 ms)."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters; :func:`_processed` processes their values."""
        parameters: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        for parameter in parameters:
            if hasattr(parameter, "type_descriptor"):  # older versions of typer convert without pydantic
                parameter.process_value = partial(_processed, parameter)
        return parameters


def _processed(parameter: Any, ctx: Any, value: Any) -> Any:
    """Return the value of an option or argument, converted if necessary."""
    is_path = parameter.type_descriptor.is_path and value is not None
    if is_path and (os.access(value, os.R_OK) or not os.path.exists(value)):
        value = Path(value)
    elif value != parameter.default or parameter.required:
        return type(parameter).process_value(parameter, ctx, value)
    return value if parameter.callback is None else parameter.callback(ctx, parameter, value)


class Group(_Params, TyperGroup):
    """A group of commands."""


class Command(_Params, TyperCommand):
    """A command whose help has panels and switches without a type."""

    def __init__(self, *args: Any, **values: Any) -> None:
        super().__init__(*args, **values)
        # Lines of a docstring are lines of the source.
        self.help = self.help and "\n\n".join(" ".join(each.split()) for each in self.help.split("\n\n"))
        for parameter in self.params:
            # typer shows the type of a switch, but a user writes none.
            if getattr(parameter, "is_flag", False) and parameter.metavar is None:
                parameter.metavar = ""

    def get_help_option(self, ctx: Any) -> Any:
        option: Any = super().get_help_option(ctx)
        if option is not None:
            option.rich_help_panel, option.metavar = "Run", ""
        return option


class GroupWithMain(Group):
    """A group whose first command is the default command.

    A folder with the name of a side command must be written as `./check`.
    """

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the commands in the order in which they were added."""
        return list(self.commands)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command; the help of the main command lists the others."""
        command = super().get_command(ctx, cmd_name)
        if command is not None and cmd_name == self._main:
            others = [self.commands[name] for name in self.list_commands(ctx) if name != self._main]
            lines = [
                f"{ctx.command_path} {each.name}: {each.get_short_help_str(limit=200)}" for each in others
            ]
            command.epilog = "\n\n".join(["Other commands:", *lines])
        return command

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the main command before arguments that name no command.

        While a shell completes the first word, either may follow: see :meth:`shell_complete`.
        """
        if (args or not ctx.resilient_parsing) and (not args or args[0] not in self.commands):
            args = [self._main, *args]
        return list(super().parse_args(ctx, args))

    def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
        """Return completions: side commands and words of the main command."""
        main = self.commands[self._main]
        with main.make_context(self._main, [], parent=ctx, resilient_parsing=True) as own:
            return [*super().shell_complete(ctx, incomplete), *main.shell_complete(own, incomplete)]

    @property
    def _main(self) -> str:
        return next(iter(self.commands))
