"""Data snooping of a block: iterative detection and removal of gross errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import Progress, adjust, adjusted, core_threads, options_in_datum
from photogram.adjustment.exchanged_names import exchanged_names
from photogram.adjustment.first_features import started, with_poses
from photogram.adjustment.first_values import FirstValues, first_values
from photogram.adjustment.options import AdjustOptions
from photogram.adjustment.remarks import check_cameras
from photogram.arguments.fields import options_of
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import fields, replace
from photogram.messages import Message
from photogram.network.block import Block, checked
from photogram.network.core_arrays import CoreOptions, block_network
from photogram.network.datum import InnerConstraints
from photogram.network.motion import image_rows, timed_photos, with_rejected_points
from photogram.results.evaluation import hypotheses, largest_odds, type_factors
from photogram.results.fixed_tests import held_remark, held_tested
from photogram.results.network import MAX_BIAS_RATIO, AdjustedNetwork
from photogram.results.network_tables import point_axes
from photogram.results.network_trial import (
    ATTITUDE,
    CONTROL,
    IMAGE,
    OBSERVATION,
    POSITION,
    LostSupportError,
    NetworkTrial,
    Out,
    Standing,
    Tests,
    block_facts,
    network_trial,
)
from photogram.results.result import Result
from photogram.results.snooping_log import Aside, Exchange, Outcome, snooped
from photogram.results.snooping_options import SnoopOptions
from photogram.results.snooping_result import Snooped, recorded
from photogram.statistics.findings import IMAGES, Removed, Tested
from photogram.statistics.weight_rules import needed, wrong_types
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.adjustment.keywords import SnoopKeywords

MOST_PHOTOS = 0.2  # Maximum part of photos without a consistent pose; beyond it the consensus is wrong


def snoop(
    block: Any,
    options: SnoopOptions | None = None,
    *,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    **changes: Unpack[SnoopKeywords],
) -> Snooped:
    """Remove gross errors from a block or collection by iterative data snooping.

    Every image (x and y together), control point (plan, height or all), component of a weighted station and
    additional observation is tested as a group. The least probable is removed first, and others are tested
    without it. After each round the network is adjusted, and removed observations that agree with the rest
    are reinstated. docs/blunders.md contains the formulas and success rates.

    Parameters
    ----------
    block
        The block, or a :class:`photogram.collection.Collection`.
    options
        The options of data snooping; None: the defaults.
    threads
        As in :func:`photogram.adjust`.
    progress
        Called with the progress of the adjustments before and after snooping.
    **changes
        Fields of :class:`photogram.results.SnoopOptions` with other values. For a block, also `datum`,
        `unit_variance`, `max_iterations`, `tolerance` and `ordering` of :func:`photogram.adjust`; tests do
        not depend on the datum. For a collection, also options of :func:`photogram.collection.adjust`.

    Returns
    -------
    The adjusted network without the removed observations, and the log.

    Raises
    ------
    RankError, AdjustmentError, OutOfMemoryError
        As in :func:`photogram.adjust`.
    InputError
        If an option is invalid.
    KeyboardInterrupt
        If interrupted by Ctrl-C.
    """
    others: dict[str, Any] = {**changes}
    names = others.keys() & {each.name for each in fields(SnoopOptions)}
    chosen = options_of(SnoopOptions, options, {name: others.pop(name) for name in names})
    if not isinstance(block, Block) and not hasattr(block, "_snoop"):
        raise kind_error("block", "a Block or a Collection", block)
    snoop_network = partial(snoop_block, block) if isinstance(block, Block) else block._snoop
    return snoop_network(chosen, threads=threads, progress=progress, **others)


def snoop_block(
    network: Block,
    options: SnoopOptions,
    *,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    control: str = "",
    start: Aside | None = None,
    **changes: Any,
) -> Snooped:
    """Remove gross errors from a block; see :func:`snoop`.

    `control` are the parts of control that may be removed alone; by default those of the options. `start`
    excludes suspected images at first.
    """
    for name in ("loss", "covariance", "max_bias_ratio"):
        require(name not in changes, "snoop", "not-applicable", name=name, other="data snooping")
    block = checked(network)
    check_cameras(block)
    control = control or options.control
    chosen = AdjustOptions(**changes)
    core, inner = options_in_datum(chosen, block)
    datum = chosen.constraints

    def adjusted_with(given: Block, **changes: Any) -> Result:
        without = replace(chosen, datum=None) if inner else chosen
        return adjust(given, without, threads=threads, progress=progress, **changes)

    def afresh() -> Aside | None:
        found = started_by_consensus(block)
        if found is None:
            return None
        start, aside = found
        trial.restart(block_trial(start, None, core, threads).core)
        return aside

    has_held = any(
        (sd == 0).any() for sd in (block.photo_position_sd, block.photo_attitude_sd, block.point_sd)
    )

    @cache
    def held() -> list[Tested]:
        with suppress(AdjustmentError):
            return held_tested(adjusted_with(block)) if has_held else []
        return []

    def common(tests: Tests, standing: Standing) -> list[Phrase]:
        facts = block_facts(block, np.array([values[:3] for values in trial.core.photos]))
        parts = trial, tests, facts, point_axes(block), standing.sum_and_freedom, MAX_BIAS_RATIO
        found, known = hypotheses(*parts, known=options.is_known), options.is_known
        rivals = largest_odds(held())  # Errors of fixed values resemble common errors
        if errors := found.common_errors(rivals):
            return errors
        # Factors of images are estimated, and need no stop.
        types = type_factors(trial, tests, MAX_BIAS_RATIO, standing.sum_and_freedom) if known else []
        return [needed(each) for each in wrong_types(types, found.odds(rivals)) if each.group != IMAGES]

    try:
        trial = block_trial(block, None, core, threads, control=control)
        outcome = snooped(trial, options, None if start else afresh, common, start)
        if Removed([], trial.suspects.counts(outcome.out.rows, outcome.active)).excessive:
            # A robust start removes members of sets before errors in common are tested.
            other = block_trial(block, None, core, threads, control=control)
            with suppress(LostSupportError, _photocore.BlockError):
                whole = snooped(other, replace(options, robust=False, max_rounds=1), None, common)
                if any(each.code == "snooping.common" for each in whole.remarks):
                    trial, outcome = other, whole
    except (LostSupportError, _photocore.BlockError):
        # This adjustment names undetermined unknowns, or continues without some points.
        covariance = chosen.unit_variance == "redundancy"
        first = adjusted_with(block, covariance=covariance)
        if not first.converged and options.robust is not False:
            first = adjusted_with(block, covariance=covariance, loss="huber")
        trial, outcome = _snooped_from(first, options, threads, control)
    cleaned = _without(block, trial, outcome.out)
    near = replace(core, points_given=True)
    result = adjusted(started(cleaned), near, threads=threads, progress=progress)
    reached = block.replace(
        photo_positions=result.photo_positions,
        photo_attitudes=result.photo_attitudes,
        cameras=[each.camera for each in result.cameras] or result.block.cameras,
    )
    exchanged = exchanged_names(reached, used_images(trial, outcome.out, len(block.image_xy)))
    if isinstance(datum, InnerConstraints) and result.converged:
        # Points without given coordinates define the datum at their first intersection.
        poses = {"photo_positions": block.photo_positions, "photo_attitudes": block.photo_attitudes}
        again = adjusted_with(cleaned.replace(**poses), datum=datum)
        result = again if again.converged else result.in_datum(datum)
    return finished(result, trial, outcome, options, held=held, exchanged=exchanged)


def finished(
    result: AdjustedNetwork,
    trial: NetworkTrial,
    outcome: Outcome,
    options: SnoopOptions,
    *,
    held: Callable[[], list[Tested]],
    exchanged: Iterable[Exchange],
) -> Snooped:
    """Create the result of snooping, with its notes among the messages.

    `result` excludes the removed observations. `held` tests fixed values in an adjustment of all
    observations, because they may explain more than the removals.
    """
    largest = max((entry.statistic for entry in outcome.log if entry.is_out), default=math.inf)
    said = list(outcome.remarks)
    if not math.isinf(largest):
        with suppress(AdjustmentError):
            said += held_remark(held(), largest)
    found = Snooped(
        result=replace(result, messages=[*map(Message, said), *result.messages]),
        outcome=outcome,
        suspects=trial.suspects,
        options=options,
        exchanged=tuple(exchanged),
    )
    return recorded(found)


def gone(trial: NetworkTrial, out: Out, kind: int) -> tuple[Indices, Indices]:
    """Return subjects and components of the removed rows of a type."""
    kinds, subjects = trial.core.suspects.subjects
    group = np.repeat(np.arange(len(kinds)), np.diff(trial.core.suspects.row_starts))
    rows = out.rows & (kinds[group] == kind)
    return subjects[group[rows]], trial.core.suspects.components[rows]


def used_images(trial: NetworkTrial, out: Out, count: int) -> Bools:
    """Return (m,) which of `count` images are not removed."""
    used = np.ones(count, dtype=bool)
    used[gone(trial, out, IMAGE)[0]] = False
    return used


def _snooped_from(
    first: Result, options: SnoopOptions, threads: int | None, control: str
) -> tuple[NetworkTrial, Outcome]:
    """Snoop from an adjusted state; retry without a robust start if it fails."""
    for attempt in (options, replace(options, robust=False)):
        trial = block_trial(first.block, first.state, first.options, threads, control=control)
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
    control: str = "plan and height",
) -> NetworkTrial:
    network = block_network(block, replace(options, covariance=True, loss=None))
    return network_trial(block, network.trial(state, threads=core_threads(threads)), control=control)


def _without(block: Block, trial: NetworkTrial, out: Out) -> Block:
    """Return a block without the removed observations, from the state of the last trial.

    Points start at their ray intersections. Given coordinates are retained for check points, but deleted for
    removed control, because a gross error is not a valid check.
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
    # Undetermined values remain fixed here; coefficients of trajectories remain anyway.
    alone = sorted(out.photos - set(np.flatnonzero(timed_photos(block)).tolist()))
    position_sd[alone], attitude_sd[alone] = 0.0, 0.0
    rows = block.observations.core_order
    dropped = {rows[index] for index in gone(trial, out, OBSERVATION)[0].tolist()}
    observed = [
        _observed(getattr(block, f"photo_{name}"), getattr(block, f"photo_{name}_observed"), sd)
        for name, sd in (("positions", position_sd), ("attitudes", attitude_sd))
    ]
    cleaned = block.replace(
        photo_positions=np.where(position_sd == 0, block.photo_positions, reached[:, :3]),
        photo_attitudes=np.where(attitude_sd == 0, block.photo_attitudes, reached[:, 3:]),
        photo_positions_observed=observed[0],
        photo_attitudes_observed=observed[1],
        photo_position_sd=position_sd,
        photo_attitude_sd=attitude_sd,
        point_positions=point_positions,
        point_sd=point_sd,
        **image_rows(block, images),
        observations=[each for row, each in enumerate(block.observations) if row not in dropped],
    )
    return with_rejected_points(cleaned, block)


