"""Rolling shutters: wrong readout parameters, and shutters that were not declared.

Wrong direction, unit, or rows instead of columns are tried. Photos of a shutter that was not declared leave
residuals proportional to row times velocity. Row r of h is exposed r/h T after the first, after the photo has
moved. Let a be the partials of an observation by the position of its photo, and d the displacement between
two exposures. The observation moves by

    (a d) (r/h) tau,      tau = T / time between two exposures

Position, attitude and points absorb a part of this. The score of tau (Rao) gives its value, and the decrease
of the sum of squares. Its standard deviation is derived from the differences between photos, because each
rotates differently during the readout.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.diagnosis.mistakes import Adjuster, Proposal, explain
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.motion import timed_photos
from photogram.network.moving_photos import Direction, Shutter
from photogram.network.rays import local_axes
from photogram.network.strips import strips_of
from photogram.network.trajectories import Readout
from photogram.results.fixed_tests import Scores, as_adjusted, is_suspected, lens_partials, station_partials
from photogram.results.result import Result
from photogram.statistics.limits import externally_studentized
from photogram.words import Phrase, phrase

SIGNIFICANT = 5.0  # Standard deviations: of a negative readout time, and of the effect of a shutter
LONGEST = 1.0  # Seconds: longest readout; a larger number is in milliseconds
MILLISECOND = 1e-3
OTHER: dict[Direction, Direction] = {"down": "up", "up": "down", "right": "left", "left": "right"}


def readout_hints(block: Block, adjusted: Adjuster) -> list[Message]:
    """Try other rolling shutter readouts if the adjustment failed or fits badly."""
    if not any(each.shutter is not None for each in block.timed):
        return []
    first = adjusted.converged(block)
    if first is not None and (first.loss or not is_suspected(first)):
        return []
    found = explain(block, _proposals(block), adjusted)
    return [Message(found.message())] if found is not None and found.is_certain else []


def backward_readouts(result: Result) -> list[Message]:
    """Report negative readout times, which fit but mean the opposite direction."""
    own = {id(each.shutter.readout) for each in result.block.timed if each.shutter is not None}
    return [
        Message(
            phrase(
                "moving.backward-readout",
                readout=each.given.title,
                value=float(each.position[0]),
                sd=float(each.sd[0]),
            )
        )
        for each in result.unknowns
        if id(each.given) in own and each.position[0] < -SIGNIFICANT * each.sd[0]
    ]


def _proposals(block: Block) -> Iterator[Proposal]:
    ends = {True: _ends(block, 0), False: _ends(block, 1)}

    def opposite(own: Shutter) -> Shutter:
        return replace(own, edges=own.edges[::-1], direction=OTHER[own.direction])

    def across(own: Shutter) -> Shutter:
        rows = own.direction in ("down", "up")
        return replace(own, edges=ends[rows], direction="right" if rows else "down")

    shutters = [own.shutter for own in block.timed if own.shutter is not None]
    readouts = {id(own.readout): own.readout for own in shutters if isinstance(own.readout, Readout)}
    code = "columns" if any(own.direction in ("down", "up") for own in shutters) else "rows"
    changes: dict[str, Callable[[Shutter], Shutter]] = {"opposite": opposite, f"{code}.first": across}
    if not all(np.isinf(own.sd).all() for own in readouts.values()):
        # A free readout time adopts the sign that fits.
        changes[f"{code}.last"] = lambda own: opposite(across(own))
    if any(abs(float(own.position[0])) > LONGEST for own in readouts.values()):
        thousandth = {
            key: replace(own, value=MILLISECOND * own.value, sd=MILLISECOND * np.asarray(own.sd))
            for key, own in readouts.items()
        }
        changes["milliseconds"] = lambda own: replace(own, readout=thousandth[id(own.readout)])
    for name, change in changes.items():
        yield Proposal(name, phrase(f"mistake.shutter.{name}"), partial(_changed, change=change))


def _changed(block: Block, change: Callable[[Shutter], Shutter]) -> Block:
    return block.replace(
        timed=[
            each if each.shutter is None else replace(each, shutter=change(each.shutter))
            for each in block.timed
        ]
    )


def _ends(block: Block, axis: int) -> tuple[float, float]:
    """Return the left and right, or upper and lower, limit of the observations."""
    low, high = float(block.image_xy[:, axis].min()), float(block.image_xy[:, axis].max())
    down = any(each.image_y == "down" for each in block.cameras)
    return (low, high) if axis == 0 or down else (high, low)


EXPLAINED = 0.8
"""Least part of the joint effect of readout, lens and affinity that the readout explains alone."""
FEWEST = 4  # Moving photos of a camera
MOST = 3  # Maximum number of examined cameras, starting with the most photos
READ = {(1, True): "down", (1, False): "up", (0, True): "right", (0, False): "left"}
"""Direction of the readout, by the axis of the coordinate and the sign of the readout time."""


def rolling_hints(result: Result) -> list[Message]:
    """Report cameras with rolling shutter residuals if the global test rejects.

    Photos must be in the order of their exposures: along strips the distance between two photos is the
    velocity. Photos on trajectories are skipped.
    """
    block = result.block
    if result.loss or not result.WHOLE or block.mounts or not is_suspected(result):
        return []
    ways = _ways(result)
    moved = (ways != 0).any(axis=1)
    cameras = np.zeros(len(moved), dtype=np.int64) if block.photo_cameras is None else block.photo_cameras
    counts = np.bincount(cameras[moved], minlength=1)
    chosen = [each for each in np.argsort(-counts, kind="stable")[:MOST].tolist() if counts[each] >= FEWEST]
    if not chosen:
        return []
    # Partials of residuals, observed minus computed.
    partials = -np.einsum("kmi,mk->mi", station_partials(result)[:3], ways[block.image_photos])
    found = (_of_camera(result, each, partials, moved & (cameras == each)) for each in chosen)
    return [Message(message) for message in found if message is not None]


def _ways(result: Result) -> Floats:
    """(P, 3) displacements until the next exposure, in metric axes; 0 if unknown."""
    adjusted = as_adjusted(result)
    places = local_axes(adjusted).positions(adjusted.photo_positions)
    rest = np.flatnonzero(~timed_photos(adjusted))
    ways = np.zeros_like(places)
    for strip in strips_of(places[rest]) if len(rest) > 1 else ():
        if len(strip) > 1:
            ways[rest[strip]] = np.gradient(places[rest[strip]], axis=0)
    return ways


def _of_camera(result: Result, camera: int, motion: Floats, photos: Bools) -> Phrase | None:
    """Return the readout that explains the residuals of a camera.

    `motion` are (m, 2) displacements of observations from one exposure to the next.
    """
    block = result.block
    own = result.used_images & photos[block.image_photos] & np.isfinite(motion).all(axis=1)
    if not own.any():
        return None
    residuals = np.where(result.used_images[:, np.newaxis], result.residuals / block.image_sd, 0.0)
    factor = result._factor()
    down = bool(block.cameras) and block.cameras[camera].image_y == "down"
    columns = {axis: _column(block, motion, own, axis, down) for axis in (1, 0)}
    tried = {axis: Scores.of(factor, each[np.newaxis], residuals) for axis, each in columns.items()}
    axis = max(tried, key=lambda each: tried[each].fall())
    readout, sd = tried[axis].estimate(block.image_photos)
    significant = _significance(result, tried[axis].fall()) > SIGNIFICANT
    if not (significant and abs(readout) > SIGNIFICANT * sd):
        return None
    rivals = np.concatenate([lens_partials(result, own), _affinities(block, own)])
    together = Scores.of(factor, np.concatenate([columns[axis][np.newaxis], rivals]), residuals)
    alone, beside = tried[axis].fall(), together.fall() - together.fall(1)
    if not (alone > EXPLAINED * together.fall() and _significance(result, beside) > SIGNIFICANT):
        return None
    omega = result.sums_of_squares.total
    return phrase(
        f"check.rolling-shutter.{READ[axis, readout > 0]}",
        camera=block.camera_names[camera] if block.cameras else "1",
        percent=100 * abs(readout),
        sd=100 * sd,
        times=math.sqrt(omega / (omega - alone)),
    )


def _column(block: Block, motion: Floats, own: Bools, axis: int, down: bool) -> Floats:
    """(m, 2) partials by tau of a readout along an axis of the observations, in sd."""
    along = block.image_xy[own, axis] * (-1.0 if axis == 1 and not down else 1.0)
    shares = (along - along.min()) / max(float(np.ptp(along)), 1e-300)
    column = np.zeros_like(block.image_xy)
    column[own] = motion[own] * shares[:, np.newaxis] / block.image_sd[own]
    return column


def _affinities(block: Block, own: Bools) -> Floats:
    """(2, m, 2) partials by stretch and shear of the image, in standard deviations."""
    x, y = (block.image_xy[own] - block.image_xy[own].mean(axis=0)).T
    columns = np.zeros((2, *block.image_xy.shape))
    columns[:, own] = np.array([[x, -y], [y, x]]).transpose(0, 2, 1) / block.image_sd[own]
    return columns


def _significance(result: Result, fall: float) -> float:
    """Return the significance of a decrease of Omega, in sd of the remaining unit weight."""
    omega, freedom = result.sum_and_freedom
    return float(externally_studentized(math.sqrt(max(fall, 0.0)), omega, freedom))
