"""Stellar calibration of a plate camera: sequence of solutions (NOAA TR NOS 55, sections 5 and 8)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import replace
from photogram.messages import Message
from photogram.stellar.camera_tables import plate_tests
from photogram.stellar.iteration import DIVERGED, PreRun, Solved, iterate, iterate_as_published
from photogram.stellar.movement import combine, movement, pairs_to_combine
from photogram.stellar.parameters import GROUPS, INDEX, NAMES
from photogram.stellar.problem import Problem, core_threads
from photogram.stellar.result import Result
from photogram.words import Phrase, phrase


def calibrate(
    problem: Problem, *, threads: int | None = None, progress: Callable[..., None] | None = None
) -> Result:
    """Calibrate a plate camera with stars.

    The solutions are, in order:

    * minimum solution, if its stars are given (8 parameters, one attitude)
    * pre-run residuals, if requested
    * maximum solution
    * coefficients of refraction, if requested
    * movement test, and combination of attitudes that do not differ

    Parameters
    ----------
    problem
        The problem with its options.
    threads
        Number of threads; None: all processors.
    progress
        Called at intervals; an exception stops the adjustment.

    Returns
    -------
    Result; `converged` refers to the last solution.

    Raises
    ------
    AdjustmentError
        If stars or parameters are not determined, or if there are too few observations (errors 2 to 4 of the
        report).
    InputError
        If stars of the minimum solution are missing, or if `threads` is less than 1.
    KeyboardInterrupt
        If Ctrl-C is pressed.
    """
    core_threads(threads)  # validated for both iterations
    options, initial = problem.options, problem.initial.copy()
    run: Callable[..., Solved] = iterate_as_published
    if not options.as_published:
        run = partial(iterate, threads=threads, progress=progress)
    stages: tuple[Solved, ...] = ()
    if options.minimum_stars:
        smallest, limit = _minimum_problem(problem), options.max_iterations_minimum
        estimated = np.zeros(len(initial), bool)
        estimated[6:14] = ~problem.fixed[6:14]
        estimated[INDEX["cy"]] &= not options.common_scale
        solved = run(smallest, initial, estimated, solution="minimum", limit=limit)
        stages = (solved,)
        initial = solved.parameters.copy()
        initial[0:3] = initial[3:6] = initial[6:9]
        if options.pre_run:
            # The minimum solution estimates neither distortion nor refraction: their curves would be zero.
            without = replace(smallest, options=replace(smallest.options, curves=False, refraction=False))
            residuals = _pre_run(problem, smallest, initial)
            return _remarked(Result(without, solved, (), problem, stages, residuals), [])
    free = free_parameters(problem)
    _check_groups(problem)
    limit = options.max_iterations
    remarks: list[Phrase] = []
    if options.as_published:
        solved, remarks = _from_far(problem, initial, free)
    else:
        solved = run(problem, initial, free, solution="maximum", limit=limit)
    stages = (*stages, solved)
    if options.refraction and solved.converged:
        solved = _refraction(problem, run, solved)
        stages = (*stages, solved)
    elif options.refraction:
        remarks = [phrase("stars.no-refraction-solution")]

    def solution(left: Problem) -> Result:
        found = run(left, initial, free_parameters(left), solution="maximum", limit=limit)
        if options.refraction and found.converged:
            found = _refraction(left, run, found)
        return Result(left, found, (), left, (found,))

    if not solved.converged:
        remarks += culprits(problem, solved, solution)
    result = Result(problem, solved, (), problem, stages)
    if result.converged:
        result = replace(result, spoiled=harm(result, solution) or "")
    result = _remarked(result, remarks)
    return _combined(result, threads) if options.movement_factor > 0 else result


def _from_far(problem: Problem, initial: Floats, free: Bools) -> tuple[Solved, list[Phrase]]:
    """Iterate as published; after divergence, use better initial attitudes.

    A deck contains only the attitude of the event, for all groups. The strict iteration with a fixed camera
    gives attitudes from which the steps of the report converge. The solution does not depend on them.
    """
    run = partial(iterate_as_published, solution="maximum", limit=problem.options.max_iterations)
    failed: AdjustmentError | None = None
    try:
        solved = run(problem, initial, free)
        if solved.stop != DIVERGED:
            return solved, []
    except AdjustmentError as error:
        failed = error
    attitudes = free & (np.arange(len(free)) < INDEX["epsilon"])
    try:
        start = iterate(problem, initial, attitudes, solution="maximum", limit=0).parameters
        again = run(problem, start, free)
        if again.converged:
            return again, [phrase("stars.far-attitudes")]
    except AdjustmentError:
        pass
    if failed is not None:
        raise failed
    return solved, []


def free_parameters(problem: Problem) -> Bools:
    """Return which of the 26 parameters are estimated in the maximum solution."""
    free = ~problem.fixed
    for group in range(3):
        if not (problem.known[problem.image_stars] & (problem.image_groups == group)).any():
            free[3 * group : 3 * group + 3] = False
    if problem.options.common_scale:
        free[INDEX["cy"]] = False
    free[22:] = False
    return free


def _minimum_problem(problem: Problem) -> Problem:
    names = set(problem.options.minimum_stars)
    if missing := sorted(names - set(problem.star_ids)):
        raise InputError(phrase("stars.minimum-unknown", names=missing))
    others = np.array([star not in names for star in problem.star_ids])
    chosen = problem.without(others, np.zeros(len(problem.image_points), bool))
    if not chosen.known.all():
        unknown = [star for star, known in zip(chosen.star_ids, chosen.known, strict=True) if not known]
        raise InputError(phrase("stars.minimum-direction", names=unknown))
    return replace(chosen, image_groups=np.full_like(chosen.image_groups, 2))


def _check_groups(problem: Problem) -> None:
    """Reject groups with unknown directions but too few stars for an attitude."""
    known = problem.known[problem.image_stars]
    for group, name in enumerate(GROUPS):
        of_group, rows = problem.image_groups == group, slice(3 * group, 3 * group + 3)
        given = problem.weighted[rows].all() or problem.fixed[rows].all()
        if of_group.any() and not given and len(np.unique(problem.image_stars[of_group & known])) < 2:
            raise AdjustmentError(phrase("stars.few-known-stars", group=name))


def _pre_run(problem: Problem, smallest: Problem, initial: Floats) -> PreRun:
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
    free = solved.free.copy()
    free[22:] = ~problem.fixed[22:]
    once = {"once": True} if problem.options.as_published else {}
    return iterate(
        problem, solved.parameters, free, solution="refraction", limit=problem.options.max_iterations, **once
    )


def _remarked(result: Result, remarks: Sequence[Phrase]) -> Result:
    solved = result.solved
    failed = result.test.problem() if result.test else None
    messages: list[str | Phrase] = [
        *([] if solved.converged else [phrase("stars.plate-not-converged", stop=solved.stop)]),
        *([failed] if failed else []),
        *outliers(result),
        *remarks,
        *solved.remarks,
        *result.doubtful(),
    ]
    return replace(result, messages=tuple(map(Message, messages)))


def _combined(result: Result, threads: int | None) -> Result:
    test = movement(result)
    if test is None:
        return result
    pairs = pairs_to_combine(test, result.problem.options.movement_factor)
    result = replace(result, movement=test)
    if not pairs:
        return replace(result, messages=(*result.messages, Message(phrase("stars.moved-between-all"))))
    combined = combine(result, pairs, threads=threads)
    if not combined.converged:
        message = Message(phrase("stars.combined-not-converged", stop=combined.solved.stop))
        result = replace(result, messages=(message, *result.messages))
    return replace(result, combined=combined)


_FALL = 10.0  # Least reduction ratio of the sum of squares by removal of a faulty star
_MAX_ROUNDS = 10
_MAX_SUSPECTS = 12


def outliers(result: Result) -> list[Phrase]:
    """Return a warning on the outliers of the verdict, worst first, or an empty list."""
    found = [
        (float(abs(tested.values[place])), tested.name(place))
        for tested in plate_tests(result)
        for place in result.verdict.outlying.get(tested.kind, ())
    ]
    if not found:
        return []
    found.sort(key=lambda item: -item[0])
    names = [phrase("stars.outlier", name=name, value=value) for value, name in found]
    fields = result.verdict.outliers[0].fields
    return [phrase("stars.outliers", statistic=fields["statistic"], limit=fields["limit"], names=names)]


def harm(result: Result, iterate: Callable[[Problem], Result]) -> Phrase | None:
    """Return the largest parameter change by outliers, in sd without them, or None.

    Rounds reject outliers that are at least half as large as the worst, and adjust again. None for a change
    below one, or if the remaining observations do not determine the camera.
    """
    clean = result
    for _ in range(_MAX_ROUNDS):
        tests, outlying = plate_tests(clean), clean.verdict.outlying
        if not any(outlying.values()):
            break
        sizes = [np.nan_to_num(np.abs(tested.values)).max(axis=1, initial=0.0) for tested in tests]
        half = 0.5 * max(values.max(initial=0.0) for values in sizes)
        images, stars = (np.zeros(len(values), bool) for values in sizes)
        for tested, rows, values in zip(tests, (images, stars), sizes, strict=True):
            rows[[place[0] for place in outlying.get(tested.kind, ())]] = True
            rows &= values > half
        try:
            clean = iterate(clean.problem.without(stars, images))
        except AdjustmentError:
            return None
        if not clean.converged:
            return None
    sd = np.sqrt(np.diag(clean.covariance))
    camera = np.flatnonzero(clean.solved.free & (sd > 0) & (np.arange(len(sd)) >= INDEX["epsilon"]))
    change = np.abs(result.solved.parameters - clean.solved.parameters)[camera] / sd[camera]
    if not change.size or change.max() <= 1.0:
        return None
    return phrase("stars.harm", name=NAMES[camera[int(change.argmax())]], change=float(change.max()))


def culprits(problem: Problem, solved: Solved, iterate: Callable[[Problem], Result]) -> list[Phrase]:
    """Return a warning on the star whose removal makes the solution converge."""
    size = np.zeros(len(problem.star_ids))
    weighted = np.einsum("mi,mij,mj->m", solved.residuals, problem.image_weights, solved.residuals)
    np.maximum.at(size, problem.image_stars, np.nan_to_num(weighted))
    observed = problem.known & ~problem.held
    off = (solved.places - problem.star_places)[observed]
    size[observed] += np.nan_to_num(np.einsum("si,sij,sj->s", off, problem.star_weights[observed], off))
    best, culprit = math.inf, ""
    for star in np.argsort(-size, kind="stable")[:_MAX_SUSPECTS].tolist():
        others = np.arange(len(problem.star_ids)) == star
        try:
            again = iterate(problem.without(others, np.zeros(len(problem.image_points), bool)))
        except AdjustmentError:
            continue
        total = sum(again.solved.sums)
        if again.converged and _FALL * total < sum(solved.sums) and total < best:
            best, culprit = total, problem.star_ids[star]
    return [phrase("stars.culprit", star=culprit)] if culprit else []
