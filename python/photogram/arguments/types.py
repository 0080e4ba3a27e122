"""Array types for annotations, and types of dataclass fields that convert their arguments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Defaults of fields that convert their arguments
NONE: Any = None
FREE: Any = np.inf
ZERO: Any = 0.0
ONE: Any = 1.0
ALL: Any = True

if TYPE_CHECKING:
    _Given = TypeVar("_Given", contravariant=True)
    _Stored = TypeVar("_Stored", covariant=True)

    class Converted(Generic[_Given, _Stored]):
        """Field whose argument has another type than the attribute, as type checkers see it."""

        def __get__(self, owner: object, kind: type | None = None) -> _Stored:
            raise NotImplementedError

        def __set__(self, owner: object, value: _Given) -> None: ...

    Array = Converted[ArrayLike, Floats]
    OptionalArray = Converted[ArrayLike | None, Floats | None]
    IndexArray = Converted[ArrayLike, Indices]
    BoolArray = Converted[ArrayLike, Bools]
    NamedIndices = Converted[ArrayLike | Sequence[str] | None, Indices | None]
    Names = Converted[Iterable[str | int] | None, list[str]]
    Identifiers = Converted[Iterable[object], Sequence[str]]
else:
    Array, OptionalArray, Names, BoolArray = Floats, Floats | None, list[str], Bools
    IndexArray, NamedIndices, Identifiers = Indices, Indices | None, Sequence[str]
