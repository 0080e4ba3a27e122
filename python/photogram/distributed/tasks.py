"""Tasks for single nodes, as functions of the folder of a run and further arguments.

A worker caches nodes and factors. A missing node is read from its part, a missing state from its file. A
missing factor also needs the contributions of the children, which only the driver can request. The task then
returns :class:`Lost`.
"""

from __future__ import annotations

import hashlib
import platform
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.distributed.files import read_arrays, write_arrays
from photogram.distributed.shelf import shelf
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.memory import give_back
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram._photocore import ContributionRow, FormedNode, Node
    from photogram.distributed.nodes import CoreEngine

GIVEN = "0"  # Initial state, defined by the nodes
LANES = 8  # Right-hand sides of points that the core reduces at a time


@dataclass(frozen=True)
class Lost:
    """Result of a task whose node `number` has lost its factor, which must be formed again.

    It is not an exception, because Dask would log a failure.
    """

    number: int


@dataclass(frozen=True)
class Job:
    """Arguments shared by all tasks of a run.

    The folder is on a disk that all workers can access; workers have the same package version as the driver.
    `threads` per task, 0 for all processors. `memory` is the limit of a process in bytes, None if unlimited.
    `source` is the hash of block and options. `columns` is the number of right-hand sides of the final datum,
    0 without one.
    """

    folder: Path
    engine: CoreEngine
    version: str
    threads: int = 0
    memory: int | None = None
    source: str = ""
    columns: int = 0


@dataclass(frozen=True)
class Point:
    """Formation point of normal equations: state of all nodes, damping, second order of a loss."""

    state: str
    damping: float = 0.0
    curved: bool = False


@dataclass(frozen=True)
class Formed:
    sum_of_squares: float
    decrease: float
    place: str
    products: Floats | None = None  # Part (d, d) of B^T Q B, if there is a final datum


@dataclass(frozen=True, eq=False)
class Contribution:
    """Contribution of a node to its parent, and summary for the driver.

    `columns` (d, S): remaining right-hand sides of a final datum, if any.
    """

    row: ContributionRow
    formed: Formed
    columns: Floats | None = None


@dataclass(frozen=True, eq=False)
class Chord:
    """Remaining right-hand side (S,) of a node for a chord, and its decrease of the sum of squares."""

    left: Floats
    decrease: float


@dataclass(frozen=True)
class InDatum:
    """Data for the inversion of nodes after the transformation to a datum.

    `common` (d, d) is the sum B^T Q B of the whole block. `last` names the states before and after the last
    step, which precedes the transformation.
    """

    common: Floats
    last: tuple[str, str]


@dataclass(frozen=True, eq=False)
class Inverted:
    """Cofactors for the children of a node, in their order, and W = Q B of a datum."""

    children: list[Floats]
    columns: list[Floats] | None = None


def state_path(folder: Path, number: int, state: str) -> Path:
    return folder / "states" / f"{number:05d}" / f"{state}.npz"


def formed(job: Job, number: int, at: Point, contributions: Sequence[Contribution]) -> Contribution:
    """Form a node at a state and eliminate its own unknowns; the factor is cached.

    RankError if its observations leave unknowns undetermined.
    """
    with shelf.lock:
        node = _node(job, number)
        prediction = _prediction(job, node)
        # Factors at other states are obsolete.
        shelf.drop(lambda key: key[0] == "factor" and key[1:3] == (job.folder, number))
        shelf.make_room(
            prediction["memory_bytes"] - prediction["node_bytes"], job.memory, (job.folder, number)
        )
        state = _arrays(job, node, number, at.state)
        found = node.form(
            state["values"],
            [(_plain(each.row[0]), _plain(each.row[1]), _plain(each.row[2])) for each in contributions],
            damping=at.damping,
            curved=at.curved,
            threads=job.threads,
        )
        row = found.contribution
        if found.undetermined is not None:
            raise job.engine.failure(job.folder, number, found.undetermined)
        columns = products = None
        if "b" in state:
            below = [each.columns for each in contributions if each.columns is not None]
            # B of the own unknowns, and of the contributions of children.
            rights = state["b"].copy()
            rights[:, node.outer] = 0.0
            for rows, left in zip(node.children, below, strict=True):
                rights[:, rows] += left
            columns, products = found.reduce(_plain(rights), threads=job.threads)
            columns = columns.reshape(len(rights), -1)
            # A node may be without own unknowns.
            products = products.reshape(len(rights), -1) if rights.size else np.zeros((len(rights),) * 2)
        told = Formed(found.sum_of_squares, found.decrease, _place(), products)
        shelf.put(_factor_key(job, number, at), found, prediction["factor_bytes"])
        return Contribution(row, told, columns)


def about(contribution: Contribution) -> Formed:
    """Return the summary of a contribution, without its matrix."""
    return contribution.formed


