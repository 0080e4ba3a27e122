"""Commands and command groups: common options in panels; a main command."""

from __future__ import annotations

import json
import math
import os
import sys
from copy import copy
from dataclasses import MISSING, Field
from functools import cache, partial
from inspect import Parameter
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

import typer
from typer.core import TyperCommand, TyperGroup
from typer.models import OptionInfo

from photogram.words import phrase

UNLIMITED = 1e9  # Limits of numbers that the help does not show


@cache
def declarations() -> dict[str, tuple[str, str | None, str]]:
    """Return panel, placeholder and help of options by name; see `options.toml`."""
    panel, table = "", {}
    for line in Path(__file__).with_name("options.toml").read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            panel = line.strip('[]"')
        elif line and not line.startswith("#"):
            name, _, value = line.partition(" = ")
            texts = json.loads(value)  # strings and lists of them are the same in JSON
            placeholder, text = (None, texts) if isinstance(texts, str) else texts
            table[name.strip('"')] = panel, placeholder, text
    return table


def misuse(option: str, code: str, /, **fields: Any) -> typer.BadParameter:
    """Return the error of an option: a code of the family `usage` with fields."""
    return typer.BadParameter(str(phrase(f"usage.{code}", **fields)), param_hint=option)


def declared(parameter: Parameter, owner: str) -> Parameter:
    """Return an option, argument or class of options with its declaration."""
    annotated = get_origin(parameter.annotation) is Annotated
    kind, *marks = get_args(parameter.annotation) if annotated else (parameter.annotation,)
    table, name = declarations(), parameter.name
    panel, placeholder, text = table.get(f"{owner}.{name}") or table[name]
    options = [mark for mark in marks if isinstance(mark, OptionInfo)]
    if panel == "Arguments":
        info = typer.Argument(metavar=placeholder, help=text)
    else:
        flag = [f"--{name.replace('_', '-')}"] if kind is bool else []
        info = copy(options[0]) if options else typer.Option(*flag)
        info.metavar, info.help, info.rich_help_panel = placeholder, text, panel
    others = [mark for mark in marks if mark not in options]
    return parameter.replace(kind=Parameter.KEYWORD_ONLY, annotation=Annotated[(kind, info, *others)])


def option_of(field: Field[Any], kind: type) -> Parameter:
    """Return the option of a field of a class of options; the help shows its limits."""
    hint: Any = field.metadata.get("kind")
    if hint is None:
        hint = eval(str(field.type), vars(sys.modules[kind.__module__]))
    default = None if field.default in ((), MISSING) else field.default
    if field.metadata.get("kind") is not None and default is None:
        hint |= None
    if name := field.metadata.get("name"):
        hint = Annotated[hint, typer.Option(name)]
    low, high = (field.metadata.get(name, limit) for name, limit in (("low", -math.inf), ("high", math.inf)))
    if int in (hint, field.metadata.get("kind")):
        limits = (("min", low), ("max", high))
        closed: dict[str, Any] = {name: limit for name, limit in limits if isinstance(limit, int)}
        hint = Annotated[hint, typer.Option(**closed)] if closed else hint
    parameter = Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=hint)
    parameter = declared(parameter, kind.__name__)
    if hint in (float, float | None) and -low < UNLIMITED:
        sign = "" if field.metadata["open"] else "="
        interval = f"x>{sign}{low:g}" if high > UNLIMITED else f"{low:g}<{sign}x<{sign}{high:g}"
        _, info = get_args(parameter.annotation)
        info.metavar = f"{info.metavar or '<float>'} [{interval}]"
    return parameter


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
