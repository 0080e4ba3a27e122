"""Observed photo positions as a set: each systematic mistake has a typical form.

    feet for metres, exchanged axes                             the intended coordinates
    heights above the ellipsoid instead of the geoid            C + A l + (0, 0, N)
    another datum                                               C + A l + s
    a wrong lever arm                                           C + A (l + d)
    positions of another time                                   C + A l + tau dC/dt

For each hypothesis, the block is adjusted with the intended coordinates, or with N, s, l or tau free. The
likelihood ratio decides; an additional parameter must gain ln f more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations, product

import numpy as np

from photogram.arguments.types import Floats
from photogram.diagnosis.adjusting import Adjuster
from photogram.diagnosis.findings import Explained, likely
from photogram.diagnosis.hypotheses import FOOT
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.observations import Position
from photogram.network.rays import local_axes
from photogram.network.strips import strips_of
from photogram.network.unknowns import LeverArm, Shift, Unknown
from photogram.results.result import Result
from photogram.statistics.likelihood import RIVAL, TESTED, judged, likelihood
from photogram.words import Phrase, phrase

FEWEST = 5  # Smallest number of observed positions
EQUAL = 0.15  # Relative difference within which a lever arm is the given one with other signs or axes
WORST = 1e6  # Assumed ratio to the worst hypothesis of a block that cannot be adjusted


@dataclass(frozen=True)
class _Trial:
    """A hypothesis: message, adjustment, parameters, and the correct positions."""

    kind: str
    message: Phrase
    result: Result | None
    parameters: int
    meant: list[Position]

    @property
    def left(self) -> float:
        """Omega; infinite if the adjustment failed."""
        return math.inf if self.result is None else self.result.sums_of_squares.total


def wrong_positions(block: Block, adjusted: Adjuster) -> Explained | None:
    """Return the mistake that explains the misfit of the observed positions, if any.

    Positions with free shifts or drifts are skipped.
    """
    given = _positions(block)
    if len(given) < FEWEST:
        return None
    first = adjusted.converged(_with(block, given))
    found = [*_coordinates(block, given, adjusted), *_unknown(block, given, adjusted)]
    found += _later(block, given, adjusted)
    found = [each for each in found if math.isfinite(each.left)]
    by_kind = {each.kind: each for each in found}
    freedom = next((each.result.degrees_of_freedom for each in found if each.result is not None), 0)
    if freedom < TESTED:
        return None
    part = by_kind.get("geoid")
    for whole in (by_kind.get("shift"), by_kind.get("lever arm")):
        # These include a height offset: they must be better by far.
        if whole and part and likelihood(part.left, whole.left, freedom) < RIVAL + 2 * math.log(freedom):
            found.remove(whole)
    left = [each.left for each in found]
    before = WORST * max(left) if first is None else first.sums_of_squares.total
    verdict = judged(before, left, freedom, parameters=[each.parameters for each in found], known_weight=True)
    if verdict is None:
        return None
    best = [found[row] for row in verdict.best]
    message = likely([each.message for each in best], phrase("mistake.residuals", times=verdict.fall))
    meant = best[0].meant
    return Explained(best[0].kind, message, verdict, lambda block: _with(block, meant))


def _positions(block: Block) -> list[Position]:
    """Return observed positions, including weighted positions of photos."""
    found = block.observations.of_type(Position)
    if any(each.shift is not None or each.drift is not None for each in found):
        return []
    sd = block.photo_position_sd
    observed = (
        block.photo_positions if block.photo_positions_observed is None else block.photo_positions_observed
    )
    for row in np.flatnonzero((np.isfinite(sd) & (sd > 0)).all(axis=1)).tolist():
        metres = sd[row].copy()
        if block.spheroid is not None:
            metres *= [block.spheroid.a * math.cos(observed[row, 1]), block.spheroid.a, 1.0]
        found.append(Position(block.photo_ids[row], observed[row], sd=metres))
    return found


def _with(block: Block, positions: Sequence[Position]) -> Block:
    sd = block.photo_position_sd
    weighted = (np.isfinite(sd) & (sd > 0)).all(axis=1, keepdims=True)
    others = [each for each in block.observations if not isinstance(each, Position)]
    return block.replace(
        photo_position_sd=np.where(weighted, np.inf, sd),
        photo_positions_observed=None,
        observations=[*others, *positions],
    )


def _changed(
    position: Position, observed: Floats | None = None, arm: object = None, shift: Shift | None = None
) -> Position:
    return Position(
        position.photo,
        position.position if observed is None else observed,
        covariance=position.precision,
        lever_arm=position.lever_arm if arm is None else arm,  # type: ignore[arg-type]
        shift=shift,
        time=position.time,
    )


def _coordinates(block: Block, given: list[Position], adjusted: Adjuster) -> list[_Trial]:
    hypotheses = [("feet in heights", [0, 1, 2], 2)]
    if block.spheroid is None:
        hypotheses += [("feet", [0, 1, 2], 0), ("X and Y exchanged", [1, 0, 2], 3)]
    trials = []
    for kind, order, first in hypotheses:
        factors = np.where(np.arange(3) >= first, FOOT, 1.0)
        meant = [_changed(each, np.asarray(each.position)[order] * factors) for each in given]
        result = adjusted.converged(_with(block, meant))
        trials.append(_Trial(kind, phrase(f"mistake.positions.{kind}"), result, 0, meant))
    return trials


def _unknown(block: Block, given: list[Position], adjusted: Adjuster) -> list[_Trial]:
    """Try a common free height offset, shift or lever arm."""
    unit = block.linear_unit
    arms = np.array([_arm(each) for each in given])
    trials = []
    unknowns: tuple[tuple[str, Unknown], ...] = (
        ("geoid", Shift("of the heights", sd=[0.0, 0.0, np.inf])),
        ("shift", Shift("of all", sd=np.inf)),
        ("lever arm", LeverArm("of all", np.median(arms, axis=0), sd=np.inf)),
    )
    for kind, unknown in unknowns:
        if isinstance(unknown, Shift):
            changed = [_changed(each, shift=unknown) for each in given]
        else:
            changed = [_changed(each, arm=unknown) for each in given]
        result = adjusted.converged(_with(block, changed))
        if result is None:
            continue
        (found,) = [each for each in result.unknowns if each.given is unknown]
        value = np.asarray(found.position)
        sd = np.sqrt(np.maximum(np.diagonal(found.cofactors), 0))
        parts = [f"{v:.3f} +- {s:.3f}" for v, s in zip(value, sd, strict=True)]
        code = kind if kind != "lever arm" else _code_of_arm(np.median(arms, axis=0), value)
        message = phrase(f"mistake.positions.{code}", vector=parts, height=float(value[2]), unit=unit)
        if isinstance(unknown, Shift):
            fixed = Shift(unknown.name, value, sd=0.0)
            meant = [_changed(each, shift=fixed) for each in given]
        else:
            meant = [_changed(each, arm=value) for each in given]
        trials.append(_Trial(kind, message, result, 1 if kind == "geoid" else 3, meant))
    return trials


def _arm(position: Position) -> Floats:
    arm = position.lever_arm
    return np.asarray(position.observed[3:6]) if not isinstance(arm, LeverArm) else arm.position


def _code_of_arm(given: Floats, meant: Floats) -> str:
    size = float(np.linalg.norm(given))
    if not size:
        return "arm.none"
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        if np.linalg.norm(given[list(order)] * signs - meant) < EQUAL * size:
            return "arm.sign" if order == (0, 1, 2) else "arm.axes"
    return "arm.wrong"


def _later(block: Block, given: list[Position], adjusted: Adjuster) -> list[_Trial]:
    """Try positions of another time by the parabola Omega of three adjustments."""
    axes = local_axes(block)
    number = {name: row for row, name in enumerate(block.photo_ids)}
    centres = axes.positions(block.photo_positions)[[number[each.photos[0]] for each in given]]
    # Initial positions are coarse; differences of observed positions are not, despite common errors.
    flown = axes.positions(np.array([each.observed[:3] for each in given]))
    times = np.array([each.time for each in given])
    velocities = np.full(centres.shape, np.nan)
    timed = bool(np.ptp(times) > 0)
    for strip in strips_of(centres):
        steps = times[strip] if timed else np.arange(len(strip), dtype=np.float64)
        if len(strip) > 1 and (np.diff(steps) > 0).all():
            velocities[strip] = np.gradient(flown[strip], steps, axis=0)
    if not np.isfinite(velocities).all():
        return []

    def earlier(tau: float) -> list[Position]:
        places = flown - tau * velocities
        return [_changed(each, place) for each, place in zip(given, axes.from_local(places), strict=True)]

    def omega(tau: float) -> float:
        result = adjusted.converged(_with(block, earlier(tau)))
        return math.inf if result is None else result.sums_of_squares.total

    step = float(np.median([np.sqrt(np.diagonal(each.precision)).max() for each in given]))
    step *= 3 / float(np.median(np.linalg.norm(velocities, axis=1)))
    before, here, after = omega(-step), omega(0.0), omega(step)
    bend = before - 2 * here + after
    if not (math.isfinite(bend) and bend > 0):
        return []
    tau = step * (before - after) / (2 * bend)
    message = phrase(f"mistake.positions.{'seconds' if timed else 'steps'}", offset=tau)
    meant = earlier(tau)
    return [_Trial("time offset", message, adjusted.converged(_with(block, meant)), 1, meant)]
