"""Iterations of a partitioned adjustment: up the tree, down the tree, and step control.

Steps and rules are the same as in one process (`crates/photocore/src/adjustment/steps.rs`). Full steps are
tried first; a step that raises the sum of squares is undone and damped. The length of steps or their rate of
decrease indicates the last one. All decisions use sums over the nodes, added in the order of their numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress
from photogram.arguments.types import Floats
from photogram.distributed import tasks
from photogram.distributed.cut import Tree
from photogram.distributed.executors import Executor, Handle
from photogram.distributed.run import Course
from photogram.distributed.tasks import Chord, InDatum, Job, Point, reduced_chord, solved_chord
from photogram.distributed.walks import Up, Walks
from photogram.errors import AdjustmentError, RankError
from photogram.lazy_dataclasses import dataclass
from photogram.network.core_arrays import CoreOptions
from photogram.results.parts import Iteration
from photogram.words import phrase

RULES = _photocore.step_rules()  # Constants of the step rules, shared with adjustments in one process


@dataclass(frozen=True)
class Outcome:
    """Outcome of a partitioned adjustment: `converged`, `not converged` or `diverged`.

    Weighted sums of squares are of photos, control, image coordinates and additional observations. `counts`
    are observations, weighted unknowns and unknowns. Degrees of freedom and variance follow the selected unit
    variance; the variance is None without degrees of freedom. `state` is the last state of the nodes,
    `before` the state before the last step. `formations` counts the formations of normal equations.
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


