"""What a process keeps of its tasks: nodes and factors, as many as its memory holds."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from photogram.memory import give_back, resident_memory


class Shelf:
    """The nodes and factors that a process keeps."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self._kept: OrderedDict[tuple[Any, ...], tuple[Any, float]] = OrderedDict()

    def get(self, key: tuple[Any, ...]) -> Any:
        """Return what is kept under a key; None where nothing is."""
        if key not in self._kept:
            return None
        self._kept.move_to_end(key)
        return self._kept[key][0]

    def put(self, key: tuple[Any, ...], value: object, size: float) -> None:
        """Keep something of so many bytes."""
        self._kept[key] = value, size
        self._kept.move_to_end(key)

    def take(self, key: tuple[Any, ...]) -> Any:
        """Return what is kept under a key, and keep it no longer."""
        return self._kept.pop(key, (None, 0.0))[0]

    def make_room(self, needed: float, memory: int | None, spared: tuple[Any, ...]) -> None:
        """Give up so much that a process which may hold `memory` bytes can take `needed` more.

        What the process holds is asked of the system: messages and what Dask keeps are in it. `spared` are
        run and node that the room is for.
        """
        if memory is None:
            return
        held = resident_memory()
        over = (sum(size for _, size in self._kept.values()) if held is None else held) + needed - memory
        given_up = False
        # Nodes, which are read again, are given up before factors. Of each what was used last goes first:
        # walks over the tree come round, so that it is asked for last.
        others = [key for key in reversed(self._kept) if key[1:3] != spared]
        for key in sorted(others, key=lambda key: key[0] != "node"):
            if over <= 0:
                break
            over -= self._kept.pop(key)[1]
            given_up = True
        if given_up:
            give_back()

    def drop(self, of: Callable[[tuple[Any, ...]], bool]) -> None:
        """Give up what some keys stand for."""
        for key in [key for key in self._kept if of(key)]:
            del self._kept[key]

    def clear(self) -> None:
        """Give up everything."""
        self._kept.clear()

    def clear_unless_used(self) -> None:
        """Give up what an earlier run has left, unless a task is at work here: it needs what it has."""
        if self.lock.acquire(blocking=False):
            try:
                self.clear()
                give_back()
            finally:
                self.lock.release()


shelf = Shelf()  # Of this process. Its lock lets one task work at a time: memory is planned for that
