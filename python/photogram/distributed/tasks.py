"""What is done of a node, wherever it is done: functions of the folder of a run and of what they are given.

A worker keeps nodes and factors on a shelf of its own. What is not there any more is made again: a node from
its part, the state from its file. A factor also takes what the children have left, which only the driver can
ask for: a task that misses one says so (:class:`Lost`).
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
from photogram.distributed.datum import LANES, InDatum
from photogram.distributed.files import read_arrays, write_arrays
from photogram.distributed.shelf import shelf
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.memory import give_back
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram._photocore import ContributionRow, FormedNode, Node
    from photogram.distributed.nodes import CoreEngine

GIVEN = "0"  # The state that the nodes themselves give


@dataclass(frozen=True)
class Lost:
    """What a task gives whose node, of this number, has lost its factor: it has to be formed again.

    No error, which Dask would log as a failure.
    """

    number: int


@dataclass(frozen=True)
class Job:
    """What all tasks of a run are told.

    Its folder is on a disk that all workers see; every worker has the version of the package on the machine
    that drives. `threads` are of each task, 0 for all processors, `memory` the bytes that a process may hold,
    None for any number; `source` tells the block and its options from others; `columns` are how many
    right-hand sides the datum takes that the block is moved to at the end, 0 without one.
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
    """Where normal equations are formed: a state of all nodes, the damping, a loss's second order."""

    state: str
    damping: float = 0.0
    curved: bool = False


@dataclass(frozen=True)
class Formed:
    """What the driver wants to know of a node that was formed."""

    sum_of_squares: float
    decrease: float
    place: str
    products: Floats | None = None  # (d, d) its share in B^T Q B, where there is a datum to go to


@dataclass(frozen=True, eq=False)
class Contribution:
    """What a node leaves to its parent, and what the driver wants to know.

    `columns`: (d, S) what it leaves of right-hand sides for a datum, where there is one to go to.
    """

    row: ContributionRow
    formed: Formed
    columns: Floats | None = None


@dataclass(frozen=True, eq=False)
class Chord:
    """(S,) what a node leaves of the right-hand side of a chord, and what it lowers the sum of squares by."""

    left: Floats
    decrease: float


@dataclass(frozen=True, eq=False)
class Inverted:
    """The cofactors that the children of a node go on with, in their order, and W = Q B of a datum."""

    children: list[Floats]
    columns: list[Floats] | None = None


def state_path(folder: Path, number: int, state: str) -> Path:
    """Return where a state of a node is kept."""
    return folder / "states" / f"{number:05d}" / f"{state}.npz"


def formed(job: Job, number: int, at: Point, contributions: Sequence[Contribution]) -> Contribution:
    """Form a node at a state and eliminate what is at home there; its factor stays on the shelf.

    RankError: its observations leave something undetermined.
    """
    with shelf.lock:
        node = _node(job, number)
        prediction = _prediction(job, node)
        # A factor at another state is of no use any more.
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
            # B of what is at home here, and what the children have left.
            rights = state["b"].copy()
            rights[:, node.outer] = 0.0
            for rows, left in zip(node.children, below, strict=True):
                rights[:, rows] += left
            columns, products = found.reduce(_plain(rights), threads=job.threads)
            columns = columns.reshape(len(rights), -1)
            # A node may have nothing to eliminate.
            products = products.reshape(len(rights), -1) if rights.size else np.zeros((len(rights),) * 2)
        told = Formed(found.sum_of_squares, found.decrease, _place(), products)
        shelf.put(_factor_key(job, number, at), found, prediction["factor_bytes"])
        return Contribution(row, told, columns)


def about(contribution: Contribution) -> Formed:
    """Return what the driver wants to know, without the matrix."""
    return contribution.formed


def solved(job: Job, number: int, at: Point, after: str, outer: Floats) -> list[Floats] | Lost:
    """Solve a node for its step, given that of the outer unknowns, and write the state after it.

    Returns the steps of what each child is over; or that its factor is lost.
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
    """Reduce the right-hand side that the equations of a node have after a step; its factor is of before.

    `after` is the state after the step, `below` what the children have left. None where a factor is lost, or
    has not kept what this takes: no chord is worth another one.
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
    """Solve a node for a chord, given that of the outer unknowns, and write the state `further` after it.

    Returns the chords of what each child is over; or that its factor is lost. Else as :func:`reduced_chord`.
    """
    with shelf.lock:
        factor: FormedNode | None = shelf.get(_factor_key(job, number, at))
        if factor is None:
            return Lost(number)
        if not factor.has_chord:  # it was formed again since
            reduced_chord(job, number, at, after, below)
        chord = factor.solve_chord(_plain(outer), threads=job.threads)
        return _advanced(job, number, after, chord, further)


def _advanced(job: Job, number: int, state: str, step: Floats, after: str) -> list[Floats]:
    """Write the state after a step of a node from another; return the steps of what each child is over."""
    node = _node(job, number)
    reached = node.advance(_state(job, node, number, state), step)
    write_state(job, number, after, {"values": reached})
    return [step[rows] for rows in node.children]


