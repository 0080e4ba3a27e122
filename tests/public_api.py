"""The public API as a list: `python tests/public_api.py` writes tests/public_api.txt, which a test compares.

A line for each function, class, method, property and field that users reach by the names that `__all__` has,
with arguments and defaults. A release whose list has lost or changed a line says so in the changelog.
"""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

LIST = Path(__file__).with_name("public_api.txt")


def arguments(what: object) -> str:
    """Return arguments with their defaults, without types, which checkers of types look after."""
    try:
        signature = inspect.signature(what)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return "(...)"
    plain = [
        each.replace(annotation=inspect.Parameter.empty)
        for each in signature.parameters.values()
        if each.name not in ("self", "cls")
    ]
    return re.sub(r"<function \S+ at 0x\w+>", "<function>", str(inspect.Signature(plain)))


def members(name: str, kind: type) -> Iterator[str]:
    """Return lines of what a class has, inherited or not, of this package."""
    fields = getattr(kind, "__dataclass_fields__", {})
    for attribute in sorted({*dir(kind), *fields}):
        if attribute.startswith("_"):
            continue
        home = next((each for each in kind.__mro__ if attribute in vars(each)), kind)
        if attribute not in fields and not home.__module__.startswith("photogram"):
            continue
        value = inspect.getattr_static(kind, attribute, None)
        if attribute in fields or isinstance(value, property | functools.cached_property):
            yield f"{name}.{attribute}"
        elif isinstance(value, staticmethod | classmethod) or callable(getattr(kind, attribute, None)):
            yield f"{name}.{attribute}{arguments(getattr(kind, attribute))}"
        else:
            yield f"{name}.{attribute}"


def packages(name: str = "photogram") -> Iterator[str]:
    """Return the names of a public package and of those in it."""
    yield name
    home = import_module(name)
    for inner in sorted({*home.__all__} - {*names(home)}):
        yield from packages(f"{name}.{inner}")


def names(package: ModuleType) -> list[str]:
    """Return the public names of a package that are no packages themselves."""
    return [name for name in sorted(package.__all__) if not inspect.ismodule(getattr(package, name))]


def lines() -> list[str]:
    """Return the whole list."""
    found = []
    for module in sorted(packages()):
        home = import_module(module)
        for own in names(home):
            value, name = getattr(home, own), f"{module}.{own}"
            if inspect.isclass(value):
                found += [f"{name}{arguments(value)}", *members(name, value)]
            elif callable(value):
                found.append(f"{name}{arguments(value)}")
            else:
                found.append(name)
    return found


if __name__ == "__main__":
    LIST.write_text("\n".join(lines()) + "\n", encoding="utf-8")
