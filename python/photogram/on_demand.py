"""Names of packages that are loaded when they are first asked for: who needs one waits for no other."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Mapping
from importlib import import_module
from typing import Any


def on_demand(
    package: str,
    homes: Mapping[str, str],
    check: Callable[[dict[str, Any], Collection[str]], None] | None = None,
    *,
    unchecked: Collection[str] = (),
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package.

    Parameters
    ----------
    package
        Its `__name__`.
    homes
        The module below it where each name stands; empty for a name that is a module itself.
    check
        What lets names check their arguments, `arguments.check_arguments`; None: they do it themselves.
    unchecked
        Names that do without: what functions make, and users do not.
    """
    names = vars(sys.modules[package])

    def load(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home = import_module(f"{package}.{homes[name] or name}")
        names[name] = getattr(home, name) if homes[name] else home
        if check is not None and name not in unchecked:
            check(names, [name])
        return names[name]

    def listed() -> list[str]:
        return sorted({*names, *homes})

    return load, listed
