"""Sets of control and of observed photo positions: feet, exchanged axes, exchanged points, constant errors.

Proposals for control are compared with the given coordinates and with single wrong points. The likeliest
errors of the catalogue (:mod:`photogram.results.hypotheses`) are proposals for positions, with estimates:

    heights above the ellipsoid instead of the geoid            C + A l + (0, 0, N)
    another datum                                               C + A l + s
    a wrong lever arm                                           C + A (l + d)
    positions of another time                                   C + A l + tau dC/dt
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import permutations, product

import numpy as np

from photogram.arguments.arrays import shaped
from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.conventions import EXCHANGED, FOOT, with_coordinates
from photogram.diagnosis.mistakes import Adjuster, Explained, Proposal, View, explain, omega
from photogram.diagnosis.tested_values import mad_sd, outliers, sizes_of_tests, spread_of
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.geometry import Cartesian
from photogram.network.observations import Position
from photogram.network.rays import Rays, local_axes
from photogram.network.unknowns import LeverArm, Shift
from photogram.results.network_trial import block_facts
from photogram.results.result import Result
from photogram.words import phrase

FEWEST = 3  # Control points with three components that distinguish a set from single points
FEWEST_OF_PAIRS = 3  # Control points needed to identify an exchanged pair
PAIRS = 3  # Largest number of pairs that are adjusted
MANY = 2  # Number of control points that do not fit above which the whole set is doubted

SETS: dict[str, tuple[tuple[int, ...], tuple[float, ...]]] = {
    "feet in heights": ((0, 1, 2), (1, 1, FOOT)),
    "metres in heights": ((0, 1, 2), (1, 1, 1 / FOOT)),
    "feet in X": ((0, 1, 2), (FOOT, 1, 1)),
    "feet in Y": ((0, 1, 2), (1, FOOT, 1)),
    "feet in X and Y": ((0, 1, 2), (FOOT, FOOT, 1)),
    "X and Y exchanged": (EXCHANGED, (1, 1, 1)),
}
"""Order and factors of the coordinates of all control, by mistake."""
OF_GEOGRAPHIC = ("feet in heights", "metres in heights", "X and Y exchanged")
SAME_BUT_SCALE = {"metres in heights", "feet in X and Y"}


def doubtful(first: Result | None, *kinds: str) -> bool:
    """Test whether all observations of some types may be wrong."""
    if first is None or not first.converged:
        return True
    found = outliers(first)
    beyond = sum(int(found[kind].any(axis=1).sum()) for kind in kinds if kind in found)
    size = mad_sd(first.standardized)
    fixed = "control" in kinds and bool((first.block.point_sd == 0).any())
    return beyond >= MANY or (fixed and size > MANY)


def wrong_control(block: Block, adjusted: Adjuster) -> Explained | None:
    """Return the mistake in the control as a set, or in two points, that explains the misfit, if any."""
    if not np.isfinite(block.point_sd).any() or not doubtful(adjusted.tried(block), "control"):
        return None
    kinds = SETS if block.spheroid is None else OF_GEOGRAPHIC
    changes = {kind: partial(intended, kind=kind) for kind in kinds}
    of_sets = [Proposal(kind, phrase(f"mistake.control.{kind}"), each) for kind, each in changes.items()]
    proposals = [*of_sets, *_of_pairs(block)]
    found = explain(block, proposals, adjusted, partial(_some_wrong, adjusted=adjusted))
    if found is None or found.best[0].points:
        return found if found is not None and found.is_certain else None
    if {each.name for each in found.best} == SAME_BUT_SCALE:
        # The hypotheses differ only in scale, which the stations determine.
        scales = [abs(math.log(_scale(each, block))) for each in found.results]
        found = replace(found, best=[found.best[int(np.argmin(scales))]])
    if np.isfinite(block.point_sd).all(axis=1).sum() < FEWEST:
        # A mistake in the set cannot be distinguished from one in some points.
        found = replace(found, judged=replace(found.judged, explained=False))
    return found


def intended(block: Block, kind: str) -> Block:
    order, factors = SETS[kind]
    control = np.asarray(np.isfinite(block.point_sd).any(axis=1))
    return with_coordinates(block, "points", order, factors, control)


def _of_pairs(block: Block) -> Iterator[Proposal]:
    """Yield the exchanges of two control points that reduce their misfit to the rays most.

    Rays predict the points, except for a shift that coarse stations cause.
    """
    rays = Rays.of(View.of(block).seen)
    met = rays.intersect().positions
    plan = np.isfinite(block.point_sd[:, :2]).all(axis=1) & np.isfinite(met).all(axis=1)
    points = np.flatnonzero(plan)
    if len(points) < FEWEST_OF_PAIRS:
        return
    heights = rays.axes.from_local(met[points])[:, 2]
    given = block.point_positions[points].copy()
    given[:, 2] = np.where(np.isfinite(block.point_sd[points, 2]), given[:, 2], heights)
    # Squared misfit of each intersection (row) with the coordinates of each point (column).
    left = met[points, np.newaxis, :2] - rays.axes.positions(given)[np.newaxis, :, :2]
    squares = ((left - np.median(np.diagonal(left).T, axis=0)) ** 2).sum(axis=2)
    own = np.diag(squares)
    ones, others = np.triu_indices(len(points), 1)
    gains = own[ones] + own[others] - squares[ones, others] - squares[others, ones]
    for k in np.argsort(-gains, kind="stable")[:PAIRS].tolist():
        if gains[k] > 0:
            pair = int(points[ones[k]]), int(points[others[k]])
            names = [block.point_ids[point] for point in pair]
            message = phrase("check.exchanged-control", points=names)
            yield Proposal("exchanged", message, partial(exchange, pair=pair), points=names)


def exchange(block: Block, pair: tuple[int, int]) -> Block:
    """Return a block with exchanged coordinates and standard deviations of two points."""
    order = np.arange(len(block.point_ids))
    order[[*pair]] = pair[::-1]
    return block.replace(point_positions=block.point_positions[order], point_sd=block.point_sd[order])


def _some_wrong(block: Block, adjusted: Adjuster) -> float:
    """Return the cost of explaining the misfit by wrong points; infinite with more than a third of them.

    The point with the largest test value is excluded until all others fit. The cost is Omega of the other
    observations plus two terms. Each wrong point adds 2 ln(3 k), because it is one of k. Each of its errors
    adds 2 ln(error / standard deviation), from its prediction.
    """
    points: Indices = np.empty(0, dtype=np.int64)
    count = int(np.isfinite(block.point_sd).any(axis=1).sum())
    for _ in range(1 + max(count // 3, 1)):
        point_sd = block.point_sd.copy()
        point_sd[points] = np.inf
        result = adjusted.converged(block.replace(point_sd=point_sd) if len(points) else block)
        if result is None:
            return math.inf
        if not outliers(result)["control"].any():
            errors = np.abs(block.point_positions[points] - result.point_positions[points])
            cofactors = np.diagonal(result.point_cofactors[points], axis1=1, axis2=2)
            deviations = spread_of(result) * np.sqrt(block.point_sd[points] ** 2 + cofactors)
            sizes = np.where(np.isfinite(block.point_sd[points]), errors / deviations, 1.0)
            cost = len(points) * math.log(3 * count) + float(np.log(np.maximum(sizes, 1.0)).sum())
            return omega(result) + 2 * cost
        points = np.append(points, np.argmax(sizes_of_tests(result)["control"].max(axis=1)))
    return math.inf


def _scale(result: Result | None, block: Block) -> float:
    """Return the scale of adjusted stations: 1 for correct ones."""
    if result is None:
        return math.inf
    axes = local_axes(block)
    places: list[Floats] = [axes.positions(each) for each in (result.photo_positions, block.photo_positions)]
    sizes = [float(np.linalg.norm(each - each.mean(axis=0))) for each in places]
    return sizes[0] / sizes[1]


FEWEST_POSITIONS = 5  # Smallest number of observed positions
EQUAL = 0.15  # Relative difference within which a lever arm is the given one with other signs or axes
COORDINATES = {"feet in heights": ([0, 1, 2], 2), "feet": ([0, 1, 2], 0), "X and Y exchanged": ([1, 0, 2], 3)}
"""Order of the axes, and first axis in feet."""
NEARLY = 0.5  # Log odds of a proposal, as a part of the largest


def wrong_positions(block: Block, adjusted: Adjuster) -> Explained | None:
    """Return the mistake that explains the misfit of the observed positions, if any.

    Positions with free shifts or drifts are skipped.
    """
    given = _positions(block)
    if len(given) < FEWEST_POSITIONS or not doubtful(
        adjusted.tried(block), "control", "station", Position.KIND
    ):
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
