"""Options declared once: fields of a dataclass with limits.

A class of options is the parameter of a function of Python and of a command. Its module imports no arrays, so
that the help of a command needs none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from photogram.lazy_dataclasses import field, fields, replace

Options = TypeVar("Options")


def option(
    default: Any,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    is_open: bool = False,
    words: Sequence[str] = (),
    kind: type | None = None,
) -> Any:
    """Return a field with its limits.

    Parameters
    ----------
    default
        Default value.
    low, high
        Smallest and largest value; excluded if `is_open`.
    words
        Allowed words.
    kind
        Type on the command line; None: the type of the field.
    """
    limits = {"low": low, "high": high, "open": is_open, "words": words, "kind": kind}
    return field(default=default, metadata=limits)


def check_options(options: Any) -> None:
    """Reject options of a wrong type or beyond their limits."""
    from photogram.arguments.arrays import number, one_of, text, truth_value, whole_number
    from photogram.arguments.objects import require

    checks: dict[str, Any] = {"int": whole_number, "float": number, "bool": truth_value, "str": text}
    for each in fields(options):
        value, name, limits = getattr(options, each.name), each.name, each.metadata
        kind, _, alternative = each.type.partition(" | ")
        if value is None and alternative == "None":
            continue
        if limits.get("words"):
            one_of(name, value, limits["words"])
        if kind not in checks or alternative not in ("", "None"):
            continue
        value = checks[kind](name, value)
        low, high = limits.get("low", -math.inf), limits.get("high", math.inf)
        if (low, high) != (-math.inf, math.inf):
            inside = low < value < high if limits["open"] else low <= value <= high
            finite = "whole-range" if kind == "int" else "range"
            code = finite if high < math.inf else "least" if low else "not-negative"
            require(inside, name, code, low=low, high=high, value=value)


def options_of(kind: type[Options], options: Options | None, changes: Mapping[str, Any]) -> Options:
    """Return options with changes by keyword; None: the defaults."""
    if options is None:
        return kind(**changes)
    from photogram.arguments.objects import require_kind

    require_kind("options", options, kind)
    return replace(options, **changes)  # type: ignore[type-var]
