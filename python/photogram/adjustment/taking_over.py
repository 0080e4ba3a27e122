"""Update of trajectory tables by large attitude corrections.

Corrections r(t) are additive but rotations are not, so that bases suit small corrections only. Corrections of
images and records may exceed half a radian. The rotation in the middle is then applied to the table, A0
Exp(r), exactly at all times. The corrections r then restart at zero (docs/moving.md).
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.motion import timed_images
from photogram.network.observations import Prior, Smoothness
from photogram.network.trajectories import Coefficient, Polynomial, RotationCoefficient, Trajectory
from photogram.results.result import Result
from photogram.results.trajectories import AdjustedTrajectory
from photogram.words import phrase

LARGE = 0.5  # Radians
TIMES = 1000  # Maximum number of times at which a trajectory is evaluated


def large_turns(result: Result) -> dict[str, Floats]:
    """Return the rotations that update tables, by trajectory name.

    (3,) rotation vectors about the axes of the photo, in radians.
    """
    block, large = result.block, _large(result)
    return {
        own.name: turn
        for own, turn in large
        if np.linalg.norm(turn) > LARGE / 2 and _is_open(block, own.given)
    }


def taken_over(turns: dict[str, Floats]) -> Message:
    """Return the note on tables that were updated by rotations."""
    parts = [
        phrase("adjust.rotations.table", name=name, angle=float(np.linalg.norm(turn)))
        for name, turn in turns.items()
    ]
    return Message(phrase("adjust.rotations.tables", tables=parts))


def stays(result: Result) -> list[Message]:
    """Return the note on large rotations that cannot be applied to tables."""
    large = [own.name for own, _ in _large(result) if own.given.angles == "vector"]
    return [Message(phrase("adjust.rotations.large", trajectories=large, limit=LARGE))] if large else []


def _large(result: Result) -> list[tuple[AdjustedTrajectory, Floats]]:
    """Return trajectories with a large attitude correction, and the correction in the middle.

    Empty without convergence, because the steps are then unreliable.
    """
    values = {each.name: each.position for each in result.unknowns if each.kind == RotationCoefficient.KIND}
    of_photos = _of_photos(result.block)
    large = [
        each.name
        for each in result.block.all_trajectories
        if _may_be_large(each, values, alone=each.name in of_photos)
    ]
    if not large or not result.converged:
        return []
    found, adjusted, seen = [], result.trajectories, _seen(result.block)
    for own in (adjusted[name] for name in large if name in seen):
        turns = own.corrections(np.clip(seen[own.name], *own.given.reach))[1]
        if np.linalg.norm(turns, axis=1).max() > LARGE:
            found.append((own, turns[len(turns) // 2]))
    return found


def _may_be_large(trajectory: Trajectory, values: dict[str, Floats], *, alone: bool) -> bool:
    """Return whether coefficients allow a large correction.

    `alone`: only the first coefficient counts, for the motion of a single photo.
    """
    basis, own = trajectory.rotation, trajectory.coefficients[1]
    sizes = np.array([np.linalg.norm(values[each.name]) for each in (own[:1] if alone else own)])
    if isinstance(basis, Polynomial):
        first, last = trajectory.table.span
        reference, scale = basis.reference or 0.0, basis.scale or 1.0
        beyond = max(1.0, abs(first - reference) / scale, abs(last - reference) / scale)
        return bool((sizes * beyond ** np.arange(len(sizes))).sum() > LARGE)
    # B-splines are positive and their sum is 1.
    return bool((sizes > LARGE).any())


def _of_photos(block: Block) -> set[str]:
    """Return the names of trajectories that belong to single photos."""
    return {each.photo for each in block.timed if each.trajectory is None}


def _seen(block: Block) -> dict[str, Floats]:
    """Return some ascending times of images and records, by trajectory name."""
    times: dict[str, list[Floats]] = {}
    for own, trajectory, _, images in timed_images(block):
        times.setdefault(trajectory.name, []).append(own.times(block.image_xy[images]))
    for each in block.observations:
        if each.moment is not None:
            times.setdefault(each.moment.trajectory.name, []).append(np.array([each.moment.time]))
    joined = {name: np.sort(np.concatenate(own)) for name, own in times.items()}
    some = {
        name: np.linspace(0, len(own) - 1, min(len(own), TIMES)).astype(int) for name, own in joined.items()
    }
    return {name: own[some[name]] for name, own in joined.items() if len(own)}


def _is_open(block: Block, trajectory: Trajectory) -> bool:
    """Return whether a common rotation of all rotation coefficients is free.

    Rates of a photo's own motion refer to its axes and do not restrict it.
    """
    own = trajectory.coefficients[1]
    if trajectory.name in _of_photos(block):
        own = own[:1]
    ids = {id(each) for each in own}

    def tells(each: object) -> bool:
        if isinstance(each, Prior):
            return id(each.unknown) in ids
        if isinstance(each, Smoothness):
            on: tuple[Coefficient, ...] = tuple(each.coefficients)
            return id(on[0]) in ids and abs(np.sum(each.factors)) > 1e-9 * np.abs(each.factors).sum()
        return False

    free = all(np.isinf(each.deviations).all() for each in own)
    return trajectory.angles == "vector" and free and not any(map(tells, block.observations))
