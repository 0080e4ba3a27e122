"""Commands and command groups: common options in panels; a main command."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import Any

from typer.core import TyperCommand, TyperGroup


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
        """Return --help in its panel."""
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
