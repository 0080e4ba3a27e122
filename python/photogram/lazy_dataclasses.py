"""Dataclasses that are created on first use, because most programs use few of them.

Creating one class takes 0.5 ms; all of them take a third of the time of a first adjustment of six photos.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import asdict, field, fields, replace
from functools import partial
from threading import RLock, active_count
from typing import TYPE_CHECKING, Any, TypeVar, dataclass_transform

__all__ = ["asdict", "converting_dataclass", "dataclass", "field", "fields", "replace"]

_Kind = TypeVar("_Kind")

MAKING = RLock()
APART = {"__repr__", "__eq__", "__hash__"}  # Methods created later: few classes need them
REPLACED = {"__dataclass_fields__", "__dataclass_params__"}  # `dataclasses` overwrites them when complete


class _Later:
    """Placeholder attribute that creates the dataclass on first access."""

    def __init__(self, name: str, of: type, options: dict[str, bool]) -> None:
        self.name, self.of, self.options = name, of, options

    def __get__(self, instance: object, owner: type) -> Any:
        with MAKING:
            waiting = {name for name, own in vars(self.of).items() if isinstance(own, _Later)}
            if self.name in waiting & APART:
                named = [(each.name, each.type, each) for each in dataclasses.fields(self.of)]
                eq, frozen = self.options["eq"], self.options["frozen"]
                other = dataclasses.make_dataclass("Other", named, init=False, eq=eq, unsafe_hash=frozen)
                for name in waiting & APART:
                    setattr(self.of, name, vars(other)[name])
            elif self.name in waiting:
                # Other threads wait at the placeholders that remain; without them, they would see a base.
                init = "__init__" in waiting and active_count() > 1
                if init and not self.of.__doc__:
                    self.of.__doc__ = self.of.__name__  # Otherwise the signature, which `__init__` defines
                for name in waiting - APART - REPLACED - ({"__init__"} if init else set()):
                    delattr(self.of, name)
                dataclasses.dataclass(**(self.options | {"repr": False, "eq": False}))(self.of)
                if init:
                    type.__setattr__(self.of, "__init__", self._init())
        made = vars(self.of)[self.name]
        return made.__get__(instance, owner) if hasattr(made, "__get__") else made

    def _init(self) -> Any:
        """Return `__init__` of the finished dataclass."""
        named = [(each.name, each.type, each) for each in dataclasses.fields(self.of)]
        hook = {"__post_init__": None} if hasattr(self.of, "__post_init__") else {}
        frozen = self.options["frozen"]
        other = dataclasses.make_dataclass(
            "Other", named, namespace=hook, eq=False, repr=False, frozen=frozen
        )
        init = vars(other)["__init__"]
        init.__qualname__ = f"{self.of.__qualname__}.__init__"
        return init


def _declared(
    cls: type | None = None,
    /,
    *,
    init: bool = True,
    repr: bool = True,  # noqa: A002  # as dataclasses call it
    eq: bool = True,
    frozen: bool = False,
    kw_only: bool = False,
) -> Any:
    """Defer `dataclasses.dataclass` with these options to the first use of the class."""
    options = {"init": init, "repr": repr, "eq": eq, "frozen": frozen, "kw_only": kw_only}
    if cls is None:
        return partial(_declared, **options)
    names = ["__dataclass_fields__", "__dataclass_params__", "__match_args__"]
    names += ["__init__"] * init + ["__repr__"] * repr + ["__eq__", "__hash__"] * eq
    names += ["__setattr__", "__delattr__"] * frozen
    for name in names:
        if name not in vars(cls):
            setattr(cls, name, _Later(name, cls, options))
    return cls


if TYPE_CHECKING:
    from dataclasses import dataclass

    @dataclass_transform(field_specifiers=(field,))
    def converting_dataclass(
        *,
        eq: bool,
        repr: bool,  # noqa: A002  # as dataclasses call it
        frozen: bool,
        kw_only: bool = False,
    ) -> Callable[[type[_Kind]], type[_Kind]]:
        """Declare a dataclass with fields of the types `Converted`."""
else:
    dataclass = converting_dataclass = _declared