def solved(job: Job, number: int, at: Point, after: str, outer: Floats) -> list[Floats] | Lost:
    """Solve a node for its step from the outer step, and write the new state.

    Return the steps of the outer unknowns of each child, or the loss of the factor.
    """
    with shelf.lock:
        factor: FormedNode | None = shelf.get(_factor_key(job, number, at))
        if factor is None:
            return Lost(number)
        step = factor.solve(_plain(outer), threads=job.threads)
        return _advanced(job, number, at.state, step, after)


def reduced_chord(
    job: Job, number: int, at: Point, after: str, below: Sequence[Chord | None]
) -> Chord | None:
    """Reduce the right-hand side of a node at a state after the step, with the factor before it.

    `after` is the state after the step, `below` are the contributions of the children. Return None if a
    factor is missing or cannot be used for a chord; a chord does not justify a new factor.
    """
    left = [each.left for each in below if each is not None]
    with shelf.lock:
        factor: FormedNode | None = shelf.get(_factor_key(job, number, at))
        if factor is None or len(left) < len(below):
            return None
        state = _state(job, _node(job, number), number, after)
        found = factor.reduce_chord(state, [_plain(each) for each in left], threads=job.threads)
        return None if found is None else Chord(*found)


def solved_chord(
    job: Job,
    number: int,
    at: Point,
    after: str,
    outer: Floats,
    further: str,
    below: Sequence[Chord | None],
) -> list[Floats] | Lost:
    """Solve a node for a chord from the outer chord, and write the state `further`.

    Return the chords of the outer unknowns of each child, or the loss of the factor.
    """
    with shelf.lock:
        factor: FormedNode | None = shelf.get(_factor_key(job, number, at))
        if factor is None:
            return Lost(number)
        if not factor.has_chord:  # it was formed again meanwhile
            reduced_chord(job, number, at, after, below)
        chord = factor.complete(_plain(outer), threads=job.threads)
        return _advanced(job, number, after, chord, further)


def _advanced(job: Job, number: int, state: str, step: Floats, after: str) -> list[Floats]:
    """Write the state of a node after a step; return the steps of each child."""
    node = _node(job, number)
    reached = node.advance(_state(job, node, number, state), step)
    write_state(job, number, after, {"values": reached})
    return [step[rows] for rows in node.children]


def relocated(job: Job, number: int, state: str, after: str) -> tuple[float, float]:
    """Write the state with points at their ray intersections; return both objective functions."""
    with shelf.lock:
        node = _node(job, number)
        before = _state(job, node, number, state)
        moved = node.relocate(before, threads=job.threads)
        write_state(job, number, after, {"values": moved})
        one, other = (node.objective(each, threads=job.threads)[-1] for each in (before, moved))
        return one, other


def evaluated(job: Job, number: int, state: str) -> tuple[float, ...]:
    """Return weighted sums of squares of a node by type, and the objective function."""
    with shelf.lock:
        node = _node(job, number)
        return tuple(node.objective(_state(job, node, number, state), threads=job.threads))


def inverted(
    job: Job,
    number: int,
    at: Point,
    after: str,
    variance: float | None,
    above: Inverted | Lost | None,
    place: int,
    datum: InDatum | None = None,
) -> Inverted | Lost:
    """Invert a node and write its results; return data for the children, or a lost factor.

    The factor is removed. `after` is the final state, `variance` the variance of unit weight of the whole
    block. `above` is from the parent (None for the root), and `place` is the index among its children.
    `datum` transforms the cofactors to a final datum.
    """
    if isinstance(above, Lost):
        return above
    with shelf.lock:
        if shelf.get(_factor_key(job, number, at)) is None:
            return Lost(number)
        node = _node(job, number)
        prediction = _prediction(job, node)
        there = prediction["node_bytes"] + prediction["factor_bytes"]
        shelf.make_room(prediction["memory_bytes"] - there, job.memory, (job.folder, number))
        factor = shelf.take(_factor_key(job, number, at))
        outer = np.zeros(0) if above is None else _plain(above.children[place])
        state = _arrays(job, node, number, after)
        columns = transformation = None
        if datum is not None:
            given = np.zeros(0) if above is None or above.columns is None else above.columns[place]
            w = factor.complete(_plain(given), threads=job.threads)
            before, reached = (_state(job, node, number, each) for each in datum.last)
            transformation = (
                *(_plain(each) for each in (state["t"], w, datum.common, reached - before)),
                float(state["condition"]),
                state["staying"].tolist(),
            )
            columns = [w.reshape(len(state["t"]), -1)[:, rows] for rows in node.children]
        solution, children = factor.invert(outer, state["values"], datum=transformation, threads=job.threads)
        job.engine.keep(job.folder, number, solution, variance)
        return Inverted(children, columns)


