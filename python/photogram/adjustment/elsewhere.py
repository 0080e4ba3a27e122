"""Adjustments that are not done in this process as a whole: on a cluster, or in parts, one after the other.

This floor knows nothing of either. `photogram.distributed.entrance`, a file above, says how; whoever asks for
`photogram.adjust` has loaded it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from photogram.network.block import Block
    from photogram.network.core import CoreOptions
    from photogram.results.result import Result

__all__ = ["IN_PARTS", "Division", "InParts"]


@dataclass(frozen=True)
class Division:
    """How a block is divided: the arguments of :func:`photogram.adjust` of the same names."""

    cluster: Any = None
    workers: int | None = None
    parts: int | None = None
    memory: int | str | None = None
    folder: str | PathLike[str] | None = None

    @property
    def is_asked_for(self) -> bool:
        """Whether anything of it is given."""
        return any(each is not None for each in vars(self).values())


InParts = Callable[
    ["Block", "CoreOptions", Division, int | None, Callable[[Any], None] | None], "Result | None"
]
"""Adjusts a block that is ready to be; None where it fits into this process as a whole."""

IN_PARTS: list[InParts] = []
"""The one that does it, once it is loaded."""