def relocated(job: Job, number: int, state: str, after: str) -> tuple[float, float]:
    """Write the state with points where their rays meet; return what is minimised at both."""
    with shelf.lock:
        node = _node(job, number)
        before = _state(job, node, number, state)
        moved = node.relocate(before, threads=job.threads)
        write_state(job, number, after, {"values": moved})
        one, other = (node.objective(each, threads=job.threads)[-1] for each in (before, moved))
        return one, other


def evaluated(job: Job, number: int, state: str) -> tuple[float, ...]:
    """Return the weighted sums of squares of a node at a state, by kinds, and what is minimised there."""
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
    """Invert a node, and write what has become of its observations and unknowns; or say which factor is lost.

    The factor at a point is used up. `after` is the state reached, `variance` that of unit weight of the
    whole, `above` what the parent has handed down, None for the root, `place` which of its children this is.
    Where the block was moved to a datum, `datum` takes cofactors there.
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
    """Return what a task has given where it is a factor that is lost, and nothing of all else."""
    return found if isinstance(found, Lost) else None


def finished(job: Job, number: int, before: str, after: str, variance: float | None) -> None:
    """Write what has become of a node, without cofactors."""
    with shelf.lock:
        node = _node(job, number)
        states = [_state(job, node, number, each) for each in (after, before)]
        job.engine.keep(job.folder, number, node.solution(*states, threads=job.threads), variance)


def redundancies(job: Job, number: int) -> tuple[float, float, float, float]:
    """Return the sums of redundancy numbers, by kinds, that a node has written."""
    return job.engine.redundancies(job.folder, number)


def settled(job: Job, number: int, variance: float | None) -> None:
    """Scale what has become of a node by a variance of unit weight that is known since."""
    with shelf.lock:
        job.engine.settle(job.folder, number, variance)


def counted(job: Job, number: int) -> tuple[int, int, int, int, int, int]:
    """Return how many observations and unknowns are at home in a node.

    Observations, weighted unknowns, unknowns that are not fixed; weighted unknowns of photos and cameras;
    unknowns, fixed ones too; 1 where its last steps may fall slowly, so that a chord pays.
    """
    with shelf.lock:
        node = _node(job, number)
        size = len(node.initial) - len(node.outer)
        return *node.counts, job.engine.stations(job.folder, number), size, int(node.ends_slowly)


def located(job: Job, number: int, state: str) -> tuple[Indices, Floats]:
    """Return (N, 3) what the unknowns of a node belong to in the whole block, and (N,) a state of them."""
    with shelf.lock:
        node = _node(job, number)
        return job.engine.unknowns(job.folder, number, node), _state(job, node, number, state)


def predicted(job: Job, number: int) -> dict[str, float]:
    """Return what work and memory a node takes."""
    with shelf.lock:
        return _prediction(job, _node(job, number))


def _prediction(job: Job, node: Node) -> dict[str, float]:
    """Return what work and memory a node takes, with its columns for a datum."""
    if not job.columns:
        return dict(node.prediction)
    size = len(node.initial)
    kept, sent = 8.0 * size * (job.columns + LANES), 8.0 * job.columns * len(node.outer)
    # B, T, W and copies of them in the order of the core.
    more = {"factor_bytes": kept, "memory_bytes": kept + 6.0 * 8.0 * job.columns * size}
    more |= {"contribution_bytes": sent, "cofactor_bytes": sent}
    return {name: value + more.get(name, 0.0) for name, value in node.prediction.items()}


def _plain(values: Floats) -> Floats:
    """Return an array as the core takes it: what comes over the wire may stand at any address."""
    return np.require(values, np.float64, ["C_CONTIGUOUS", "ALIGNED"])


def _place() -> str:
    """Return the address of the worker that this is; empty where it is none."""
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
        # Tables were read for it.
        give_back()
        shelf.make_room(0.0, job.memory, (job.folder, number))
        shelf.put(key, found, found.prediction["node_bytes"])
    return found


def _factor_key(job: Job, number: int, at: Point) -> tuple[Any, ...]:
    return "factor", job.folder, number, at


def _state(job: Job, node: Node, number: int, state: str) -> Floats:
    return _arrays(job, node, number, state)["values"]


def _arrays(job: Job, node: Node, number: int, state: str) -> dict[str, np.ndarray]:
    """Return the `values` of a state and, where it was moved to a datum, what takes cofactors there."""
    if state == GIVEN:
        return {"values": node.initial}
    path = state_path(job.folder, number, state)
    found = read_arrays(path)
    sealed = found.pop("seal", None)
    if "values" not in found or str(sealed) != _seal(job, number, state, found):
        raise InputError(phrase("parts.other-state"), file=path)
    return found


def write_state(job: Job, number: int, state: str, arrays: dict[str, np.ndarray]) -> None:
    """Write a state of a node: its `values`, and what belongs to them."""
    path = state_path(job.folder, number, state)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_arrays(path, {**arrays, "seal": np.array(_seal(job, number, state, arrays))})


def _seal(job: Job, number: int, state: str, arrays: dict[str, np.ndarray]) -> str:
    """Return what binds arrays to the run, node and step that they belong to."""
    digest = hashlib.sha256(f"{job.source} {number} {state}".encode())
    for name, values in sorted(arrays.items()):
        digest.update(f" {name} {values.dtype.str} {values.shape}".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
