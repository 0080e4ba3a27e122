"""Validation of arguments of public functions by their annotations.

Invalid values raise an error that names the argument, instead of an error of Python or NumPy from deep
inside.

Why not a package: beartype does not convert values (strings to paths, NumPy integers to integers), raises its
own errors, and accepts NaN, NUL and lone surrogates. pydantic does not support arrays and adds a compiled
core to a light install. msgspec does not support arrays, does not list the allowed words or the nearest key,
and accepts 1e400 as a number. Its import is slow.
"""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache, partial, wraps
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

import lazy_loader
import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.arguments.arrays import is_masked, number, one_of, refused, truth_value, whole_number
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.words import phrase

Check = Callable[[str, Any], Any]
"""Function of argument name and value; returns the converted value or raises an error."""
_MARK = "_checks_arguments"  # Attribute of functions that check their arguments
_ARRAYS = {"NDArray": NDArray, "np": np, "Floats": Floats, "Indices": Indices, "Bools": Bools}
"""Names of arrays in annotations, if the names are imported for type checking only."""


def check_arguments(names: dict[str, Any], public: Iterable[str]) -> None:
    """Add argument checks to `public` functions and classes of a module.

    A function is replaced by a checking one; a class checks the arguments of its constructor.
    """
    for name in public:
        found = names[name]
        if inspect.isclass(found):
            if not hasattr(found.__init__, _MARK):
                checking = _checked(found.__init__, found.__name__, names)
                type.__setattr__(found, "__init__", checking)
        elif not hasattr(found, _MARK):
            names[name] = _checked(found, name, names)


def check_members(kind: type, given: Mapping[str, Any]) -> None:
    """Check values of a class by parameter name, without conversion."""
    checks = _checks_of_class(kind)
    for name, value in given.items():
        made = checks.get(name, _anything)(name, value)
        if isinstance(made, np.ndarray) and not isinstance(value, np.ndarray):
            raise refused(name, value, "an array of numbers")


@cache
def _checks_of_class(kind: type) -> dict[str, Check]:
    plain = inspect.unwrap(kind.__init__)  # type: ignore[misc]
    return _checks(plain, {**_ARRAYS, **vars(sys.modules[kind.__module__])})


def path(name: str, value: object) -> Path:
    """Return a path from a string or a path-like object."""
    try:
        text = os.fspath(value)  # type: ignore[call-overload]
    except TypeError:
        raise refused(name, value, "a path") from None
    if not isinstance(text, str) or not text or "\0" in text:
        raise refused(name, value, "a path without NUL characters" if text else "a path")
    try:
        os.fsencode(text)
    except UnicodeEncodeError:
        raise refused(name, value, "a path") from None
    return value if isinstance(value, Path) else Path(text)


def _checked(function: Callable[..., Any], name: str, names: dict[str, Any]) -> Callable[..., Any]:
    signature = inspect.signature(function)
    checks: dict[str, Check] = {}

    @wraps(function)
    def checked(*arguments: Any, **options: Any) -> Any:
        if not checks:
            plain = inspect.unwrap(function)
            checks.update(_checks(plain, {**_ARRAYS, **names, **plain.__globals__}))
        try:
            bound = signature.bind(*arguments, **options)
        except TypeError as error:
            raise TypeError(f"{name}: {error}") from None
        for parameter, value in bound.arguments.items():
            if parameter in checks:
                bound.arguments[parameter] = checks[parameter](parameter, value)
        return function(*bound.args, **bound.kwargs)

    setattr(checked, _MARK, True)
    return checked


class _Names(dict[str, Any]):
    """Names in annotations; names imported for type checking only are resolved."""

    def __missing__(self, name: str) -> Any:
        modules = [vars(module) for key, module in list(sys.modules.items()) if key.startswith("photogram.")]
        found = {names[name] for names in modules if inspect.isclass(names.get(name))}
        if len(found) != 1:
            raise KeyError(name)
        return found.pop()


def _checks(function: Callable[..., Any], names: dict[str, Any]) -> dict[str, Check]:
    """Return a check for each parameter; annotations without a known type accept anything."""
    checks: dict[str, Check] = {"": _anything}
    known = _Names(names)
    for name, annotation in inspect.get_annotations(function).items():
        if name == "return":
            continue
        with suppress(NameError):
            checks[name] = _check_of(
                eval(annotation, {}, known) if isinstance(annotation, str) else annotation
            )
    return checks


