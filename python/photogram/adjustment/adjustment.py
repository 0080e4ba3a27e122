"""Adjustment of a block by least squares."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Unpack

import numpy as np

from photogram import _photocore
from photogram.adjustment.first_features import started
from photogram.adjustment.options import AdjustOptions, AsPublished
from photogram.adjustment.remarks import (
    behind,
    check_cameras,
    folded,
    harmful,
    refraction_remarks,
    rounded,
    too_coarse,
    undetermined,
)
from photogram.adjustment.robust import loss_row, remark
from photogram.adjustment.undetermined import beyond_trajectory, in_one_place, undetermined_combinations
from photogram.arguments.arrays import argument_error, by_key, whole_number
from photogram.arguments.fields import options_of
from photogram.arguments.objects import kind_error
from photogram.errors import AdjustmentError, InputError, RankError, failure_of_core
from photogram.lazy_dataclasses import dataclass, replace
from photogram.memory import threads_that_fit, turned
from photogram.messages import Message
from photogram.network.block import Block, checked
from photogram.network.core_arrays import CoreOptions, block_network
from photogram.network.datum import DatumRow, InnerConstraints, MinimumConstraints, datum_row, minimum_row
from photogram.network.unknowns import Unknown
from photogram.results.datum import ResultDatum, datum_messages, datum_of, refused, tested_together
from photogram.results.parts import Iteration
from photogram.results.result import Result, dropped_points
from photogram.results.trajectories import large_turns, stays, taken_over
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.adjustment.keywords import AdjustKeywords

AS_PUBLISHED = 4  # Default number of iterations of the 1987 program
OF_CAMERAS = 200  # Maximum iterations with free camera parameters
OF_KNOTS = 400  # Maximum iterations with the knots of a splined lens
NOTABLE_RISE = 1e-3  # Percent; less is rounding
TURNS = 5  # Maximum number of updates of trajectory tables by large corrections


@dataclass(frozen=True)
class Progress:
    """Progress of an adjustment.

    Attributes
    ----------
    phase
        `form` (with factorisation), `solve`, `invert` (with cofactors), or `iteration` after an iteration.
    done, total
        Processed points and all points of the phase.
    iteration
        The completed iteration.
    """

    phase: str
    done: int
    total: int
    iteration: Iteration | None = None


def adjust(
    block: Block,
    options: AdjustOptions | None = None,
    *,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    **changes: Unpack[AdjustKeywords],
) -> Result:
    """Adjust a block by least squares.

    Every unknown is a weighted parameter, from free to fixed. Points that their image observations do not
    determine are excluded (see `messages` and `dropped` of the result). Other points start from the
    intersection of their rays. Refraction of the block is applied in every iteration. Use
    :func:`photogram.adjust_in_parts` for a block that is too large or too slow for one process, and
    `block.with_fixed_photos()` for fixed poses.

    Parameters
    ----------
    block
        The block.
    options
        The options; None: the defaults.
    threads
        Number of threads, at most four per processor. None: one thread for up to a few thousand image points,
        otherwise all processors. The result is identical to the last bit for any number.
    progress
        Called with the progress from time to time; an exception that it raises stops the adjustment.
    **changes
        Fields of :class:`photogram.AdjustOptions` with other values.

    Returns
    -------
    The result; its `status` is `converged` if the adjustment converged.

    Raises
    ------
    RankError
        If the observations do not determine all unknowns; lists the photos and points concerned.
    AdjustmentError
        If there is nothing to adjust, initial values give infinite image coordinates, or double precision is
        insufficient for large coordinates; lists the photos and points concerned. If a datum is specified for
        a block that is not free.
    OutOfMemoryError
        If the adjustment needs more memory than is available.
    InputError
        If an option is invalid, or the points and photos of the datum cannot define it or are on
        trajectories. If a photo is not above the water of the block.
    KeyboardInterrupt
        If interrupted by Ctrl-C.
    """
    chosen = options_of(AdjustOptions, options, changes)
    core, inner = options_in_datum(chosen, checked(block))
    check_cameras(block)
    again = partial(
        adjusted,
        options=core,
        threads=threads,
        progress=progress,
        inner=inner,
        keep=chosen.covariance == "verdict",
    )
    result = again(started(block))
    messages: list[Message] = []
    for _ in range(TURNS if block.all_trajectories else 0):
        if not (turns := large_turns(result)):
            break
        messages.append(taken_over(turns))
        result = again(started(result.restarted(turns)))
    messages += stays(result) if block.all_trajectories else []
    result = replace(result, messages=[*messages, *result.messages]) if messages else result
    return result.with_max_bias_ratio(chosen.max_bias_ratio)


def options_in_datum(chosen: AdjustOptions, block: Block) -> tuple[CoreOptions, DatumRow | None]:
    """Return options for the core with the minimum constraints of a block, and inner constraints."""
    options, datum = core_options(chosen, block), chosen.constraints
    if isinstance(datum, MinimumConstraints):
        options = replace(options, minimum=minimum_row(block, datum))
    return options, datum_row(block, datum) if isinstance(datum, InnerConstraints) else None


def core_options(chosen: AdjustOptions, block: Block | None = None) -> CoreOptions:
    """Return options for the core, without minimum constraints; a block may need more iterations."""
    row, tolerance = loss_row(chosen.loss), chosen.tolerance
    as_published = isinstance(tolerance, AsPublished)
    count = chosen.max_iterations
    if count is None:
        # Reweighting needs more iterations.
        count = AS_PUBLISHED if as_published else 50 if row is None else 200
        cameras = block.cameras if block else ()
        if any(each.knot_unknowns for each in cameras):
            count = OF_KNOTS
        elif not as_published and any(np.isinf(each.deviations).any() for each in cameras):
            count = OF_CAMERAS
    if chosen.unit_variance == "redundancy" and not chosen.covariance:
        raise InputError(phrase("adjust.redundancy-numbers"))
    if row and as_published:
        raise InputError(phrase("adjust.loss-as-published"))
    return CoreOptions(
        criterion="percent" if as_published else "fraction",
        limit=tolerance.percent if isinstance(tolerance, AsPublished) else tolerance,
        max_iterations=count,
        covariance=bool(chosen.covariance),
        loss=row,
        ordering=chosen.ordering,
        unit_variance=chosen.unit_variance,
        minimum=None,
    )


def adjusted(
    block: Block,
    options: CoreOptions,
    *,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    inner: DatumRow | None = None,
    keep: bool = False,
    start: _photocore.BlockState | None = None,
) -> Result:
    """Adjust a block from its initial values, or from the state of a result with other weights.

    `keep` keeps the factor for a verdict.
    """
    processors, network = core_threads(threads), block_network(block, options)
    tested = tested_together(block) if keep else None
    try:
        call = None if progress is None else teller(progress)
        solution = network.adjust(datum=inner, threads=processors, progress=call, start=start, keep=tested)
    except _photocore.BlockError as error:
        if error.args[0] in ("not free", "datum"):
            raise refused(block, network, None, error) from None
        raise named(block, *error.args) from None
    with turned("the adjusted block"):
        datum = datum_of(block, solution, inner)
        messages = messages_of(block, solution, options, datum)
        freedom: float = solution.degrees_of_freedom
        if options.unit_variance == "redundancy" and solution.redundancies is not None:
            _, *measured = solution.redundancies
            freedom = round(sum(measured), 6)
        return Result.from_solution(block, solution, options, datum, messages, freedom)


def messages_of(
    block: Block, solution: _photocore.BlockSolution, options: CoreOptions, datum: ResultDatum
) -> list[Message]:
    """Return the notes of a result, the most severe first, without hints."""
    error = None if solution.undetermined is None else named(block, *solution.undetermined)
    messages = datum_messages(block, datum, solution.point_rays) + undetermined(block, solution, error)
    messages += rounded(solution.redundancy_excess) + harmful(block, solution)
    messages += behind(block, solution) + folded(block, solution)
    dropped = dropped_points(block, solution)
    messages += [
        Message(phrase("adjust.left-out", reason=phrase(f"reason.{reason}"), points=", ".join(points)))
        for reason, points in by_key((reason, point) for point, reason in dropped.items()).items()
    ]
    of_points = enumerate(block.observations.column("points") if dropped else [])
    lost = [block.observations[row].name for row, of in of_points if not dropped.keys().isdisjoint(of)]
    if lost:
        messages.append(Message(phrase("adjust.left-out.observations", observations=lost)))
    messages += refraction_remarks(block, solution.photo_positions)
    messages += remark(options.loss, solution.image_weights)
    iterations = [Iteration(*row) for row in solution.iterations] if options.criterion == "percent" else []
    for before, after in pairwise(iterations):
        percent = 100 * (after.weighted_sum_of_squares / before.weighted_sum_of_squares - 1)
        if percent > NOTABLE_RISE:
            messages.append(Message(phrase("adjust.rise", percent=percent, iteration=after.number)))
    return messages


def teller(
    progress: Callable[[Progress], None],
) -> Callable[[str, int, int, _photocore.IterationRow | None], None]:
    """Return the callback of the core that calls `progress`."""
    if not callable(progress):
        raise kind_error("progress", "a function", progress)

    def tell(phase: str, done: int, total: int, iteration: _photocore.IterationRow | None) -> None:
        progress(Progress(phase, done, total, Iteration(*iteration) if iteration else None))

    return tell


def at_least(name: str, value: object, least: int) -> int:
    """Return a validated whole number with a lower limit."""
    if (whole := whole_number(name, value)) < least:
        raise argument_error(name, "least", low=least, value=whole)
    return whole


def core_threads(threads: int | None) -> int:
    """Return the number of threads for the core, a few per processor; 0 is the default of the core."""
    if threads is None:
        processors = os.cpu_count() or 1
        fit = threads_that_fit(processors)
        return 0 if fit == processors else fit
    return threads_that_fit(min(at_least("threads", threads, 1), 4 * (os.cpu_count() or 1)))


def named(
    block: Block,
    kind: str,
    message: str,
    combinations: list[_photocore.CombinationRow],
    points: list[int],
    seconds: Sequence[float] = (),
    *,
    unknowns: Sequence[Unknown] | None = None,
) -> AdjustmentError:
    """Name the objects of a core failure; `unknowns` if they are not the unknowns of the block."""
    point_names = [block.point_ids[i] for i in points]
    if kind == "undetermined points":
        seen = sorted({int(p) for p in block.image_photos[np.isin(block.image_points, points)]})
        photo_names = [block.photo_ids[p] for p in seen]
        code = "adjust.points.one-place" if in_one_place(block, seen) else "adjust.points.undetermined"
        message_of_points = phrase(code, photos=photo_names, points=point_names)
        return RankError(message_of_points, photo_names, point_names)
    if kind == "undetermined photos":
        return undetermined_combinations(block, combinations, unknowns)
    if kind == "no intersection":
        return RankError(phrase("adjust.no-intersection", point=point_names[0]), [], point_names)
    if kind == "coarse":
        return too_coarse([block.photo_ids[i] for i in combinations[0][0]], point_names)
    if kind == "outside":
        return AdjustmentError(beyond_trajectory(block, combinations[0][0][0], points, seconds))
    return failure_of_core(kind, message)
