"""Adjustments that are not done in this process as a whole: on a cluster, or in parts, one after the other.

This floor knows nothing of either. `photogram.distributed.entrance`, a file above, says how: it is loaded
when such an adjustment is asked for, by whichever name `adjust` was imported.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from os import PathLike
from typing import TYPE_CHECKING, Any

from photogram.arguments.annotations import path
from photogram.arguments.arrays import shown, whole_number
from photogram.errors import InputError

if TYPE_CHECKING:
    from photogram.network.block import Block
    from photogram.network.core import CoreOptions
    from photogram.results.result import Result

__all__ = ["Division", "InParts", "in_parts"]

MOST = 100_000
"""Workers or parts: more is a slip."""


@dataclass(frozen=True)
class Division:
    """How a block is divided: the arguments of :func:`photogram.adjust` of the same names."""

    cluster: Any = None
    workers: int | None = None
    parts: int | None = None
    memory: int | str | None = None
    folder: str | PathLike[str] | None = None

    def __post_init__(self) -> None:
        for name in ("workers", "parts"):
            given = getattr(self, name)
            if given is not None and not 1 <= whole_number(name, given) <= MOST:
                raise InputError(f"{name} must be 1 to {MOST}, not {shown(given)}")
        if self.folder is not None:
            path("folder", self.folder)

    def parts_of(self, photos: int) -> int | None:
        """Return the number of parts that is asked for; None where none is.

        Raises
        ------
        InputError
            There are fewer photos.
        """
        if self.parts is not None and self.parts > photos:
            raise InputError(f"{self.parts} parts of {photos} photos: a part needs a photo, better twenty")
        return self.parts

    @property
    def is_asked_for(self) -> bool:
        """Whether anything of it is given."""
        return any(each is not None for each in vars(self).values())


InParts = Callable[
    ["Block", "CoreOptions", Division, int | None, Callable[[Any], None] | None], "Result | None"
]
"""Adjusts a block that is ready to be; None where it fits into this process as a whole."""


def in_parts() -> InParts:
    """Return the one that does it."""
    found: InParts = import_module("photogram.distributed.entrance").adjusted_in_parts
    return found
