"""Adjustment of a block by least squares."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from photogram import _photocore
from photogram.adjustment.coefficients import outside
from photogram.adjustment.ends import behind, folded, harmful, rounded, too_coarse, undetermined
from photogram.adjustment.robust import Loss, loss_row, remark
from photogram.adjustment.started import started
from photogram.adjustment.undetermined import one_place, undetermined_combinations
from photogram.arguments.arrays import number, one_of, shown, truth_value, whole_number
from photogram.errors import AdjustmentError, InputError, OutOfMemoryError, RankError
from photogram.memory import threads_that_fit, turned
from photogram.messages import Message, listed
from photogram.network.block import Block, checked
from photogram.network.core import CoreOptions, block_network
from photogram.network.datum import (
    DatumRow,
    InnerConstraints,
    MinimumConstraints,
    datum_row,
    minimum_row,
)
from photogram.network.motion import refuse_datum, refuse_trajectories
from photogram.network.refracted import check_cameras, remarks
from photogram.network.unknowns import Unknown
from photogram.results.datum import datum_messages, datum_of, refused
from photogram.results.iteration import Iteration
from photogram.results.network import AdjustedNetwork
from photogram.results.result import Result
from photogram.show.ways import Way

__all__ = ["AsPublished", "Ordering", "Progress", "UnitVariance", "adjust", "adjusted_again", "teller"]

UnitVariance = Literal["free", "constrained", "unity", "redundancy"]
Ordering = Literal["auto", "input", "rcm", "amd", "dissection", "graph-dissection"]


NOTABLE_RISE = 1e-3
"""Percent; less is rounding."""


@dataclass(frozen=True)
class AsPublished:
    """The iteration of the 1987 program (GIANT guide, section 6).

    Attributes
    ----------
    percent
        Converged when the weighted sum of squares changes by less than this from one iteration to the next.
    max_iterations
        Limit of iterations.
    """

    percent: float = 5.0
    max_iterations: int = 4


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
    unit_variance: UnitVariance = "constrained",
    max_iterations: int | None = None,
    tolerance: float = 1e-5,
    as_published: AsPublished | None = None,
    covariance: bool = True,
    loss: Loss | None = None,
    scale: float | None = None,
    fix_photos: bool = False,
    datum: InnerConstraints | MinimumConstraints | None = None,
    ordering: Ordering = "auto",
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    verdict: bool = False,
) -> Result:
    """Adjust a block by least squares.

    Every unknown is a weighted parameter, from free to fixed. Points that their image points cannot determine
    are left out (the result's `messages` and `dropped` say which); the others start from the intersection of
    their rays. Refraction, where the block has it, is applied in every iteration. A block that is too large
    for one process, or too slow in it, is for :func:`photogram.adjust_in_parts`.

    Parameters
    ----------
    block
        The block.
    unit_variance
        What the variance of unit weight is based on: every weighted quantity as the observation that it is
        (`constrained`), 1 (`unity`), or the redundancy numbers of image coordinates, control and observations
        beside images (`redundancy`, docs/weights.md). `free`, the default of the 1987 program (GIANT guide,
        Appendix E), counts image coordinates and ground control only, and is too large where photos or
        cameras are weighted. Covariances are scaled by it.
    max_iterations
        Iterations at the most. When None, 50 without a loss, and 200 with one: reweighting takes more of
        them.
    tolerance
        Iterate until no unknown changes by more than this fraction of its standard deviation (a priori unit
        weight), or until the rate of convergence shows that none would by more than a tenth of it. A step
        that raises the sum of squares is damped (Levenberg-Marquardt).
    as_published
        Iterate as the 1987 program did instead.
    covariance
        Whether to compute covariances, redundancy numbers and standardized residuals.
    loss
        Robust loss in place of the squares of image coordinates: `huber` or `cauchy`, of both coordinates
        of an image point together; None for least squares. Variance, covariances and redundancy numbers
        hold for the weights as the loss has modified them (`image_weights`).
    scale
        Where the loss sets in, in standard deviations a priori; 1.50 for `huber` and 2.55 for `cauchy` when
        None.
    fix_photos
        Keep positions and attitudes as they are: every point by itself.
    datum
        Of a block that is free: what is held (minimum constraints), or chosen points and photos that stay as
        near as they come to their given places (inner constraints); see docs/datum.md. None: minimum
        constraints, chosen where nothing else gives a datum.
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
    verdict
        Whether the verdict, or a report, will be asked for: the adjustment takes about a twentieth longer,
        and keeps what the tests need until then, where there is memory, so that they form nothing again. It
        does so without a loss and inner constraints, and where it converges.

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
        the water of the block; a datum or fixed poses of photos on trajectories.
    KeyboardInterrupt
        Ctrl-C.
    """
    max_iterations = most_iterations(max_iterations, loss)
    checked(block)
    truth_value("covariance", covariance)
    truth_value("fix_photos", fix_photos)
    truth_value("verdict", verdict)
    if not isinstance(datum, InnerConstraints | MinimumConstraints | None):
        raise InputError(f"datum is InnerConstraints, MinimumConstraints or None, not {shown(datum)}")
    one_of("unit_variance", unit_variance, get_args(UnitVariance))
    if as_published is not None and not isinstance(as_published, AsPublished):
        raise InputError(f"as_published is an AsPublished or None, not {shown(as_published)}")
    check_iteration(
        ordering,
        as_published.max_iterations if as_published else max_iterations,
        as_published.percent if as_published else tolerance,
    )
    processors = core_threads(threads)
    row = loss_row(loss, scale)
    if unit_variance == "redundancy" and not covariance:
        raise InputError("unit_variance='redundancy' needs redundancy numbers: covariance=True")
    if row and as_published:
        raise InputError("the 1987 program has no robust loss: as_published or loss")
    check_cameras(block)
    if fix_photos:
        refuse_trajectories(block, "fix_photos", "whose pose is not its own")
        block = block.replace(
            photo_position_sd=0.0,
            photo_attitude_sd=0.0,
            photo_positions_observed=None,
            photo_attitudes_observed=None,
        )
    if datum is not None:
        refuse_datum(block, "datum")
    block = started(block)
    inner = datum_row(block, datum) if isinstance(datum, InnerConstraints) else None
    options = CoreOptions(
        criterion="percent" if as_published else "fraction",
        limit=as_published.percent if as_published else tolerance,
        max_iterations=as_published.max_iterations if as_published else max_iterations,
        covariance=covariance,
        loss=row,
        ordering=ordering,
        unit_variance=unit_variance,
        minimum=minimum_row(block, datum) if isinstance(datum, MinimumConstraints) else None,
    )
    return _adjusted(block, options, processors, progress, inner, as_published, keep=verdict)


def adjusted_from(
    block: Block,
    options: CoreOptions,
    *,
    threads: int | None,
    progress: Callable[[Progress], None] | None = None,
) -> Result:
    """Adjust a block whose values, those of points too, are where an adjustment of much of it has ended.

    Parameters
    ----------
    block, options
        The block, and how the core adjusts it.
    threads, progress
        As of :func:`adjust`.
    """
    options = replace(options, points_given=True)
    return _adjusted(started(block), options, core_threads(threads), progress)


def _adjusted(
    block: Block,
    options: CoreOptions,
    processors: int,
    progress: Callable[[Progress], None] | None,
    inner: DatumRow | None = None,
    as_published: AsPublished | None = None,
    *,
    keep: bool = False,
) -> Result:
    network = block_network(block, options)
    try:
        told = None if progress is None else teller(progress)
        solution = network.adjust(datum=inner, threads=processors, progress=told, keep=keep)
    except _photocore.BlockError as error:
        if error.args[0] in ("not free", "datum"):
            raise refused(block, network, None, error) from None
        raise named(block, *error.args) from None
    with turned("the adjusted block"):
        freedom = _freedom(solution, options)
        return _result(block, solution, options, freedom, inner, as_published)


@Way
def adjusted_again(
    block: object, options: CoreOptions, start: _photocore.BlockState, *, threads: int | None
) -> AdjustedNetwork:
    """Adjust a network, of which only weights have changed, from where an adjustment of it has ended.

    Parameters
    ----------
    block
        The block, or another network.
    options, start
        Those of the former result, and where it ended: its `options` and `state`.
    threads
        As of :func:`adjust`.
    """
    raise NotImplementedError(type(block).__name__)


@adjusted_again.register
def _(block: Block, options: CoreOptions, start: _photocore.BlockState, *, threads: int | None) -> Result:
    network = block_network(block, options)
    try:
        solution = network.adjust(datum=None, threads=core_threads(threads), progress=None, start=start)
    except _photocore.BlockError as error:
        raise named(block, *error.args) from None
    return _result(block, solution, options, _freedom(solution, options))


def _freedom(solution: _photocore.BlockSolution, options: CoreOptions) -> float:
    """Return the degrees of freedom of the unit variance: counted, or the sum of redundancy numbers."""
    if options.unit_variance != "redundancy" or solution.redundancies is None:
        return solution.degrees_of_freedom
    _, *measured = solution.redundancies
    return round(sum(measured), 6)


def _result(
    block: Block,
    solution: _photocore.BlockSolution,
    options: CoreOptions,
    freedom: float,
    inner: DatumRow | None = None,
    as_published: AsPublished | None = None,
) -> Result:
    datum = datum_of(block, solution, inner)
    messages = datum_messages(block, datum, solution.point_rays) + remarks_on(block, solution)
    messages += remark(options.loss, solution.image_weights)
    if as_published:
        messages += _rises([Iteration(*row) for row in solution.iterations])
    return Result.from_solution(block, solution, options, datum, messages, freedom)


def teller(
    progress: Callable[[Progress], None],
) -> Callable[[str, int, int, _photocore.IterationRow | None], None]:
    """Return what the core calls: it tells `progress`.

    Raises
    ------
    InputError
        It is no function.
    """
    if not callable(progress):
        raise InputError(f"progress is no function: {shown(progress)}")

    def tell(phase: str, done: int, total: int, iteration: _photocore.IterationRow | None) -> None:
        progress(Progress(phase, done, total, Iteration(*iteration) if iteration else None))

    return tell


def most_iterations(given: int | None, loss: Loss | None) -> int:
    """Return how many iterations there are at the most: reweighting takes more."""
    if given is not None:
        return given
    return 50 if loss is None else 200


def check_iteration(ordering: str, max_iterations: int, tolerance: float) -> None:
    """Refuse an iteration that cannot be.

    Raises
    ------
    InputError
        An ordering that there is not, no iteration, a criterion that is not positive.
    """
    one_of("ordering", ordering, get_args(Ordering))
    if whole_number("max_iterations", max_iterations) < 1:
        raise InputError("there must be one iteration at least")
    if not number("the criterion", tolerance) > 0:
        raise InputError("the criterion of convergence must be positive")


def core_threads(threads: int | None) -> int:
    """Return the number of threads for the core, a few for each processor at most; 0 leaves it to the core.

    Raises
    ------
    InputError
        It is no number, or not positive.
    """
    if threads is None:
        processors = os.cpu_count() or 1
        fit = threads_that_fit(processors)
        return 0 if fit == processors else fit
    if whole_number("threads", threads) < 1:
        raise InputError(f"threads must be positive, not {threads}")
    return threads_that_fit(min(threads, 4 * (os.cpu_count() or 1)))


def remarks_on(block: Block, solution: _photocore.BlockSolution) -> list[Message]:
    """Collect remarks on the block that did not stop the adjustment, the gravest first."""
    by_reason: dict[str, list[str]] = {}
    for point, reason in solution.dropped:
        by_reason.setdefault(reason, []).append(block.point_ids[point])
    error = None if solution.undetermined is None else named(block, *solution.undetermined)
    messages = undetermined(block, solution, error) + rounded(solution.redundancy_excess)
    messages += harmful(block, solution) + behind(block, solution) + folded(block, solution)
    messages += [Message(f"left out, {reason}: {', '.join(names)}") for reason, names in by_reason.items()]
    dropped = {block.point_ids[point] for point, _ in solution.dropped}
    lost = [each.name for each in block.observations if dropped.intersection(each.points)]
    if lost:
        messages.append(Message(f"left out with their points: {listed(lost)}"))
    return messages + remarks(block, solution.photo_positions)


def _rises(iterations: list[Iteration]) -> list[Message]:
    """Remark on iterations after which the sum of squares was larger than before, rounding apart."""
    messages = []
    for before, after in pairwise(iterations):
        percent = 100 * (after.weighted_sum_of_squares / before.weighted_sum_of_squares - 1)
        if percent > NOTABLE_RISE:
            messages.append(
                Message(
                    f"the weighted sum of squares rose by {percent:.2g} percent in iteration {after.number}"
                )
            )
    return messages


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
        text = f"the rays on photos {listed(photo_names)} do not determine the points {listed(point_names)}"
        text += one_place(block, seen)
        return RankError(text, photo_names, point_names)
    if kind == "undetermined photos":
        return undetermined_combinations(block, combinations, unknowns)
    if kind == "no intersection":
        return RankError(f"point {point_names[0]}: its rays do not intersect", [], point_names)
    if kind == "coarse":
        return too_coarse([block.photo_ids[i] for i in combinations[0][0]], point_names)
    if kind == "memory":
        return OutOfMemoryError(message)
    if kind == "outside":
        return AdjustmentError(outside(block, combinations[0][0][0], points, seconds))
    return AdjustmentError(message)
