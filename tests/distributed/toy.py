"""A network small enough to be solved densely: in parts behind the protocol of the engine, and whole.

Stations and points stand in the plane; z = (1 + c) (q - p) + 0.05 sin(q - p) is measured from station p to
point q, with a scale c that all stations share. Some stations are weighted.
"""

import json
import os
import signal
from pathlib import Path

import numpy as np

from photogram import AdjustOptions, RankError
from photogram.adjustment.adjustment import core_options
from photogram.distributed.cut import Incidence, Tree, cut, homes, tree_of

SD, STATION_SD = 0.01, 0.05
OPTIONS = core_options(AdjustOptions(max_iterations=50))


def make(folder: Path, stations: int, points: int, parts: int, seed: int = 1) -> Tree:
    """Write a network and its cut into a folder."""
    rng = np.random.default_rng(seed)
    places = np.column_stack([np.arange(stations) * 1.0, rng.uniform(-1, 1, stations)])
    targets = np.column_stack([rng.uniform(-1, stations, points), rng.uniform(-2, 2, points)])
    near = np.abs(targets[:, :1] - places[:, 0]) < 2.2
    point, station = np.nonzero(near)
    away = targets[point] - places[station]
    z = 1.1 * away + 0.05 * np.sin(away) + rng.normal(0, SD, away.shape)
    incidence = Incidence(station, point, points)
    weights = np.bincount(station, minlength=stations).astype(float)
    found = cut(np.column_stack([places, np.zeros(stations)]), weights, lambda: [incidence], parts)
    np.savez(
        folder / "toy.npz",
        places=places + rng.normal(0, 0.05, places.shape),
        observed=places + rng.normal(0, STATION_SD, places.shape),
        targets=targets + rng.normal(0, 0.1, targets.shape),
        station=station,
        point=point,
        z=z,
        owners=found.owners,
        homes=homes(found.owners, incidence, found.tree.root),
    )
    (folder / "parts").write_text(json.dumps(parts))
    return found.tree


class Toy:
    """The whole network; station k has the unknowns 2 k and 2 k + 1, c stands after them, then points."""

    def __init__(self, folder: Path):
        with np.load(folder / "toy.npz") as file:
            self.__dict__.update(file)
        self.stations, self.points = len(self.places), len(self.targets)
        self.c = 2 * self.stations
        self.size = self.c + 1 + 2 * self.points
        self.weighted = np.arange(0, self.stations, 3)

    def initial(self):
        """Return the unknowns to begin with."""
        return np.concatenate([self.places.ravel(), [0.0], self.targets.ravel()])

    def equations(self, x, images, stations):
        """Return rows (A, b) of unit weight, b = observed minus computed."""
        a = np.zeros((2 * len(images) + 2 * len(stations), self.size))
        b = np.zeros(len(a))
        for row, image in enumerate(images):
            s, p = 2 * self.station[image], self.c + 1 + 2 * self.point[image]
            away = x[p : p + 2] - x[s : s + 2]
            slope = 1 + x[self.c] + 0.05 * np.cos(away)
            rows = slice(2 * row, 2 * row + 2)
            a[rows, s : s + 2], a[rows, p : p + 2] = -np.diag(slope) / SD, np.diag(slope) / SD
            a[rows, self.c] = away / SD
            b[rows] = (self.z[image] - (1 + x[self.c]) * away - 0.05 * np.sin(away)) / SD
        for row, station in enumerate(stations, len(images)):
            rows, own = slice(2 * row, 2 * row + 2), slice(2 * station, 2 * station + 2)
            a[rows, own] = np.eye(2) / STATION_SD
            b[rows] = (self.observed[station] - x[own]) / STATION_SD
        return a, b


def adjusted(folder: Path, tolerance=1e-5):
    """Return unknowns, cofactors, redundancy numbers of images, sum of squares and changes, all at once."""
    toy = Toy(folder)
    x, changes = toy.initial(), []
    images = np.arange(len(toy.station))
    while True:
        a, b = toy.equations(x, images, toy.weighted)
        q = np.linalg.inv(a.T @ a)
        step = q @ (a.T @ b)
        changes.append(float(np.sqrt(step @ (a.T @ b))))
        x = x + step
        rate = changes[-1] / changes[-2] if len(changes) > 1 else 1.0
        small = changes[-1] <= 1e-3 and rate < 1 and rate / (1 - rate) * changes[-1] <= tolerance
        if changes[-1] <= tolerance or small:
            redundancy = 1 - np.einsum("ij,jk,ik->i", a, q, a)
            b = toy.equations(x, images, toy.weighted)[1]
            return x, q, redundancy[: 2 * len(images)].reshape(-1, 2), float(b @ b), changes


