"""Validation of array arguments: numbers of a given shape, indices and names.

Invalid values raise an :class:`~photogram.errors.InputError` with the name of the argument and its value.

An argument is copied once into a read-only array, so that later changes of the caller's array do not affect
it. A read-only array that owns its data is shared.
"""

from __future__ import annotations

import math
import random
import re
import sys
from collections.abc import Callable, Iterable, Sequence, Set
from dataclasses import fields
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.arguments.objects import argument_error as argument_error
from photogram.arguments.objects import value_field as value_field
from photogram.errors import InputError
from photogram.words import Phrase, phrase

LARGEST_SD = math.sqrt(sys.float_info.max)  # Larger standard deviations have an infinite variance
_SYMMETRIC = 1e-9  # Largest asymmetry of a covariance matrix, relative to its diagonal
_ROUNDING = 1e-6  # Tolerance for correlations that were written with all digits and read again

_Kind = TypeVar("_Kind")
_Key = TypeVar("_Key")
_Scalar = TypeVar("_Scalar", bound=np.generic)

RULES: dict[str, Callable[[Any], Any]] = {
    "number": lambda values: ~np.isnan(values),
    "finite": np.isfinite,
    "positive": lambda values: (values > 0) & np.isfinite(values),
    "not-negative": lambda values: (values >= 0) & np.isfinite(values),
    "not-zero": lambda values: (values != 0) & np.isfinite(values),
    "sd": lambda values: values >= 0,  # Infinite if free
    "check-sd": lambda values: np.isnan(values) | ((values >= 0) & ~np.isinf(values)),
    "not-infinite": lambda values: ~np.isinf(values),
    # Larger angles, in radians, do not have the digits that an attitude needs.
    "angle": lambda values: np.isnan(values) | (np.abs(values) <= 1e6),
}
"""Rules of numbers: functions that return which values are valid."""


def shaped(
    name: str,
    value: ArrayLike,
    shape: tuple[int | None, ...],
    rule: str = "",
    *,
    missing: bool = False,
    one_row: bool = False,
) -> NDArray[np.float64]:
    """Return a read-only array of the given shape, with values of one of the `RULES`.

    A first size of None is any number of rows; otherwise a single number is broadcast, and with `one_row`
    also a single row. Words, truth values and complex numbers are rejected, even if NumPy would convert them.
    If `missing` is True, NaN is valid, and masked values become NaN.
    """
    array = numbers(name, value, missing=missing)
    wanted: Any = array.shape[:1] + shape[1:] if shape[:1] == (None,) else shape
    if array.shape != wanted:
        if None not in shape and (array.ndim == 0 or (one_row and array.shape == shape[1:])):
            array = np.full(wanted, array)
            array.flags.writeable = False
        else:
            raise argument_error(name, "shape", shape=str(shape).replace("None", "n"), actual=array.shape)
    if rule and not (good := RULES[rule](array)).all():
        wrong = np.argwhere(~(good | (missing & np.isnan(array)))).tolist()
        if wrong:
            where = f"{name}[{', '.join(map(str, wrong[0]))}]" if wrong[0] else name
            raise _rule_error(where, rule, float(array[tuple(wrong[0])]))
    return frozen(array)


def _rule_error(name: str, rule: str, value: float) -> InputError:
    return argument_error(name, "not-negative" if rule == "sd" else rule, value=value)


def numbers(name: str, value: ArrayLike, *, missing: bool = False) -> NDArray[np.float64]:
    """Return an array of numbers of any shape, possibly the caller's array."""
    array = _array(name, value, "numbers")
    kind = array.dtype.kind
    if kind not in "fiuO" or (kind == "O" and not all(map(_is_real, array.flat))):
        raise _no_array(name, "numbers", array.tolist() if kind == "O" else value)
    try:
        with np.errstate(over="ignore"):  # Infinite values are left to the caller
            found: NDArray[np.float64] = array.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError):
        raise _no_array(name, "numbers", value) from None
    if (mask := _mask(value)) is not None:
        if not missing:
            raise argument_error(name, "masked")
        found = np.where(mask, math.nan, found)
    return found


