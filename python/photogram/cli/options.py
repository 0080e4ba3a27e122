"""Options of commands: their declarations, roles of paths, and values from the command line."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping
from copy import copy
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum, StrEnum
from functools import cache, reduce
from inspect import Parameter, signature
from operator import or_
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin

import typer
from typer.models import ArgumentInfo, OptionInfo

from photogram.words import phrase

UNLIMITED = 1e9  # Limits of numbers that the help does not show
STANDS = {"example": "--example", "plan_views": "--plan"}
"""Options that replace the first argument of a command, by parameter."""


class Reads(Enum):
    """Input of a command that an option or argument names."""

    FILE = "file"
    PROJECT = "directory of a GIANT project"


class Writes(Enum):
    """Output of a command that an option or argument names."""

    FILE = "file"
    DIRECTORY = "directory of results"
    EITHER = "file or directory"


Input = Annotated[Path, Reads.FILE]
InputFile = Annotated[Path | None, Reads.FILE]
OutputFile = Annotated[Path | None, Writes.FILE]
OutputFolder = Annotated[Path | None, Writes.DIRECTORY]
Threads = Annotated[int | None, typer.Option(min=1)]


class Without:
    """Mark of a parameter: the command has no options for these fields of the class."""

    def __init__(self, *names: str) -> None:
        self.names = names

    def __contains__(self, name: str) -> bool:
        return name not in self.names


class Only(Without):
    """Mark of a parameter: the command only has options for these fields of the class."""

    def __contains__(self, name: str) -> bool:
        return name in self.names


class Changes(Only):
    """Mark of a parameter: a mapping of the fields of a class that the user specifies, without defaults."""

    def __init__(self, kind: type, *names: str) -> None:
        self.kind, self.names = kind, names


class OptionClass(NamedTuple):
    kind: type
    options: list[Parameter]
    changes: bool

    def value(self, values: dict[str, Any]) -> Any:
        """Return an object of the class, or changes; errors of its constructor name the option."""
        from photogram.errors import InputError

        names = {each.name: option_name(each) for each in self.options}
        parsers = {each.name: each.metadata.get("parse") for each in fields(self.kind)}
        given = {name: value for name in names if (value := values.pop(name, None)) is not None}
        if self.changes:
            defaults = {each.name: each.default for each in self.options}
            given = {name: value for name, value in given.items() if value != defaults[name]}
        for name, value in given.items():
            if parse := parsers[name]:
                try:
                    given[name] = parse(value)
                except InputError:
                    raise
                except ValueError as error:
                    raise misuse(names[name], "form", form=str(error), value=value) from None
        try:
            made = self.kind(**given)
        except InputError as error:
            known = error.phrase.fields if error.phrase else {}
            if known.get("what") not in names:
                raise
            message = known["message"]
            if "options" in message.fields:
                message = phrase(message.code, options=[names[name] for name in message.fields["options"]])
            raise typer.BadParameter(str(message), param_hint=names[known["what"]]) from None
        return given if self.changes else made


OfSnooping = Without("robust", "parts", "max_rounds")  # Of SnoopOptions


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


def misuse(option: str, code: str, /, **values: Any) -> typer.BadParameter:
    """Return the error of an option: a code of the family `usage` with fields."""
    return typer.BadParameter(str(phrase(f"usage.{code}", **values)), param_hint=option)


def words_of(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(",") if word.strip()) or (text,)


def _enumerated(kind: Any) -> Any:
    """Return a type with enumerations of the words of lists, because typer reads no lists of literals."""
    if isinstance(kind, UnionType):
        return reduce(or_, map(_enumerated, get_args(kind)))
    if get_origin(kind) is list and get_origin(get_args(kind)[0]) is Literal:
        words = get_args(get_args(kind)[0])
        return list[StrEnum("Words", dict(zip(words, words, strict=True)))]  # type: ignore[misc]
    return kind


def declared(parameter: Parameter, *owners: str) -> Parameter:
    """Return an option or argument with the declaration of its first owner that has one."""
    annotated = get_origin(parameter.annotation) is Annotated
    kind, *marks = get_args(parameter.annotation) if annotated else (parameter.annotation,)
    table, name = declarations(), parameter.name
    key = next((f"{owner}.{name}" for owner in owners if f"{owner}.{name}" in table), name)
    panel, placeholder, text = table[key]
    options = [mark for mark in marks if isinstance(mark, OptionInfo)]
    if panel == "Arguments":
        info = typer.Argument(metavar=placeholder, help=text)
    else:
        flag = [f"--{name.replace('_', '-')}"] if kind is bool else []
        info = copy(options[0]) if options else typer.Option(*flag)
        info.metavar, info.help, info.rich_help_panel = placeholder, text, panel
    others = [mark for mark in marks if mark not in options]
    return parameter.replace(
        kind=Parameter.KEYWORD_ONLY, annotation=Annotated[(_enumerated(kind), info, *others)]
    )


def field_option(field: Field[Any], kind: type, command: str, *, is_change: bool) -> Parameter:
    """Return the option of a field of a class of options; the help shows its limits.

    A path without a role is an input file.
    """
    hint: Any = field.metadata.get("kind")
    if hint is None:
        hint = eval(str(field.type), vars(sys.modules[kind.__module__]))
    is_change = is_change and hint is not bool
    default = None if is_change or field.default in ((), MISSING) else field.default
    if is_change or (field.metadata.get("kind") is not None and default is None):
        hint |= None
    if name := field.metadata.get("name"):
        hint = Annotated[hint, typer.Option(name)]
    low, high = (field.metadata.get(name, limit) for name, limit in (("low", -math.inf), ("high", math.inf)))
    base = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    if base in (int, int | None):
        limits = (("min", low), ("max", high))
        closed: dict[str, Any] = {name: limit for name, limit in limits if isinstance(limit, int)}
        hint = Annotated[(base, typer.Option(*filter(None, [name]), **closed))] if closed else hint
    parameter = Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=hint)
    parameter = declared(parameter, command, kind.__name__)
    if base in (float, float | None) and -low < UNLIMITED:
        sign = "" if field.metadata["open"] else "="
        interval = f"x>{sign}{low:g}" if high > UNLIMITED else f"{low:g}<{sign}x<{sign}{high:g}"
        _, info, *_ = get_args(parameter.annotation)
        info.metavar = f"{info.metavar or '<float>'} [{interval}]"
    if _holds_path(parameter.annotation) and mark(parameter, (Reads, Writes)) is None:
        return parameter.replace(annotation=Annotated[parameter.annotation, Reads.FILE])
    return parameter


def options_of(command: Callable[..., Any]) -> tuple[list[Parameter], dict[str, OptionClass]]:
    options: list[Parameter] = []
    classes: dict[str, OptionClass] = {}
    for parameter in signature(command, eval_str=True).parameters.values():
        kind, *marks = get_args(parameter.annotation) or (parameter.annotation,)
        selection = next((each for each in marks if isinstance(each, Without)), Without())
        is_change = isinstance(selection, Changes)
        kind = selection.kind if isinstance(selection, Changes) else kind
        if isinstance(kind, type) and is_dataclass(kind):
            chosen = [each for each in fields(kind) if each.name in selection]
            own = [field_option(each, kind, command.__name__, is_change=is_change) for each in chosen]
            classes[parameter.name] = OptionClass(kind, own, is_change)
            options += own
        elif parameter.name != "job":
            options.append(declared(parameter, command.__name__))
    return options, classes


def roles(command: Callable[..., Any]) -> dict[str, Reads | Writes]:
    """Return the roles of options and arguments of a command that are paths."""
    found = {}
    for each in options_of(command)[0]:
        if (role := mark(each, (Reads, Writes))) is not None:
            found[each.name] = role
        elif _holds_path(each.annotation):
            raise TypeError(f"{command.__name__}: {each.name} must be marked as one of Reads or Writes")
    return found


def mark(parameter: Parameter, kind: type | tuple[type, ...]) -> Any:
    """Return the mark of a kind in the annotation of an option or argument; None without one."""
    return next((each for each in get_args(parameter.annotation)[1:] if isinstance(each, kind)), None)


def _holds_path(kind: object) -> bool:
    return kind is Path or any(_holds_path(part) for part in get_args(kind))


def option_name(parameter: Parameter) -> str:
    info = mark(parameter, OptionInfo)
    # In an annotation, the default of the mark is the first option name.
    given = () if info is None else (info.default, *(info.param_decls or ()))
    names = [each for each in given if isinstance(each, str)] or ["--" + parameter.name.replace("_", "-")]
    return next((each for each in names if each.startswith("--")), names[0])


def given_options(parameters: Iterable[Parameter], values: Mapping[str, Any]) -> dict[str, str]:
    """Return options and arguments without defaults, as a user writes them."""
    found = {}
    for parameter in parameters:
        value = values.get(parameter.name, parameter.default)
        if value == parameter.default or value is None:
            continue
        argument = mark(parameter, ArgumentInfo)
        name = option_name(parameter) if argument is None else str(argument.metavar)
        each = value if isinstance(value, list) else [value]
        found[name] = ", ".join(str(getattr(one, "value", one)) for one in each)
    return found


def arrange(parameters: Iterable[Parameter], values: dict[str, Any]) -> None:
    """Assign values to arguments; an option may replace the first argument."""
    marks = {parameter.name: mark(parameter, ArgumentInfo) for parameter in parameters}
    arguments = {name: info.metavar for name, info in marks.items() if info is not None}
    given = [values[name] for name in arguments if values[name]]
    stands = [word for name, word in STANDS.items() if name in values]
    instead = sum(bool(values.get(name)) for name in STANDS)
    first, *others = arguments.values()
    if len(given) + instead > len(arguments) or not (given or instead):
        raise misuse(str(first), "alternatives", names=[first, *stands])
    if len(given) + instead < len(arguments):
        raise misuse(str(others[-1]), "missing")
    if instead:
        values.update(zip(arguments, [None, *given], strict=True))