def _check_of(hint: Any) -> Check:
    origin, inner = get_origin(hint), get_args(hint)
    kinds = [kind for kind in inner if kind is not type(None)]
    if hint is ArrayLike:
        return _array
    if origin in (Union, UnionType) and len(kinds) < len(inner):
        needed = _check_of_union(kinds)
        return lambda name, value: None if value is None else needed(name, value)
    if origin in (Union, UnionType):
        return _check_of_union(kinds)
    if origin is Literal:
        return partial(_one_of, inner)
    if origin is np.ndarray:
        return _numpy(get_args(inner[1])[0])
    if origin in (list, tuple, Sequence, Iterable):
        return _sequence(origin, inner)
    if hint in _SIMPLE:
        return _SIMPLE[hint]
    kind = origin or hint
    usable = inspect.isclass(kind) and kind not in (object, Any) and not getattr(kind, "_is_protocol", False)
    return _instance(kind) if usable else _anything


def _one_of(words: tuple[str, ...], name: str, value: Any) -> Any:
    one_of(name, value, words)
    return value


def _check_of_union(kinds: list[Any]) -> Check:
    """Return a check of alternatives; None is no alternative."""
    arrays = set(get_args(ArrayLike))
    if arrays <= set(kinds):
        classes = tuple(kind for kind in kinds if kind not in arrays)
        return lambda name, value: value if isinstance(value, classes) else _array(name, value)
    if kinds != [str] and all(kind in (str, Path) or get_origin(kind) is os.PathLike for kind in kinds):
        return path
    if len(kinds) == 1:
        return _check_of(kinds[0])
    return _instance(*kinds) if all(map(inspect.isclass, kinds)) else _anything


def _sequence(origin: Any, inner: tuple[Any, ...]) -> Check:
    """Return a check of each element of a sequence, and of its defined length."""
    is_fixed = origin is tuple and Ellipsis not in inner
    checks = [_name if kind is object else _check_of(kind) for kind in inner if kind is not Ellipsis]
    made = tuple if origin is tuple else list

    def sequence(name: str, value: Any) -> Any:
        if isinstance(value, str | bytes) or not isinstance(value, Iterable):
            raise refused(name, value, "a sequence")
        elements = np.atleast_1d(value).tolist() if isinstance(value, np.ndarray) else list(value)
        if is_fixed and len(elements) != len(checks):
            raise refused(name, value, f"a sequence of {len(checks)}")
        if {*checks} == {number} and {*map(type, elements)} == {float}:  # No conversion is needed
            return made(elements)
        rows = zip(checks if is_fixed else checks * len(elements), elements, strict=True)
        return made(check(f"{name}[{row}]", each) for row, (check, each) in enumerate(rows))

    return sequence


def _name(name: str, value: Any) -> Any:
    """Reject values that are neither text nor number, and invalid text."""
    if isinstance(value, str):
        return _text(name, value)
    is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    return (whole_number if is_whole else number)(name, value)


def _anything(name: str, value: Any) -> Any:
    return value


def _instance(*kinds: type) -> Check:
    def instance(name: str, value: Any) -> Any:
        if not isinstance(value, kinds):
            raise refused(name, value, "a " + " or ".join(kind.__name__ for kind in kinds))
        return value

    return instance


def _text(name: str, value: Any) -> str:
    with suppress(UnicodeEncodeError):
        if isinstance(value, str):
            value.encode()
            return value
    raise refused(name, value, "a text")


def _array(name: str, value: Any, kinds: str = "biuf", what: str = "numbers") -> Any:
    """Reject other values than real numbers, and arrays with masked elements."""
    numbers, array = value, np.array("")
    with suppress(TypeError, ValueError, OverflowError, RecursionError):
        array = np.asarray(value)
        if array.dtype.kind == "O" and value is not None:
            numbers = array = array.astype(float)
    kind = array.dtype.kind
    if kind not in "biuf" or (array.size and kind not in kinds):
        raise refused(name, value, f"an array of {what}")
    if is_masked(value):
        raise InputError(phrase("argument.masked", name=name))
    return numbers


def _numpy(kind: type[np.generic]) -> Check:
    """Return a check that converts to an array of floats, integers or truth values."""
    kinds, what = {"f": ("biuf", "numbers"), "i": ("iu", "whole numbers"), "b": ("b", "truth values")}[
        np.dtype(kind).kind
    ]

    def converted(name: str, value: Any) -> Any:
        array = np.asarray(_array(name, value, kinds, what))
        if kind is np.int64 and array.dtype.kind == "u" and array.size and array.max() >= 2**63:
            raise refused(name, value, "an array of whole numbers of 64 bits")
        return array.astype(kind, copy=False)

    return converted


_SIMPLE: dict[Any, Check] = {
    int: whole_number,
    float: number,
    bool: truth_value,
    str: _text,
    Path: path,
}


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
