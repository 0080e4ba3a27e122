"""Mistakes in units, axes and angles of observations, photos and points by trial.

Such a mistake makes every observation look wrong. So the check searches for it first and reports it once.
Later steps use corrected values; the data are not changed.

The criterion is the ratio of the misfit m under a hypothesis to the misfit of the given data
(:mod:`photogram.diagnosis.predictions`). `docs/hints.md` lists hypotheses and limits.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.hypotheses import hypotheses, turns
from photogram.diagnosis.mistakes import Proposal, View
from photogram.diagnosis.predictions import (
    EACH,
    MOST,
    SUSPICION,
    UNKNOWN,
    Predicted,
    control_misfit,
    eligible,
    given_points,
    misfits,
    predict,
    regressions,
    spread,
    view,
)
from photogram.lazy_dataclasses import replace
from photogram.messages import Message
from photogram.network.block import Block, checked
from photogram.network.film_reduction import as_seen
from photogram.network.motion import at_rest
from photogram.network.observations import Distance
from photogram.network.rays import Rays
from photogram.words import phrase

BAR_FACTOR, BAR_WITHIN, BAR_EACH = 1000.0, 0.05, float(np.log(2))
"""Factor between metres and millimetres; limits of the median, and of the logarithm of each distance."""


def hints(block: Block) -> list[Message]:
    """Return mistakes in data conventions that would explain the misfit.

    The block must have positions and attitudes of photos, which may be rough; otherwise InputError is raised.
    Photos on trajectories are skipped, because a single pose is undefined.
    """
    rest = at_rest(as_seen(block)) if isinstance(block, Block) else block
    if rest is not block and not len(rest.image_xy):
        return []
    with np.errstate(all="ignore"):
        block = View.of(checked(rest)).seen
        bar = distances_in_millimetres(block)
        return [Message(each.message) for each in (*verdicts(block), bar) if each is not None]


def verdicts(block: Block) -> list[Predicted]:
    """Return verdicts on observations compared with predictions; see :func:`hints`."""
    photos = eligible(block)
    if not len(photos):
        return []
    seen, chosen = misfits(view(block, photos), photos), spread(photos, MOST)
    looked, common = view(block, chosen), bool(np.median(seen) > SUSPICION)
    if common:
        tried = hypotheses(looked, regressions(looked, chosen))
        if (found := predict(tried, looked, partial(misfits, photos=chosen))) is not None:
            return [found]
    worst = photos[np.argsort(-seen)][:MOST]
    some = _of_groups(block, photos) or _single(block, np.sort(worst[np.sort(-seen)[:MOST] < -SUSPICION]))
    return some or ([] if common else _of_control(looked, chosen))


def _of_groups(block: Block, photos: Indices) -> list[Predicted]:
    """Try turned images of all photos with the same principal distance."""
    distances, found = block.known_distances("hints"), []
    for distance in np.unique(distances) if np.ptp(distances) else ():
        own, group = spread(photos[distances[photos] == distance], MOST), distances == distance
        names = [block.photo_ids[photo] for photo in np.flatnonzero(group).tolist()]
        of = {"photos": names, "distance": float(distance)}
        found.append(predict(turns(block, group), view(block, own), partial(misfits, photos=own), **of))
    return [each for each in found if each is not None]


def _of_control(looked: Block, photos: Indices) -> list[Predicted]:
    """Find hypotheses for rays that intersect well but miss the given points."""
    _, before = control_misfit(looked)

    def misfit(meant: Block) -> Floats:
        # Most observations must improve, not only the ones of a few distant points.
        found, median = control_misfit(meant)
        fits = meant is looked or (median < EACH * before and np.median(misfits(meant, photos)) < SUSPICION)
        return np.array([found if fits else UNKNOWN])

    found = predict(hypotheses(looked), looked, misfit)
    return [] if found is None else [found]


def _single(block: Block, photos: Indices) -> list[Predicted]:
    """Try photos one by one, with the other photos unchanged; join photos with the same mistake."""
    alike: dict[tuple[str, ...], Predicted] = {}
    rows = np.arange(len(block.photo_ids))
    for photo in photos.tolist():
        own = np.array([photo])
        found = predict(turns(block, rows == photo), view(block, own), partial(misfits, photos=own))
        if found is not None:
            first = alike.get((*found.names,), found)
            names = [*first.photos, block.photo_ids[photo]]
            tried = {each.name: each for each in turns(block, np.isin(block.photo_ids, names))}
            best = [tried[name] for name in found.names]
            alike[(*found.names,)] = replace(first, best=best, photos=names)
    return [*alike.values()]


def distances_in_millimetres(block: Block) -> Proposal | None:
    """Compare observed distances with coordinates, to find millimetres."""
    bars = block.observations.of_type(Distance)
    if not bars:
        return None
    place = {name: row for row, name in enumerate(block.point_ids)}
    rays = Rays.of(block)
    positions = rays.axes.positions(block.point_positions)
    positions = np.where(given_points(block)[:, np.newaxis], positions, rays.intersect().positions)
    ratios = np.array(
        [
            each.length / np.linalg.norm(positions[place[each.first]] - positions[place[each.second]])
            for each in bars
        ]
    )
    for factor, unit in ((BAR_FACTOR, "mm"), (1 / BAR_FACTOR, "m")):
        relative = ratios / factor
        if abs(np.median(relative) - 1) < BAR_WITHIN and (np.abs(np.log(relative)) < BAR_EACH).all():
            fields = {"distances": [each.name for each in bars], "times": factor}
            message = phrase(f"convention.distances.{unit}", **fields)
            return Proposal("distances", message, partial(_shorter, factor=factor))
    return None


def _shorter(block: Block, factor: float) -> Block:
    return block.replace(
        observations=[
            replace(each, length=each.length / factor) if isinstance(each, Distance) else each
            for each in block.observations
        ]
    )
