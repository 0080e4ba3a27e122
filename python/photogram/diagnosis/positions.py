"""Observed photo positions as a set: feet, exchanged axes, and errors that the catalogue of hypotheses names.

    heights above the ellipsoid instead of the geoid            C + A l + (0, 0, N)
    another datum                                               C + A l + s
    a wrong lever arm                                           C + A (l + d)
    positions of another time                                   C + A l + tau dC/dt

The likeliest errors of the catalogue (:mod:`photogram.results.hypotheses`) are proposals, with their
estimates.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import permutations, product

import numpy as np

from photogram.arguments.arrays import shaped
from photogram.arguments.types import Floats
from photogram.diagnosis.control_sets import doubtful
from photogram.diagnosis.hypotheses import FOOT
from photogram.diagnosis.mistakes import Adjuster, Explained, Proposal, explain
from photogram.network.block import Block
from photogram.network.geometry import Cartesian
from photogram.network.observations import Position
from photogram.network.unknowns import LeverArm, Shift
from photogram.results.network_trial import block_facts
from photogram.words import phrase

FEWEST = 5  # Smallest number of observed positions
EQUAL = 0.15  # Relative difference within which a lever arm is the given one with other signs or axes
COORDINATES = {"feet in heights": ([0, 1, 2], 2), "feet": ([0, 1, 2], 0), "X and Y exchanged": ([1, 0, 2], 3)}
"""Order of the axes, and first axis in feet."""
NEARLY = 0.5  # Log odds of a proposal, as a part of the largest


def wrong_positions(block: Block, adjusted: Adjuster) -> Explained | None:
    """Return the mistake that explains the misfit of the observed positions, if any.

    Positions with free shifts or drifts are skipped.
    """
    given = _positions(block)
    if len(given) < FEWEST or not doubtful(adjusted.tried(block), "control", "station", Position.KIND):
        return None
    block = _with(block, given)
    return explain(block, [*_coordinates(block, given), *_of_catalogue(block, given, adjusted)], adjusted)


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


def _coordinates(block: Block, given: list[Position]) -> Iterator[Proposal]:
    for kind, (order, first) in COORDINATES.items():
        if block.spheroid is None or kind == "feet in heights":
            factors = np.where(np.arange(3) >= first, FOOT, 1.0)
            meant = [replace(each, position=np.asarray(each.position)[order] * factors) for each in given]
            yield Proposal(kind, phrase(f"mistake.positions.{kind}"), partial(_with, positions=meant))


def _of_catalogue(block: Block, given: list[Position], adjusted: Adjuster) -> Iterator[Proposal]:
    """Yield the likeliest errors of the catalogue, with their estimates."""
    first = adjusted.converged(block)
    errors = None if first is None else first.reliability_summary
    if first is None or errors is None:
        return
    found, unit = errors.hypotheses, block.linear_unit
    # First-order odds of large errors are approximate; adjustments decide.
    least = NEARLY * max((found.log_odds[row] for row in found.common()), default=math.inf)
    for row in np.flatnonzero(found.log_odds[: len(found.sets)] >= least).tolist():
        error, code = found.sets[row], str(found.code[row])
        value, k = np.array(error["estimate"]), len(error["estimate"])
        sd = np.sqrt(np.diag(np.reshape(error["cofactors"], (k, k)))) if k else value
        fields = {"vector": [f"{v:.3f} +- {s:.3f}" for v, s in zip(value, sd, strict=True)], "unit": unit}
        if code in ("gnss-heights", "gnss-shift"):
            shift = Shift("of all", value if k == 3 else [0.0, 0.0, value[-1]], sd=0.0)
            meant = [replace(each, shift=shift) for each in given]
            name = "geoid" if code == "gnss-heights" else "shift"
            message = phrase(f"mistake.positions.{name}", height=float(value[-1]), **fields)
        elif code == "lever-arm":
            arm = np.median([arm_of(each) for each in given], axis=0)
            meant = [replace(each, lever_arm=arm + value) for each in given]
            fields["vector"] = [f"{v:.3f} +- {s:.3f}" for v, s in zip(arm + value, sd, strict=True)]
            message = phrase(f"mistake.positions.{_code_of_arm(arm, arm + value)}", **fields)
        elif code == "time-offset":
            facts, axes = block_facts(block, first.photo_positions), Cartesian(block.spheroid)
            flown = dict(zip(block.photo_ids, facts["velocities"] * value, strict=True))
            places = axes.positions(np.array([each.position for each in given]))
            places = axes.from_cartesian(places - [flown[each.photos[0]] for each in given])
            meant = [replace(each, position=place) for each, place in zip(given, places, strict=True)]
            name = "seconds" if facts["timed"] else "steps"
            message = phrase(f"mistake.positions.{name}", offset=float(value[0]))
        else:
            continue
        yield Proposal(code, message, partial(_with, positions=meant), parameters=k)


def arm_of(position: Position) -> Floats:
    """Return the given lever arm of an observed position."""
    arm = position.lever_arm
    return arm.position if isinstance(arm, LeverArm) else shaped("lever arm", arm, (3,))


def _code_of_arm(given: Floats, meant: Floats) -> str:
    size = float(np.linalg.norm(given))
    if not size:
        return "arm.none"
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        if np.linalg.norm(given[list(order)] * signs - meant) < EQUAL * size:
            return "arm.sign" if order == (0, 1, 2) else "arm.axes"
    return "arm.wrong"
