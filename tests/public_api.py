"""The public API as a list, and the keywords of functions with options, which tests compare.

`python tests/public_api.py` writes tests/public_api.txt and the files `keywords.pyi` of the package.
A line for each function, class, method, property and field that users reach by the names that `__all__` has,
with arguments and defaults. A release whose list has lost or changed a line says so in the changelog.
"""

from __future__ import annotations

import ast
import functools
import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import photogram

LIST = Path(__file__).with_name("public_api.txt")
KEYWORDS = {
    "adjustment": {
        "AdjustKeywords(TypedDict": "photogram.adjustment.options.AdjustOptions",
        "SnoopKeywords(AdjustKeywords": "photogram.results.snooping_options.SnoopOptions",
    },
    "targets": {"CalibrationKeywords(TypedDict": "photogram.targets.options.CalibrationOptions"},
    "network": {"SimulationKeywords(TypedDict": "photogram.network.simulation_options.SimulationOptions"},
}
"""Types of keywords that the fields of a class define, for checkers of types and editors, by folder."""


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


def keywords() -> Iterator[tuple[Path, str]]:
    """Return the files with types of keywords, and their contents."""
    for folder, classes in KEYWORDS.items():
        imports, bodies = {"typing": {"TypedDict"}}, []
        for head, source in classes.items():
            module, _, name = source.rpartition(".")
            kind = getattr(import_module(module), name)
            tree = ast.parse(inspect.getsource(import_module(module)))
            homes = {
                alias.name: node.module
                for node in ast.walk(tree)
                if isinstance(node, ast.ImportFrom)
                for alias in node.names
            }
            body = [f'    """Fields of `{name}` as keywords of functions."""\n']
            for field in kind.__dataclass_fields__.values():
                body.append(f"    {field.name}: {field.type}".replace("'", '"'))
                for part in re.findall(r"[A-Za-z]\w*", re.sub(r'"\w+"', "", field.type)):
                    if part in homes or hasattr(import_module(module), part):
                        imports.setdefault(homes.get(part, module), set()).add(part)
            bodies.append(f"class {head}, total=False):\n" + "\n".join(body) + "\n")
        groups = [[], ["import numpy as np"] if "np." in "".join(bodies) else [], []]
        for home, parts in sorted(imports.items()):
            line = f"from {home} import {', '.join(sorted(parts))}"
            groups[2 if home.startswith("photogram") else 0].append(line)
        head = "\n\n".join("\n".join(lines) for lines in groups if lines)
        yield (
            Path(photogram.__file__).parent / folder / "keywords.pyi",
            "\n\n".join([head, "\n".join(bodies)]),
        )


if __name__ == "__main__":
    for path, text in keywords():
        path.write_text(text, encoding="utf-8")
    LIST.write_text("\n".join(lines()) + "\n", encoding="utf-8")
