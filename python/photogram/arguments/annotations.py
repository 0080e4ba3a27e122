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
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, wraps
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.arguments.arrays import is_masked, number, one_of, shown, truth_value, whole_number
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
            raise _refused(name, value, "an array of numbers")


@cache
def _checks_of_class(kind: type) -> dict[str, Check]:
    plain = inspect.unwrap(kind.__init__)  # type: ignore[misc]
    return _checks(plain, {**_ARRAYS, **vars(sys.modules[kind.__module__])})


def path(name: str, value: object) -> Path:
    """Return a path from a string or a path-like object."""
    try:
        text = os.fspath(value)  # type: ignore[call-overload]
    except TypeError:
        raise _refused(name, value, "a path") from None
    if not isinstance(text, str) or not text or "\0" in text:
        raise _refused(name, value, "a path without NUL characters" if text else "a path")
    try:
        os.fsencode(text)
    except UnicodeEncodeError:
        raise _refused(name, value, "a path") from None
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
    """Return a check for each parameter with a supported annotation."""
    checks: dict[str, Check] = {"": _anything}
    known = _Names(names)
    for name, annotation in inspect.get_annotations(function).items():
        if name == "return":
            continue
        try:
            hint = eval(annotation, {}, known) if isinstance(annotation, str) else annotation
        except NameError:
            continue
        if check := _check_of(hint):
            checks[name] = check
    return checks


def _check_of(hint: Any) -> Check | None:
    if hint is ArrayLike:
        return _array
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return _check_of_union(inner)
    if origin is Literal:
        return _one_of(inner)
    if origin is np.ndarray:
        return _numpy(get_args(inner[1])[0])
    if origin in (list, tuple, Sequence, Iterable):
        return _several(hint)
    if inspect.isclass(origin):
        return _instance(origin)
    simple: dict[Any, Check] = {
        int: whole_number,
        float: number,
        bool: truth_value,
        str: _text,
        Path: path,
    }
    if hint in simple:
        return simple[hint]
    usable = inspect.isclass(hint) and hint not in (object, Any) and not getattr(hint, "_is_protocol", False)
    return _instance(hint) if usable else None


def _check_of_union(inner: tuple[Any, ...]) -> Check | None:
    kinds = [kind for kind in inner if kind is not type(None)]
    arrays = set(get_args(ArrayLike))
    if arrays <= set(inner):
        check: Check | None = _array_or(*(kind for kind in kinds if kind not in arrays))
    elif all(kind in (str, Path) or get_origin(kind) is os.PathLike for kind in kinds) and kinds != [str]:
        check = path
    elif len(kinds) == 1:
        check = _check_of(kinds[0])
    elif all(inspect.isclass(kind) for kind in kinds):
        check = _instance(*kinds)
    else:
        check = None
    if check is None or len(kinds) == len(inner):
        return check
    needed = check
    return lambda name, value: None if value is None else needed(name, value)


def _several(hint: Any) -> Check | None:
    """Return a check of each element of a sequence, and of its defined length."""
    origin, inner = get_origin(hint), get_args(hint)
    fixed = origin is tuple and (len(inner) < 2 or inner[1] is not Ellipsis)
    checks = [
        _name if kind is object else _check_of(kind) or _anything for kind in inner if kind is not Ellipsis
    ]

    of_numbers = {*checks} == {number}

    def several(name: str, value: Any) -> Any:
        if isinstance(value, str | bytes) or not isinstance(value, Iterable):
            raise _refused(name, value, "a sequence")
        if isinstance(value, np.ndarray):
            value = value.tolist() if value.ndim else [value.item()]
        elements = list(value)
        if fixed and len(elements) != len(checks):
            raise _refused(name, value, f"a sequence of {len(checks)}")
        if of_numbers and {*map(type, elements)} == {float}:  # Nearly all sequences: no conversion is needed
            return tuple(elements) if origin is tuple else elements
        all_checks = checks if fixed else checks * len(elements)
        found = [
            check(f"{name}[{k}]", each)
            for k, (check, each) in enumerate(zip(all_checks, elements, strict=True))
        ]
        return tuple(found) if origin is tuple else found

    return several


def _name(name: str, value: Any) -> Any:
    """Reject values that are neither text nor number, and invalid text."""
    if isinstance(value, str):
        return _text(name, value)
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        return whole_number(name, value)
    return number(name, value)


def _anything(name: str, value: Any) -> Any:
    return value


def _instance(*kinds: type) -> Check:
    what = " or ".join(kind.__name__ for kind in kinds)

    def instance(name: str, value: Any) -> Any:
        if not isinstance(value, kinds):
            raise _refused(name, value, f"a {what}")
        return value

    return instance


def _one_of(choices: tuple[Any, ...]) -> Check:
    def one_of_them(name: str, value: Any) -> Any:
        one_of(name, value, choices)
        return value

    return one_of_them


def _text(name: str, value: Any) -> str:
    if isinstance(value, str):
        try:
            value.encode()
        except UnicodeEncodeError:
            pass
        else:
            return value
    raise _refused(name, value, "a text")


def _array(name: str, value: Any) -> Any:
    """Reject other values than real numbers, and arrays with masked elements."""
    if value is None:
        raise _refused(name, value, "an array of numbers")
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError, RecursionError):
        raise _refused(name, value, "an array of numbers") from None
    if array.dtype.kind == "O":
        try:
            value = array = array.astype(float)
        except (TypeError, ValueError, OverflowError):
            raise _refused(name, value, "an array of numbers") from None
    if array.dtype.kind not in "biuf":
        raise _refused(name, value, "an array of numbers")
    if is_masked(value):
        raise InputError(phrase("argument.masked", name=name))
    return value


def _array_or(*kinds: type) -> Check:
    """Return a check of an array or an instance of the given classes."""
    return lambda name, value: value if isinstance(value, kinds) else _array(name, value)


def _numpy(kind: type[np.generic]) -> Check:
    """Return a check that converts to an array of floats, integers or truth values."""
    needed, what = {
        "f": ("biuf", "numbers"),
        "i": ("iu", "whole numbers"),
        "b": ("b", "truth values"),
    }[np.dtype(kind).kind]

    def converted(name: str, value: Any) -> Any:
        array = np.asarray(_array(name, value))
        if array.size and array.dtype.kind not in needed:
            raise _refused(name, value, f"an array of {what}")
        if kind is np.int64 and array.dtype.kind == "u" and array.size and array.max() >= 2**63:
            raise _refused(name, value, "an array of whole numbers of 64 bits")
        return array.astype(kind, copy=False)

    return converted


def _refused(name: str, value: object, what: str) -> InputError:
    return InputError(phrase("argument.other", name=name, what=what, value=shown(value)))
