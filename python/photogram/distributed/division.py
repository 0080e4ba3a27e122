"""How a block is divided: into parts, among workers, within memory."""

from __future__ import annotations

import re
from os import PathLike
from typing import Any

from photogram.arguments.annotations import path
from photogram.arguments.arrays import shown, whole_number
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

__all__ = ["Division", "bytes_of"]

MOST = 100_000  # Workers or parts: more is a slip
MOST_BYTES = 2**63
UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "t": 10**12, "ki": 2**10, "mi": 2**20, "gi": 2**30}


def bytes_of(memory: int | str) -> int:
    """Return a number of bytes: of `4GB` (10^9), `1.5GiB` (2^30), or a number."""
    size: float
    if isinstance(memory, str):
        match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([kmgt]?i?)b?\s*", memory.lower(), re.ASCII)
        if match is None or match[2] not in UNITS:
            raise InputError(phrase("parts.memory", value=shown(memory)))
        size = float(match[1]) * UNITS[match[2]]
    else:
        size = whole_number("memory", memory)
    if not 1 <= size < MOST_BYTES:
        raise InputError(phrase("parts.memory-range", value=shown(memory)))
    return int(size)


@dataclass(frozen=True, kw_only=True)
class Division:
    """How a block is divided, for :func:`photogram.adjust_in_parts` and the plan of it.

    Attributes
    ----------
    parts
        How many; as many as `memory` and the workers ask for when None. Without a cluster they are worked off
        one after the other in this process.
    cluster
        Where: a `dask.distributed.Client`, the address of a scheduler, or `local` for workers on this
        machine.
    workers
        Of a local cluster: how many; one for each processor when None.
    memory
        Bytes that a worker, or this process, may take for parts, or text such as `4GB`. A block that fits as
        a whole is adjusted as a whole, where neither a cluster nor a number of parts is given.
    folder
        Where parts and states are kept, on a disk that all workers see; a run that died is taken up there.
        None: a temporary folder.

    Raises
    ------
    InputError
        Parts or workers that are not 1 to 100,000, a memory or a folder that is none.
    """

    parts: int | None = None
    cluster: Any = None
    workers: int | None = None
    memory: int | str | None = None
    folder: str | PathLike[str] | None = None

    def __post_init__(self) -> None:
        for name in ("parts", "workers"):
            given = getattr(self, name)
            if given is not None and not 1 <= whole_number(name, given) <= MOST:
                raise InputError(phrase("parts.range", name=name, most=MOST, value=shown(given)))
        if self.memory is not None:
            bytes_of(self.memory)
        if self.folder is not None:
            path("folder", self.folder)

    @property
    def memory_bytes(self) -> int | None:
        """The memory in bytes; None where nothing bounds it."""
        return None if self.memory is None else bytes_of(self.memory)

    def parts_of(self, photos: int) -> int | None:
        """Return the number of parts that is asked for; None where none is.

        Raises
        ------
        InputError
            There are fewer photos.
        """
        if self.parts is not None and self.parts > photos:
            raise InputError(phrase("parts.too-many", parts=self.parts, photos=photos))
        return self.parts