def of_kind(name: str, value: ArrayLike, kinds: str, of: str) -> NDArray[Any]:
    """Return an array of integers (`iu`) or truth values (`b`), possibly the caller's array."""
    array = _array(name, value, of)
    if array.size and array.dtype.kind not in kinds:
        raise _no_array(name, of, value)
    if _mask(value) is not None:
        raise argument_error(name, "masked")
    if array.size and array.dtype.kind == "u" and array.max() >= 2**63:
        raise _no_array(name, "whole numbers of 64 bits", value)
    return array.astype(np.bool_ if kinds == "b" else np.int64, copy=False)


def _array(name: str, value: ArrayLike, of: str) -> NDArray[Any]:
    """Convert an argument to a NumPy array of any type."""
    try:
        if value is not None:
            return np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        pass
    raise _no_array(name, of, value)


def _no_array(name: str, of: str, value: object) -> InputError:
    if isinstance(value, np.ndarray) and value.ndim:
        value = phrase("error.object", type=f"array of {value.dtype}")
    part = _wrong_part(name, value, 3) if of == "numbers" and isinstance(value, list | tuple) else None
    return part or argument_error(name, "array", of=of, value=value)


def _wrong_part(name: str, value: Any, depth: int) -> InputError | None:
    """Return the error of the first element that is no number, or of the first row of another size."""
    if not isinstance(value, list | tuple) or not depth:
        return None if _is_real(value) else argument_error(name, "number", value=value)
    sizes = [len(row) if isinstance(row, list | tuple) else None for row in value]
    usual = max(sizes, key=sizes.count, default=None)
    for place, (row, size) in enumerate(zip(value, sizes, strict=True)):
        code = "list" if size is None else "number" if usual is None else "count"
        if size != usual:
            return argument_error(f"{name}[{place}]", code, value=row, count=usual, actual=size)
        if wrong := _wrong_part(f"{name}[{place}]", row, depth - 1):
            return wrong
    return None


def elements(
    name: str, value: object, kind: type[_Kind] | None = None, count: int | None = None
) -> tuple[_Kind, ...]:
    """Return the elements of a sequence, possibly of a required class and number."""
    if isinstance(value, str | bytes | Set) or not isinstance(value, Iterable):
        raise argument_error(name, "list", value=value)
    found = tuple(np.atleast_1d(value).tolist() if isinstance(value, np.ndarray) else value)
    if count is not None and len(found) != count:
        raise argument_error(name, "count", count=count, actual=len(found))
    for row, each in enumerate(() if kind is None else found):
        if kind is not None and not isinstance(each, kind):
            raise argument_error(f"{name}[{row}]", "kind", kind=kind.__name__, value=each)
    return found


def _is_real(value: object) -> bool:
    """Return whether a value is a real number, or None, a missing value (NaN)."""
    return value is None or (isinstance(value, Real) and not isinstance(value, bool))


def _mask(value: object) -> NDArray[np.bool_] | None:
    """Return the mask of an array with masked elements; numpy.ma, which is slow to import, is not needed."""
    mask = getattr(value, "mask", None)
    return np.asarray(mask) if isinstance(mask, np.ndarray | np.bool_) and np.any(mask) else None


