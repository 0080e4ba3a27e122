"""Arguments of public functions, checked against their annotations: a wrong one is an error that names it.

An argument of a wrong kind would otherwise fail somewhere inside, as whatever Python or NumPy makes of it.

Packages that check annotations would do less here: beartype converts nothing (strings to paths, integers of
NumPy to integers), raises errors of its own, and takes NaN, NUL and half a surrogate pair for good values;
pydantic knows no arrays, and brings a compiled core to an install that is light; msgspec knows none either,
names neither the words that may stand nor the nearest key, takes 1e400 for a number, and is imported in more
time than this package.
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
"""Takes the name of an argument and its value; returns the value, converted where it must be, or raises."""
_MARK = "_checks_arguments"  # Attribute of functions that check their arguments
_ARRAYS = {"NDArray": NDArray, "np": np, "Floats": Floats, "Indices": Indices, "Bools": Bools}
"""What arrays are called in annotations, where the names are imported for type checking only."""


def check_arguments(names: dict[str, Any], public: Iterable[str]) -> None:
    """Let the `public` functions and classes among the globals of a module check their arguments.

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
    """Check the values of a class by parameter name as arguments are checked; nothing is converted."""
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
    """Return a path that a string or an object like a path stands for."""
    try:
        text = os.fspath(value)  # type: ignore[call-overload]
    except TypeError:
        raise _refused(name, value, "a path") from None
    if not isinstance(text, str) or not text or "\0" in text:
        raise _refused(name, value, "a path")
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
    """Names of annotations, which are strings: those imported for type checking only are looked for."""

    def __missing__(self, name: str) -> Any:
        modules = [vars(module) for key, module in list(sys.modules.items()) if key.startswith("photogram.")]
        found = {names[name] for names in modules if inspect.isclass(names.get(name))}
        if len(found) != 1:
            raise KeyError(name)
        return found.pop()


def _checks(function: Callable[..., Any], names: dict[str, Any]) -> dict[str, Check]:
    """Return a check for each parameter whose annotation says enough."""
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
    """Return a check of a sequence: of each element, and of their number where the annotation tells it."""
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
        if of_numbers and {*map(type, elements)} == {float}:  # as nearly all are: nothing to convert
            return tuple(elements) if origin is tuple else elements
        all_checks = checks if fixed else checks * len(elements)
        found = [
            check(f"{name}[{k}]", each)
            for k, (check, each) in enumerate(zip(all_checks, elements, strict=True))
        ]
        return tuple(found) if origin is tuple else found

    return several


def _name(name: str, value: Any) -> Any:
    """Reject what cannot be a name: text that is none, and what is neither text nor number."""
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
    """Reject what is no array of real numbers, and arrays with masked ones."""
    if value is None:
        raise _refused(name, value, "an array of numbers")
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise InputError(phrase("argument.array", name=name, of="numbers", reason=str(error))) from None
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
    """Return a check of an array, or of an object of some classes."""
    return lambda name, value: value if isinstance(value, kinds) else _array(name, value)


def _numpy(kind: type[np.generic]) -> Check:
    """Return a check that makes an array of a type: floating-point, whole numbers or truth values."""
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
