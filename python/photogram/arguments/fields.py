"""Fields of dataclasses, declared once by their type and limits: arguments and options.

A class of options is the parameter of a function of Python and of a command. This module imports no
arrays, so that the help of a command needs none.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial, reduce
from typing import Any, Literal, TypeVar, get_args, get_origin

from photogram.lazy_dataclasses import field, fields, replace

Options = TypeVar("Options")
Check = Callable[[str, Any], Any]
"""Function of name and value; returns the converted value or raises an error."""
_SEQUENCE = re.compile(r"(?:list|tuple|Sequence)\[([\w.]+)(?:, \.\.\.)?\]")
_TUPLE = re.compile(r"tuple\[((?:int|float|str|, )+)(, \.\.\.)?\]")


def option(
    default: Any,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    is_open: bool = False,
    kind: Any = None,
    parse: Callable[[str], Any] | None = None,
    name: str = "",
) -> Any:
    """Return a field with its limits.

    Parameters
    ----------
    default
        Default value, or a class whose constructor returns it.
    low, high
        Smallest and largest value; excluded if `is_open`.
    kind
        Type on the command line; None: the type of the field.
    parse
        Function that converts the text of the command line; its ValueError has the required form.
    name
        Name on the command line; empty: the name of the field.
    """
    limits = {"low": low, "high": high, "open": is_open}
    metadata = {**limits, "kind": kind, "parse": parse, "name": name}
    if isinstance(default, type):
        return field(default_factory=default, metadata=metadata)
    return field(default=default, metadata=metadata)


def array(
    *shape: int | str, rule: str = "", missing: bool = False, one_row: bool = False, index: str = ""
) -> dict[str, Any]:
    """Declare an array field.

    Parameters
    ----------
    shape
        Sizes, as numbers or names. A name is the number of rows of the first array that begins with it.
    rule
        Rule of its numbers, of `arrays.RULES`.
    missing
        Whether NaN is valid.
    one_row
        Whether a single row applies to all, as a single number does.
    index
        Name of the size that its indices are below; empty: an array of numbers.
    """
    return {"shape": shape, "rule": rule, "missing": missing, "one_row": one_row, "index": index}


def check_arrays(made: Any, **sizes: int) -> None:
    """Check and convert the declared arrays of an object; `sizes` are known by other means."""
    from photogram.arguments import arrays

    for each in fields(made):
        name, declared, value = each.name, each.metadata, getattr(made, each.name)
        if "shape" not in declared or (value is None and each.default is None):
            continue
        if isinstance(rows := declared["shape"][0], str) and rows not in sizes:
            sizes[rows] = arrays.length(name, value)
        shape = tuple(size if isinstance(size, int) else sizes[size] for size in declared["shape"])
        if limit := declared["index"]:
            value = arrays.indices(name, value, shape[0], sizes[limit])
        else:
            permitted = {option: declared[option] for option in ("missing", "one_row")}
            value = arrays.shaped(name, value, shape, declared["rule"], **permitted)
        object.__setattr__(made, name, value)


class Checked:
    """Base class of a dataclass whose constructor checks and converts the fields by their types."""

    def __post_init__(self) -> None:
        check_fields(self)


def check_fields(made: Any, title: str = "") -> None:
    """Check and convert the fields of an object; errors name the field and the title.

    The check of a field is `check` in its metadata, or follows from its type and limits.
    """
    kind: Any = type(made)
    for name, check in checks_of(kind).items():
        value = getattr(made, name)
        converted = check(f"{name} of {title}" if title else name, value)
        if converted is not value:
            object.__setattr__(made, name, converted)


def check_members(kind: type, members: Mapping[str, Any]) -> None:
    """Reject members of a saved object of a class with wrong types."""
    if hasattr(kind, "__dataclass_fields__"):
        from photogram.arguments.objects import kind_error

        for name, check in checks_of(kind).items():
            if name in members:
                converted = check(name, members[name])
                if hasattr(converted, "dtype") and not hasattr(members[name], "dtype"):
                    raise kind_error(name, "an array of numbers", members[name])
        for each in fields(kind):
            if each.type == "Names" and isinstance(members.get(each.name), str):
                raise kind_error(each.name, "a list of names", members[each.name])


@cache
def checks_of(kind: Any) -> dict[str, Check]:
    """Return the checks of fields with a check, or with a type that can be checked, by name."""
    checks: dict[str, Check] = {}
    for each in fields(kind):
        of, _, alternative = str(each.type).partition(" | ")
        optional = alternative == "None"
        check = each.metadata.get("check")
        if check is None and (optional or not alternative):
            check = _check_of(of, vars(sys.modules[kind.__module__]), optional=optional)
        if check is not None and each.init:
            checks[each.name] = _limited(check, each.metadata, of, optional=optional)
    return checks


def _check_of(of: str, names: Mapping[str, Any], *, optional: bool) -> Check | None:
    """Return the check of a type; None if values of the type are not checked."""
    from photogram.arguments import arrays
    from photogram.arguments.objects import path_of, require_kind

    simple: dict[str, Check] = {
        "int": arrays.whole_number,
        "float": arrays.number,
        "bool": arrays.truth_value,
        "str": _text,
        "Path": path_of,
        "Floats": arrays.numbers,
        "Indices": partial(arrays.of_kind, kinds="iu", of="whole numbers"),
        "Bools": partial(arrays.of_kind, kinds="b", of="truth values"),
    }
    kind: Any = eval(of, {"Literal": Literal}) if of.startswith("Literal[") else _named(of, names)
    if get_origin(kind) is Literal:
        return lambda name, value: arrays.one_of(name, value, get_args(kind))
    if _is_own_class(kind):
        return lambda name, value: require_kind(name, value, kind, optional=optional)
    if (match := _TUPLE.fullmatch(of)) is None:
        match = _SEQUENCE.fullmatch(of)
        return simple.get(of) if match is None else partial(_sequence, _named(match[1], names))
    inner = [simple[each] for each in match[1].split(", ")]

    def elements(name: str, value: Any) -> tuple[Any, ...]:
        values: tuple[Any, ...] = arrays.elements(name, value, count=None if match[2] else len(inner))
        if inner == [_text] and {*map(type, values)} <= {str}:  # Names of a hundred thousand stars
            return values
        checks = inner * len(values) if match[2] else inner
        pairs = zip(checks, values, strict=True)
        return tuple(check(f"{name}[{row}]", each) for row, (check, each) in enumerate(pairs))

    return elements


def _named(text: str, names: Mapping[str, Any]) -> Any:
    """Return the type with a name, which may have the names of modules before dots; None if it is unknown."""
    first, *others = text.split(".")
    return reduce(lambda found, name: getattr(found, name, None), others, names.get(first))


def _text(name: str, value: Any) -> str:
    """Return a text; titles of files may have control characters, but no lone surrogates."""
    from photogram.arguments.arrays import argument_error

    try:
        if isinstance(value, str):
            value.encode()
            return value
    except UnicodeEncodeError:
        pass
    raise argument_error(name, "text", value=value)


def _is_own_class(kind: Any) -> bool:
    """Return whether a type is a class of the package, and not a protocol."""
    is_class = isinstance(kind, type) and kind.__module__.startswith("photogram.")
    return is_class and not getattr(kind, "_is_protocol", False)


def _sequence(kind: Any, name: str, value: Any) -> Any:
    from photogram.arguments.arrays import elements

    found = elements(name, value, kind if _is_own_class(kind) else None)
    return value if isinstance(value, Sequence) else found


def _limited(check: Check, limits: Mapping[str, Any], of: str, *, optional: bool) -> Check:
    from photogram.arguments.objects import require

    low, high = limits.get("low", -math.inf), limits.get("high", math.inf)
    code = "range" if high < math.inf else "least" if low else "not-negative"
    code = "positive" if limits.get("open") and (low, high) == (0, math.inf) else code
    code = "whole-range" if code == "range" and of == "int" else code
    shown = {} if code in ("positive", "not-negative") else {"low": low, "high": high}

    def limited(name: str, value: Any) -> Any:
        if value is None and optional:
            return None
        value = check(name, value)
        if (low, high) != (-math.inf, math.inf):
            inside = low < value < high if limits["open"] else low <= value <= high
            require(inside, name, code, **shown, value=value)
        return value

    return limited


def options_of(kind: type[Options], options: Options | None, changes: Mapping[str, Any]) -> Options:
    """Return options with changes by keyword; None: the defaults."""
    if options is None:
        return kind(**changes)
    from photogram.arguments.objects import require_kind

    require_kind("options", options, kind)
    return replace(options, **changes)  # type: ignore[type-var]
