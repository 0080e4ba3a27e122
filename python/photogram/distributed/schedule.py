"""How long a tree of tasks takes on some workers: list scheduling by counted work and traffic."""

from __future__ import annotations

import heapq

import numpy as np

from photogram.arguments.types import Floats
from photogram.distributed.cut import Tree
from photogram.lazy_dataclasses import dataclass

__all__ = ["Rates", "Times", "scheduled"]


@dataclass(frozen=True)
class Rates:
    """What a worker does in a second.

    Attributes
    ----------
    formation, factor, inverse
        Multiply-adds.
    bandwidth
        Bytes to or from another worker.
    """

    formation: float
    factor: float
    inverse: float
    bandwidth: float


@dataclass(frozen=True)
class Times:
    """Seconds on some workers.

    Attributes
    ----------
    up, down, inversion
        Forming and reducing once; solving once; inverting.
    moved_up, moved_down, moved_inversion
        Bytes that go from one worker to another in these.
    """

    up: float
    down: float
    inversion: float
    moved_up: float
    moved_down: float
    moved_inversion: float

    def whole(self, iterations: int) -> float:
        """Return the seconds of an adjustment with so many formations, and the inversion."""
        return iterations * (self.up + self.down) + self.inversion


def scheduled(
    tree: Tree,
    up: Floats,
    down: Floats,
    inversion: Floats,
    traffic: tuple[Floats, Floats, Floats],
    workers: int,
    bandwidth: float,
) -> Times:
    """Work a tree off.

    A task that is ready goes to the worker that is free first; one with children to that of one of them,
    where it can begin earlier. The way down goes where the factors are. A worker receives one message at a
    time.

    Parameters
    ----------
    tree
        The tree.
    up, down, inversion
        (N,) seconds of each node.
    traffic
        (N,) bytes of each node up, down in a step, down in the inversion.
    workers, bandwidth
        How many, and bytes a second.
    """
    time, moved, placed = _up(tree, up, traffic[0], workers, bandwidth)
    step, step_moved = _down(tree, down, traffic[1], placed, workers, bandwidth)
    invert, invert_moved = _down(tree, inversion, traffic[2], placed, workers, bandwidth)
    return Times(time, step, invert, moved, step_moved, invert_moved)


def _up(
    tree: Tree, seconds: Floats, sizes: Floats, workers: int, bandwidth: float
) -> tuple[float, float, list[int]]:
    remaining = np.zeros(len(tree))
    for node in range(tree.root, -1, -1):
        parent = tree.parents[node]
        remaining[node] = seconds[node] + (remaining[parent] if parent >= 0 else 0.0)
    free = [0.0] * workers
    placed, done, moved = [0] * len(tree), np.zeros(len(tree)), 0.0
    left = [len(children) for children in tree.children]
    ready = [(0.0, -remaining[node], node) for node in range(len(tree)) if not left[node]]
    heapq.heapify(ready)
    while ready:
        since, _, node = heapq.heappop(ready)
        children = tree.children[node]
        choices = sorted({placed[child] for child in children}) or range(workers)
        begins = []
        for each in choices:
            away = sum(float(sizes[child]) for child in children if placed[child] != each)
            begins.append((max(free[each], since) + away / bandwidth, away, each))
        start, away, worker = min(begins)
        moved += away
        free[worker] = done[node] = start + seconds[node]
        placed[node] = worker
        parent = int(tree.parents[node])
        if parent >= 0:
            left[parent] -= 1
            if not left[parent]:
                since = max(done[child] for child in tree.children[parent])
                heapq.heappush(ready, (since, -remaining[parent], parent))
    return float(done[tree.root]), moved, placed


def _down(
    tree: Tree, seconds: Floats, sizes: Floats, placed: list[int], workers: int, bandwidth: float
) -> tuple[float, float]:
    below = np.array(seconds)
    for node in range(len(tree)):
        below[node] += max((below[child] for child in tree.children[node]), default=0.0)
    free, moved, end = [0.0] * workers, 0.0, 0.0
    ready = [(0.0, -float(below[tree.root]), tree.root)]
    while ready:
        since, _, node = heapq.heappop(ready)
        worker, parent = placed[node], int(tree.parents[node])
        away = float(sizes[node]) if parent >= 0 and placed[parent] != worker else 0.0
        moved += away
        free[worker] = max(free[worker], since) + away / bandwidth + seconds[node]
        end = max(end, free[worker])
        for child in tree.children[node]:
            heapq.heappush(ready, (free[worker], -float(below[child]), child))
    return float(end), moved
