"""What the driver asks of the engine of a node: `photogram._photocore.Node` is one, tests have another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from photogram.arguments.types import Floats, Indices

__all__ = ["ContributionRow", "Engine", "FormedNode", "Node"]

ContributionRow = tuple[Floats, Floats, Floats]
"""What a node leaves to the one above: packed triangle, right-hand side, diagonal before elimination."""


class FormedNode(Protocol):
    """A node whose points and blocks are eliminated: `photogram._photocore.FormedNode` describes all of it."""

    @property
    def contribution(self) -> ContributionRow: ...
    @property
    def sum_of_squares(self) -> float: ...
    @property
    def decrease(self) -> float: ...
    @property
    def undetermined(self) -> Any: ...
    def solve(self, outer: Floats, *, threads: int) -> Floats: ...
    def invert(self, outer: Floats, state: Floats, *, threads: int) -> tuple[Any, list[Floats]]: ...


class Node(Protocol):
    """A node of the tree: `photogram._photocore.Node` describes all of it."""

    @property
    def outer(self) -> Indices: ...
    @property
    def children(self) -> list[Indices]: ...
    @property
    def counts(self) -> tuple[int, int, int]: ...
    @property
    def initial(self) -> Floats: ...
    @property
    def prediction(self) -> Mapping[str, float]: ...
    def advance(self, state: Floats, step: Floats) -> Floats: ...
    def relocate(self, state: Floats) -> Floats: ...
    def objective(self, state: Floats, *, threads: int) -> Sequence[float]: ...
    def form(
        self, state: Floats, contributions: list[ContributionRow], *, damping: float, threads: int
    ) -> FormedNode: ...
    def solution(self, state: Floats, before: Floats, *, threads: int) -> Any: ...


class Engine(Protocol):
    """Makes nodes of what lies in the folder of a run, and keeps what is found."""

    def node(self, run: Path, number: int) -> Node:
        """Return a node.

        Raises
        ------
        PhotogramError
            Its part cannot be read, or cannot be adjusted.
        """

    def stations(self, run: Path, number: int) -> int:
        """Return how many weighted unknowns of photos and cameras are at home in a node."""

    def failure(self, run: Path, number: int, undetermined: Any) -> Exception:
        """Return what the observations of a node leave undetermined as an error, with names."""

    def keep(self, run: Path, number: int, solution: Any, variance: float | None) -> None:
        """Write what has become of a node into the folder of the run.

        Parameters
        ----------
        run, number
            The run and the node.
        solution
            What the node gives.
        variance
            The variance of unit weight of the whole; None without degrees of freedom.
        """
