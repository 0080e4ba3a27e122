"""Nested dissection of the photos of a block by position, and the work per node of the tree.

Photos and other unknowns of the reduced normal equations are the vertices of a graph, points and observations
are its edges. An edge contains all vertices that it touches. The photos are halved by position, recursively.
The separator consists of the photos on the smaller side of a cut that share an edge with the other side. All
photos of a remaining edge are then in one part, or in separators between this part and the root (George 1973;
Lipton, Rose and Tarjan 1979).

To count the work in advance, parts are cut further until the pieces have the size of the fronts of the
factorisation. Multiply-adds and memory are then computed for dense panels, as in multifrontal elimination of
the whole tree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from photogram.arguments.equality import Valued
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block, flown_by
from photogram.network.films import Scan
from photogram.network.observations import Observation
from photogram.network.unknowns import Unknown

UNKNOWNS = 6  # Unknowns of the pose of a photo
SMALLEST = 8  # Minimum number of photos of a front
FORMATION, PAIR = 200.0, 108.0  # Multiply-adds per image point, and per pair of photos that share a point
WORD = 8.0  # Bytes of a number
IMAGE_BYTES = 1300.0  # Peak bytes per image point, with its share of the object point


@dataclass(frozen=True)
class Incidence:
    """Vertices and edges that touch, as (k,) pairs in any order; each edge is in one incidence only.

    Edges are numbered from 0; `count` is their number.
    """

    vertices: Indices
    edges: Indices
    count: int


@dataclass(frozen=True, eq=False)
class Tree(Valued):
    """Binary tree over parts; children have smaller numbers than their parent.

    `parents` (N,) of the nodes; the root is the last node and has -1. `children` are in the fixed order in
    which contributions are added; parts are without children. `spans` (N, 2) are the first part below a node
    and the one after the last.
    """

    parents: Indices
    children: tuple[tuple[int, ...], ...]
    spans: Indices

    def __len__(self) -> int:
        return len(self.parents)

    @property
    def root(self) -> int:
        return len(self.parents) - 1

    @property
    def levels(self) -> Indices:
        """(N,) distance of each node from the root."""
        found = np.zeros(len(self.parents), dtype=np.int64)
        for node in range(self.root - 1, -1, -1):
            found[node] = found[self.parents[node]] + 1
        return found

    def above(self, node: int) -> list[int]:
        """Return the ancestors of a node, from its parent to the root."""
        found = []
        while (node := int(self.parents[node])) >= 0:
            found.append(node)
        return found


@dataclass(frozen=True)
class Cut:
    """Division of photos among the nodes of a tree; `owners` are (V,) nodes of the vertices."""

    tree: Tree
    owners: Indices


def tree_of(parts: int) -> Tree:
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
    """Cut (V, 3) positions of photos with (V,) weights into parts with separators.

    Positions have one unit of length; a weight is the number of image points. `incidences` yields all edges
    in batches, once per level of the tree.
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
        # Boundary: free vertices that share an edge with one beyond the cut.
        boundary, side_of = np.zeros(len(owners), dtype=bool), right[part]
        for incidence in incidences() if here else ():
            free = (owners[incidence.vertices] < 0) & (side_of[incidence.vertices] >= 0)
            vertices, edges = incidence.vertices[free], incidence.edges[free]
            seen = np.zeros((2, incidence.count), dtype=bool)
            seen[side_of[vertices], edges] = True
            across = seen[0] & seen[1]
            boundary[vertices[across[edges]]] = True
        near = np.flatnonzero(boundary)
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
    """Return the home node (edges,) of each edge, in which its first vertex is eliminated.

    The home of an edge without vertices is the root.
    """
    found = np.full(incidence.count, root, dtype=np.int64)
    np.minimum.at(found, incidence.edges, owners[incidence.vertices])
    return found


def joined(count: int, together: Iterable[tuple[int, ...]]) -> Indices:
    """Return (count,) the least member of the set of each element, after joining sets."""
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


