"""Nested dissection of the photos of a block by place: parts, and a tree of separators above them.

Photos, and whatever else stays in the normal equations, are the vertices of a graph; points and observations
are its edges: an edge holds all vertices that it touches. The photos are halved by place again and again. Of
the edges that reach across a cut the photos on its smaller side become the separator, so that what is left of
every edge lies on one side: all its photos are in one part, or in separators on the way from there to the
root (George 1973; Lipton, Rose and Tarjan 1979).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from photogram.arguments.equality import Valued
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass

__all__ = ["Cut", "Incidence", "Tree", "cut", "homes", "joined", "tree_of"]


@dataclass(frozen=True)
class Incidence:
    """Which vertices some edges touch, in no order; an edge stands in one incidence alone.

    Attributes
    ----------
    vertices, edges
        (k,) each vertex of each edge; edges are counted from 0 here.
    count
        How many edges there are.
    """

    vertices: Indices
    edges: Indices
    count: int


@dataclass(frozen=True, eq=False)
class Tree(Valued):
    """A binary tree over parts; its nodes are numbered so that children come before their parent.

    Attributes
    ----------
    parents
        (N,) the root, which is the last node, has -1.
    children
        Of each node, in the fixed order in which their contributions are added; parts have none.
    spans
        (N, 2) the first part below a node and the one after the last.
    """

    parents: Indices
    children: tuple[tuple[int, ...], ...]
    spans: Indices

    def __len__(self) -> int:
        return len(self.parents)

    @property
    def root(self) -> int:
        """The last node."""
        return len(self.parents) - 1

    @property
    def levels(self) -> Indices:
        """(N,) how far each node is from the root."""
        found = np.zeros(len(self.parents), dtype=np.int64)
        for node in range(self.root - 1, -1, -1):
            found[node] = found[self.parents[node]] + 1
        return found

    def above(self, node: int) -> list[int]:
        """Return the nodes between one and the root, that one left out, from below."""
        found = []
        while (node := int(self.parents[node])) >= 0:
            found.append(node)
        return found


@dataclass(frozen=True)
class Cut:
    """Photos in the nodes of a tree.

    Attributes
    ----------
    tree
        The tree.
    owners
        (V,) the node of each vertex.
    """

    tree: Tree
    owners: Indices


def tree_of(parts: int) -> Tree:
    """Return the tree over a number of parts, as even as it can be."""
    parents: list[int] = []
    children: list[tuple[int, ...]] = []
    spans: list[tuple[int, int]] = []

    def grown(first: int, last: int) -> int:
        middle = (first + last) // 2
        below = () if last - first == 1 else (grown(first, middle), grown(middle, last))
        node = len(parents)
        for child in below:
            parents[child] = node
        parents.append(-1)
        children.append(below)
        spans.append((first, last))
        return node

    grown(0, parts)
    return Tree(np.array(parents, dtype=np.int64), tuple(children), np.array(spans, dtype=np.int64))


def cut(positions: Floats, weights: Floats, incidences: Callable[[], Iterable[Incidence]], parts: int) -> Cut:
    """Cut photos into parts with separators.

    Parameters
    ----------
    positions
        (V, 3) in one unit of length.
    weights
        (V,) what a photo weighs: its image points.
    incidences
        Gives all edges, some at a time; called once for each level of the tree.
    parts
        How many.
    """
    tree = tree_of(parts)
    owners = np.full(len(positions), -1, dtype=np.int64)
    part = _halved(positions, weights, tree)
    levels = tree.levels
    for level in range(int(levels.max(initial=0)) + 1):
        here = [node for node in np.flatnonzero(levels == level).tolist() if tree.children[node]]
        right = np.full(parts, -1, dtype=np.int64)
        node_of = np.full(parts, -1, dtype=np.int64)
        for node in here:
            first, last = tree.spans[node]
            middle = tree.spans[tree.children[node][0]][1]
            node_of[first:last] = node
            right[first:middle], right[middle:last] = 0, 1
        near = np.flatnonzero(_boundary(owners, right[part], incidences())) if here else part[:0]
        nodes, sides = node_of[part[near]], right[part[near]]
        counts = np.bincount(2 * nodes + sides, minlength=2 * len(tree)).reshape(-1, 2)
        smaller = (counts[:, 1] < counts[:, 0]).astype(np.int64)
        chosen = sides == smaller[nodes]
        owners[near[chosen]] = nodes[chosen]
    leaves = np.flatnonzero(tree.spans[:, 1] - tree.spans[:, 0] == 1)
    of_part = np.empty(parts, dtype=np.int64)
    of_part[tree.spans[leaves, 0]] = leaves
    return Cut(tree, np.where(owners < 0, of_part[part], owners))


def homes(owners: Indices, incidence: Incidence, root: int) -> Indices:
    """Return (edges,) the node where each edge is at home: of the vertex that is eliminated first.

    An edge without vertices is at home in the root.
    """
    found = np.full(incidence.count, root, dtype=np.int64)
    np.minimum.at(found, incidence.edges, owners[incidence.vertices])
    return found


def joined(count: int, together: Iterable[tuple[int, ...]]) -> Indices:
    """Return (count,) the least member of the set that each of some things is in, after joining some."""
    found = np.arange(count, dtype=np.int64)

    def least(one: int) -> int:
        while found[one] != one:
            found[one] = found[found[one]]
            one = int(found[one])
        return one

    touched: list[int] = []
    for members in together:
        first = min(least(each) for each in members)
        for each in members:
            found[least(each)] = first
        touched += members
    for each in touched:
        found[each] = least(each)
    return found


def _boundary(owners: Indices, right: Indices, incidences: Iterable[Incidence]) -> np.ndarray:
    """Return (V,) which vertices are free yet and share an edge with one beyond the cut."""
    boundary = np.zeros(len(owners), dtype=bool)
    for each in incidences:
        free = (owners[each.vertices] < 0) & (right[each.vertices] >= 0)
        vertices, edges = each.vertices[free], each.edges[free]
        seen = np.zeros((2, each.count), dtype=bool)
        seen[right[vertices], edges] = True
        across = seen[0] & seen[1]
        boundary[vertices[across[edges]]] = True
    return boundary


def _halved(positions: Floats, weights: Floats, tree: Tree) -> Indices:
    """Return (V,) the part of each photo: halves across the longest extent, of equal weight."""
    part = np.zeros(len(positions), dtype=np.int64)

    def split(node: int, rows: Indices) -> None:
        first, last = tree.spans[node]
        if not tree.children[node]:
            part[rows] = first
            return
        left, right = tree.children[node]
        share = (tree.spans[left, 1] - first) / (last - first)
        places = positions[rows]
        axis = int(np.argmax(np.ptp(places, axis=0))) if len(rows) else 0
        # By place, then by row: ties have one order on every machine.
        order = rows[np.argsort(places[:, axis], kind="stable")]
        reached = np.cumsum(weights[order])
        total = reached[-1] if len(order) else 0.0
        middle = (
            int(np.searchsorted(reached, share * total, side="left")) + 1 if total > 0 else len(order) // 2
        )
        middle = min(middle, max(len(order) - 1, 0))
        split(left, order[:middle])
        split(right, order[middle:])

    split(tree.root, np.arange(len(positions), dtype=np.int64))
    return part
