"""Nodes whose factors were lost, and are formed again while others are worked on."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable

from photogram.distributed.executors import Handle

__all__ = ["Reforming"]


class Reforming:
    """Nodes that are formed again, one at a time on each worker.

    A factor that waits for its task is the first that a worker gives up for another: the next one is formed
    there when the task is over.

    Parameters
    ----------
    form
        Has a node formed; returns the handle of what tells that it is.
    place
        The worker of a node.
    """

    def __init__(self, form: Callable[[int], Handle], place: Callable[[int], str]) -> None:
        self._form, self._place = form, place
        self._queues: defaultdict[str, deque[int]] = defaultdict(deque)
        self._busy: dict[int, str] = {}
        self.handles: dict[Handle, int] = {}

    def begin(self, node: int) -> None:
        """Have a node formed, at once where its worker forms no other one."""
        place = self._place(node)
        if place in self._busy.values():
            self._queues[place].append(node)
        else:
            self._start(node, place)

    def over(self, node: int) -> None:
        """Have the next one formed where the task of a node, which was formed again perhaps, is over."""
        place = self._busy.pop(node, None)
        if place is not None and self._queues[place]:
            self._start(self._queues[place].popleft(), place)

    def _start(self, node: int, place: str) -> None:
        self._busy[node] = place
        self.handles[self._form(node)] = node
