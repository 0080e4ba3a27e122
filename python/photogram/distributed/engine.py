"""What the driver asks of the engine of a node: `photogram._photocore.Node` is one, tests have another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from photogram.arguments.types import Floats, Indices

__all__ = ["ContributionRow", "Engine", "FormedNode", "Node", "TransformationRow"]

ContributionRow = tuple[Floats, Floats, Floats]
"""What a node leaves to the one above: packed triangle, right-hand side, diagonal before elimination."""


TransformationRow = tuple[Floats, Floats, Floats, Floats, float, list[int]]
"""T, W, B^T W, the last step, the condition of B^T G and unknowns that do not move (docs/distributed.md)."""


class FormedNode(Protocol):
    """A node whose points and blocks are eliminated; `photogram._photocore.FormedNode` tells more."""

    @property
    def contribution(self) -> ContributionRow:
        """What it leaves to the node above."""

    @property
    def sum_of_squares(self) -> float:
        """Weighted, of what is at home here."""

    @property
    def decrease(self) -> float:
        """What a full step lowers it by, as far as known here."""

    @property
    def undetermined(self) -> Any:
        """What the observations leave undetermined; or None."""

    def solve(self, outer: Floats, *, threads: int) -> Floats:
        """Return the step of all unknowns, given that of the outer ones."""

    @property
    def has_chord(self) -> bool:
        """Whether the right-hand side of a chord was reduced, and is not solved for."""

    def reduce_chord(
        self, state: Floats, left: Sequence[Floats], *, threads: int
    ) -> tuple[Floats, float] | None:
        """Reduce the right-hand side of a chord at a state; return what is left, and the decrease."""

    def solve_chord(self, outer: Floats, *, threads: int) -> Floats:
        """Return the chord of all unknowns, given that of the outer ones."""

    def reduce(self, rights: Floats, *, threads: int) -> tuple[Floats, Floats]:
        """Reduce right-hand sides; return what is left for the outer unknowns, and their products."""

    def complete(self, outer: Floats, *, threads: int) -> Floats:
        """Solve for all unknowns where right-hand sides were reduced, given the outer ones."""

    def invert(
        self, outer: Floats, state: Floats, *, threads: int, datum: TransformationRow | None = None
    ) -> tuple[Any, list[Floats]]:
        """Return what is adjusted, in a datum of the whole, and the cofactors for each child."""


class Node(Protocol):
    """A node of the tree; `photogram._photocore.Node` tells more."""

    @property
    def outer(self) -> Indices:
        """Where the outer unknowns stand in a state."""

    @property
    def children(self) -> list[Indices]:
        """Where those of each child stand."""

    @property
    def unknown_names(self) -> Indices:
        """What each unknown of a state belongs to, by rows of the node."""

    @property
    def counts(self) -> tuple[int, int, int]:
        """Observations, weighted unknowns, unknowns."""

    @property
    def ends_slowly(self) -> bool:
        """Whether the last steps may fall slowly, so that a chord pays."""

    @property
    def initial(self) -> Floats:
        """The state to begin with."""

    @property
    def prediction(self) -> Mapping[str, float]:
        """Work and memory."""

    def advance(self, state: Floats, step: Floats) -> Floats:
        """Return the state after a step."""

    def relocate(self, state: Floats, *, threads: int) -> Floats:
        """Return the state with points where their rays meet."""

    def objective(self, state: Floats, *, threads: int) -> Sequence[float]:
        """Return weighted sums of squares by kinds, then what is minimised: their sum, or losses."""

    def form(
        self,
        state: Floats,
        contributions: list[ContributionRow],
        *,
        damping: float,
        curved: bool,
        threads: int,
    ) -> FormedNode:
        """Form the normal equations at a state, and eliminate what is at home here."""

    def solution(self, state: Floats, before: Floats, *, threads: int) -> Any:
        """Return what is adjusted, without cofactors."""


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

    def unknowns(self, run: Path, number: int, node: Node) -> Indices:
        """Return (N, 3) what the unknowns of a node belong to, rows being those of the whole block."""

    def redundancies(self, run: Path, number: int) -> tuple[float, float, float, float]:
        """Return sums of redundancy numbers, by kinds, of what was written of a node."""

    def settle(self, run: Path, number: int, variance: float | None) -> None:
        """Scale what was written of a node by a variance of unit weight that is known since."""