def _observed(initial: Floats, observed: Floats | None, sd: Floats) -> Floats | None:
    """Return observed values, fixed ones at the initial values; None if nothing is weighted."""
    weighted = bool((np.isfinite(sd) & (sd > 0)).any())
    if observed is None:
        return initial if weighted else None
    return np.where(sd == 0, initial, observed)


def started_by_consensus(block: Block) -> tuple[Block, Aside] | None:
    """Return a block with initial values from images only, and the inconsistent observations.

    Given poses of photos are used only if they are fixed, because errors may have distorted them. None if
    there is no consensus in the datum of the block, if everything agrees, or if photos are on frames or
    trajectories.
    """
    found = None if block.mounts or block.timed else _consensus(block)
    if found is None:
        return None
    wrong: dict[int, str | Phrase] = {
        photo: found.missing[name] for photo, name in enumerate(block.photo_ids) if name in found.contradicted
    }
    if len(wrong) > MOST_PHOTOS * len(block.photo_ids) or not (wrong or found.set_aside.any()):
        return None
    # Missing photos keep their given poses.
    of_block = (found.block.photo_positions, found.block.photo_attitudes)
    pairs = zip(of_block, (block.photo_positions, block.photo_attitudes), strict=True)
    poses = (np.where(np.isnan(values), given, values) for values, given in pairs)
    return with_poses(block, *poses), Aside(np.flatnonzero(found.set_aside), wrong)


def _consensus(block: Block) -> FirstValues | None:
    """Return initial values in the datum of control, or else of observed positions."""
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
