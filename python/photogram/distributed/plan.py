"""Plan of a partitioned adjustment: work, memory, traffic and time of the nodes."""

from __future__ import annotations

import heapq
import math
import time
from collections.abc import Mapping, Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.distributed.cut import Tree
from photogram.errors import OutOfMemoryError
from photogram.lazy_dataclasses import dataclass
from photogram.memory import gibibytes
from photogram.show.methods import Documented
from photogram.show.page import Document, Fact, Facts, Section, about
from photogram.show.quantity import Table, column, members
from photogram.words import Phrase, phrase

IMAGE = 200.0  # Multiply-adds of the formation of an image point
BANDWIDTH = 1e9  # Bytes per second between workers: 10 Gbit Ethernet
ITERATIONS = 4  # Formations of an adjustment from typical initial values
MIB = 2.0**20
SHARE = 0.8  # Part of the memory of a worker for nodes; messages use the rest


@dataclass(frozen=True)
class PartsPlan(Documented):
    """Resources of a partitioned adjustment.

    Attributes
    ----------
    tree
        Tree of the nodes.
    predictions
        Prediction of each node: `_photocore.Node.prediction`.
    photos
        Number of photos at home in each node.
    workers
        Number of workers.
    memory
        Bytes of each worker; None if unlimited.
    rates
        Speed of a worker; None if not measured.
    held
        Bytes that a worker uses before the run: Python and libraries.
    """

    tree: Tree
    predictions: Sequence[Mapping[str, float]]
    photos: Sequence[int]
    workers: int
    memory: int | None = None
    rates: Rates | None = None
    held: int = 0

    def of(self, name: str) -> Floats:
        """Return (N,) one prediction of all nodes."""
        return np.array([each[name] for each in self.predictions])

    @property
    def largest(self) -> float:
        """Peak bytes of the largest node."""
        return float(self.of("memory_bytes").max())

    @property
    def room(self) -> float:
        """Bytes of a worker for nodes."""
        return math.inf if self.memory is None else SHARE * self.memory - self.held

    @property
    def bytes_up(self) -> float:
        """Bytes sent from all nodes to their parents per iteration."""
        return float(self.of("contribution_bytes").sum())

    @property
    def bytes_down(self) -> float:
        """Bytes of the steps sent down per iteration."""
        return float(self.of("step_bytes").sum())

    @property
    def bytes_inverted(self) -> float:
        """Bytes of cofactors sent down in the inversion."""
        return float(self.of("cofactor_bytes").sum())

    @property
    def times(self) -> Times | None:
        """Seconds on the workers; None without rates."""
        if self.rates is None:
            return None
        formation = IMAGE * self.of("images") + self.of("reduction")
        up = formation / self.rates.formation + self.of("factor") / self.rates.factor
        inversion = formation / self.rates.formation + self.of("inverse") / self.rates.inverse
        # Substitution needs two multiply-adds per number of the factor, and processes the points again.
        down = self.of("factor_bytes") / 4 / self.rates.factor + IMAGE * self.of("images") / (
            self.rates.formation
        )
        traffic = self.of("contribution_bytes"), self.of("step_bytes"), self.of("cofactor_bytes")
        return scheduled(self.tree, up, down, inversion, traffic, self.workers, self.rates.bandwidth)

    def check(self) -> None:
        """Reject a plan that exceeds the memory of a worker.

        Raises
        ------
        OutOfMemoryError
            If a node requires more memory than a worker has; the message proposes a number of parts.
        """
        if self.memory is None or self.largest <= self.room:
            return
        sizes = {"node": self.largest, "memory": self.memory, "share": SHARE * self.memory}
        fields = {name: gibibytes(size) for name, size in sizes.items()}
        busy = phrase("parts.busy-memory", memory=gibibytes(self.held)) if self.held else ""
        raise OutOfMemoryError(phrase("parts.node-too-large", **fields, busy=busy, advice=self._advice()))

    def _advice(self) -> Phrase:
        """Propose more parts or memory; twice as many parts halve their size, but not separators."""
        memory = self.of("memory_bytes")
        leaf = np.array([not below for below in self.tree.children])
        top = float(memory[~leaf].max(initial=0.0))
        if top > self.room:
            size = gibibytes((top + self.held) / SHARE)
            return phrase("parts.large-separator", separator=gibibytes(top), memory=size)
        parts = int(leaf.sum())
        # The memory of a part is proportional to its photos, except for contributions of its borders.
        fit = parts * 2 ** int(np.ceil(np.log2(float(memory[leaf].max()) / self.room)))
        return phrase("parts.more-parts", parts=fit, given=parts)

    def document(self) -> Document:
        """Return the document: size, levels of the tree, traffic, and predicted time."""
        leaf = np.array([not below for below in self.tree.children])
        unknowns = self.of("interior") + self.of("points")
        traffic = [
            Fact.of(
                "Up in an iteration", self.bytes_up / MIB, "MiB", decimals=1, note=about("parts.traffic")
            ),
            Fact.of("Down in an iteration", self.bytes_down / MIB, "MiB", decimals=3),
            Fact.of("Down in the inversion", self.bytes_inverted / MIB, "MiB", decimals=1),
        ]
        memory = [
            Fact.of("Largest node", self.largest / MIB, "MiB", decimals=0),
            Fact.of("Worker before the run", self.held / MIB, "MiB", decimals=0),
        ]
        seconds = list[Fact]()
        if (times := self.times) is not None:
            seconds = [
                Fact.of("Iteration", times.up + times.down, "s", decimals=1),
                Fact.of("Inversion", times.inversion, "s", decimals=1),
                Fact.of(f"Adjustment with {ITERATIONS} iterations", times.whole(ITERATIONS), "s", decimals=0),
            ]
        limit = "" if self.memory is None else f"of {gibibytes(self.memory)} GiB"
        return Document(
            "Plan of an adjustment in parts",
            "",
            highlights=[
                Fact.of("Parts", leaf.sum(), note=f"{np.count_nonzero(~leaf)} separators"),
                Fact.of("Workers", self.workers, note=limit),
                Fact.of("Photos", sum(self.photos)),
                Fact.of("Image points", self.of("images").sum(), decimals=0),
                Fact.of("Observations", self.of("observations").sum(), decimals=0),
                Fact.of("Unknowns", unknowns.sum(), decimals=0),
            ],
            sections=[
                Section.of(self._levels(leaf)),
                Section("resources", "Memory and traffic", [Facts("", [*memory, *traffic])]),
                Section("time", "Predicted time", [Facts("", seconds)], about("parts.time")),
            ],
            members=members(
                self,
                *("workers", "memory", "held", "largest", "bytes_up", "bytes_down", "bytes_inverted"),
            ),
        )

    def _levels(self, leaf: Bools) -> Table:
        """Return one row per level of separators from the root, and one of the parts."""
        levels = self.tree.levels
        separators = [(str(level), ~leaf & (levels == level)) for level in range(int(levels.max()) + 1)]
        rows = [(name, nodes) for name, nodes in [*separators, ("parts", leaf)] if nodes.any()]

        def sums(values: Floats, factor: float = 1.0) -> list[float]:
            return [float(values[nodes].sum()) / factor for _, nodes in rows]

        def largest(name: str, factor: float = 1.0) -> list[float]:
            return [float(self.of(name)[nodes].max()) / factor for _, nodes in rows]

        columns = [
            column("level", [name for name, _ in rows], "Level", kind="name"),
            column("nodes", [int(nodes.sum()) for _, nodes in rows], "Nodes"),
            column("photos", sums(np.array(self.photos)), "Photos", decimals=0),
            column("image_points", sums(self.of("images")), "Image points", decimals=0),
            column("largest_outer", largest("outer"), "Outer, most", decimals=0),
            column("factor_1e9", sums(self.of("factor"), 1e9), "Factor, 10^9", decimals=3),
            column("largest_memory_mib", largest("memory_bytes", MIB), "Memory, most MiB", decimals=1),
            column("up_mib", sums(self.of("contribution_bytes"), MIB), "Up, MiB", decimals=1),
        ]
        return Table("levels", "Levels of the tree", columns)


