"""Mistakes in units, axes and angles of observations, photos and points by trial.

Such a mistake makes every observation look wrong. So the check searches for it first and reports it once.
Later steps use corrected values; the data are not changed.

The criterion is the ratio of the misfit m under a hypothesis to the misfit of the given data
(:mod:`photogram.diagnosis.regression`). `docs/hints.md` lists hypotheses and limits.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.hypotheses import attitude_readings, hypotheses, turns
from photogram.diagnosis.mistakes import Adjuster, Proposal
from photogram.diagnosis.predictions import EACH, PASSES, SUSPICION, Predicted, predict
from photogram.diagnosis.regression import (
    LEAST,
    MOST,
    UNKNOWN,
    control_misfit,
    control_residuals,
    eligible,
    given_points,
    misfits,
    regressions,
    spread,
    view,
)
from photogram.diagnosis.views import View
from photogram.messages import Message
from photogram.network.attitudes import Attitudes, angles_form
from photogram.network.block import Block, checked
from photogram.network.film_reduction import as_seen
from photogram.network.motion import at_rest
from photogram.network.observations import Distance
from photogram.network.rays import Rays
from photogram.network.subset import kept_images, of_photos
from photogram.words import phrase

SLIGHT = float(np.radians(1.0))  # Attitudes closer than this to the resected ones are correct
CLEARLY = 5.0  # A rival reading must be closer to the resected attitudes by this factor
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
        found = [Message(verdict.message) for verdict in verdicts(block)]
        bar = distances_in_millimetres(block)
        bars = [] if bar is None else [Message(bar.message)]
        return [*(found or readings(block)), *latitudes(block), *bars]


def verdicts(block: Block) -> list[Predicted]:
    """Return verdicts on observations compared with predictions; see :func:`hints`."""
    photos = eligible(block)
    if not len(photos):
        return []
    seen = misfits(view(block, photos), photos)
    chosen = spread(photos, MOST)
    looked = view(block, chosen)
    if np.median(seen) > SUSPICION:
        fits = regressions(looked, chosen)
        tried, misfit = hypotheses(looked, fits), partial(misfits, photos=chosen)
        if (found := predict(tried, looked, fits.misfit, misfit)) is not None:
            return [found]
    worst = photos[np.argsort(-seen)][:MOST]
    some = _of_groups(block, photos) or _single(block, np.sort(worst[np.sort(-seen)[:MOST] < -SUSPICION]))
    return some or (_of_control(looked, chosen) if np.median(seen) <= SUSPICION else [])


def _of_groups(block: Block, photos: Indices) -> list[Predicted]:
    """Try turned images of all photos with the same principal distance."""
    distances, found = block.known_distances("hints"), []
    for distance in np.unique(distances) if np.ptp(distances) else ():
        own = spread(photos[distances[photos] == distance], MOST)
        looked = view(block, own)
        given = misfits(looked, own)
        if len(own) and np.median(given) > SUSPICION:
            names = [block.photo_ids[photo] for photo in np.flatnonzero(distances == distance).tolist()]
            of = {"photos": names, "distance": float(distance)}
            tried, misfit = turns(block, distances == distance), partial(misfits, photos=own)
            if (fitting := predict(tried, looked, given, misfit, **of)) is not None:
                found.append(fitting)
    return found


def _of_control(looked: Block, photos: Indices) -> list[Predicted]:
    """Find hypotheses for rays that intersect well but miss the given points."""
    given = control_misfit(looked)
    if not given_points(looked)[looked.image_points].any() or given <= SUSPICION:
        return []
    before = float(np.median(control_residuals(looked)))

    def misfit(meant: Block) -> Floats:
        # Most observations must improve, not only the ones of a few distant points.
        improves = float(np.median(control_residuals(meant))) < EACH * before
        fits = improves and np.median(misfits(meant, photos)) < SUSPICION
        return np.array([control_misfit(meant) if fits else UNKNOWN])

    found = predict(hypotheses(looked), looked, np.array([given]), misfit)
    return [] if found is None else [found]


def _single(block: Block, photos: Indices) -> list[Predicted]:
    """Try photos one by one, with the other photos unchanged."""
    by_names: dict[tuple[str, ...], tuple[dict[str, float], float, list[int]]] = {}
    for photo in photos.tolist():
        own = np.array([photo])
        looked = view(block, own)
        given = float(misfits(looked, own)[0])
        tried = turns(block, np.arange(len(block.photo_ids)) == photo)
        left = {each.name: float(misfits(each.change(looked), own)[0]) for each in tried}
        fitting = {name: misfit for name, misfit in left.items() if misfit < min(PASSES * given, SUSPICION)}
        if fitting:
            by_names.setdefault(tuple(sorted(fitting)), (fitting, given, []))[2].append(photo)
    found = []
    for fitting, given, alike in by_names.values():
        tried = turns(block, np.isin(np.arange(len(block.photo_ids)), alike))
        best = [(fitting[each.name], each) for each in tried if each.name in fitting]
        found.append(Predicted(best, given, [block.photo_ids[photo] for photo in alike]))
    return found


def latitudes(block: Block) -> list[Message]:
    """Report latitudes beyond the poles."""
    if block.spheroid is None:
        return []
    return [
        Message(phrase(f"convention.latitudes.{what}"))
        for what, positions in (("photos", block.photo_positions), ("points", block.point_positions))
        if (np.abs(positions[:, 1]) > np.pi / 2).any()
    ]


def readings(block: Block) -> list[Message]:
    """Compare given attitudes with adjusted ones; finds mistakes in small angles."""
    if block.spheroid is not None:
        return []
    known = given_points(block)[block.image_points]
    counts = np.bincount(block.image_photos[known], minlength=len(block.photo_ids))
    rows = spread(np.flatnonzero(counts >= LEAST), MOST)
    if len(rows) < 2:
        return []
    chosen = np.isin(np.arange(len(block.photo_ids)), rows)
    free = view(of_photos(kept_images(block, known), chosen), np.arange(len(rows)))
    point_sd = np.where(np.isfinite(free.point_positions), 0.0, np.inf)
    resected = Adjuster({}).converged(free.replace(point_sd=point_sd))
    if resected is None:
        return []
    turned = Attitudes.of(angles_form(block.photo_to_ground), resected.photo_attitudes).matrices
    own = _apart(Rays.of(block).cameras[rows], turned)
    rivals = [
        (_apart(matrices[rows], turned), cause) for cause, matrices in attitude_readings(block).values()
    ]
    (least, cause), (second, _) = sorted(rivals, key=lambda rival: rival[0])[:2]
    if own < SLIGHT or CLEARLY * least > min(own, second):
        return []
    angles = {"after": float(np.degrees(least)), "before": float(np.degrees(own))}
    return [Message(phrase("convention.attitudes", cause=cause, **angles))]


def _apart(given: Floats, found: Floats) -> float:
    """Return the rms angle between attitudes, radians."""
    trace = np.einsum("pij,pij->p", given, found)
    return float(np.sqrt((np.arccos(np.clip((trace - 1) / 2, -1, 1)) ** 2).mean()))


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
