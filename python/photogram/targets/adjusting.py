"""Adjusting a calibration: once, again with the priors of its cameras, again without what does not fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from photogram.adjustment.adjustment import Progress, adjust, adjusted_again
from photogram.adjustment.robust import Loss
from photogram.adjustment.snooping import snoop
from photogram.arguments.arrays import one_of
from photogram.errors import InputError
from photogram.network.block import Block
from photogram.results.result import Result
from photogram.targets.calibration_result import Calibrated, deviation_of_corners, with_unknown_weight
from photogram.targets.clocks import checked_clocks
from photogram.targets.findings import judged
from photogram.targets.outliers import marked_as_mrcal
from photogram.targets.regularisation import regularised
from photogram.targets.start import Start
from photogram.targets.vision import photo_poses

__all__ = ["adjusted_start", "snooped_start", "weighted_block"]

ROUNDS = 8
"""In which the standard deviation of corners is found, at the most, and the change that is none."""
CHANGE = 0.01
FINELY = 1e-6
"""Of a standard deviation: where the steps of a splined lens end."""


def adjusted_start(
    start: Start,
    *,
    loss: Loss | None = None,
    outliers: Literal["mrcal"] | None = None,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Calibrated:
    """Adjust cameras, sensors, views and the board together; see :meth:`Calibration.adjust`."""
    if outliers is not None:
        one_of("outliers", outliers, ("mrcal",))
    rounds = 0
    while True:
        how: dict[str, Any] = {"loss": loss, "threads": threads, "progress": progress}
        # Knots that no image touches are determined by priors alone.
        free = None if _has_knots(start) else adjust(start.block(), covariance="verdict", **how)
        if free is None:
            result = adjust(weighted_block(start), **how, covariance="verdict", tolerance=FINELY)
        else:
            result = _with_priors(start, free, threads)
        worse = marked_as_mrcal(result) if outliers else np.zeros(len(result.residuals), dtype=bool)
        if worse.any() and result.converged:
            start = start.without(worse)
        elif rounds < ROUNDS and (better := _better(start, result)) is not None:
            start, rounds = better, rounds + 1
        else:
            break
    messages = [*start.messages, *result.messages]
    if start.sync == "offset":
        messages += checked_clocks(Calibrated(calibration=start, result=result))
    told = replace(result, messages=messages)
    if start.sd0 is None:
        told = with_unknown_weight(told)
    return judged(
        Calibrated(calibration=start, result=told, unregularised=free if start.regularise else None)
    )


def _better(start: Start, result: Result) -> Start | None:
    """Return what to adjust again, where the result says otherwise of what was held; None where it does not.

    That are the standard deviation of corners, and the motion of the board.
    """
    found = start if start.sync != "offset" or not result.converged else _in_motion(start, result)
    if (sd := _sd_to_assume(start, result)) is not None:
        found = found.replace(assumed=sd)
    return None if found is start else found


def _in_motion(start: Start, result: Result) -> Start:
    """Return a calibration whose board moves as its adjusted poses say; itself where this changes nothing."""
    ended = Calibrated(calibration=start, result=result)
    again = ended.restarted().replace(motion=None)
    # Where the new motion has pictures, with everything else as adjusted.
    late = {name: each.values[0] for name, each in ended.offsets.items()}
    there = again.replace(
        sensors=ended.sensors, offsets=[late.get(each.name, 0.0) for each in ended.cameras]
    ).picture_poses()
    pictures = slice(len(start.corners.pictures))
    gaps = np.abs(photo_poses(there)[0] - result.photo_positions[pictures])
    return start if (gaps <= CHANGE * result.photo_sd[pictures, :3]).all() else again


def _sd_to_assume(start: Start, result: Result) -> float | None:
    """Return another standard deviation of corners to weigh the board against; None where none is asked."""
    if start.sd0 is not None or start.shape != "points" or not result.converged:
        return None
    found = deviation_of_corners(result)
    # Corners that fit to the last digit are made, not measured.
    return start.assumed * found if abs(found - 1) > CHANGE and start.assumed * found > 1e-6 else None


def _has_knots(start: Start) -> bool:
    return any(each.knot_unknowns for each in start.cameras)


def weighted_block(start: Start) -> Block:
    """Return the block of a calibration with the priors of its cameras."""
    if start.regularise is None:
        return start.block()
    observed = 2 * len(start.board.places) * len(start.corners.pictures)
    return start.block(regularised(start.cameras, start.corners.sizes, observed))


def _with_priors(start: Start, free: Result, threads: int | None) -> Result:
    """Return the adjustment with the priors of cameras, from where that without them has ended."""
    if start.regularise is None:
        return free
    found = adjusted_again(weighted_block(start), free.options, free.state, threads=threads)
    assert isinstance(found, Result)
    return found


def snooped_start(start: Start, **options: Any) -> Calibrated:
    """Take gross errors out one after the other, and adjust what is left; see :meth:`Calibration.snoop`."""
    if start.regularise is not None and not _has_knots(start):
        raise InputError("gross errors are taken out without priors of cameras: regularise is None")
    if start.sync == "offset":
        start = adjusted_start(start).calibration
    found = snoop(weighted_block(start), **options)
    result = found.judged
    assert isinstance(result, Result)
    own = start.with_images_of(result.block)
    told = replace(result, messages=[*own.messages, *result.messages])
    return judged(Calibrated(calibration=own, result=told, snooped=found))