def measured_rates(part: _photocore.Node) -> Rates:
    """Measure the speed of this process by forming and inverting one part."""
    prediction = part.prediction(0)
    size = len(part.outer)
    start = time.perf_counter()
    formed = part.form(part.initial, [], damping=0.0, curved=False, threads=0)
    forming = time.perf_counter() - start
    start = time.perf_counter()
    formed.invert(np.zeros(size * (size + 1) // 2), part.initial, threads=0)
    inverting = time.perf_counter() - start
    # Dense work achieves 0.4 of the rate of matrix products; the remaining time is formation.
    matrix = np.ones((1024, 1024))
    matrix @ matrix
    start = time.perf_counter()
    matrix @ matrix
    dense = 0.4 * 1024**3 / (time.perf_counter() - start)
    formation = IMAGE * prediction["images"] + prediction["reduction"]
    in_factor = min(prediction["factor"] / dense, 0.9 * forming)
    in_inverse = min(prediction["inverse"] / dense, 0.9 * inverting)
    rate = 2 * formation / (forming - in_factor + inverting - in_inverse)
    return Rates(rate, dense, dense, BANDWIDTH)


@dataclass(frozen=True)
class Rates:
    """Speed of a worker per second: multiply-adds, and bytes sent or received."""

    formation: float
    factor: float
    inverse: float
    bandwidth: float


@dataclass(frozen=True)
class Times:
    """Seconds to form, solve and invert on some workers, and bytes sent in each phase."""

    up: float
    down: float
    inversion: float
    moved_up: float
    moved_down: float
    moved_inversion: float

    def whole(self, iterations: int) -> float:
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
    """Schedule a tree from seconds (N,) and `traffic` in bytes of each node.

    A ready task is assigned to the first free worker, or to the worker of a child if it can start earlier
    there. Tasks on the way down run where the factors are. A worker receives one message at a time, with
    `bandwidth` bytes per second.
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
