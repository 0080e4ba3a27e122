"""Data snooping of a block: gross errors found one after the other and taken out."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from typing import Any, get_args

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import (
    Progress,
    UnitVariance,
    adjust,
    adjusted_from,
    at_least,
    core_options,
    core_threads,
    iteration_limit,
    with_datum,
)
from photogram.adjustment.first_values import FirstValues, first_values
from photogram.adjustment.remarks import check_cameras
from photogram.arguments.arrays import argument_error, number, one_of, truth_value
from photogram.arguments.objects import kind_error
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError
from photogram.messages import Message
from photogram.network.block import Block, checked
from photogram.network.core_arrays import CoreOptions, block_network
from photogram.network.datum import InnerConstraints, MinimumConstraints, check_datum
from photogram.network.motion import timed_photos
from photogram.network.subset import image_rows, with_rejected_points
from photogram.results.exchanged_names import Exchange, exchanged_names
from photogram.results.fixed_tests import held_remark, held_tested
from photogram.results.network import AdjustedNetwork
from photogram.results.network_trial import (
    ATTITUDE,
    CONTROL,
    IMAGE,
    OBSERVATION,
    POSITION,
    NetworkTrial,
    network_trial,
)
from photogram.results.result import Result
from photogram.results.snooping_result import Snooped, recorded
from photogram.statistics.distributions import LEVEL
from photogram.statistics.findings import Tested
from photogram.statistics.snooping.snooping import Outcome, snooped
from photogram.statistics.snooping.suspects import Aside, LostSupportError, Out
from photogram.statistics.snooping.taking_out import Settings
from photogram.words import Phrase, phrase

MOST_PHOTOS = 0.2  # Of the photos, that may agree with no pose: with more it is the consensus that is wrong


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
    **options: Any,
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
    options
        Of a block: `datum` and `max_iterations` of :func:`photogram.adjust`; tests do not depend on the
        datum. Of a collection: further ones of :func:`photogram.collection.adjust`.

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
    truth_value("parts", parts)
    one_of("unit_weight", unit_weight, ("known", "unknown"))
    if robust is not None:
        truth_value("robust", robust)
    family = number("level", level) if fdr is None else number("fdr", fdr)
    if not 0 < family < 1:
        raise argument_error("level" if fdr is None else "fdr", "range", low=0, high=1, value=family)
    at_least("max_rounds", max_rounds, 1)
    if not isinstance(block, Block) and not hasattr(block, "_snoop"):
        raise kind_error("block", "a Block or a Collection", block)
    snoop_network = partial(_snoop_block, block) if isinstance(block, Block) else block._snoop
    return snoop_network(
        Settings(
            level=family,
            fdr=fdr is not None,
            known=unit_weight == "known",
            robust=robust,
            max_rounds=max_rounds,
        ),
        parts=parts,
        unit_variance=unit_variance,
        threads=threads,
        progress=progress,
        **options,
    )


def _snoop_block(
    network: Block,
    settings: Settings,
    *,
    parts: bool,
    unit_variance: UnitVariance,
    threads: int | None,
    progress: Callable[[Progress], None] | None,
    datum: InnerConstraints | MinimumConstraints | None = None,
    max_iterations: int | None = None,
) -> Snooped:
    block = checked(network)
    check_cameras(block)
    check_datum(datum)
    one_of("unit_variance", unit_variance, get_args(UnitVariance))
    limit = iteration_limit(block) if max_iterations is None else max_iterations
    core, inner = with_datum(block, core_options(unit_variance, None, max_iterations=limit), datum)

    def adjusted(given: Block, **options: Any) -> Result:
        return adjust(
            given,
            **{"datum": None if inner else datum, **options},
            unit_variance=unit_variance,
            max_iterations=max_iterations,
            threads=threads,
            progress=progress,
        )

    def afresh() -> Aside | None:
        found = started_by_consensus(block)
        if found is None:
            return None
        start, aside = found
        trial.restart(core_trial(start, None, core, threads))
        return aside

    try:
        trial = block_trial(block, None, core, threads, parts=parts)
        outcome = snooped(trial, settings, afresh)
    except (LostSupportError, _photocore.BlockError):
        # It says by name what is not determined, or goes on where points have to leave.
        covariance = unit_variance == "redundancy"
        first = adjusted(block, covariance=covariance)
        if not first.converged and settings.robust is not False:
            first = adjusted(block, covariance=covariance, loss="huber")
        trial, outcome = _snooped_from(first, settings, threads, parts=parts)
    cleaned = _without(block, trial, outcome.out)
    result = adjusted_from(cleaned, core, threads=threads, progress=progress)
    exchanged = _exchanged(block, trial, outcome, result)
    if isinstance(datum, InnerConstraints) and result.converged:
        # Points without given coordinates carry the datum at the places of their first intersection.
        poses = {"photo_positions": block.photo_positions, "photo_attitudes": block.photo_attitudes}
        again = adjusted(cleaned.replace(**poses), datum=datum)
        result = again if again.converged else result.in_datum(datum)
    has_held = any(
        (sd == 0).any() for sd in (block.photo_position_sd, block.photo_attitude_sd, block.point_sd)
    )
    return finished(
        result,
        trial,
        outcome,
        settings,
        held=lambda: held_tested(adjusted(block)) if has_held else [],
        exchanged=exchanged,
    )


def finished(
    result: AdjustedNetwork,
    trial: NetworkTrial,
    outcome: Outcome,
    settings: Settings,
    *,
    held: Callable[[], list[Tested]],
    exchanged: Iterable[Exchange],
) -> Snooped:
    """Return what snooping gives, with what it has to say among the messages of its result.

    The result is without what is out; `held` tests what is held in an adjustment of everything: it may
    explain more than what was taken out.
    """
    largest = max((entry.statistic for entry in outcome.log if entry.is_out), default=math.inf)
    said = list(outcome.remarks)
    if not math.isinf(largest):
        with suppress(AdjustmentError):
            said += held_remark(held(), largest)
    found = Snooped(
        result=dataclasses.replace(result, messages=[*map(Message, said), *result.messages]),
        outcome=outcome,
        suspects=trial.suspects,
        settings=settings,
        exchanged=tuple(exchanged),
    )
    return recorded(found)


def _exchanged(block: Block, trial: NetworkTrial, outcome: Outcome, result: Result) -> list[Exchange]:
    """Find exchanged names among what is out."""
    reached = block.replace(
        photo_positions=result.photo_positions,
        photo_attitudes=result.photo_attitudes,
        cameras=result.block.cameras if not result.cameras else [each.camera for each in result.cameras],
    )
    return exchanged_names(reached, used_images(trial, outcome.out, len(block.image_xy)))


def gone(trial: NetworkTrial, out: Out, kind: int) -> tuple[Indices, Indices]:
    """Return what of a kind is out, row by row: the numbers of the subjects, and their components."""
    kinds, subjects = trial.core.suspects.subjects
    group = np.repeat(np.arange(len(kinds)), np.diff(trial.core.suspects.row_starts))
    rows = out.rows & (kinds[group] == kind)
    return subjects[group[rows]], trial.core.suspects.components[rows]


def used_images(trial: NetworkTrial, out: Out, count: int) -> Bools:
    """(m,) images of a network, so many, that are not out."""
    used = np.ones(count, dtype=bool)
    used[gone(trial, out, IMAGE)[0]] = False
    return used


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
    raise AdjustmentError(phrase("adjust.untested", reason=str(reason.args[0]))) from reason


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
    options = dataclasses.replace(options, covariance=True, loss=None)
    return block_network(block, options).trial(state, threads=core_threads(threads))


def _without(block: Block, trial: NetworkTrial, out: Out) -> Block:
    """Return a block without what is out, from where the last trial has ended.

    Points start where their rays meet; what was given of them stays, for check points are compared with it.
    Of control that is out nothing stays: what is taken for a gross error checks nothing.
    """
    reached = np.array([values[:6] for values in trial.core.photos])
    images = used_images(trial, out, len(block.image_xy))
    point_sd = block.point_sd.copy()
    point_positions = block.point_positions.copy()
    control = gone(trial, out, CONTROL)
    point_sd[control], point_positions[control] = np.inf, np.nan
    position_sd, attitude_sd = block.photo_position_sd.copy(), block.photo_attitude_sd.copy()
    position_sd[gone(trial, out, POSITION)] = np.inf
    attitude_sd[gone(trial, out, ATTITUDE)] = np.inf
    # Nothing is left that determines them: they stay where they are. Coefficients of trajectories do anyway.
    alone = sorted(out.photos - set(np.flatnonzero(timed_photos(block)).tolist()))
    position_sd[alone], attitude_sd[alone] = 0.0, 0.0
    rows = [row for own, _ in block.observation_groups for row in own]
    dropped = {rows[index] for index in gone(trial, out, OBSERVATION)[0].tolist()}
    positions, attitudes = block.photo_positions_observed, block.photo_attitudes_observed
    cleaned = block.replace(
        photo_positions=np.where(position_sd == 0, block.photo_positions, reached[:, :3]),
        photo_attitudes=np.where(attitude_sd == 0, block.photo_attitudes, reached[:, 3:]),
        photo_positions_observed=_observed(block.photo_positions, positions, position_sd),
        photo_attitudes_observed=_observed(block.photo_attitudes, attitudes, attitude_sd),
        photo_position_sd=position_sd,
        photo_attitude_sd=attitude_sd,
        point_positions=point_positions,
        point_sd=point_sd,
        **image_rows(block, images),
        observations=[each for row, each in enumerate(block.observations) if row not in dropped],
    )
    return with_rejected_points(cleaned, block)


def _observed(initial: Floats, observed: Floats | None, sd: Floats) -> Floats | None:
    """Return what was observed; nothing where nothing is weighted."""
    weighted = bool((np.isfinite(sd) & (sd > 0)).any())
    return initial if observed is None and weighted else observed


def started_by_consensus(block: Block) -> tuple[Block, Aside] | None:
    """Return a block with first values of its images alone, and what does not fit them.

    The given poses of photos that are not held are not used: they may be of a block that errors have bent.
    None where there is no consensus in the datum of the block, or nothing against it, and where photos are on
    frames or trajectories: each is no picture with a pose of its own.
    """
    found = None if block.mounts or block.timed else _consensus(block)
    if found is None:
        return None
    wrong: dict[int, str | Phrase] = {
        photo: found.missing[name] for photo, name in enumerate(block.photo_ids) if name in found.contradicted
    }
    if len(wrong) > MOST_PHOTOS * len(block.photo_ids) or not (wrong or found.set_aside.any()):
        return None
    return _started(block, found), Aside(tuple(np.flatnonzero(found.set_aside).tolist()), wrong)


def _consensus(block: Block) -> FirstValues | None:
    """Return first values in the datum of control, or where that does not do of observed positions."""
    free = (block.photo_position_sd != 0) | (block.photo_attitude_sd != 0)
    observed = block.photo_positions_observed
    observed = block.photo_positions if observed is None else observed
    weighted = np.isfinite(block.photo_position_sd) & (block.photo_position_sd > 0)
    unknown = block.replace(
        photo_positions=np.where(free, np.nan, block.photo_positions),
        photo_attitudes=np.where(free, np.nan, block.photo_attitudes),
        photo_positions_observed=None,
        photo_attitudes_observed=None,
        photo_position_sd=np.where(free, np.inf, block.photo_position_sd),
        photo_attitude_sd=np.where(free, np.inf, block.photo_attitude_sd),
    )
    tries = [unknown]
    if weighted.any():
        sd = np.where(free & ~weighted, np.inf, block.photo_position_sd)
        tries.append(unknown.replace(photo_positions_observed=observed, photo_position_sd=sd))
    for each in tries:
        try:
            found = first_values(each)
        except (AdjustmentError, InputError):
            continue
        if found.first_photo is None:
            return found
    return None


def _started(block: Block, found: FirstValues) -> Block:
    """Return the block with the poses that were found; what is observed of it stays."""
    changes: dict[str, Floats] = {}
    for name in ("position", "attitude"):
        given, sd = getattr(block, f"photo_{name}s"), getattr(block, f"photo_{name}_sd")
        values = getattr(found.block, f"photo_{name}s")
        changes[f"photo_{name}s"] = np.where((sd == 0) | np.isnan(values), given, values)
        if getattr(block, f"photo_{name}s_observed") is None and np.isfinite(sd).any():
            changes[f"photo_{name}s_observed"] = given
    return block.replace(**changes)
