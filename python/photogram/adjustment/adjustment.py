"""Adjustment of a block by least squares."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from photogram import _photocore
from photogram.adjustment.first_features import started
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
from photogram.adjustment.robust import Loss, loss_row, remark
from photogram.adjustment.taking_over import large_turns, stays, taken_over
from photogram.adjustment.undetermined import beyond_trajectory, in_one_place, undetermined_combinations
from photogram.arguments.arrays import argument_error, number, one_of, whole_number
from photogram.arguments.objects import kind_error
from photogram.errors import AdjustmentError, InputError, OutOfMemoryError, RankError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.memory import threads_that_fit, turned
from photogram.messages import Message
from photogram.network.block import Block, checked
from photogram.network.core_arrays import CoreOptions, block_network
from photogram.network.datum import (
    DatumRow,
    InnerConstraints,
    MinimumConstraints,
    check_datum,
    datum_row,
    minimum_row,
)
from photogram.network.unknowns import Unknown
from photogram.results.check_points import tested_together
from photogram.results.datum import ResultDatum, datum_messages, datum_of, refused
from photogram.results.iteration import Iteration
from photogram.results.result import Result, dropped_points
from photogram.words import phrase

UnitVariance = Literal["free", "constrained", "unity", "redundancy"]
Ordering = Literal["auto", "input", "rcm", "amd", "dissection", "graph-dissection"]


AS_PUBLISHED = 4  # Iterations of the 1987 program, where nobody says how many
OF_CAMERAS = 200  # Most iterations with free camera parameters
OF_KNOTS = 400  # Most iterations with the knots of a splined lens
NOTABLE_RISE = 1e-3  # Percent; less is rounding
TURNS = 5  # So often at the most do tables of trajectories take over large corrections


@dataclass(frozen=True)
class AsPublished:
    """The iteration of the 1987 program (GIANT guide, section 6).

    Attributes
    ----------
    percent
        Converged when the weighted sum of squares changes by less than this from one iteration to the next.
    """

    percent: float = 5.0


@dataclass(frozen=True)
class Progress:
    """How far an adjustment has come.

    Attributes
    ----------
    phase
        `form` (with the factorisation), `solve`, `invert` (with cofactors), or `iteration` when one is over.
    done, total
        Points done of all, within the phase.
    iteration
        The iteration that is over.
    """

    phase: str
    done: int
    total: int
    iteration: Iteration | None = None


def adjust(
    block: Block,
    *,
    datum: InnerConstraints | MinimumConstraints | None = None,
    unit_variance: UnitVariance = "constrained",
    loss: Loss | None = None,
    covariance: bool | Literal["verdict"] = True,
    tolerance: float | AsPublished = 1e-5,
    max_iterations: int | None = None,
    ordering: Ordering = "auto",
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Result:
    """Adjust a block by least squares.

    Every unknown is a weighted parameter, from free to fixed. Points that their image points cannot determine
    are left out (the result's `messages` and `dropped` say which); the others start from the intersection of
    their rays. Refraction, where the block has it, is applied in every iteration. A block that is too large
    for one process, or too slow in it, is for :func:`photogram.adjust_in_parts`; one whose photos keep their
    poses is `block.with_fixed_photos()`.

    Parameters
    ----------
    block
        The block.
    datum
        Of a block that is free: what is held (minimum constraints), or chosen points and photos that stay as
        near as they come to their given places (inner constraints); see docs/datum.md. None: minimum
        constraints, chosen where nothing else gives a datum.
    unit_variance
        What the variance of unit weight is based on: every weighted quantity as the observation that it is
        (`constrained`), 1 (`unity`), or the redundancy numbers of image coordinates, control and observations
        beside images (`redundancy`, docs/weights.md). `free`, the default of the 1987 program (GIANT guide,
        Appendix E), counts image coordinates and ground control only, and is too large where photos or
        cameras are weighted. Covariances are scaled by it.
    loss
        Robust loss in place of the squares of image coordinates: `huber` or `cauchy`, of both coordinates
        of an image point together; None for least squares. `("huber", 2.0)` also says where it sets in, in
        standard deviations a priori, which is at 1.50 for `huber` and 2.55 for `cauchy` otherwise. Variance,
        covariances and redundancy numbers hold for the weights as the loss has modified them
        (`image_weights`).
    covariance
        Whether to compute covariances, redundancy numbers and standardized residuals. `verdict`: the verdict,
        or a report, will be asked for too; the adjustment takes about a twentieth longer, and keeps what the
        tests need until then, where there is memory, so that they form nothing again. It does so without a
        loss and inner constraints, and where it converges.
    tolerance
        Iterate until no unknown changes by more than this fraction of its standard deviation (a priori unit
        weight), or until the rate of convergence shows that none would by more than a tenth of it. A step
        that raises the sum of squares is damped (Levenberg-Marquardt). Or as the 1987 program did.
    max_iterations
        Largest number of iterations. When None, 50; 200 with a loss, because reweighting needs more of them,
        or with free parameters of cameras, because a weak network follows a curved valley; 400 with a splined
        lens, whose knots few images leave to their priors, and steps along these are short; 4 as the 1987
        program did.
    ordering
        How photos are ordered for elimination: in input order, in a narrow band (reverse Cuthill-McKee), by
        approximate minimum degree, by nested dissection across their positions, or across their ties alone.
        `auto` takes the one with the least predicted work.
    threads
        Number of threads, no more than four for each processor. When None, a block of a few thousand image
        points stays on the calling thread, to which others would only be a burden; a larger one has all
        processors. The result does not depend on it, to the last bit.
    progress
        Called now and then with what is going on; an exception it raises stops the adjustment.

    Returns
    -------
    The result; its `status` says whether the adjustment converged.

    Raises
    ------
    RankError
        The observations do not determine all unknowns; names the photos and points concerned.
    AdjustmentError
        There is nothing to adjust, the initial values give no finite image coordinates, or double precision
        is too coarse for coordinates so large; names the photos and points concerned. A datum was asked for,
        and the block is not free.
    OutOfMemoryError
        The adjustment would take more memory than there is.
    InputError
        An option that cannot be, a datum of points and photos that do not carry it, a photo that is not above
        the water of the block; a datum that photos on trajectories would carry.
    KeyboardInterrupt
        Ctrl-C.
    """
    checked(block)
    keep = isinstance(covariance, str) and covariance == "verdict"
    if not (keep or isinstance(covariance, bool | np.bool_)):
        raise kind_error("covariance", "True, False or `verdict`", covariance)
    check_datum(datum)
    options = core_options(
        unit_variance,
        loss,
        bool(covariance),
        tolerance,
        iteration_limit(block, tolerance) if max_iterations is None else max_iterations,
        ordering=ordering,
    )
    processors = core_threads(threads)
    check_cameras(block)
    block = started(block)
    options, inner = with_datum(block, options, datum)
    result = _adjusted(block, options, processors, progress, inner, keep=keep)
    if not block.all_trajectories:
        return result
    messages: list[Message] = []
    for _ in range(TURNS):
        if not (turns := large_turns(result)):
            break
        messages.append(taken_over(turns))
        block = started(result.restarted(turns))
        result = _adjusted(block, options, processors, progress, inner, keep=keep)
    messages += stays(result)
    return replace(result, messages=[*messages, *result.messages]) if messages else result


def iteration_limit(block: Block, tolerance: float | AsPublished = 1e-5) -> int | None:
    """Return the default largest number of iterations for the cameras of a block; None if they need none."""
    if any(each.knot_unknowns for each in block.cameras):
        return OF_KNOTS
    if isinstance(tolerance, AsPublished) or not any(
        np.isinf(each.deviations).any() for each in block.cameras
    ):
        return None
    return OF_CAMERAS


def with_datum(
    block: Block, options: CoreOptions, datum: InnerConstraints | MinimumConstraints | None
) -> tuple[CoreOptions, DatumRow | None]:
    """Return options with what is to be held of a block, and inner constraints as the core knows them."""
    if isinstance(datum, MinimumConstraints):
        options = replace(options, minimum=minimum_row(block, datum))
    return options, datum_row(block, datum) if isinstance(datum, InnerConstraints) else None


def core_options(
    unit_variance: UnitVariance,
    loss: Loss | None,
    covariance: bool = True,
    tolerance: float | AsPublished = 1e-5,
    max_iterations: int | None = None,
    *,
    ordering: Ordering = "auto",
) -> CoreOptions:
    """Return how the core adjusts, by options of :func:`adjust`, checked; nothing is chosen to be held."""
    one_of("unit_variance", unit_variance, get_args(UnitVariance))
    row = loss_row(loss)
    as_published = isinstance(tolerance, AsPublished)
    limit = tolerance.percent if isinstance(tolerance, AsPublished) else tolerance
    if max_iterations is None:
        # Reweighting takes more iterations.
        max_iterations = AS_PUBLISHED if as_published else 50 if row is None else 200
    check_iteration(ordering, max_iterations, limit)
    if unit_variance == "redundancy" and not covariance:
        raise InputError(phrase("adjust.redundancy-numbers"))
    if row and as_published:
        raise InputError(phrase("adjust.loss-as-published"))
    return CoreOptions(
        criterion="percent" if as_published else "fraction",
        limit=limit,
        max_iterations=max_iterations,
        covariance=covariance,
        loss=row,
        ordering=ordering,
        unit_variance=unit_variance,
        minimum=None,
    )


def adjusted_from(
    block: Block,
    options: CoreOptions,
    *,
    threads: int | None,
    progress: Callable[[Progress], None] | None = None,
) -> Result:
    """Adjust a block whose values, those of points too, are where an adjustment of much of it has ended."""
    options = replace(options, points_given=True)
    return _adjusted(started(block), options, core_threads(threads), progress)


def _adjusted(
    block: Block,
    options: CoreOptions,
    processors: int,
    progress: Callable[[Progress], None] | None = None,
    inner: DatumRow | None = None,
    *,
    keep: bool = False,
    start: _photocore.BlockState | None = None,
) -> Result:
    network = block_network(block, options)
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


def adjusted_again(
    block: Block, options: CoreOptions, start: _photocore.BlockState, *, threads: int | None
) -> Result:
    """Adjust a block, of which only weights have changed, from where an adjustment of it has ended.

    `options` and `start` are those of the former result, and where it ended: its `options` and `state`.
    """
    return _adjusted(block, options, core_threads(threads), start=start)


def messages_of(
    block: Block, solution: _photocore.BlockSolution, options: CoreOptions, datum: ResultDatum
) -> list[Message]:
    """Return what a result remarks on, but for hints."""
    messages = datum_messages(block, datum, solution.point_rays) + remarks_on(block, solution)
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
    """Return the function that the core calls, which calls `progress`."""
    if not callable(progress):
        raise kind_error("progress", "a function", progress)

    def tell(phase: str, done: int, total: int, iteration: _photocore.IterationRow | None) -> None:
        progress(Progress(phase, done, total, Iteration(*iteration) if iteration else None))

    return tell


def check_iteration(ordering: str, max_iterations: int, tolerance: float) -> None:
    """Refuse invalid options of an iteration."""
    one_of("ordering", ordering, get_args(Ordering))
    at_least("max_iterations", max_iterations, 1)
    if not number("tolerance", tolerance) > 0:
        raise argument_error("tolerance", "positive", value=tolerance)


def at_least(name: str, value: object, least: int) -> int:
    """Return a whole number that is not below a limit."""
    if (whole := whole_number(name, value)) < least:
        raise argument_error(name, "least", low=least, value=whole)
    return whole


def core_threads(threads: int | None) -> int:
    """Return the number of threads for the core, a few for each processor; 0 leaves it to the core."""
    if threads is None:
        processors = os.cpu_count() or 1
        fit = threads_that_fit(processors)
        return 0 if fit == processors else fit
    return threads_that_fit(min(at_least("threads", threads, 1), 4 * (os.cpu_count() or 1)))


def remarks_on(block: Block, solution: _photocore.BlockSolution) -> list[Message]:
    """Collect remarks on the block that did not stop the adjustment, the gravest first."""
    error = None if solution.undetermined is None else named(block, *solution.undetermined)
    messages = undetermined(block, solution, error) + rounded(solution.redundancy_excess)
    messages += harmful(block, solution) + behind(block, solution) + folded(block, solution)
    dropped = dropped_points(block, solution)
    by_reason: dict[str, list[str]] = {}
    for point, reason in dropped.items():
        by_reason.setdefault(reason, []).append(point)
    messages += [
        Message(phrase("adjust.left-out", reason=reason, points=", ".join(points)))
        for reason, points in by_reason.items()
    ]
    lost = [each.name for each in block.observations if dropped.keys() & set(each.points)]
    if lost:
        messages.append(Message(phrase("adjust.left-out.observations", observations=lost)))
    return messages + refraction_remarks(block, solution.photo_positions)


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
    """Put names to the indices of a failure of the core; `unknowns` where it has others than the block."""
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
    if kind == "memory":
        return OutOfMemoryError(message)
    if kind == "outside":
        return AdjustmentError(beyond_trajectory(block, combinations[0][0][0], points, seconds))
    return AdjustmentError(message)