def _halved(positions: Floats, weights: Floats, tree: Tree) -> Indices:
    """Return the part (V,) of each photo: equal weights, cut across the longest extent."""
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
        # Sort by position, then by row, so that ties are resolved identically on every machine.
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


@dataclass(frozen=True)
class Counts:
    """Work of each of N nodes.

    `photos` are eliminated in the node, `images` have their home there, `outer` counts unknowns of nodes
    above that it touches. Multiply-adds are for one formation with reduction of points, one factorisation and
    one inversion. Bytes are of the factor, and the peak of the node.
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
        """(N,) bytes sent up per iteration: U, u and the diagonal."""
        return np.asarray(WORD * (self.outer * (self.outer + 1) / 2 + 2 * self.outer))

    @property
    def cofactor_bytes(self) -> Floats:
        """(N,) bytes sent down in the inversion."""
        return np.asarray(WORD * self.outer * (self.outer + 1) / 2)

    @property
    def step_bytes(self) -> Floats:
        """(N,) bytes sent down per iteration."""
        return np.asarray(WORD * self.outer)


def counted_work(
    positions: Floats,
    images: Floats,
    incidences: Callable[[], Iterable[Incidence]],
    parts: int,
    unknowns: float = UNKNOWNS,
) -> tuple[Tree, Counts]:
    """Count the work of a block in parts, for (P, 3) positions and (P,) image points.

    `incidences` are the ties by points, possibly of a thinned block. `unknowns` is the number per photo, for
    pose and film.
    """
    pieces = 1
    while len(positions) / (parts * pieces * 2) >= SMALLEST:
        pieces *= 2
    deep = cut(positions, images, incidences, parts * pieces)
    tree = tree_of(parts)
    # Coarse node that contains each fine node
    of_span = {tuple(span): node for node, span in enumerate((tree.spans * pieces).tolist())}
    node_of = np.empty(len(deep.tree), dtype=np.int64)
    for node in range(deep.tree.root, -1, -1):
        span = tuple(deep.tree.spans[node].tolist())
        node_of[node] = of_span[span] if span in of_span else node_of[deep.tree.parents[node]]
    outer = outer_vertices(deep.tree, deep.owners, list(incidences()))
    inner: Floats = unknowns * np.bincount(deep.owners, minlength=len(deep.tree)).astype(np.float64)
    above = unknowns * np.array([len(each) for each in outer], dtype=float)
    # Symmetric, dense: I^3 / 6 for the pivot, I^2 S / 2 for the panel, I S^2 / 2 for the remainder.
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
        # The selected inverse needs the products of the factorisation again, in both directions.
        inverse=2 * summed(factor),
        factor_bytes=factor_bytes,
        memory_bytes=factor_bytes + WORD * contribution[tops] + received + IMAGE_BYTES * summed(at_home),
    )
    return tree, counts


def outer_vertices(tree: Tree, owners: Indices, incidences: list[Incidence]) -> list[Indices]:
    """Return the vertices above each node that edges of the node or of its descendants touch."""
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


def vertices_of(block: Block) -> Indices:
    """Return (P,) representing photos: the frame, or the first photo on the trajectory."""
    found = np.arange(len(block.photo_ids), dtype=np.int64)
    for each in block.mounts:
        found[block._photo_rows[each.photo]] = block._photo_rows[each.frame]
    first: dict[int, int] = {}
    for timed, trajectory in zip(block.timed, block.trajectories, strict=True):
        row = block._photo_rows[timed.photo]
        found[row] = first.setdefault(id(trajectory), row)
    return found


def photos_of_unknowns(block: Block) -> dict[int, str]:
    """Return photos whose unknowns include shared unknowns, by object identity.

    Unknowns of a film belong to its photo, coefficients of a trajectory to its first photo. Unknowns of films
    of several photos remain shared unknowns. The same applies to all films if there are photos on frames
    (halves of joined scans) or trajectories.
    """
    alone = _of_one_photo(
        (own, each.photo)
        for each in (() if block.mounts or flown_by(block) else block.passages)
        if isinstance(each, Scan)
        for own in (each.film.placement, each.film.size, each.film.bend)
    )
    for timed, trajectory in zip(block.timed, block.trajectories, strict=True):
        for part in trajectory.coefficients:
            for coefficient in part:
                alone.setdefault(id(coefficient), timed.photo)
    return alone


def alone_of(block: Block) -> dict[int, str]:
    """Return the photos of unknowns that only they use, including reseau nodes.

    A reseau node is a separate block that images in its cells touch; it belongs to its photo.
    """
    return photos_of_unknowns(block) | _of_one_photo(
        (own, each.photo)
        for each in block.passages
        if isinstance(each, Scan) and each.film.pattern is not None
        for own in each.film.pattern.weights
    )


def _of_one_photo(pairs: Iterable[tuple[Unknown | None, str]]) -> dict[int, str]:
    """Return the photos of unknowns with one photo, by object identity."""
    found: dict[int, set[str]] = {}
    for own, photo in pairs:
        if own is not None:
            found.setdefault(id(own), set()).add(photo)
    return {own: photos.pop() for own, photos in found.items() if len(photos) == 1}


def photos_of(observation: Observation, alone: Mapping[int, str]) -> list[str]:
    """Return the photos that an observation touches, by pose or by unknowns of a single photo."""
    moment, photos, unknowns = observation.moment, observation.photos, observation.unknowns
    if moment is not None:
        # One coefficient represents all.
        photos, own = (), [part[0] for part in moment.trajectory.coefficients if part]
        unknowns = (*unknowns, *own)
    others = [alone[id(each)] for each in unknowns if id(each) in alone]
    return [*dict.fromkeys([*photos, *others])]


def incidence_of(block: Block) -> tuple[Incidence, Indices, Indices]:
    """Return the incidence of points and observations, and the edge of each of them."""
    images = block.image_photos, block.image_points
    return incidence_of_points(block, block.point_ids, images, block.observations)


def incidence_of_points(
    block: Block,
    names: Sequence[str],
    images: tuple[Indices, Indices],
    observations: Sequence[Observation],
) -> tuple[Incidence, Indices, Indices]:
    """Return the incidence as :func:`incidence_of`, with other points, images and observations.

    `images` are the rows of photos of the block and of points. Points that are observed together are one
    edge, and remain in one node.
    """
    vertices = vertices_of(block)
    points = {name: row for row, name in enumerate(names)} if observations else {}
    tied = [tuple(points[name] for name in each.points) for each in observations]
    edges = joined(len(names), (each for each in tied if len(each) > 1))
    own_edges, others, of_observations, alone = [], [], [], alone_of(block)
    count = len(names)
    for each, members in zip(observations, tied, strict=True):
        edge = int(edges[members[0]]) if members else count
        count += not members
        of_observations.append(edge)
        for name in photos_of(each, alone):
            own_edges.append(edge)
            others.append(int(vertices[block._photo_rows[name]]))
    incidence = Incidence(
        np.concatenate([vertices[images[0]], np.array(others, dtype=np.int64)]),
        np.concatenate([edges[images[1]], np.array(own_edges, dtype=np.int64)]),
        count,
    )
    return incidence, edges, np.array(of_observations, dtype=np.int64)


def shared_cameras(block: Block) -> Indices:
    """Return cameras with free or weighted parameters and several photos; they belong to the root.

    Cameras of photos on frames and trajectories also belong to the root.
    """
    if block.photo_cameras is None:
        return np.zeros(0, dtype=np.int64)
    photos = np.bincount(block.photo_cameras, minlength=len(block.cameras))
    mounted = {each.photo for each in block.mounts} | {each.photo for each in block.timed}
    rows = [row for row, name in enumerate(block.photo_ids) if name in mounted] if mounted else []
    photos[block.photo_cameras[rows]] += 1
    own = [row for row, each in enumerate(block.cameras) if photos[row] > 1 and not each.is_held]
    return np.array(own, dtype=np.int64)
