"""Declared fields of dataclasses: each field contains the check that converts its value.

`size: Floats = field(metadata=check_with(array((2,), "positive")))` declares a field;
:func:`check_fields` checks and converts all declared fields of an object.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_args

import numpy as np

from photogram.arguments.arrays import argument_error, names, number, one_of, shaped
from photogram.arguments.objects import require_kind
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import fields

Check = Callable[[str, Any], Any]
"""Function of name and value of a field; returns the converted value or raises an error."""

_RULES: dict[str, Callable[[Floats], Bools]] = {
    "finite": np.isfinite,
    "positive": lambda values: (values > 0) & np.isfinite(values),
}


def check_with(check: Check) -> dict[str, Check]:
    """Return the metadata of a field with a check."""
    return {"check": check}


def check_fields(owner: Any, title: str = "") -> None:
    """Check and convert all declared fields of an object; errors name the field and the title."""
    for each in fields(owner):
        if check := each.metadata.get("check"):
            name = f"{each.name} of {title}" if title else each.name
            vars(owner)[each.name] = check(name, getattr(owner, each.name))


def optional(check: Check) -> Check:
    """Return a check that also accepts None."""
    return lambda name, value: None if value is None else check(name, value)


def instance(kind: type, *others: None) -> Check:
    """Return a check for an instance of a class, or for None if it is among the arguments."""

    def check(name: str, value: Any) -> Any:
        require_kind(name, value, kind, optional=bool(others))
        return value

    return check


def choice(words: Any) -> Check:
    """Return a check for one of the words of a Literal."""

    def check(name: str, value: Any) -> Any:
        one_of(name, value, get_args(words))
        return value

    return check


def array(shape: tuple[int, ...], rule: str = "") -> Check:
    """Return a check for numbers of a shape that satisfy a rule: `finite` or `positive`."""

    def check(name: str, value: Any) -> Floats:
        found = shaped(name, value, shape)
        if rule and not _RULES[rule](found).all():
            raise argument_error(name, rule, value=found.tolist())
        return found

    return check


def numbers(shape: tuple[int, ...], rule: str = "") -> Check:
    """Return a check like :func:`array` that returns a number or a tuple of numbers."""

    def check(name: str, value: Any) -> Any:
        found = array(shape, rule)(name, value).tolist()
        return tuple(found) if shape else found

    return check


def finite(name: str, value: Any) -> float:
    """Return a finite number."""
    found = number(name, value)
    if not np.isfinite(found):
        raise argument_error(name, "finite", value=found)
    return found


def object_name(name: str, value: Any) -> str:
    """Return the name of an object."""
    return names(name, [value])[0]