def frozen(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    """Return a contiguous read-only array: the array itself or a copy."""
    flags = array.flags
    if not (flags.owndata and flags.c_contiguous and not flags.writeable):
        array = np.array(array, order="C", subok=False)
        array.flags.writeable = False
    return array


def freeze_fields(owner: Any) -> None:
    """Make the array fields of a dataclass read-only."""
    for each in fields(owner):
        value = getattr(owner, each.name)
        if isinstance(value, np.ndarray):
            value.flags.writeable = False


def repeated_pairs(first: NDArray[np.int64], second: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return rows whose pair of indices repeats an earlier row; `second` < `count`."""
    pairs = np.asarray(first, dtype=np.int64) * max(count, 1)
    pairs += second
    if (pairs[1:] > pairs[:-1]).all():  # Sorted, as in most blocks
        return np.zeros(0, dtype=np.int64)
    ordered = np.sort(pairs, kind="stable")  # Fast for observations that are sorted by photo
    if (ordered[1:] != ordered[:-1]).all():
        return np.zeros(0, dtype=np.int64)
    return np.setdiff1d(np.arange(len(pairs)), np.unique(pairs, return_index=True)[1])


def rows_of_each(values: NDArray[np.integer[Any]], count: int) -> list[NDArray[np.int64]]:
    """Return the rows of each integer below `count` in an array of values."""
    order = np.argsort(values, kind="stable")
    return np.split(order, np.searchsorted(values[order], np.arange(1, count)))


def length(name: str, value: ArrayLike) -> int:
    """Return the number of rows of an array; reject a single value."""
    array = _array(name, value, "values")
    if array.ndim == 0:
        raise _no_array(name, "values", value)
    return len(array)


def indices(name: str, value: ArrayLike, length: int, count: int) -> NDArray[np.int64]:
    """Return a read-only array of `length` integers from 0 to `count` - 1."""
    array = of_kind(name, value, "iu", f"{length} whole numbers")
    if array.shape != (length,):
        raise argument_error(name, "shape", shape=(length,), actual=array.shape)
    bad = np.flatnonzero((array < 0) | (array >= count))
    if bad.size:
        row = int(bad[0])
        raise argument_error(f"{name}[{row}]", "whole-range", low=0, high=count - 1, value=int(array[row]))
    return frozen(array)


def names(name: str, values: Iterable[object]) -> list[str]:
    """Return names as strings; integers are valid names.

    Tables contain None or NaN for a missing name. A column of integers with a missing value has become
    floats, and 1.0 is not the name 1.
    """
    no_row = isinstance(values, np.ndarray) and values.ndim != 1
    if no_row or isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise argument_error(name, "kind", kind="a list of names", value=values)
    found: list[Any] = values.tolist() if isinstance(values, np.ndarray) else list(values)
    if {str} != set(map(type, found)):
        found = [_name(f"{name}[{row}]", value) for row, value in enumerate(found)]
    if not ("".join(found).isprintable() and all(map(str.strip, found))):
        for row, each in enumerate(found):
            if not text(f"{name}[{row}]", each).strip():
                raise argument_error(f"{name}[{row}]", "no-name", value=each)
    return found


def _name(name: str, value: object) -> str:
    if isinstance(value, str) or (isinstance(value, Integral) and not isinstance(value, bool)):
        return str(value)
    is_missing = value is None or (isinstance(value, Real) and value != value)
    raise argument_error(name, "no-name" if is_missing else "name", value=value)


def text(name: str, value: object) -> str:
    """Return a line of printable text; line ends and lone surrogates are rejected."""
    if not isinstance(value, str) or not value.isprintable():
        code = "unprintable" if isinstance(value, str) else "text"
        raise argument_error(name, code, value=value)
    return value


def number(name: str, value: object, rule: str = "") -> float:
    """Return a number, possibly infinite or NaN if it has no rule."""
    if type(value) is float:  # Nearly all values; ten times faster than the check for a type of number
        converted = value
    else:
        try:
            converted = float(value if _is_real(value) else None)  # type: ignore[arg-type]
        except (TypeError, OverflowError):
            raise argument_error(name, "number", value=value) from None
    # Positive finite numbers follow every rule.
    if rule and not 0 < converted < math.inf and not RULES[rule](converted):
        raise _rule_error(name, rule, converted)
    return converted


def whole_number(name: str, value: object) -> int:
    """Return an integer of 64 bits."""
    if not isinstance(value, Integral) or isinstance(value, bool) or not -(2**63) <= int(value) < 2**63:
        raise argument_error(name, "kind", kind="an integer of 64 bits", value=value)
    return int(value)


def truth_value(name: str, value: object) -> bool:
    """Return True or False."""
    if not isinstance(value, bool | np.bool_):
        raise argument_error(name, "flag", value=value)
    return bool(value)


def one_of(name: str, value: object, choices: Sequence[str]) -> str:
    """Return one of some words."""
    if not (isinstance(value, str) and value in choices):
        raise argument_error(name, "choice", names=list(choices), value=value)
    return value


def object_name(name: str, value: object) -> str:
    return names(name, [value])[0]


def probability(name: str, value: object) -> float:
    """Return a probability between 0 and 1; reject other numbers."""
    checked = number(name, value)
    if not 0 < checked < 1:
        raise argument_error(name, "range", low=0, high=1, value=checked)
    return checked


def is_covariance(matrices: NDArray[np.float64], *, singular: bool = False) -> NDArray[np.bool_]:
    """Return which (..., k, k) matrices are symmetric and positive definite.

    A singular one may have rows of zeros, and the others may be indefinite by rounding.
    """
    variances = np.diagonal(matrices, axis1=-2, axis2=-1)
    known = variances > 0
    good = np.isfinite(matrices).all(axis=(-2, -1)) & (singular | known.all(axis=-1))
    good &= (known[..., np.newaxis] | (matrices == 0)).all(axis=(-2, -1))
    deviations = np.sqrt(np.where(known, variances, 1.0))
    with np.errstate(over="ignore", invalid="ignore"):
        correlations = matrices / deviations[..., np.newaxis, :] / deviations[..., np.newaxis]
        asymmetry = np.abs(correlations - np.swapaxes(correlations, -1, -2)).max(axis=(-2, -1), initial=0.0)
    # A correlation that is not finite fails this comparison.
    good &= asymmetry <= (_ROUNDING if singular else _SYMMETRIC)
    correlations = np.where(good[..., np.newaxis, np.newaxis], correlations, np.eye(variances.shape[-1]))
    smallest = np.linalg.eigvalsh(correlations).min(axis=-1, initial=1.0)
    return np.asarray(good & (smallest > (-_ROUNDING if singular else 0.0)))


def matrix_fault(matrix: NDArray[np.float64], *, singular: bool = False) -> Phrase | None:
    """Return the fault of a (k, k) matrix, with its first wrong elements; None for a covariance matrix."""
    if is_covariance(matrix, singular=singular):
        return None
    with np.errstate(all="ignore"):
        variances = np.diagonal(matrix)
        limits = np.sqrt(np.abs(np.outer(variances, variances)))
        wrong = (matrix != matrix.T) & ~(np.abs(matrix - matrix.T) <= _ROUNDING * limits)
        wrong |= ~(np.abs(matrix) <= (1 + _ROUNDING) * limits) | np.diag(variances < 0)
    reason: list[Phrase] = []
    if wrong.any():
        i, j = np.argwhere(wrong)[0].tolist()
        values = matrix[[i, j], [j, i]].tolist() if i != j else [float(matrix[i, i])]
        reason = [phrase("error.elements", n=len(values), row=i, column=j, values=values)]
    return phrase("error.covariance-singular" if singular else "error.covariance", reason=reason)


def chosen(which: NDArray[np.bool_]) -> NDArray[np.bool_] | slice:
    """Return an index of the chosen rows: a slice, without copy, for all."""
    return slice(None) if which.all() else which


def sampled(rows: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """Return at most so many rows, in order.

    Rows are random but reproducible, because every n-th row of a regular network would form patterns.
    """
    if len(rows) <= most:
        return rows
    # Not `numpy.random`, whose import takes far longer than the selection.
    keys = np.frombuffer(random.Random(0).randbytes(8 * len(rows)), "<u8")
    return rows[np.sort(np.argpartition(keys, most)[:most])]


def by_occurrence(numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the distinct ones of (m,) numbers from 0, in the order of their first occurrence."""
    first = np.full(numbers.max(initial=-1) + 1, len(numbers))
    first[numbers[::-1]] = np.arange(len(numbers))[::-1]
    return np.argsort(first)[: np.count_nonzero(first < len(numbers))]


def by_key(pairs: Iterable[tuple[_Key, _Kind]]) -> dict[_Key, list[_Kind]]:
    """Return the values of each key, with the keys in the order of their first occurrence."""
    groups: dict[_Key, list[_Kind]] = {}
    for key, value in pairs:
        groups.setdefault(key, []).append(value)
    return groups


def bounds(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (2, k) least and largest values of (m, k) places; faster column by column."""
    return np.array([[column.min() for column in places.T], [column.max() for column in places.T]])


def finite_rows(pairs: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which of (m, 2) rows are finite; faster column by column."""
    found: NDArray[np.bool_] = np.isfinite(pairs[:, 0]) & np.isfinite(pairs[:, 1])
    return found


def standard_deviations(covariances: NDArray[np.float64], scale: float = 1.0) -> NDArray[np.float64]:
    """Return the standard deviations (n, k) of covariance matrices (n, k, k) times a scale.

    NaN for a negative variance, which a nearly singular network has by rounding.
    """
    with np.errstate(invalid="ignore"):
        deviations: NDArray[np.float64] = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2) * scale)
    return deviations


_DIGITS = re.compile("([0-9]+)")


def natural_order(name: str) -> list[tuple[int, str]]:
    """Return the key for natural sorting of names: digits sort as numbers."""
    parts = _DIGITS.split(name)
    return [(int(part), "") if place % 2 else (-1, part) for place, part in enumerate(parts)]
