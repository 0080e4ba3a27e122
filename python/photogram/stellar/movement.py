"""Movement test of the camera (NOAA TR NOS 55, equations 99 to 103), and combination of attitudes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.stellar.iteration import Solved, iterate, residual_cycle
from photogram.stellar.parameters import GROUPS, NAMES
from photogram.stellar.problem import Problem, core_problem

if TYPE_CHECKING:
    from photogram.stellar import Result


@dataclass(frozen=True, eq=False)
class Movement:
    """Directions of nine plate points under G estimated attitudes, compared for P pairs; radians."""

    groups: tuple[str, ...]  # Groups of the attitudes
    places: Floats  # (G, 9, 2) apparent right ascension and declination
    horizontal: Floats  # (G, 9, 2) observed (refracted) azimuth from south, positive west, and elevation
    covariances: Floats  # (G, 9, 2, 2) of the positions, from the orientation
    pairs: tuple[tuple[str, str], ...]  # First and second group
    angles: Floats  # (P, 9) angles between the directions, and their mean errors
    mean_errors: Floats
    # (P, 9, 4) second minus first: right ascension times cos(declination), declination, azimuth times
    # sin(zenith distance), elevation
    differences: Floats


DIAGONAL = np.arange(9) * 0.01  # x = y of the points, metres
PAIRS = (("pre", "post"), ("post", "event"), ("pre", "event"))


def movement(result: Result) -> Movement | None:
    """Compare the directions of nine diagonal points for all pairs of attitudes; None without pairs.

    The mean error follows from the covariance of all parameters, since both attitudes share the camera.
    """
    free = result.solved.free
    groups = tuple(name for k, name in enumerate(GROUPS) if free[3 * k : 3 * k + 3].all())
    pairs = tuple(pair for pair in PAIRS if {*pair} <= {*groups})
    if not pairs:
        return None
    points = [_directions(result, GROUPS.index(name)) for name in groups]
    places, local, by = (np.stack(parts) for parts in zip(*points, strict=True))
    a, b = ([groups.index(pair[k]) for pair in pairs] for k in (0, 1))
    angles, rows = _angles(places[a], places[b])
    total = np.einsum("pni,pnij->pnj", rows, np.concatenate([by[a], by[b]], axis=2))
    variances = np.einsum("pni,ij,pnj->pn", total, result.solved.cofactors, total)
    turns = np.concatenate([places[b] - places[a], local[b] - local[a]], axis=2)
    turns[..., ::2] = np.remainder(turns[..., ::2] + np.pi, 2 * np.pi) - np.pi
    turns[..., 0] *= np.cos(places[a][..., 1])
    turns[..., 2] *= np.cos(local[a][..., 1])
    local[..., 0] %= 2 * np.pi
    covariances = by @ result.covariance @ np.swapaxes(by, 2, 3)
    errors = result.mean_error * np.sqrt(variances)
    return Movement(groups, places, local, covariances, pairs, angles, errors, turns)


def pairs_to_combine(test: Movement, factor: float) -> tuple[tuple[str, str], ...]:
    """Return pairs whose centre directions differ by less than `factor` mean errors."""
    near = test.angles[:, 0] < factor * test.mean_errors[:, 0]
    return tuple(pair for pair, chosen in zip(test.pairs, near, strict=True) if chosen)


def _directions(result: Result, group: int) -> tuple[Floats, Floats, Floats]:
    """Return directions, azimuths and elevations of points, and direction partials."""
    problem, parameters = result.problem, result.solved.parameters
    count, index, kind = len(DIAGONAL), np.arange(len(DIAGONAL)), problem.options.camera_kind
    xy = np.column_stack([DIAGONAL, DIAGONAL])
    time = np.full(count, problem.options.movement_time)
    standard = _photocore.plate_directions(
        xy, parameters[3 * group : 3 * group + 3], parameters[9:22], kind, tolerance=1e-15, passes=100
    )[:, :2]
    places = problem.site.places(standard, time, parameters[22:])
    azimuth = np.arctan2(-standard[:, 1], -standard[:, 0])
    elevation = np.arctan2(1.0, np.hypot(standard[:, 0], standard[:, 1]))
    equations = core_problem(
        problem.site,
        kind,
        parameters,
        np.zeros(len(parameters), bool),
        places=places,
        star_weights=np.zeros((count, 2, 2)),
        star_fixed=np.zeros(count, bool),
        image_stars=index,
        image_pointings=np.full(count, group),
        image_xy=xy,
        image_weights=np.broadcast_to(np.eye(2), (count, 2, 2)).copy(),
        image_times=time,
    ).equations()
    rows = np.zeros((count, 2, len(parameters)))
    rows[:, :, 3 * group : 3 * group + 3] = equations["pointing"]
    rows[:, :, 9:] = equations["common"]
    # The image is fixed: B_x d(direction) = -B_o d(parameters).
    local = np.column_stack([azimuth, elevation])
    return places, local, np.asarray(-np.linalg.solve(equations["star"], rows), float)


def _angles(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return angles of directions (..., 2), and their partials (..., 4) by both (equations 100 and 102).

    Partials for equal directions are undefined and replaced by those for a movement along the meridian.
    """
    (sa, ca), (sb, cb) = ((np.sin(each[..., 1]), np.cos(each[..., 1])) for each in (a, b))
    sd, cd = np.sin(b[..., 0] - a[..., 0]), np.cos(b[..., 0] - a[..., 0])
    sine = np.hypot(cb * sd, ca * sb - sa * cb * cd)
    # d cos(angle) = -sin(angle) d angle
    partials = [-ca * cb * sd, sa * cb * cd - ca * sb, ca * cb * sd, cb * -sa + sb * ca * cd]
    equal = (sine < 0.5e-11)[..., None]
    rows = np.stack(partials, axis=-1) / np.where(equal, 1.0, sine[..., None])
    return np.arctan2(sine, sa * sb + ca * cb * cd), np.where(equal, [0.0, -1.0, 0.0, 1.0], rows)


