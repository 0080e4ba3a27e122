"""Calibration of a camera by stars: the order of solutions (NOAA TR NOS 55, sections 5 and 8)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError, InputError
from photogram.messages import Message
from photogram.stellar import report_iteration, strict
from photogram.stellar.movement import combine, movement, pairs_to_combine
from photogram.stellar.options import core_threads
from photogram.stellar.outliers import culprits, harm, outliers
from photogram.stellar.parameters import GROUPS, INDEX
from photogram.stellar.problem import Problem, degrees_of_freedom
from photogram.stellar.result import PreRun, Result, Stage
from photogram.stellar.state import Solved


def calibrate(
    problem: Problem, *, threads: int | None = None, progress: Callable[..., None] | None = None
) -> Result:
    """Calibrate a camera.

    In order: minimum solution where its stars are named (8 parameters, one attitude), pre-run residuals if
    asked for, maximum solution, coefficients of refraction if asked for, movement test, combination of
    attitudes that do not differ.

    Parameters
    ----------
    problem
        The problem with its options.
    threads
        Number of threads; all processors when None.
    progress
        Called now and then; an exception it raises stops the adjustment.

    Returns
    -------
    The result; its `converged` says whether the last solution did.

    Raises
    ------
    AdjustmentError
        Errors 2 to 4 of the report: stars or parameters that are not determined, observations too few.
    InputError
        Stars of the minimum solution that are not there; fewer than one thread.
    KeyboardInterrupt
        Ctrl-C.
    """
    core_threads(threads)  # refused here, whatever iterates
    iterate = (
        report_iteration.iterate
        if problem.options.as_published
        else partial(strict.iterate, threads=threads, progress=progress)
    )
    initial = problem.initial.copy()
    stages: tuple[Stage, ...] = ()
    if problem.options.minimum_stars:
        smallest = _minimum_problem(problem)
        solved = iterate(
            smallest,
            initial,
            _free_minimum(problem),
            solution="minimum",
            limit=problem.options.max_iterations_minimum,
        )
        stages = (_stage(smallest, solved),)
        initial = solved.parameters.copy()
        initial[0:3] = initial[3:6] = initial[6:9]
        if problem.options.pre_run:
            residuals = _pre_run(problem, smallest, initial, solved)
            # The minimum solution has neither distortion nor refraction: their curves would be zeros.
            without = replace(smallest.options, curves=False, refraction=False)
            smallest = replace(smallest, options=without)
            return _result(problem, smallest, solved, stages, pre_run=residuals)
    free = free_parameters(problem)
    _check_groups(problem)
    limit = problem.options.max_iterations
    remarks: list[str] = []
    if problem.options.as_published:
        solved, remarks = _from_far(problem, initial, free)
    else:
        solved = iterate(problem, initial, free, solution="maximum", limit=limit)
    stages = (*stages, _stage(problem, solved))
    if problem.options.refraction and solved.converged:
        solved = _refraction(problem, iterate, solved)
        stages = (*stages, _stage(problem, solved))
    elif problem.options.refraction:
        remarks = ["REFRACTION SOLUTION ELIMINATED FROM PROBLEM"]

    def again(left: Problem) -> Solved:
        found = iterate(left, initial, free_parameters(left), solution="maximum", limit=limit)
        return _refraction(left, iterate, found) if problem.options.refraction and found.converged else found

    if not stages[-1].converged:
        remarks += culprits(problem, solved, again)
    result = _result(problem, problem, solved, stages, remarks=remarks)
    if result.converged:
        result = replace(result, spoiled=harm(result, lambda left: _solution(left, again(left))))
    return _combined(result, threads) if problem.options.movement_factor > 0 else result


def _from_far(problem: Problem, initial: Floats, free: Bools) -> tuple[Solved, list[str]]:
    """Iterate as published; where its steps, which nothing damps, lead astray, from better attitudes.

    A deck starts all groups with the attitude of the event. Attitudes by the strict iteration, the camera
    held, begin where the report's steps lead to its solution, which does not depend on the beginning.
    """
    run = partial(report_iteration.iterate, solution="maximum", limit=problem.options.max_iterations)
    failed: AdjustmentError | None = None
    try:
        solved = run(problem, initial, free)
        if solved.stop != report_iteration.DIVERGED:
            return solved, []
    except AdjustmentError as error:
        failed = error
    attitudes = free & (np.arange(len(free)) < INDEX["epsilon"])
    try:
        start = strict.iterate(problem, initial, attitudes, solution="maximum", limit=0).parameters
        again = run(problem, start, free)
        if again.converged:
            return again, ["the initial attitudes are far: the iteration began with those of a damped one"]
    except AdjustmentError:
        pass
    if failed is not None:
        raise failed
    return solved, []


def free_parameters(problem: Problem) -> Bools:
    """Say which of the 26 parameters are estimated in the maximum solution."""
    free = ~problem.fixed
    for group in range(3):
        if not (problem.known[problem.image_stars] & (problem.image_groups == group)).any():
            free[3 * group : 3 * group + 3] = False
    if problem.options.common_scale:
        free[INDEX["cy"]] = False
    free[22:] = False
    return free


def _free_minimum(problem: Problem) -> Bools:
    free = np.zeros(len(problem.initial), bool)
    free[6:14] = ~problem.fixed[6:14]
    if problem.options.common_scale:
        free[INDEX["cy"]] = False
    return free


def _minimum_problem(problem: Problem) -> Problem:
    """Take the stars of the minimum solution, all images with the attitude of the event."""
    names = set(problem.options.minimum_stars)
    missing = names - set(problem.star_ids)
    if missing:
        raise InputError(f"incorrect stars specified for minimum solution: {', '.join(sorted(missing))}")
    others = np.array([star not in names for star in problem.star_ids])
    chosen = problem.without(others, np.zeros(len(problem.image_points), bool))
    if not chosen.known.all():
        raise InputError("incorrect stars specified for minimum solution: a direction that is not known")
    return replace(chosen, image_groups=np.full_like(chosen.image_groups, 2))


def _check_groups(problem: Problem) -> None:
    """Refuse a group that has images of unknown directions but too few known stars for an attitude."""
    known = problem.known[problem.image_stars]
    for group, name in enumerate(GROUPS):
        of_group = problem.image_groups == group
        if of_group.any() and len(np.unique(problem.image_stars[of_group & known])) < 2:
            weighted = (
                problem.weighted[3 * group : 3 * group + 3].all()
                or problem.fixed[3 * group : 3 * group + 3].all()
            )
            if not weighted:
                raise AdjustmentError(
                    f"insufficient type 2 stars for individual orientation: {name} needs two known stars"
                )


def _pre_run(problem: Problem, smallest: Problem, initial: Floats, solved: Solved) -> PreRun:
    """Compute residuals of all images that took no part in the minimum solution."""
    used = set(smallest.star_ids)
    rest = problem.without(
        np.array([star in used for star in problem.star_ids]), np.zeros(len(problem.image_points), bool)
    )
    core = rest.core(initial, rest.star_places, np.ones(len(initial), bool))
    return PreRun(
        points=rest.image_points,
        stars=tuple(rest.star_ids[i] for i in rest.image_stars),
        residuals=-core.equations()["constant"] if len(rest.image_points) else np.zeros((0, 2)),
    )


def _refraction(problem: Problem, iterate: Callable[..., Solved], solved: Solved) -> Solved:
    """Estimate the coefficients of refraction with the camera."""
    free = solved.free.copy()
    free[22:] = ~problem.fixed[22:]
    once = {"once": True} if problem.options.as_published else {}
    return iterate(
        problem, solved.parameters, free, solution="refraction", limit=problem.options.max_iterations, **once
    )


def _stage(problem: Problem, solved: Solved) -> Stage:
    counts = degrees_of_freedom(problem, solved.free)
    return Stage(
        solved.levels[0].solution,
        counts,
        solved.levels,
        solved.stop,
        solved.converged,
        solved.log_determinant,
    )


def _solution(problem: Problem, solved: Solved) -> Result:
    """Return the result of one solution, without remarks."""
    stage = _stage(problem, solved)
    return Result(problem, solved, stage.counts, (), problem, (stage,))


def _result(
    problem: Problem,
    solved_problem: Problem,
    solved: Solved,
    stages: tuple[Stage, ...],
    *,
    remarks: Sequence[str] = (),
    pre_run: PreRun | None = None,
) -> Result:
    unsettled = [] if solved.converged else [f"the solution has not converged: {solved.stop}"]
    result = Result(solved_problem, solved, stages[-1].counts, (), problem, stages, pre_run)
    failed = result.test.problem() if result.test else None
    texts = (
        *unsettled,
        *([failed] if failed else []),
        *outliers(result),
        *remarks,
        *solved.remarks,
        *result.doubtful(),
    )
    return replace(result, messages=tuple(Message(text) for text in texts))


def _combined(result: Result, threads: int | None) -> Result:
    """Test the camera for movement; combine the attitudes whose directions do not differ."""
    test = movement(result)
    pairs = pairs_to_combine(test, result.problem.options.movement_factor)
    result = replace(result, movement=test)
    if not test:
        return result
    if not pairs:
        text = "no combined solution: the camera has moved between any two of its attitudes"
        return replace(result, messages=(*result.messages, Message(text)))
    combined = combine(result, pairs, threads=threads)
    if not combined.converged:
        text = f"the combined solution has not converged: {combined.solved.stop}"
        result = replace(result, messages=(Message(text), *result.messages))
    return replace(result, combined=combined)
