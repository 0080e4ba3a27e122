"""Lazy loading of package members, with argument checks."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection

import lazy_loader

from photogram.arguments.annotations import check_arguments


def attach_checked(
    package: str, file: str, given: Collection[str] = ()
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of a lazily loaded package.

    Functions check their arguments. Classes in `given`, which users instantiate, check them too.
    """
    load, listed, public = lazy_loader.attach_stub(package, file)

    def load_checked(name: str) -> object:
        loaded = load(name)
        names = vars(sys.modules[package])
        if name in given or (name.islower() and callable(loaded)):
            check_arguments(names, [name])
        return names[name]

    return load_checked, listed, public
