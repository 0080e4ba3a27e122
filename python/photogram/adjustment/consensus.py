"""A block started anew from what most of its observations agree on, for snooping."""

from __future__ import annotations

import numpy as np

from photogram.adjustment.first_values import FirstValues, first_values
from photogram.arguments.types import Floats
from photogram.errors import AdjustmentError, InputError
from photogram.network.block import Block
from photogram.statistics.snooping.suspects import Aside

__all__ = ["started_by_consensus"]

MOST_PHOTOS = 0.2
"""Of the photos, that may agree with no pose: with more it is the consensus that is wrong."""


def started_by_consensus(block: Block) -> tuple[Block, Aside] | None:
    """Return a block with first values of its images alone, and what does not fit them.

    The given poses of photos that are not held are not used: they may be of a block that errors have bent.
    None where there is no consensus in the datum of the block, or nothing against it, and where photos are on
    frames or trajectories: each is no picture with a pose of its own.
    """
    found = None if block.mounts or block.timed else _consensus(block)
    if found is None:
        return None
    wrong = {
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