class Driver:
    """Partitioned adjustment; `mover` transforms the values of all nodes to a datum."""

    def __init__(
        self,
        job: Job,
        tree: Tree,
        executor: Executor,
        options: CoreOptions,
        progress: Callable[[Progress], None] | None = None,
        mover: Callable[[list[Any]], list[dict[str, np.ndarray]]] | None = None,
    ) -> None:
        self.job, self.options, self._mover = job, options, mover
        self._walks, self._course = Walks(job, tree, executor, progress), Course()

    def run(self, *, resume: bool = False) -> Outcome:
        """Adjust; with `resume`, continue from the last complete iteration in the folder of the run.

        RankError if the observations do not determine all unknowns. AdjustmentError if initial values give no
        finite sum of squares, a disk is full, or a worker was lost too often. The last complete iteration
        remains on disk.
        """
        if resume:
            self._course = Course.read(self.job.folder, self.job.source)
        try:
            return self._run()
        except BaseException:
            self._walks.executor.stop()
            raise

    def _run(self) -> Outcome:
        course = self._course
        found = np.array(self._walks.all(tasks.counted, phase="read")).sum(axis=0)
        self._unknowns: tuple[int, int, int, int, int, int] = tuple(found.tolist())
        if course.ending is not None:
            return self._finish(None)
        up = self._up(Point(course.state, course.damping, course.curved))
        if not math.isfinite(up.sum_of_squares):
            raise AdjustmentError(phrase("parts.not-finite"))
        if not course.iterations:
            course.initial = course.best = up.sum_of_squares
            if self._mover is not None:
                # Reject an undefined datum before the adjustment.
                self._mover(self._walks.all(tasks.located, course.state, phase="solve"))
        return self._full_steps(up) if self.options.criterion == "percent" else self._damped_steps(up)

    def _full_steps(self, up: Up) -> Outcome:
        """Take full steps regardless of the sum of squares (GIANT guide, section 6)."""
        course = self._course
        while (status := self._as_published()) is None:
            change = math.sqrt(max(up.decrease, 0.0))
            after = self._step(up)
            self._walks.forget(up)
            up = self._up(Point(after))
            if not math.isfinite(up.sum_of_squares):
                self._walks.forget(up)
                self._walks.remove(after)
                return self._end("diverged", self._up(Point(course.state)), None)
            self._accept(Iteration(len(course.iterations) + 1, up.sum_of_squares, change, 0.0), up.at)
        return self._end(status, up, None)

    def _as_published(self) -> str | None:
        """Return the status of full steps from the last change; None if not finished."""
        *_, last = sums = [each.weighted_sum_of_squares for each in self._course.iterations] or [math.nan]
        change = 100.0 * (last / sums[-2] - 1.0) if len(sums) > 1 else math.nan
        if abs(change) < self.options.limit:
            return "converged"
        if change >= self.options.limit:
            return "diverged"
        return "not converged" if len(self._course.iterations) >= self.options.max_iterations else None

    def _damped_steps(self, up: Up) -> Outcome:
        course = self._course
        while len(course.iterations) < self.options.max_iterations and up.at.damping <= RULES["most_damping"]:
            change = math.sqrt(max(up.decrease, 0.0))
            kind = self._judged(change) if up.at.damping == 0.0 else "damped"
            if kind in ("last", "rests"):
                return self._end("converged", up, change)
            up, still = self._take(up, change, chord=kind == "before a chord")
            if still:
                return self._end("converged", up, None)
        lost = up.at.damping > RULES["most_damping"]
        return self._end("diverged" if lost else "not converged", up, None)

    def _judged(self, change: float) -> str:
        """Classify a full step by its length and former steps (`_photocore.judge_full_step`)."""
        course = self._course
        taken = [(each.damping, each.largest_change) for each in course.iterations]
        unknowns, tolerance = self._unknowns[4], self.options.limit
        return _photocore.judge_full_step(
            taken, change, chord=course.chord, unknowns=unknowns, tolerance=tolerance
        )

    def _take(self, up: Up, change: float, *, chord: bool) -> tuple[Up, bool]:
        """Take a step and possibly a chord, or undo it and increase the damping.

        Return the next formation, and whether the sum of squares is stationary.
        """
        course, damping = self._course, up.at.damping
        after, course.chord = self._step(up), None
        if change > RULES["far"] * math.sqrt(self._unknowns[4]):
            # Points are intersected again if this lowers the sum of squares.
            other = self._new_state()
            sums = np.array(self._walks.all(tasks.relocated, after, other, phase="solve"))
            before, moved = sums.sum(axis=0).tolist()
            self._walks.remove(after if moved < before else other)
            after = other if moved < before else after
        elif chord and self._unknowns[5] and self.options.loss is None:
            after = self._with_chord(up, after, change)
        self._walks.forget(up)
        relaxed = damping / 10.0 if damping / 10.0 >= RULES["least_damping"] else 0.0
        negligible = damping == 0.0 and change <= RULES["negligible"]
        try:
            following = self._up(Point(after, relaxed, course.near))
        except RankError:
            # A step that leaves unknowns undetermined has failed.
            return self._refuse(damping)
        if not (negligible or following.sum_of_squares <= course.best * (1.0 + RULES["rounding"])):
            self._walks.forget(following)
            self._walks.remove(after)
            return self._refuse(damping)
        course.best = following.sum_of_squares
        iteration = Iteration(len(course.iterations) + 1, following.sum_of_squares, change, damping)
        self._accept(iteration, following.at)
        return following, False

    def _refuse(self, damping: float) -> tuple[Up, bool]:
        """Continue from the same values with more damping, or end if the sum of squares is stationary."""
        course, still = self._course, False
        if damping == 0.0:
            freedom = max(self._unknowns[0] + self._unknowns[1] - self._unknowns[2], 1)
            least = RULES["still"] * max(course.best / freedom, 1.0)
            before, course.refused = course.refused, course.best
            still = before is not None and before - course.best <= least
        harder = 0.0 if still else max(10.0 * damping, RULES["first_damping"])
        return self._up(Point(course.state, harder, course.near)), still

    def _accept(self, iteration: Iteration, at: Point) -> None:
        """Store an accepted iteration and delete earlier states."""
        course = self._course
        old, course.before, course.state = course.before, course.state, at.state
        course.damping, course.curved = at.damping, at.curved
        course.near = self.options.loss is not None and iteration.largest_change <= RULES["near"]
        course.iterations.append(iteration)
        course.write(self.job.folder, self.job.source)
        if old not in (course.before, course.state):
            self._walks.remove(old)
        self._walks.tell("iteration", iteration.number, 0, iteration)

    def _end(self, status: str, up: Up, change: float | None) -> Outcome:
        """Take the last step, if any, and finish.

        Without a last step, cofactors refer to the equations at the final values. Otherwise they refer to the
        equations of the last step, unless these contain the second-order term of a loss.
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
        course.write(self.job.folder, self.job.source)
        if up.at == Point(course.state):
            return self._finish(up)
        self._walks.forget(up)
        return self._finish(None)

    def _finish(self, up: Up | None) -> Outcome:
        """Invert and write the results after the last iteration.

        With a datum, the normal equations are formed again in this datum.
        """
        course = self._course
        assert course.ending is not None
        status, formed, after = course.ending
        last = course.before, after
        if self._mover is not None:
            if up is not None:
                self._walks.forget(up)
            formed = f"{after}-in-datum"
            for node, arrays in enumerate(self._mover(self._walks.all(tasks.located, after, phase="solve"))):
                tasks.write_state(self.job, node, formed, arrays)
            after, up = formed, None
        if up is None:
            up = self._up(Point(formed))
        sums = self._evaluated(after)[:4]
        freedom, variance = self._variance(sums)
        if self.options.covariance:
            datum = None if up.products is None else InDatum(up.products, last)
            self._walks.invert(up, after, variance, datum)
            if self.options.unit_variance == "redundancy":
                # The nodes scale their results by q / r, except for photos (docs/weights.md).
                numbers = self._walks.all(tasks.redundancies, phase="invert")
                freedom = math.fsum(share for _, *measured in numbers for share in measured)
                variance = sum(sums[1:]) / freedom if freedom > RULES["least_redundancy"] else None
                self._walks.all(tasks.settled, variance, phase="invert")
                freedom = round(freedom, 6)
        else:
            self._walks.all(tasks.finished, course.before, after, variance, phase="invert")
        self._walks.forget(up)
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

    def _evaluated(self, state: str) -> tuple[float, float, float, float, float]:
        """Return weighted sums of squares of all nodes, by type, and the objective function."""
        found = np.array(self._walks.all(tasks.evaluated, state, phase="solve"))
        # Add sequentially, because the order of NumPy sums depends on their length.
        camera, ground, plates, others, minimised = (sum(column) for column in found.T.tolist())
        return camera, ground, plates, others, minimised

    def _variance(self, sums: tuple[float, float, float, float]) -> tuple[float, float | None]:
        """Return degrees of freedom and variance of unit weight (GIANT guide, Appendix E)."""
        observations, weighted, unknowns, stations, *_ = self._unknowns
        freedom, kind = observations + weighted - unknowns, self.options.unit_variance
        total = sum(sums)
        if kind == "unity":
            return freedom, 1.0
        if kind == "free":
            freedom, total = freedom - stations, total - sums[0]
        if kind == "redundancy":  # these are available after the inversion of all nodes
            return freedom, None
        return freedom, total / freedom if freedom > 0 else None

    def _up(self, at: Point) -> Up:
        up = self._walks.up(at)
        self._course.formations += 1
        return up

    def _step(self, up: Up) -> str:
        """Solve from the root down and write the state after the step; return its name."""
        after = self._new_state()
        self._walks.substitute(
            up, lambda node, outer: self._walks.do(tasks.solved, node, up.at, after, outer)
        )
        return after

    def _with_chord(self, up: Up, after: str, change: float) -> str:
        """Return the state after a chord, or after the step if no chord is taken.

        A chord is a second step with the same factors (crates/photocore/src/adjustment/acceleration.rs).
        """
        walks = self._walks
        # The data are small enough to pass through the driver, so that they survive the loss of a worker.
        left: list[Chord | None] = walks.sums([*walks.climb(reduced_chord, up.at, after).values()], "solve")
        decreases = [each.decrease for each in left if each is not None]
        length = math.sqrt(max(sum(decreases), 0.0))
        if len(decreases) < len(left) or not _photocore.is_chord(length, change):
            return after
        further = self._new_state()

        def task(node: int, outer: Floats) -> Handle:
            below = [left[child] for child in walks.tree.children[node]]
            return walks.do(solved_chord, node, up.at, after, outer, further, below)

        walks.substitute(up, task)
        walks.remove(after)
        self._course.chord = length
        return further

    def _new_state(self) -> str:
        self._course.trials += 1
        return f"{self._course.trials}"