class ToyNode:
    """A node: its unknowns are those of its points, its stations, then of the outer ones."""

    converges_linearly = False

    def __init__(self, folder: Path, number: int):
        self.toy = toy = Toy(folder)
        tree = tree_of(json.loads((folder / "parts").read_text()))
        outers = [_outer(toy, tree, node) for node in range(len(tree))]
        own = np.flatnonzero(toy.owners == number).tolist() + ([toy.stations] if number == tree.root else [])
        self.points = np.flatnonzero(toy.homes == number)
        self.images = np.flatnonzero(toy.homes[toy.point] == number)
        self.weighted = [each for each in own if each in toy.weighted]
        self.local = np.array(
            [toy.c + 1 + 2 * p + k for p in self.points for k in (0, 1)]
            + [row for each in [*own, *outers[number]] for row in self._rows(each)],
            dtype=np.int64,
        )
        place = {row: k for k, row in enumerate(self.local.tolist())}
        self.outer, *self.children = (
            np.array([place[row] for each in one for row in self._rows(each)], dtype=np.int64)
            for one in [outers[number], *(outers[child] for child in tree.children[number])]
        )
        self.initial = toy.initial()[self.local]
        rows = 2 * len(self.images)
        self.counts = rows, 2 * len(self.weighted), len(self.local) - len(self.outer)
        n, s = len(self.local), len(self.outer)
        self._bytes = {"memory_bytes": 24.0 * n * n, "factor_bytes": 8.0 * n * n, "node_bytes": 8.0 * n}
        self._bytes["contribution_bytes"] = 8.0 * (s * (s + 1) / 2 + 2 * s)

    def prediction(self, threads):
        """Return the memory, which does not depend on the threads."""
        return self._bytes

    def _rows(self, block):
        return [self.toy.c] if block == self.toy.stations else [2 * block, 2 * block + 1]

    def whole(self, state):
        """Return all unknowns of the network."""
        x = self.toy.initial()
        x[self.local] = state
        return x

    def equations(self, state):
        """Return rows (A, b) of unit weight over the unknowns of the node."""
        a, b = self.toy.equations(self.whole(state), self.images, self.weighted)
        return a[:, self.local], b

    def advance(self, state, step):
        """Return the state after a step."""
        return state + step

    def relocate(self, state, *, threads):
        """Return the state: points stay."""
        return state.copy()

    def objective(self, state, *, threads):
        """Return the sums of squares, and their sum."""
        b = self.equations(state)[1]
        split = 2 * len(self.images)
        return float(b[split:] @ b[split:]), 0.0, float(b[:split] @ b[:split]), 0.0, float(b @ b)

    def reached(self, phase):
        """Nothing, unless an engine wants to know."""

    def form(self, state, contributions, *, damping, curved, threads):
        """Form and eliminate."""
        self.reached("form")
        return FormedToy(self, state, contributions, damping)

    def solution(self, state, before, *, threads):
        """Return the state."""
        return {"state": state}


