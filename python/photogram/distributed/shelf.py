"""Cache of nodes and factors in a process, limited by its memory."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from photogram.memory import give_back, resident_memory


class Shelf:
    def __init__(self) -> None:
        self.lock = threading.RLock()
        self._kept: OrderedDict[tuple[Any, ...], tuple[Any, float]] = OrderedDict()

    def get(self, key: tuple[Any, ...]) -> Any:
        if key not in self._kept:
            return None
        self._kept.move_to_end(key)
        return self._kept[key][0]

    def put(self, key: tuple[Any, ...], value: object, size: float) -> None:
        self._kept[key] = value, size
        self._kept.move_to_end(key)

    def take(self, key: tuple[Any, ...]) -> Any:
        return self._kept.pop(key, (None, 0.0))[0]

    def make_room(self, needed: float, memory: int | None, spared: tuple[Any, ...]) -> None:
        """Remove objects until `needed` bytes fit into the limit of `memory` bytes.

        The used memory is requested from the system, so that it includes messages and objects of Dask.
        `spared` is the run and node that needs the memory.
        """
        if memory is None:
            return
        held = resident_memory()
        over = (sum(size for _, size in self._kept.values()) if held is None else held) + needed - memory
        given_up = False
        # Nodes can be read again and are removed before factors. The most recently used is removed first,
        # because tree walks are cyclic and need it last.
        others = [key for key in reversed(self._kept) if key[1:3] != spared]
        for key in sorted(others, key=lambda key: key[0] != "node"):
            if over <= 0:
                break
            over -= self._kept.pop(key)[1]
            given_up = True
        if given_up:
            give_back()

    def drop(self, of: Callable[[tuple[Any, ...]], bool]) -> None:
        for key in [key for key in self._kept if of(key)]:
            del self._kept[key]

    def clear(self) -> None:
        self._kept.clear()

    def clear_unless_used(self) -> None:
        """Remove the objects of earlier runs, unless a task is running and needs them."""
        if self.lock.acquire(blocking=False):
            try:
                self.clear()
                give_back()
            finally:
                self.lock.release()


shelf = Shelf()  # Cache of this process; its lock admits one task at a time, as assumed by the memory plan
