"""The iterations of a block that is adjusted in parts: up the tree, down again, and control of the steps.

Steps and their rules are those of one process (`crates/photocore/src/adjustment/damped.rs`): full steps, one
that raises the sum of squares is taken back and damped, the last one is told by its length or by the rate at
which steps fall. What is decided here rests on sums over all nodes, added in the order of their numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress
from photogram.arguments.types import Floats
from photogram.declared import dataclass
from photogram.distributed.course import Course
from photogram.distributed.cut import Tree
from photogram.distributed.datum import InDatum, Mover
from photogram.distributed.executors import Executor, Handle
from photogram.distributed.reforming import Reforming
from photogram.distributed.tasks import (
    Formed,
    Job,
    Lost,
    Point,
    about,
    counted,
    evaluated,
    finished,
    formed,
    inverted,
    located,
    lost,
    redundancies,
    relocated,
    settled,
    solved,
    state_path,
    write_state,
)
from photogram.errors import AdjustmentError, PhotogramError, RankError
from photogram.results.iteration import Iteration

__all__ = ["Driver", "Outcome", "Stop"]

RULES = _photocore.step_rules()
"""The constants of the rules of steps, which are those of one process."""
ALIKE = round(RULES["alike"])
ATTEMPTS = 20
"""So often is a node formed again that a worker has taken with it."""


@dataclass(frozen=True)
class Stop:
    """When to stop: the options of :func:`photogram.adjust` of the same names."""

    tolerance: float = 1e-5
    max_iterations: int = 50
    covariance: bool = True
    unit_variance: str = "constrained"
    reweighted: bool = False
    """Whether a loss weights the observations."""
    as_published: bool = False
    """Whether steps are those of the 1987 program: the tolerance is its percentage."""


@dataclass(frozen=True)
class Outcome:
    """What an adjustment in parts has come to.

    Attributes
    ----------
    status
        `converged`, `not converged` or `diverged`.
    initial_sum_of_squares, iterations
        The history.
    sums_of_squares
        Weighted, of camera, ground, plates and observations beside images.
    counts
        Observations, weighted unknowns, unknowns.
    degrees_of_freedom, variance_of_unit_weight
        Of the chosen unit variance; None without degrees of freedom.
    state, before
        The last state of the nodes, and the one before the last step.
    formations
        How often the normal equations were formed.
    """

    status: str
    initial_sum_of_squares: float
    iterations: list[Iteration]
    sums_of_squares: tuple[float, float, float, float]
    counts: tuple[int, int, int]
    degrees_of_freedom: float
    variance_of_unit_weight: float | None
    state: str
    before: str
    formations: int


@dataclass
class _Up:
    """Normal equations that are formed: what every node leaves, and the sums."""

    at: Point
    contributions: dict[int, Handle]
    sum_of_squares: float
    decrease: float
    products: Floats | None
    """B^T Q B, where the block was moved to a datum."""


class LostFactorError(PhotogramError):
    """The factor of a node is lost: it has to be formed again.

    Parameters
    ----------
    number
        The node.
    """

    def __init__(self, number: int) -> None:
        super().__init__(f"the factor of node {number} is lost")
        self.number = number


class Driver:
    """Adjusts in parts.

    Parameters
    ----------
    job
        What tasks are told.
    tree
        The tree of the nodes.
    executor
        Does the tasks.
    stop
        When to stop.
    progress
        Told of parts done.
    mover
        Takes the block to a datum when it is adjusted.
    """

    def __init__(
        self,
        job: Job,
        tree: Tree,
        executor: Executor,
        stop: Stop,
        progress: Callable[[Progress], None] | None = None,
        mover: Mover | None = None,
    ) -> None:
        self.job, self.tree, self.executor, self.stop = job, tree, executor, stop
        self._progress, self._mover = progress, mover
        self._course = Course()
        # Neighbours to one worker: less is sent. Later, where nodes were last: they need not be read again.
        places, parts = executor.places(), int(tree.spans[:, 1].max())
        self._places = [places[first * len(places) // parts] for first in tree.spans[:, 0].tolist()]
        self._nodes = range(len(tree))
        heights = np.zeros(len(tree))
        for node in range(tree.root - 1, -1, -1):
            heights[node] = heights[tree.parents[node]] + 1
        # Deep nodes first: what waits for them waits longest.
        self._costs = heights.tolist()

    def run(self, *, resume: bool = False) -> Outcome:
        """Adjust; with `resume` from the last complete iteration that the folder of the run has.

        Raises
        ------
        RankError
            The observations do not determine all unknowns.
        AdjustmentError
            The initial values give no finite sum of squares; a disk is full, a worker was lost too often: the
            state of the last complete iteration stays.
        """
        if resume:
            self._course = Course.read(self.job)
        try:
            return self._run()
        except BaseException:
            self.executor.stop()
            raise

    def _run(self) -> Outcome:
        course = self._course
        self._unknowns = self._counts()
        if course.ending is not None:
            return self._finish(None)
        up = self._up(Point(course.state, course.damping, course.curved))
        if not math.isfinite(up.sum_of_squares):
            raise AdjustmentError("the initial values give no finite image coordinates")
        if not course.iterations:
            course.initial = course.best = up.sum_of_squares
            if self._mover is not None:
                # A datum that is not carried is refused before anything is adjusted.
                self._in_datum(self._mover, course.state)
        return self._full_steps(up) if self.stop.as_published else self._damped_steps(up)

    def _full_steps(self, up: _Up) -> Outcome:
        """Take full steps, whatever becomes of the sum of squares (GIANT guide, section 6)."""
        course = self._course
        while (status := self._as_published()) is None:
            change = math.sqrt(max(up.decrease, 0.0))
            after = self._step(up)
            self._forget(up)
            up = self._up(Point(after))
            if not math.isfinite(up.sum_of_squares):
                self._forget(up)
                self._remove(after)
                return self._end("diverged", self._up(Point(course.state)), None)
            self._accept(Iteration(len(course.iterations) + 1, up.sum_of_squares, change, 0.0), up.at)
        return self._end(status, up, None)

    def _as_published(self) -> str | None:
        """Return how full steps have ended, by what the last one has changed; None where they have not."""
        *_, last = sums = [each.weighted_sum_of_squares for each in self._course.iterations] or [math.nan]
        change = 100.0 * (last / sums[-2] - 1.0) if len(sums) > 1 else math.nan
        if abs(change) < self.stop.tolerance:
            return "converged"
        if change >= self.stop.tolerance:
            return "diverged"
        return "not converged" if len(self._course.iterations) >= self.stop.max_iterations else None

    def _damped_steps(self, up: _Up) -> Outcome:
        """Take steps that lower the sum of squares."""
        course = self._course
        while len(course.iterations) < self.stop.max_iterations and up.at.damping <= RULES["most_damping"]:
            change = math.sqrt(max(up.decrease, 0.0))
            if up.at.damping == 0.0 and (self._is_last(change) or self._falls_no_more(change)):
                return self._end("converged", up, change)
            up, still = self._take(up, change)
            if still:
                return self._end("converged", up, None)
        lost = up.at.damping > RULES["most_damping"]
        return self._end("diverged" if lost else "not converged", up, None)

    def _is_last(self, change: float) -> bool:
        """Whether a full step is the last one, by its length or by those that would follow (Hairer, IV.8)."""
        if change <= self.stop.tolerance:
            return True
        before = self._course.iterations[-1] if self._course.iterations else None
        rate = change / before.largest_change if before is not None and before.damping == 0.0 else 1.0
        leaves_cofactors = change <= max(
            RULES["negligible"], RULES["in_the_mean"] * math.sqrt(self._unknowns[4])
        )
        return leaves_cofactors and rate < 1.0 and rate / (1.0 - rate) * change <= self.stop.tolerance

    def _falls_no_more(self, change: float) -> bool:
        """Whether full steps are negligible and have long been as long as this one: rounding, no more."""
        last = self._course.iterations[-ALIKE:]
        least = RULES["negligible"]
        negligible = all(each.damping == 0.0 and each.largest_change <= least for each in last)
        alike = len(last) == ALIKE and change > RULES["falling"] * last[0].largest_change
        return change <= least and negligible and alike

    def _take(self, up: _Up, change: float) -> tuple[_Up, bool]:
        """Take a step, or take it back and go on with more damping.

        Returns
        -------
        What is formed next, and whether the sum of squares has stood still there.
        """
        course, damping = self._course, up.at.damping
        after = self._step(up)
        if change > RULES["far"] * math.sqrt(self._unknowns[4]):
            after = self._relocated(after)
        self._forget(up)
        relaxed = damping / 10.0 if damping / 10.0 >= RULES["least_damping"] else 0.0
        negligible = damping == 0.0 and change <= RULES["negligible"]
        try:
            following = self._up(Point(after, relaxed, course.near))
        except RankError:
            # A step that leaves something undetermined has failed.
            return self._refuse(damping)
        if not (negligible or following.sum_of_squares <= course.best * (1.0 + RULES["rounding"])):
            self._forget(following)
            self._remove(after)
            return self._refuse(damping)
        course.best = following.sum_of_squares
        iteration = Iteration(len(course.iterations) + 1, following.sum_of_squares, change, damping)
        self._accept(iteration, following.at)
        return following, False

    def _refuse(self, damping: float) -> tuple[_Up, bool]:
        """Go on from the same values with more damping, or end where the sum of squares has stood still."""
        course, still = self._course, False
        if damping == 0.0:
            freedom = max(self._unknowns[0] + self._unknowns[1] - self._unknowns[2], 1)
            least = RULES["still"] * max(course.best / freedom, 1.0)
            before, course.refused = course.refused, course.best
            still = before is not None and before - course.best <= least
        harder = 0.0 if still else max(10.0 * damping, RULES["first_damping"])
        return self._up(Point(course.state, harder, course.near)), still

    def _accept(self, iteration: Iteration, at: Point) -> None:
        """Keep an iteration that stands; the states before it are needed no longer."""
        course = self._course
        old, course.before, course.state = course.before, course.state, at.state
        course.damping, course.curved = at.damping, at.curved
        course.near = self.stop.reweighted and iteration.largest_change <= RULES["near"]
        course.iterations.append(iteration)
        course.write(self.job)
        if old not in (course.before, course.state):
            self._remove(old)
        self._tell("iteration", iteration.number, 0, iteration)

    def _end(self, status: str, up: _Up, change: float | None) -> Outcome:
        """Take the last step, where there is one, and finish.

        Where the iterations end without a step the cofactors are those of the equations at the values
        reached; else of those that have given the last step, unless these have a loss's second-order term.
        """
        course = self._course
        if change is not None:
            after = self._step(up)
            last = Iteration(len(course.iterations) + 1, self._evaluated(after)[-1], change, 0.0)
            if not up.at.curved:
                course.ending = status, course.state, after
                self._accept(last, Point(after))
                return self._finish(up)
            self._accept(last, Point(after))
        course.ending = status, course.state, course.state
        course.write(self.job)
        if up.at == Point(course.state):
            return self._finish(up)
        self._forget(up)
        return self._finish(None)

    def _finish(self, up: _Up | None) -> Outcome:
        """Invert, and write the results: all that is left when the iterations are over.

        Where there is a datum to go to, the normal equations are formed once more there.
        """
        course = self._course
        assert course.ending is not None
        status, formed, after = course.ending
        last = course.before, after
        if self._mover is not None:
            if up is not None:
                self._forget(up)
            formed = f"{after}-in-datum"
            for node, arrays in enumerate(self._in_datum(self._mover, after)):
                write_state(self.job, node, formed, arrays)
            after, up = formed, None
        if up is None:
            up = self._up(Point(formed))
        sums = self._evaluated(after)[:4]
        freedom, variance = self._variance(sums)
        if self.stop.covariance:
            datum = None if up.products is None else InDatum(up.products, last)
            self._invert(up, after, variance, datum)
            if self.stop.unit_variance == "redundancy":
                freedom, variance = self._settled(sums)
        else:
            self._sums([self._do(finished, n, course.before, after, variance) for n in self._nodes], "invert")
        self._forget(up)
        return Outcome(
            status,
            course.initial,
            course.iterations,
            sums,
            self._unknowns[:3],
            freedom,
            variance,
            after,
            course.before,
            course.formations,
        )

    def _in_datum(self, mover: Mover, state: str) -> list[dict[str, np.ndarray]]:
        """Return a state of all nodes as it is moved to the datum, with what takes cofactors there."""
        return mover(self._sums([self._do(located, n, state) for n in self._nodes], "solve"))

    def _evaluated(self, state: str) -> tuple[float, float, float, float, float]:
        """Return weighted sums of squares of all nodes, by kinds, and what is minimised."""
        found = np.array(self._sums([self._do(evaluated, n, state) for n in self._nodes], "solve"))
        # One after the other: NumPy's own order depends on how many there are.
        camera, ground, plates, others, minimised = (sum(column) for column in found.T.tolist())
        return camera, ground, plates, others, minimised

    def _variance(self, sums: tuple[float, float, float, float]) -> tuple[float, float | None]:
        """Return degrees of freedom and variance of unit weight (GIANT guide, Appendix E)."""
        observations, weighted, unknowns, stations, _ = self._unknowns
        freedom, kind = observations + weighted - unknowns, self.stop.unit_variance
        total = sum(sums)
        if kind == "unity":
            return freedom, 1.0
        if kind == "free":
            freedom, total = freedom - stations, total - sums[0]
        if kind == "redundancy":  # these are known when all nodes are inverted
            return freedom, None
        return freedom, total / freedom if freedom > 0 else None

    def _settled(self, sums: tuple[float, float, float, float]) -> tuple[float, float | None]:
        """Have the nodes scale what they have found by q / r, of all but photos (docs/weights.md).

        Returns
        -------
        The sum of redundancy numbers r and the variance of unit weight; None without redundancy.
        """
        found = self._sums([self._do(redundancies, n) for n in self._nodes], "invert")
        freedom = math.fsum(own for _, *measured in found for own in measured)
        variance = sum(sums[1:]) / freedom if freedom > RULES["least_redundancy"] else None
        self._sums([self._do(settled, n, variance) for n in self._nodes], "invert")
        return round(freedom, 6), variance

    def _counts(self) -> tuple[int, int, int, int, int]:
        found = self._sums([self._do(counted, n) for n in self._nodes], "read")
        observations, weighted, unknowns, stations, size = np.array(found).sum(axis=0).tolist()
        return observations, weighted, unknowns, stations, size

    def _up(self, at: Point) -> _Up:
        """Form all nodes, children before parents."""
        handles: dict[int, Handle] = {}
        for node in self._nodes:
            below = [handles[child] for child in self.tree.children[node]]
            handles[node] = self._do(formed, node, at, below)
        told = [self.executor.submit(about, handles[node]) for node in self._nodes]
        try:
            found: list[Formed] = self._sums(told, "form")
        except BaseException:
            self.executor.forget([*told, *handles.values()])
            raise
        self._course.formations += 1
        self._places = [each.place for each in found]
        return _Up(
            at,
            handles,
            sum(each.sum_of_squares for each in found),
            sum(each.decrease for each in found),
            _added([each.products for each in found if each.products is not None]),
        )

    def _step(self, up: _Up) -> str:
        """Solve from the root down; every node writes its state after the step. Return the name of that."""
        self._course.trials += 1
        after = f"{self._course.trials}"
        wanted: dict[int, Floats] = {self.tree.root: np.zeros(0)}

        def task(node: int) -> Handle:
            return self._do(solved, node, up.at, after, wanted[node])

        def then(node: int, handle: Handle) -> None:
            wanted.update(zip(self.tree.children[node], self._found(handle), strict=True))
            self.executor.forget([handle])

        self._down(up, task, then, "solve")
        return after

    def _invert(self, up: _Up, after: str, variance: float | None, datum: InDatum | None) -> None:
        """Invert from the root down; every node writes what has become of it.

        What a node has handed down, and what its children have left, stays until all below it is done: they
        are needed again where a worker is lost.
        """
        done: dict[int, Handle] = {}
        left = [1 + sum(1 for other in self._nodes if node in self.tree.above(other)) for node in self._nodes]

        def task(node: int) -> Handle:
            parent = int(self.tree.parents[node])
            place = 0 if parent < 0 else self.tree.children[parent].index(node)
            above = None if parent < 0 else done[parent]
            return self._do(inverted, node, up.at, after, variance, above, place, datum)

        def then(node: int, handle: Handle) -> None:
            # Cofactors stay where they are: this asks only whether they are there.
            self._found(self.executor.submit(lost, handle))
            if node in done:
                self.executor.forget([done[node]])
            else:
                for each in (node, *self.tree.above(node)):
                    left[each] -= 1
                    if not left[each] and each != node:
                        below = [up.contributions[child] for child in self.tree.children[each]]
                        self.executor.forget([done[each], *below])
            done[node] = handle
            if not self.tree.children[node]:
                self.executor.forget([handle])

        self._down(up, task, then, "invert")

    def _down(
        self, up: _Up, task: Callable[[int], Handle], then: Callable[[int, Handle], None], phase: str
    ) -> None:
        """Do a task of every node, parents before children.

        A node whose factor was lost with its worker is formed again from what its children have left. What a
        parent has handed down may be lost too, and Dask cannot make it again without that factor: then the
        parent goes first, and what waits for it after it.
        """
        parents = self.tree.parents.tolist()
        waiting: dict[Handle, tuple[int, int]] = {}
        reforming = Reforming(lambda node: self._form_again(up, node), lambda node: self._places[node])
        rounds = [0] * (len(self.tree) + 1)
        again: dict[int, list[int]] = {}
        failures = 0

        def begin(node: int) -> None:
            waiting[task(node)] = node, rounds[parents[node]]

        begin(self.tree.root)
        while waiting or reforming.handles:
            handle = self.executor.first([*waiting, *reforming.handles])
            if handle in reforming.handles:
                node = reforming.handles.pop(handle)
                self._places[node] = self.executor.value(handle).place
                begin(node)
                continue
            node, since = waiting.pop(handle)
            parent = parents[node]
            reforming.over(node)
            try:
                then(node, handle)
            except LostFactorError as missed:
                failures += 1
                if failures > ATTEMPTS * len(self.tree):
                    raise AdjustmentError(
                        "workers were lost too often; the run can be taken up again"
                    ) from None
                if missed.number == node:
                    reforming.begin(node)
                elif parent in again:
                    again[parent].append(node)
                elif rounds[parent] > since:
                    begin(node)
                else:
                    again[parent] = [node]
                    begin(parent)
                continue
            rounds[node] += 1
            if rounds[node] == 1:
                self._tell(phase, sum(map(bool, rounds)), len(self.tree))
            for each in again.pop(node, []) if rounds[node] > 1 else self.tree.children[node]:
                begin(each)

    def _form_again(self, up: _Up, node: int) -> Handle:
        """Have a node formed again whose factor was lost; return the handle of what tells of it."""
        below = [up.contributions[child] for child in self.tree.children[node]]
        old = up.contributions[node]
        up.contributions[node] = self._do(formed, node, up.at, below)
        self.executor.forget([old])
        return self.executor.submit(about, up.contributions[node])

    def _relocated(self, state: str) -> str:
        """Return the state with points intersected anew, where that lowers the sum of squares."""
        self._course.trials += 1
        other = f"{self._course.trials}"
        sums = np.array(self._sums([self._do(relocated, n, state, other) for n in self._nodes], "solve"))
        before, moved = sums.sum(axis=0).tolist()
        self._remove(state if moved < before else other)
        return other if moved < before else state

    def _do(self, function: Callable[..., Any], node: int, *given: Any) -> Handle:
        near, cost = self._places[node], self._costs[node]
        return self.executor.submit(function, self.job, node, *given, near=near, cost=cost)

    def _found(self, handle: Handle) -> Any:
        """Return what a task has given that needs a factor; raises LostFactorError."""
        found = self.executor.value(handle)
        if isinstance(found, Lost):
            raise LostFactorError(found.number)
        return found

    def _sums(self, handles: list[Handle], phase: str) -> list[Any]:
        """Return what tasks of all nodes give, in the order of the nodes, however they arrive."""
        waiting = dict(zip(handles, self._nodes, strict=True))
        found: dict[int, Any] = {}
        while waiting:
            handle = self.executor.first(waiting)
            found[waiting.pop(handle)] = self.executor.value(handle)
            self._tell(phase, len(found), len(handles))
        self.executor.forget(handles)
        return [found[node] for node in self._nodes]

    def _forget(self, up: _Up) -> None:
        self.executor.forget(list(up.contributions.values()))

    def _remove(self, state: str) -> None:
        for node in self._nodes:
            state_path(self.job.folder, node, state).unlink(missing_ok=True)

    def _tell(self, phase: str, done: int, total: int, iteration: Iteration | None = None) -> None:
        if self._progress is not None:
            self._progress(Progress(phase, done, total, iteration))


def _added(products: list[Floats]) -> Floats | None:
    """Return a sum in the order of the nodes; None of nothing."""
    return np.sum(products, axis=0) if products else None
