"""Division of a block into parts, among workers, within memory."""

from __future__ import annotations

import re
from os import PathLike
from typing import Any

from photogram.arguments.fields import check_fields, option
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

MOST = 100_000  # Maximum number of workers or parts; more is a typing error
MOST_BYTES = 2**63
UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "t": 10**12, "ki": 2**10, "mi": 2**20, "gi": 2**30}


def bytes_of(memory: int | str) -> int:
    """Convert a memory size to bytes: `4GB` (10^9), `1.5GiB` (2^30), or a number."""
    from photogram.arguments.arrays import value_field, whole_number

    size: float
    if isinstance(memory, str):
        match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([kmgt]?i?)b?\s*", memory.lower(), re.ASCII)
        if match is None or match[2] not in UNITS:
            raise InputError(phrase("parts.memory", value=value_field(memory)))
        size = float(match[1]) * UNITS[match[2]]
    else:
        size = whole_number("memory", memory)
    if not 1 <= size < MOST_BYTES:
        raise InputError(phrase("parts.memory-range", value=value_field(memory)))
    return int(size)


@dataclass(frozen=True, kw_only=True)
class Division:
    """Division of a block, for :func:`photogram.adjust_in_parts` and its plan.

    Attributes
    ----------
    parts
        Number of parts; None: as required by `memory` and the workers. Without a cluster, the parts are
        processed sequentially in this process.
    cluster
        A `dask.distributed.Client`, the address of a scheduler, or `local` for workers on this machine.
    workers
        Number of workers of a local cluster; None: one per processor.
    memory
        Memory of a worker, or of this process, for parts: bytes, or text such as `4GB`. A block that fits is
        adjusted as a whole, if neither a cluster nor a number of parts is specified.
    folder
        Folder for parts and states, on a disk that all workers can access. An interrupted run is resumed
        there. None: a temporary folder.

    Raises
    ------
    InputError
        If parts or workers are not within 1 to 100,000, or the memory or folder is invalid.
    """

    parts: int | None = option(None, 1, MOST)
    cluster: Any = option(None, kind=str)
    workers: int | None = option(None, 1, MOST)
    memory: int | str | None = option(None, kind=str)
    folder: str | PathLike[str] | None = None

    def __post_init__(self) -> None:
        from photogram.arguments.objects import path_of

        check_fields(self)
        if self.memory is not None:
            bytes_of(self.memory)
        if self.folder is not None:
            path_of("folder", self.folder)

    @property
    def memory_bytes(self) -> int | None:
        """Memory in bytes; None if unlimited."""
        return None if self.memory is None else bytes_of(self.memory)

    def parts_of(self, photos: int) -> int | None:
        """Return the requested number of parts; None if not specified.

        Raises
        ------
        InputError
            If there are fewer photos than parts.
        """
        if self.parts is not None and self.parts > photos:
            raise InputError(phrase("parts.too-many", parts=self.parts, photos=photos))
        return self.parts
