"""Data snooping of a block: gross errors found one after the other and taken out."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any, get_args

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress, UnitVariance, adjust, adjusted_from, core_threads
from photogram.adjustment.consensus import started_by_consensus
from photogram.arguments.arrays import number, one_of, truth_value, whole_number
from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError, InputError
from photogram.messages import Message
from photogram.network.block import Block, checked
from photogram.network.core import CoreOptions, block_network
from photogram.network.observations import observation_rows
from photogram.network.refracted import check_cameras
from photogram.results.exchanged import Exchange, exchanged_names
from photogram.results.held import held_remark
from photogram.results.network_trial import (
    ATTITUDE,
    CONTROL,
    IMAGE,
    OBSERVATION,
    POSITION,
    NetworkTrial,
)
from photogram.results.result import Result
from photogram.results.snooped import Snooped
from photogram.results.suspects import network_trial
from photogram.show.ways import Way
from photogram.statistics.distributions import LEVEL
from photogram.statistics.snooping.snooping import Outcome, Settings, snooped
from photogram.statistics.snooping.suspects import Aside, LostSupportError, Out

__all__ = ["block_trial", "of_network", "settings_of", "snoop", "used_images"]


def snoop(
    block: Any,
    *,
    level: float = LEVEL,
    fdr: float | None = None,
    unit_weight: str = "known",
    robust: bool | None = None,
    parts: bool = True,
    max_rounds: int = 20,
    unit_variance: UnitVariance = "constrained",
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Snooped:
    """Take gross errors out of a block, or of a collection, one after the other.

    Every image (x and y together), control point (plan, height or all), component of a weighted station and
    observation beside images is tested as a group; the least probable goes first, and the others are tested
    without it. After each round the network is adjusted, and what is out is tested against the rest: what
    agrees comes back. docs/blunders.md has the formulas, and how well it works.

    Parameters
    ----------
    block
        The block, or a :class:`photogram.collection.Collection`.
    level
        Probability that any good observation is taken out of a network without gross errors (Bonferroni; the
        number of tests is that of the start in all rounds).
    fdr
        A false discovery rate in place of `level`: the limit rises with every group that is out.
    unit_weight
        `known`: the given standard deviations are right, tests are chi-square. `unknown`: they are right but
        for a common factor, tests are F. With `known`, standard deviations that are more than twice too small
        by the median of all test values are multiplied by that factor for the tests.
    robust
        Whether to start from a robust adjustment (Huber's loss, then Cauchy's), whose outliers are then
        tested; None where many observations disagree, or the plain adjustment does not converge.
    parts
        Whether a part of a control point (height, plan) or of a weighted station may go alone; otherwise all
        of it goes.
    max_rounds
        Rounds at the most.
    unit_variance, threads
        See :func:`photogram.adjust`; the unit variance of collections is `constrained`.
    progress
        Told of the adjustments before and after.

    Returns
    -------
    The adjusted network without what was taken out, and the log.

    Raises
    ------
    RankError, AdjustmentError, OutOfMemoryError
        As :func:`photogram.adjust`.
    InputError
        An option that cannot be.
    KeyboardInterrupt
        Ctrl-C.
    """
    return of_network(
        block,
        level=level,
        fdr=fdr,
        unit_weight=unit_weight,
        robust=robust,
        parts=parts,
        max_rounds=max_rounds,
        unit_variance=unit_variance,
        threads=threads,
        progress=progress,
    )


@Way
def of_network(network: object, **options: Any) -> Snooped:
    """Take gross errors out of a network of any class; see :func:`snoop`."""
    raise InputError(f"snoop takes a Block or a Collection, not {type(network).__name__}")


def settings_of(
    level: float, fdr: float | None, unit_weight: str, robust: bool | None, max_rounds: int
) -> Settings:
    """Return checked options.

    Raises
    ------
    InputError
        One that cannot be.
    """
    one_of("unit_weight", unit_weight, ("known", "unknown"))
    if robust is not None:
        truth_value("robust", robust)
    family = number("level", level) if fdr is None else number("fdr", fdr)
    if not 0 < family < 1:
        raise InputError(
            f"{'level' if fdr is None else 'fdr'} is a probability between 0 and 1, not {family:g}"
        )
    if whole_number("max_rounds", max_rounds) < 1:
        raise InputError("there must be one round at least")
    return Settings(
        level=family,
        fdr=fdr is not None,
        known=unit_weight == "known",
        robust=robust,
        max_rounds=max_rounds,
    )


@of_network.register
def _snoop_block(
    block: Block,
    *,
    level: float = LEVEL,
    fdr: float | None = None,
    unit_weight: str = "known",
    robust: bool | None = None,
    parts: bool = True,
    max_rounds: int = 20,
    unit_variance: UnitVariance = "constrained",
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Snooped:
    checked(block)
    check_cameras(block)
    settings = settings_of(level, fdr, unit_weight, robust, max_rounds)
    truth_value("parts", parts)
    one_of("unit_variance", unit_variance, get_args(UnitVariance))

    def adjusted(given: Block, **options: Any) -> Result:
        return adjust(given, unit_variance=unit_variance, threads=threads, progress=progress, **options)

    def afresh() -> Aside | None:
        found = started_by_consensus(block)
        if found is None:
            return None
        start, aside = found
        trial.restart(core_trial(start, None, options_of(unit_variance), threads))
        return aside

    try:
        trial = block_trial(block, None, options_of(unit_variance), threads, parts=parts)
        outcome = snooped(trial, settings, afresh)
    except (LostSupportError, _photocore.BlockError):
        # It says by name what is not determined, or goes on where points have to leave.
        first = adjusted(block, covariance=False)
        if not first.converged and robust is not False:
            first = adjusted(block, covariance=False, loss="huber")
        trial, outcome = _snooped_from(first, settings, threads, parts=parts)
    cleaned, options = _without(block, trial, outcome.out), options_of(unit_variance)
    result = adjusted_from(cleaned, options, threads=threads, progress=progress)
    said = [*outcome.remarks, *_held(block, outcome, adjusted)]
    result = dataclasses.replace(result, messages=[*map(Message, said), *result.messages])
    return Snooped(
        result=result,
        outcome=outcome,
        suspects=trial.suspects,
        settings=settings,
        exchanged=_exchanged(block, trial, outcome, result),
    )


def _exchanged(block: Block, trial: NetworkTrial, outcome: Outcome, result: Result) -> tuple[Exchange, ...]:
    """Find exchanged names among what is out."""
    reached = block.replace(
        photo_positions=result.photo_positions,
        photo_attitudes=result.photo_attitudes,
        cameras=result.block.cameras if not result.cameras else [each.camera for each in result.cameras],
    )
    return tuple(exchanged_names(reached, used_images(trial, outcome.out, len(block.image_xy))))


def used_images(trial: NetworkTrial, out: Out, count: int) -> Bools:
    """(m,) images of a network, so many, that are not out."""
    kinds, subjects = trial.core.subjects
    group = np.repeat(np.arange(len(kinds)), np.diff(trial.core.row_starts))
    used = np.ones(count, dtype=bool)
    used[subjects[group[out.rows & (kinds[group] == IMAGE)]]] = False
    return used


def _held(block: Block, outcome: Outcome, adjusted: Callable[..., Result]) -> list[str]:
    """Say of what is held that it explains more than what was taken out; see :func:`held_remark`."""
    largest = max((entry.statistic for entry in outcome.log if entry.is_out), default=math.inf)
    if math.isinf(largest) or not any(
        (sd == 0).any() for sd in (block.photo_position_sd, block.photo_attitude_sd, block.point_sd)
    ):
        return []
    try:
        return held_remark(adjusted(block), largest)
    except AdjustmentError:
        return []


def _snooped_from(
    first: Result, settings: Settings, threads: int | None, *, parts: bool
) -> tuple[NetworkTrial, Outcome]:
    """Snoop from where an adjustment has ended; without a robust start where that leads nowhere."""
    for attempt in (settings, dataclasses.replace(settings, robust=False)):
        trial = block_trial(first.block, first.state, first.options, threads, parts=parts)
        try:
            return trial, snooped(trial, attempt)
        except (LostSupportError, _photocore.BlockError) as error:
            reason: Exception = error
    raise AdjustmentError(f"the block cannot be tested: {reason.args[0]}") from reason


def options_of(unit_variance: UnitVariance) -> CoreOptions:
    """Return how the core adjusts a block that is snooped: as :func:`photogram.adjust` does by default."""
    return CoreOptions(
        criterion="fraction",
        limit=1e-5,
        max_iterations=50,
        covariance=True,
        loss=None,
        ordering="auto",
        unit_variance=unit_variance,
        minimum=None,
    )


def block_trial(
    block: Block,
    state: _photocore.BlockState | None,
    options: CoreOptions,
    threads: int | None = None,
    *,
    parts: bool = True,
) -> NetworkTrial:
    """Return a block as snooping asks it, from the start or from where an adjustment has ended."""
    return network_trial(block, core_trial(block, state, options, threads), parts=parts)


def core_trial(
    block: Block, state: _photocore.BlockState | None, options: CoreOptions, threads: int | None
) -> _photocore.NetworkTrial:
    """Return the same in the core."""
    options = dataclasses.replace(options, covariance=True, loss=None)
    return block_network(block, options).trial(state, threads=core_threads(threads))


def _without(block: Block, trial: NetworkTrial, out: Out) -> Block:
    """Return a block without what is out, from where the last trial has ended.

    Points start where their rays meet; what was given of them stays, for check points are compared with it.
    Of control that is out nothing stays: what is taken for a gross error checks nothing.
    """
    core = trial.core
    kinds, subjects = core.subjects
    starts, components = core.row_starts, core.components
    reached = np.array([values[:6] for values in core.photos])
    group = np.repeat(np.arange(len(kinds)), np.diff(starts))
    gone = {kind: out.rows & (kinds[group] == kind) for kind in range(OBSERVATION + 1)}
    subject = subjects[group]
    images = np.ones(len(block.image_xy), dtype=bool)
    images[subject[gone[IMAGE]]] = False
    point_sd = block.point_sd.copy()
    point_positions = block.point_positions.copy()
    control = subject[gone[CONTROL]], components[gone[CONTROL]]
    point_sd[control], point_positions[control] = np.inf, np.nan
    position_sd, attitude_sd = block.photo_position_sd.copy(), block.photo_attitude_sd.copy()
    position_sd[subject[gone[POSITION]], components[gone[POSITION]]] = np.inf
    attitude_sd[subject[gone[ATTITUDE]], components[gone[ATTITUDE]]] = np.inf
    # Nothing is left that determines them: they stay where they are.
    alone = sorted(out.photos)
    position_sd[alone], attitude_sd[alone] = 0.0, 0.0
    rows = [
        row
        for own, _ in observation_rows(block.observations, block.point_ids, block.photo_ids, block.unknowns)
        for row in own
    ]
    dropped = {rows[index] for index in subject[gone[OBSERVATION]].tolist()}
    positions, attitudes = block.photo_positions_observed, block.photo_attitudes_observed
    return block.replace(
        photo_positions=np.where(position_sd == 0, block.photo_positions, reached[:, :3]),
        photo_attitudes=np.where(attitude_sd == 0, block.photo_attitudes, reached[:, 3:]),
        photo_positions_observed=_observed(block.photo_positions, positions, position_sd),
        photo_attitudes_observed=_observed(block.photo_attitudes, attitudes, attitude_sd),
        photo_position_sd=position_sd,
        photo_attitude_sd=attitude_sd,
        point_positions=point_positions,
        point_sd=point_sd,
        image_photos=block.image_photos[images],
        image_points=block.image_points[images],
        image_xy=block.image_xy[images],
        image_sd=block.image_sd[images],
        observations=[each for row, each in enumerate(block.observations) if row not in dropped],
    )


def _observed(initial: Floats, observed: Floats | None, sd: Floats) -> Floats | None:
    """Return what was observed; nothing where nothing is weighted."""
    weighted = bool((np.isfinite(sd) & (sd > 0)).any())
    return initial if observed is None and weighted else observed