class FormedToy:
    """The factor of a node: dense."""

    def __init__(self, node, state, contributions, damping):
        self.node = node
        self.a, b = node.equations(state)
        n, right = self.a.T @ self.a, self.a.T @ b
        for rows, (packed, u, _) in zip(node.children, contributions, strict=True):
            n[np.ix_(rows, rows)] += unpacked(packed)
            right[rows] += u
        self.diagonal = np.diag(n).copy()
        n[np.diag_indices(len(n))] *= 1 + damping
        self.inner = np.setdiff1d(np.arange(len(n)), node.outer)
        i, s = self.inner, node.outer
        self.singular = len(i) and np.linalg.matrix_rank(n[np.ix_(i, i)]) < len(i)
        self.inverse = np.linalg.inv(n[np.ix_(i, i)] + self.singular * np.eye(len(i)))
        self.coupling = n[np.ix_(s, i)]
        self.right = right[i]
        self.u_matrix = n[np.ix_(s, s)] - self.coupling @ self.inverse @ self.coupling.T
        self.u = right[s] - self.coupling @ self.inverse @ self.right
        self.sum_of_squares = float(b @ b)
        self.decrease = float(self.right @ self.inverse @ self.right)
        self.undetermined = "singular" if self.singular else None

    @property
    def contribution(self):
        """What is left."""
        return packed(self.u_matrix), self.u, self.diagonal[self.node.outer]

    def solve(self, outer, *, threads):
        """Return the step."""
        self.node.reached("solve")
        step = np.zeros(len(self.node.local))
        step[self.node.outer] = outer
        step[self.inner] = self.inverse @ (self.right - self.coupling.T @ outer)
        return step

    def invert(self, outer, state, *, threads, datum=None):
        """Return what is found, and cofactors for the children."""
        y = self.coupling @ self.inverse
        q_ss = unpacked(outer)
        q = np.zeros((len(state), len(state)))
        q[np.ix_(self.node.outer, self.node.outer)] = q_ss
        q[np.ix_(self.node.outer, self.inner)] = -q_ss @ y
        q[np.ix_(self.inner, self.node.outer)] = -(q_ss @ y).T
        q[np.ix_(self.inner, self.inner)] = self.inverse + y.T @ q_ss @ y
        rows = 2 * len(self.node.images)
        redundancy = 1 - np.einsum("ij,jk,ik->i", self.a, q, self.a)[:rows].reshape(-1, 2)
        found = {"state": state, "cofactors": q, "redundancy": redundancy}
        return found, [packed(q[np.ix_(each, each)]) for each in self.node.children]


class ToyEngine:
    """Makes toy nodes, and keeps what is found of them as arrays.

    The process that first comes to a certain phase of a certain node is killed there, if that is asked for.
    """

    def __init__(self, kill=None):
        self.kill = kill

    def node(self, run, number):
        """Return a node."""
        node = ToyNode(run, number)
        if self.kill is not None:
            node.reached = lambda phase: self.reached(run, number, phase)
        return node

    def reached(self, run, number, phase):
        """Die here, where that is asked for."""
        mark = run / f"killed-{phase}-{number}"
        if (phase, number) == self.kill and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)

    def stations(self, run, number):
        """Count weighted unknowns."""
        return 2 * len(ToyNode(run, number).weighted)

    def failure(self, run, number, undetermined):
        """Return an error."""
        return RankError(f"node {number} is {undetermined}", [], [])

    def keep(self, run, number, solution, variance):
        """Write what was found."""
        node = ToyNode(run, number)
        self.reached(run, number, "keep")
        np.savez(
            run / f"kept{number}.npz", local=node.local, images=node.images, outer=node.outer, **solution
        )


def kept(folder: Path, nodes: int):
    """Return unknowns, cofactors within nodes and redundancy numbers, from what the nodes have kept."""
    toy = Toy(folder)
    x, q = np.full(toy.size, np.nan), np.full((toy.size, toy.size), np.nan)
    redundancy = np.full((len(toy.station), 2), np.nan)
    for number in range(nodes):
        with np.load(folder / f"kept{number}.npz") as file:
            own = np.setdiff1d(np.arange(len(file["local"])), file["outer"])
            x[file["local"][own]] = file["state"][own]
            q[np.ix_(file["local"], file["local"])] = file["cofactors"]
            redundancy[file["images"]] = file["redundancy"]
    return x, q, redundancy


def packed(matrix):
    """Return the lower triangle, column by column."""
    return np.ascontiguousarray(matrix.T[np.triu_indices(len(matrix))])


def unpacked(triangle):
    """Return the symmetric matrix of a lower triangle, column by column."""
    n = round((np.sqrt(8 * len(triangle) + 1) - 1) / 2)
    matrix = np.zeros((n, n))
    matrix[np.triu_indices(n)] = triangle
    return matrix + np.triu(matrix, 1).T


def _outer(toy, tree, node):
    """Return the stations above a node that it or what is below it touches, and c, where they are known."""
    below = [each for each in range(len(tree)) if each == node or node in tree.above(each)]
    images = np.isin(toy.homes[toy.point], below)
    touched = set(toy.station[images].tolist())
    outer = sorted(each for each in touched if toy.owners[each] not in below)
    return outer + ([toy.stations] if node != tree.root else [])