def lost(found: object) -> Lost | None:
    """Return the result if it is a lost factor, else None."""
    return found if isinstance(found, Lost) else None


def finished(job: Job, number: int, before: str, after: str, variance: float | None) -> None:
    """Write the results of a node without cofactors."""
    with shelf.lock:
        node = _node(job, number)
        states = [_state(job, node, number, each) for each in (after, before)]
        job.engine.keep(job.folder, number, node.solution(*states, threads=job.threads), variance)


def redundancies(job: Job, number: int) -> tuple[float, float, float, float]:
    """Return the sums of redundancy numbers of a node by type."""
    return job.engine.redundancies(job.folder, number)


def settled(job: Job, number: int, variance: float | None) -> None:
    """Scale the results of a node by the final variance of unit weight."""
    with shelf.lock:
        job.engine.settle(job.folder, number, variance)


def counted(job: Job, number: int) -> tuple[int, int, int, int, int, int]:
    """Return the numbers of observations and unknowns at home in a node.

    Order: observations, weighted unknowns, unknowns that are not fixed, weighted unknowns of photos and
    cameras, all unknowns, and 1 if its last steps may decrease slowly, so that a chord is useful.
    """
    with shelf.lock:
        node = _node(job, number)
        size = len(node.initial) - len(node.outer)
        return *node.counts, job.engine.stations(job.folder, number), size, int(node.converges_linearly)


def located(job: Job, number: int, state: str) -> tuple[Indices, Floats]:
    """Return (N, 3) owners of the unknowns of a node in the whole block, and (N,) values."""
    with shelf.lock:
        node = _node(job, number)
        return job.engine.unknowns(job.folder, number, node), _state(job, node, number, state)


def predicted(job: Job, number: int) -> dict[str, float]:
    with shelf.lock:
        return _prediction(job, _node(job, number))


def _prediction(job: Job, node: Node) -> dict[str, float]:
    """Return the predicted work and memory of a node, with columns of a datum."""
    if not job.columns:
        return dict(node.prediction(job.threads))
    size = len(node.initial)
    kept, sent = 8.0 * size * (job.columns + LANES), 8.0 * job.columns * len(node.outer)
    # B, T, W and copies of them in the order of the core.
    more = {"factor_bytes": kept, "memory_bytes": kept + 6.0 * 8.0 * job.columns * size}
    more |= {"contribution_bytes": sent, "cofactor_bytes": sent}
    return {name: value + more.get(name, 0.0) for name, value in node.prediction(job.threads).items()}


def _plain(values: Floats) -> Floats:
    """Return an aligned array for the core; received arrays may be unaligned."""
    return np.require(values, np.float64, ["C_CONTIGUOUS", "ALIGNED"])


def _place() -> str:
    """Return the address of this worker; empty outside of a worker."""
    distributed = sys.modules.get("distributed")
    try:
        return "" if distributed is None else str(distributed.get_worker().address)
    except ValueError:
        return ""


def _node(job: Job, number: int) -> Node:
    if job.version != _photocore.__version__:
        raise InputError(phrase("parts.versions", version=job.version, workers=[platform.node()]))
    key = "node", job.folder, number
    found: Node | None = shelf.get(key)
    if found is None:
        found = job.engine.node(job.folder, number)
        # Release the memory of the tables.
        give_back()
        shelf.make_room(0.0, job.memory, (job.folder, number))
        shelf.put(key, found, found.prediction(job.threads)["node_bytes"])
    return found


def _factor_key(job: Job, number: int, at: Point) -> tuple[Any, ...]:
    return "factor", job.folder, number, at


def _state(job: Job, node: Node, number: int, state: str) -> Floats:
    return _arrays(job, node, number, state)["values"]


def _arrays(job: Job, node: Node, number: int, state: str) -> dict[str, np.ndarray]:
    """Return the `values` of a state, and cofactor data if it was transformed to a datum."""
    if state == GIVEN:
        return {"values": node.initial}
    path = state_path(job.folder, number, state)
    found = read_arrays(path)
    sealed = found.pop("seal", None)
    if "values" not in found or str(sealed) != _seal(job, number, state, found):
        raise InputError(phrase("parts.other-state"), file=path)
    return found


def write_state(job: Job, number: int, state: str, arrays: dict[str, np.ndarray]) -> None:
    """Write a state of a node: `values` and related arrays."""
    path = state_path(job.folder, number, state)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(path, {**arrays, "seal": np.array(_seal(job, number, state, arrays))})


def _seal(job: Job, number: int, state: str, arrays: dict[str, np.ndarray]) -> str:
    """Return a hash of arrays with their run, node and step."""
    digest = hashlib.sha256(f"{job.source} {number} {state}".encode())
    for name, values in sorted(arrays.items()):
        digest.update(f" {name} {values.dtype.str} {values.shape}".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
