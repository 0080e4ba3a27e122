"""Walks over the tree of a partitioned block: up to form and eliminate, down to solve and invert.

Sums are added in the order of the node numbers, independent of the order of arrival.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
from typing import Any

import numpy as np

from photogram.adjustment.adjustment import Progress
from photogram.arguments.types import Floats
from photogram.distributed.cut import Tree
from photogram.distributed.executors import Executor, Handle
from photogram.distributed.tasks import (
    Formed,
    InDatum,
    Job,
    Lost,
    Point,
    about,
    formed,
    inverted,
    lost,
    state_path,
)
from photogram.errors import AdjustmentError, PhotogramError
from photogram.lazy_dataclasses import dataclass
from photogram.results.parts import Iteration
from photogram.words import phrase

ATTEMPTS = 20  # Maximum number of formations of a node after losses of workers


@dataclass
class Up:
    """Formed normal equations: contributions of all nodes, and sums."""

    at: Point
    contributions: dict[int, Handle]
    sum_of_squares: float
    decrease: float
    products: Floats | None  # B^T Q B, if the block was transformed to a datum


class LostFactorError(PhotogramError):
    def __init__(self, number: int) -> None:
        super().__init__(f"the factor of node {number} is lost")
        self.number = number


class Walks:
    """Walks over the nodes of a tree; `job` is passed to tasks, `progress` is called."""

    def __init__(
        self,
        job: Job,
        tree: Tree,
        executor: Executor,
        progress: Callable[[Progress], None] | None = None,
    ) -> None:
        self.job, self.tree, self.executor = job, tree, executor
        self._progress = progress
        # Neighbours share a worker to reduce traffic. Later, nodes remain with their workers.
        places, parts = executor.places(), int(tree.spans[:, 1].max())
        self._places = [places[first * len(places) // parts] for first in tree.spans[:, 0].tolist()]
        self.nodes = range(len(tree))
        # Deep nodes first, because the longest chains depend on them.
        self._costs = tree.levels.tolist()

    def all(self, function: Callable[..., Any], *given: Any, phase: str) -> list[Any]:
        """Run a task for each node and return the results."""
        return self.sums([self.do(function, node, *given) for node in self.nodes], phase)

    def climb(self, function: Callable[..., Any], *given: Any) -> dict[int, Handle]:
        """Run a task for every node, children first; it receives the results of the children."""
        handles: dict[int, Handle] = {}
        for node in self.nodes:
            below = [handles[child] for child in self.tree.children[node]]
            handles[node] = self.do(function, node, *given, below)
        return handles

    def up(self, at: Point) -> Up:
        """Form all nodes, children before parents."""
        handles = self.climb(formed, at)
        told = [self.executor.submit(about, handles[node]) for node in self.nodes]
        try:
            found: list[Formed] = self.sums(told, "form")
        except BaseException:
            self.executor.forget([*told, *handles.values()])
            raise
        self._places = [each.place for each in found]
        products = [each.products for each in found if each.products is not None]
        return Up(
            at,
            handles,
            sum(each.sum_of_squares for each in found),
            sum(each.decrease for each in found),
            np.sum(products, axis=0) if products else None,  # in the order of the nodes
        )

    def substitute(self, up: Up, task: Callable[[int, Floats], Handle]) -> None:
        """Run a task for every node that uses outer unknowns and returns those for its children."""
        wanted: dict[int, Floats] = {self.tree.root: np.zeros(0)}

        def then(node: int, handle: Handle) -> None:
            wanted.update(zip(self.tree.children[node], self.found(handle), strict=True))
            self.executor.forget([handle])

        self._down(up, lambda node: task(node, wanted[node]), then, "solve")

    def invert(self, up: Up, after: str, variance: float | None, datum: InDatum | None) -> None:
        """Invert from the root down; every node writes its results.

        The results of a node and the contributions of its children remain until all descendants are finished.
        They are needed again if a worker is lost.
        """
        done: dict[int, Handle] = {}
        left = [1 + sum(1 for other in self.nodes if node in self.tree.above(other)) for node in self.nodes]

        def task(node: int) -> Handle:
            parent = int(self.tree.parents[node])
            place = 0 if parent < 0 else self.tree.children[parent].index(node)
            above = None if parent < 0 else done[parent]
            return self.do(inverted, node, up.at, after, variance, above, place, datum)

        def then(node: int, handle: Handle) -> None:
            # Cofactors remain with the workers; this only tests whether they exist.
            self.found(self.executor.submit(lost, handle))
            if node in done:
                self.executor.forget([done[node]])
            else:
                for each in (node, *self.tree.above(node)):
                    left[each] -= 1
                    if not left[each] and each != node:
                        below = [up.contributions[child] for child in self.tree.children[each]]
                        self.executor.forget([done[each], *below])
            done[node] = handle
            if not self.tree.children[node]:
                self.executor.forget([handle])

        self._down(up, task, then, "invert")

    def _down(
        self, up: Up, task: Callable[[int], Handle], then: Callable[[int, Handle], None], phase: str
    ) -> None:
        """Run a task for every node, parents before children.

        A node whose factor was lost is formed again from the contributions of its children. If the result of
        a parent is also lost, Dask cannot recompute it without that factor. The parent is then processed
        first, and dependent nodes after it.
        """
        parents = self.tree.parents.tolist()
        waiting: dict[Handle, tuple[int, int]] = {}

        def form_again(node: int) -> Handle:
            below = [up.contributions[child] for child in self.tree.children[node]]
            old = up.contributions[node]
            up.contributions[node] = self.do(formed, node, up.at, below)
            self.executor.forget([old])
            return self.executor.submit(about, up.contributions[node])

        reforming = Reforming(form_again, self._places)
        rounds = [0] * (len(self.tree) + 1)
        again: dict[int, list[int]] = {}
        failures = 0

        def begin(node: int) -> None:
            waiting[task(node)] = node, rounds[parents[node]]

        begin(self.tree.root)
        while waiting or reforming.handles:
            handle = self.executor.first([*waiting, *reforming.handles])
            if handle in reforming.handles:
                node = reforming.handles.pop(handle)
                self._places[node] = self.executor.value(handle).place
                begin(node)
                continue
            node, since = waiting.pop(handle)
            parent = parents[node]
            reforming.over(node)
            try:
                then(node, handle)
            except LostFactorError as missed:
                failures += 1
                if failures > ATTEMPTS * len(self.tree):
                    raise AdjustmentError(phrase("parts.workers-lost")) from None
                if missed.number == node:
                    reforming.begin(node)
                elif parent in again:
                    again[parent].append(node)
                elif rounds[parent] > since:
                    begin(node)
                else:
                    again[parent] = [node]
                    begin(parent)
                continue
            rounds[node] += 1
            if rounds[node] == 1:
                self.tell(phase, sum(map(bool, rounds)), len(self.tree))
            for each in again.pop(node, []) if rounds[node] > 1 else self.tree.children[node]:
                begin(each)

    def do(self, function: Callable[..., Any], node: int, *given: Any) -> Handle:
        """Submit a task for a node to its last worker."""
        near, cost = self._places[node], self._costs[node]
        return self.executor.submit(function, self.job, node, *given, near=near, cost=cost)

    def found(self, handle: Handle) -> Any:
        """Return the result of a task that needs a factor; LostFactorError if it is lost."""
        found = self.executor.value(handle)
        if isinstance(found, Lost):
            raise LostFactorError(found.number)
        return found

    def sums(self, handles: list[Handle], phase: str) -> list[Any]:
        """Return the results of tasks of all nodes, in the order of the nodes."""
        waiting = dict(zip(handles, self.nodes, strict=True))
        found: dict[int, Any] = {}
        while waiting:
            handle = self.executor.first(waiting)
            found[waiting.pop(handle)] = self.executor.value(handle)
            self.tell(phase, len(found), len(handles))
        self.executor.forget(handles)
        return [found[node] for node in self.nodes]

    def forget(self, up: Up) -> None:
        self.executor.forget(list(up.contributions.values()))

    def remove(self, state: str) -> None:
        for node in self.nodes:
            state_path(self.job.folder, node, state).unlink(missing_ok=True)

    def tell(self, phase: str, done: int, total: int, iteration: Iteration | None = None) -> None:
        if self._progress is not None:
            self._progress(Progress(phase, done, total, iteration))


class Reforming:
    """Repeated formation of nodes, one at a time per worker.

    A worker removes a waiting factor first if it needs memory, so that the next node is formed only after the
    task. `form` has a node formed and returns the handle of its completion; `places` are the workers of the
    nodes.
    """

    def __init__(self, form: Callable[[int], Handle], places: list[str]) -> None:
        self._form, self._places = form, places
        self._queues: defaultdict[str, deque[int]] = defaultdict(deque)
        self._busy: dict[int, str] = {}
        self.handles: dict[Handle, int] = {}

    def begin(self, node: int) -> None:
        """Form a node, immediately if its worker is not forming another one."""
        place = self._places[node]
        if place in self._busy.values():
            self._queues[place].append(node)
        else:
            self._start(node, place)

    def over(self, node: int) -> None:
        """Form the next node after the task of a reformed node is finished."""
        place = self._busy.pop(node, None)
        if place is not None and self._queues[place]:
            self._start(self._queues[place].popleft(), place)

    def _start(self, node: int, place: str) -> None:
        self._busy[node] = place
        self.handles[self._form(node)] = node