def common_attitudes(pairs: tuple[tuple[str, str], ...]) -> tuple[Floats, list[int]]:
    """Return S with p = S p for parameters p with equal attitudes of pairs, and the rows that S replaces."""
    *others, last = sorted({GROUPS.index(name) for pair in pairs for name in pair})
    spread = np.eye(len(NAMES))
    rows = [3 * group + k for group in others for k in range(3)]
    spread[rows] = np.tile(spread[3 * last : 3 * last + 3], (len(others), 1))
    return spread, rows


def modify(cofactors: Floats, right: Floats, c: Floats, misclosure: Floats) -> tuple[Floats, Floats]:
    """Return corrections and cofactors under C x = misclosure (equations 104 and 105).

    The cofactors (n, n) are the inverse of the normal matrix without constraints, `right` (n,) is its
    right-hand side, c (k, n) the constraints.
    """
    across = cofactors @ c.T
    gain = np.linalg.solve(c @ across, across.T).T
    step = cofactors @ right
    return step + gain @ (misclosure - c @ step), cofactors - gain @ across.T


def combine(result: Result, pairs: tuple[tuple[str, str], ...], *, threads: int | None = None) -> Result:
    """Constrain the attitudes of pairs to be equal; two pairs imply all three groups.

    As published, this is one linear step; otherwise it is iterated with one attitude for the groups. The
    degrees of freedom of the result include the constraints.
    """
    spread, rows = common_attitudes(pairs)
    counts = replace(result.solved.counts, constraints=len(rows))
    if result.problem.options.as_published:
        solved = _modified(result, np.eye(len(spread))[rows] - spread[rows])
    else:
        solved = _iterated(result, spread, threads)
    return replace(result, solved=replace(solved, counts=counts), pairs=pairs, movement=None, messages=())


def _modified(result: Result, c: Floats) -> Solved:
    """Correct once under C p = 0 (equations 104 and 105), and compute residuals."""
    solved, problem = result.solved, result.problem
    # Whole rotations between two kappas are not movements.
    off = c @ solved.parameters
    misclosure = -(np.remainder(off + np.pi, 2 * np.pi) - np.pi)
    step, cofactors = modify(solved.cofactors, np.zeros(len(solved.parameters)), c, misclosure)
    parameters = solved.parameters + step
    return residual_cycle(
        problem,
        parameters,
        solved.free,
        cofactors=cofactors,
        log_determinant=solved.log_determinant,
        stop=solved.stop,
        converged=solved.converged,
        levels=solved.levels,
        solution=solved.solution,
    )


def _iterated(result: Result, spread: Floats, threads: int | None) -> Solved:
    solved, problem = result.solved, result.problem
    groups = spread[:9:3, :9:3].argmax(axis=1)
    weights, initial = _common_weights(problem, spread, solved.parameters)
    merged = replace(
        problem,
        image_groups=groups[problem.image_groups],
        axis=problem.axis and replace(problem.axis, group=int(groups[problem.axis.group])),
        parameter_weights=weights,
        initial=initial,
    )
    free = solved.free & (spread.any(axis=0))
    again = iterate(
        merged,
        solved.parameters,
        free,
        solution="combined",
        limit=problem.options.max_iterations,
        threads=threads,
    )
    # The sum of squares contains the differences of the common values from the weighted values of each group.
    off, axis = spread @ again.parameters - problem.initial, again.axis_residual
    weighted = float(off @ problem.parameter_weights @ off)
    if problem.axis is not None and axis is not None:
        weighted += float(axis @ problem.axis.weight @ axis)
    return replace(
        again,
        parameters=spread @ again.parameters,
        free=solved.free,
        cofactors=spread @ again.cofactors @ spread.T,
        sums=(again.sums[0], again.sums[1], weighted),
    )


def _common_weights(problem: Problem, spread: Floats, near: Floats) -> tuple[Floats, Floats]:
    """Return weights and weighted values of the remaining parameters, summed."""
    weights = spread.T @ problem.parameter_weights @ spread
    if not problem.weighted[:9].any():
        return weights, problem.initial
    initial = problem.initial.copy()
    # Remove whole rotations between two angles.
    initial[:9] += 2 * np.pi * np.round(((spread @ near)[:9] - initial[:9]) / (2 * np.pi))
    weighted = np.flatnonzero(np.diag(weights) > 0)
    right = spread.T @ problem.parameter_weights @ initial
    values = initial.copy()
    values[weighted] = np.linalg.solve(weights[np.ix_(weighted, weighted)], right[weighted])
    return weights, values
