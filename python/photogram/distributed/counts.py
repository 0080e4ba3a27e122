"""Counted work, memory and traffic of the nodes of a tree, from which photos points tie, before forming any.

A part is cut further until its pieces are as small as the fronts of the factorisation, whose multiply-adds,
numbers and contributions are then those of dense panels: multifrontal elimination on the whole tree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.distributed.cut import Incidence, Tree, cut, homes, tree_of
from photogram.lazy_dataclasses import dataclass

__all__ = ["UNKNOWNS", "Counts", "counted_work", "outer_vertices"]

UNKNOWNS = 6
"""Of the pose of a photo."""
SMALLEST = 8
"""Photos of a piece that is a front of its own."""
FORMATION, PAIR = 200.0, 108.0
"""Multiply-adds for an image point, and for every two photos that share a point."""
WORD = 8.0
"""Bytes of a number."""
IMAGE_BYTES = 1300.0
"""Of an image point with its share of its point, as it is read, formed and handed back."""


@dataclass(frozen=True)
class Counts:
    """Counted work of each of N nodes.

    Attributes
    ----------
    photos, images, outer
        (N,) photos eliminated there, image points at home there, unknowns of nodes above that it touches.
    formation, factor, inverse
        (N,) multiply-adds of one formation with the reduction of points, one factorisation, one inversion.
    factor_bytes, memory_bytes
        (N,) of the factor, and at the most while the node is worked on.
    """

    photos: Indices
    images: Indices
    outer: Indices
    formation: Floats
    factor: Floats
    inverse: Floats
    factor_bytes: Floats
    memory_bytes: Floats

    @property
    def contribution_bytes(self) -> Floats:
        """(N,) bytes that go up in an iteration: U, u and the diagonal."""
        found: Floats = WORD * (self.outer * (self.outer + 1) / 2 + 2 * self.outer)
        return found

    @property
    def cofactor_bytes(self) -> Floats:
        """(N,) bytes that come down in the inversion."""
        found: Floats = WORD * self.outer * (self.outer + 1) / 2
        return found

    @property
    def step_bytes(self) -> Floats:
        """(N,) bytes that come down in an iteration."""
        return np.asarray(WORD * self.outer)


def counted_work(
    positions: Floats,
    images: Floats,
    incidences: Callable[[], Iterable[Incidence]],
    parts: int,
    unknowns: float = UNKNOWNS,
) -> tuple[Tree, Counts]:
    """Count the work of a block in parts.

    Parameters
    ----------
    positions
        (P, 3) of the photos, in one unit of length.
    images
        (P,) image points of each.
    incidences
        Which photos the points tie; those of a thinned block do.
    parts
        How many; cut further, twice as fine again and again, for counting.
    unknowns
        Of a photo: of its pose, and of its film.
    """
    pieces = 1
    while len(positions) / (parts * pieces * 2) >= SMALLEST:
        pieces *= 2
    deep = cut(positions, images, incidences, parts * pieces)
    tree = tree_of(parts)
    node_of = _nodes_above(deep.tree, tree, pieces)
    outer = outer_vertices(deep.tree, deep.owners, list(incidences()))
    inner: Floats = unknowns * np.bincount(deep.owners, minlength=len(deep.tree)).astype(np.float64)
    above = unknowns * np.array([len(each) for each in outer], dtype=float)
    # Symmetric, dense: I^3 / 6 for the pivot, I^2 S / 2 for the panel, I S^2 / 2 for what is left.
    factor = inner**3 / 6 + inner**2 * above / 2 + inner * above**2 / 2
    numbers = inner**2 / 2 + inner * above
    contribution = above * (above + 1) / 2
    at_home = np.zeros(len(deep.tree))
    pairs = np.zeros(len(deep.tree))
    total = max(float(sum(len(each.vertices) for each in incidences())), 1.0)
    thinned = images.sum() / total
    for each in incidences():
        home = homes(deep.owners, each, deep.tree.root)
        rays = np.bincount(each.edges, minlength=each.count).astype(float)
        np.add.at(at_home, home, thinned * rays)
        np.add.at(pairs, home, thinned * rays * (rays + 1) / 2)

    def summed(values: Floats) -> Floats:
        return np.bincount(node_of, weights=values, minlength=len(tree)).astype(np.float64)

    tops = np.zeros(len(tree), dtype=np.int64)
    np.maximum.at(tops, node_of, np.arange(len(deep.tree)))
    factor_bytes = WORD * summed(numbers)
    received = WORD * np.array([sum(contribution[tops[child]] for child in below) for below in tree.children])
    counts = Counts(
        photos=(summed(inner) / unknowns).round().astype(np.int64),
        images=summed(at_home).round().astype(np.int64),
        outer=above[tops].astype(np.int64),
        formation=FORMATION * summed(at_home) + PAIR * summed(pairs),
        factor=summed(factor),
        # The selected inverse takes the products of the factorisation once more, both ways.
        inverse=2 * summed(factor),
        factor_bytes=factor_bytes,
        memory_bytes=factor_bytes + WORD * contribution[tops] + received + IMAGE_BYTES * summed(at_home),
    )
    return tree, counts


def outer_vertices(tree: Tree, owners: Indices, incidences: list[Incidence]) -> list[Indices]:
    """Return the vertices above each node that its own edges, or those below it, touch."""
    own: list[list[Indices]] = [[] for _ in range(len(tree))]
    for each in incidences:
        home = homes(owners, each, tree.root)[each.edges]
        away = owners[each.vertices] != home
        pairs = np.unique(home[away] * len(owners) + each.vertices[away])
        nodes, starts = np.unique(pairs // len(owners), return_index=True)
        parts = np.split(pairs % len(owners), starts[1:])
        for node, part in zip(nodes.tolist(), parts, strict=False):
            own[node].append(part)
    found: list[Indices] = []
    for node, children in enumerate(tree.children):
        below = [*own[node], *(found[child] for child in children)]
        touched = np.unique(np.concatenate(below)) if below else np.zeros(0, dtype=np.int64)
        found.append(touched[owners[touched] != node])
    return found


def _nodes_above(deep: Tree, tree: Tree, pieces: int) -> Indices:
    """Return the node of the coarse tree that each node of a finer one is part of."""
    of_span = {tuple(span): node for node, span in enumerate((tree.spans * pieces).tolist())}
    found = np.empty(len(deep), dtype=np.int64)
    for node in range(deep.root, -1, -1):
        span = tuple(deep.spans[node].tolist())
        found[node] = of_span[span] if span in of_span else found[deep.parents[node]]
    return found
