"""Random blocks against a dense solution that shares nothing with the engine.

    python -m tests.fuzz.dense --blocks 8000 --seed 12 --page docs/reliability.md

The dense solution has collinearity equations of its own, partials by imaginary steps, and iterates by an
orthogonal decomposition of all equations with scaled columns. It starts from the engine's result: where this
is right, it stays there, and cofactors and redundancy numbers are the same.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from photogram import Block, PhotogramError, Result, adjust, simulate

from .page import machine, write_section

__all__ = ["ENDINGS", "KINDS", "Comparison", "compare", "random_block"]

Floats = NDArray[np.float64]
STEP = 1e-100
"""Imaginary, as a share of the unknown's unit: its square vanishes."""
NEAR = 1e-3
"""Of their standard deviations, unknowns may differ: the engine stops at changes of a hundredth of this."""
EXACT = 1e-6
"""Cofactors (as correlations) and redundancy numbers may differ where the condition is good."""
ROUNDING = 1e-13
"""They may differ by this times the condition squared, as the engine forms normal equations."""
TOLERANCE = 1e-9
"""Of the engine."""
HOPELESS = 1e6
"""Condition of the scaled equations beyond which normal equations have no digits that could be compared."""
TOLD = ("adjust.weak", "adjust.rounding")
"""Of the engine's remarks that its values may be off."""
REPORTED = "differ, and reported"
ENDINGS = ("agree", "too weak to compare", "not converged", "refused by name", REPORTED, "differ")


def _size(random: np.random.Generator) -> dict[str, object]:
    """Return the arguments of a small simulated block."""
    return {
        "strips": int(random.integers(1, 3)),
        "photos_per_strip": int(random.integers(3, 5)),
        "points_per_photo": float(random.uniform(6, 12)),
        "control_spacing": int(random.integers(1, 4)),
        "photo_to_ground": bool(random.random() < 0.5),
        "position_sd": float(random.choice([np.inf, 0.05, 1.0])),
        "attitude_sd": float(random.choice([np.inf, 1e-4, 1e-2])),
        "position_error": 1.0,
        "attitude_error": 1e-3,
        "check_points": 1,
        "seed": int(random.integers(2**31)),
    }


def ordinary(random: np.random.Generator) -> Block:
    """Return a block as it is flown."""
    return simulate(**_size(random)).block


def mixed_weights(random: np.random.Generator) -> Block:
    """Return a block whose photos have free, weighted and fixed components in any order."""
    block = ordinary(random)
    sds = random.choice([0.0, 0.01, 1.0, np.inf], block.photo_positions.shape)
    turns = random.choice([0.0, 1e-5, 1e-2, np.inf], block.photo_attitudes.shape)
    known = {"photo_positions_observed": None, "photo_attitudes_observed": None}
    return block.replace(photo_position_sd=sds, photo_attitude_sd=turns, **known)


def ill_conditioned(random: np.random.Generator) -> Block:
    """Return a block of narrow rays over flat ground: heights, tilts and distances are nearly the same."""
    narrow = {"principal_distance": -float(10 ** random.uniform(2.5, 4.0)), "relief": 1.0}
    narrow["flying_height"] = -30.0 * narrow["principal_distance"]
    return simulate(**{**_size(random), **narrow}).block


def extreme_units(random: np.random.Generator) -> Block:
    """Return a block in a unit of length from 1e-300 to 1e300 metres."""
    block, unit = ordinary(random), 10.0 ** random.uniform(-300, 300)
    lengths = (
        "photo_positions",
        "photo_position_sd",
        "point_positions",
        "point_sd",
        "photo_positions_observed",
    )
    given = {name: getattr(block, name) for name in lengths}
    with np.errstate(over="ignore"):
        return block.replace(**{name: unit * each for name, each in given.items() if each is not None})


def extreme_weights(random: np.random.Generator) -> Block:
    """Return a block whose standard deviations are wrong by up to ten orders of magnitude."""
    block = ordinary(random)
    names = ("photo_position_sd", "photo_attitude_sd", "point_sd", "image_sd")
    return block.replace(**{name: getattr(block, name) * 10.0 ** random.uniform(-10, 10) for name in names})


KINDS: dict[str, Callable[[np.random.Generator], Block]] = {
    "as flown": ordinary,
    "free, weighted and fixed mixed": mixed_weights,
    "ill-conditioned": ill_conditioned,
    "units of 1e-300 to 1e300 m": extreme_units,
    "standard deviations off by 1e-10 to 1e10": extreme_weights,
}


def random_block(seed: int, number: int) -> tuple[str, Block | None]:
    """Return the kind of a random block, and the block; None where its values are refused."""
    kind = list(KINDS)[number % len(KINDS)]
    try:
        return kind, KINDS[kind](np.random.default_rng([seed, number]))
    except PhotogramError:
        return kind, None


@dataclass(frozen=True)
class Comparison:
    """How the engine's result compares.

    Attributes
    ----------
    ending
        One of the endings.
    condition
        Of the scaled equations.
    moved
        Largest change of an unknown by the dense solution, in standard deviations.
    cofactors, redundancy
        Largest differences: of correlations, of redundancy numbers.
    """

    ending: str
    condition: float = np.nan
    moved: float = np.nan
    cofactors: float = np.nan
    redundancy: float = np.nan


def compare(block: Block | None) -> Comparison:
    """Adjust a block, and compare the result with the dense solution."""
    if block is None:
        return Comparison("refused by name")
    try:
        result = adjust(block, threads=1, max_iterations=300, tolerance=TOLERANCE)
    except PhotogramError:
        return Comparison("refused by name")
    if not result.converged:
        return Comparison("not converged")
    return _compared(block, result)


def _compared(block: Block, result: Result) -> Comparison:
    sd, observed = _priors(block)
    place = _Place(block, result)
    start = place.unknowns.copy()
    free = np.flatnonzero((sd > 0) & place.used)
    for _ in range(4):
        design, right = _equations(place, sd, observed, free)
        scale = np.linalg.norm(design, axis=0)
        if not (np.isfinite(scale).all() and (scale > 0).all()):
            return Comparison("too weak to compare", np.inf)
        q, r = np.linalg.qr(design / scale)
        condition = float(np.linalg.cond(r))
        if not condition < HOPELESS:
            return Comparison("too weak to compare", condition)
        step = np.linalg.solve(r, q.T @ right)
        root = np.linalg.inv(r)
        correlations = root @ root.T
        deviations = np.sqrt(np.diag(correlations))
        place.unknowns[free] += step / scale
    # Coordinates of 5 km have their last digits at 1e-12 m, angles at 1e-16: what is known better is lost.
    size = np.where(place.angles, 1.0, np.nanmax(np.abs(start[~place.angles])))
    unwritten = 4 * np.spacing(size)[free]
    change = np.maximum(np.abs(place.unknowns - start)[free] - unwritten, 0.0)
    moved = float((change * scale / deviations).max())
    found = _cofactors(block, result)[np.ix_(free, free)]
    normal = found * np.outer(scale / deviations, scale / deviations)
    blocks = place.blocks[free][:, None] == place.blocks[free]
    expected = correlations / np.outer(deviations, deviations)
    cofactors = float(np.abs(np.where(blocks, normal - expected, 0.0)).max())
    images = 2 * len(place.images)
    numbers = 1 - (q[:images] ** 2).sum(axis=1)
    redundancy = float(np.abs(result.redundancy[place.images].ravel() - numbers).max())
    fine = max(EXACT, ROUNDING * condition**2, _bent(block, result, deviations / scale))
    same = moved < max(NEAR, fine) and cofactors < fine and redundancy < fine
    told = any(message.code.startswith(remark) for message in result.messages for remark in TOLD)
    ending = "agree" if same else REPORTED if told else "differ"
    return Comparison(ending, condition, moved, cofactors, redundancy)


def _bent(block: Block, result: Result, deviations: Floats) -> float:
    """Return how far the last step may have bent the equations: cofactors are those from before it.

    Only standard deviations of the size of the block make this large.
    """
    size = np.ptp(block.photo_positions, axis=0).max() or 1.0
    return float(100 * result.iterations[-1].largest_change * deviations.max() / size)


class _Place:
    """All unknowns of a block as one vector: six of each photo, three of each point."""

    def __init__(self, block: Block, result: Result) -> None:
        self.block = block
        self.photos = len(block.photo_ids)
        photos = np.hstack([result.photo_positions, result.photo_attitudes])
        self.unknowns = np.concatenate([photos.ravel(), result.point_positions.ravel()])
        self.images = np.flatnonzero(result.used_images)
        used_photos = np.isin(np.arange(self.photos), block.image_photos[self.images])
        self.used = np.concatenate([np.repeat(used_photos, 6), np.repeat(result.used_points, 3)])
        self.angles = np.zeros(len(self.unknowns), bool)
        self.angles[: 6 * self.photos].reshape(-1, 6)[:, 3:] = True
        count = self.photos + len(block.point_ids)
        self.blocks = np.repeat(np.arange(count), [6] * self.photos + [3] * len(block.point_ids))

    def columns(self) -> NDArray[np.int64]:
        """Return (m, 9) the unknowns of each image."""
        photos, points = self.block.image_photos[self.images], self.block.image_points[self.images]
        first = 6 * photos[:, None] + np.arange(6)
        return np.hstack([first, 6 * self.photos + 3 * points[:, None] + np.arange(3)])

    def project(self, values: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return (m, 2) image coordinates of (m, 9) unknowns: x = c u1 / u3, y = c u2 / u3, u = G (P - C)."""
        sine, cosine = np.sin(values[:, 3:6]).T, np.cos(values[:, 3:6]).T
        u = (values[:, 6:] - values[:, :3]).T
        turns = list(zip(((1, 2), (2, 0), (0, 1)), sine, cosine, strict=True))
        if self.block.photo_to_ground:
            turns = [(axes, -s, c) for axes, s, c in reversed(turns)]
        for (i, k), s, c in turns:
            # M_omega turns y to z, M_phi z to x, M_kappa x to y.
            u[i], u[k] = c * u[i] + s * u[k], c * u[k] - s * u[i]
        c = self.block.principal_distances[self.block.image_photos[self.images]]
        return np.column_stack([c * u[0] / u[2], c * u[1] / u[2]])


def _equations(place: _Place, sd: Floats, observed: Floats, free: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Return the equations of images and weighted unknowns with unit weight, and observed minus computed."""
    columns = place.columns()
    values = place.unknowns[columns].astype(complex)
    measured = place.block.image_xy[place.images]
    weight = 1 / place.block.image_sd[place.images]
    design = np.zeros((len(columns), 2, len(sd)))
    rows = np.arange(len(columns))
    for k in range(9):
        # The step in a unit of the unknown: its size, or one for angles near zero.
        unit = np.maximum(np.abs(values[:, k].real), 1e-3 if 3 <= k < 6 else 1e-300)
        beside = values.copy()
        beside[:, k] += 1j * STEP * unit
        slope = place.project(beside).imag / STEP / unit[:, None]
        design[rows, :, columns[:, k]] = slope * weight
    right = ((measured - place.project(values).real) * weight).ravel()
    weighted = free[np.isfinite(sd[free])]
    own = np.zeros((len(weighted), len(sd)))
    own[np.arange(len(weighted)), weighted] = 1 / sd[weighted]
    all_rows = np.vstack([design.reshape(-1, len(sd)), own])[:, free]
    return all_rows, np.concatenate([right, (observed - place.unknowns)[weighted] / sd[weighted]])


def _priors(block: Block) -> tuple[Floats, Floats]:
    """Return standard deviations and observed values of all unknowns."""
    photos = np.hstack([block.photo_position_sd, block.photo_attitude_sd])
    positions = (
        block.photo_positions if block.photo_positions_observed is None else block.photo_positions_observed
    )
    attitudes = (
        block.photo_attitudes if block.photo_attitudes_observed is None else block.photo_attitudes_observed
    )
    observed = np.concatenate([np.hstack([positions, attitudes]).ravel(), block.point_positions.ravel()])
    return np.concatenate([photos.ravel(), block.point_sd.ravel()]), observed


def _cofactors(block: Block, result: Result) -> Floats:
    """Return the cofactors of photos and points on the diagonal of one matrix."""
    size = 6 * len(block.photo_ids) + 3 * len(block.point_ids)
    whole, at = np.zeros((size, size)), 0
    for own in (*result.photo_cofactors, *result.point_cofactors):
        whole[at : at + len(own), at : at + len(own)] = own
        at += len(own)
    return whole


def main() -> int:
    """Compare random blocks; return 1 where one differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.dense", description=__doc__)
    parser.add_argument("--blocks", type=int, default=1000, help="how many (1000)")
    parser.add_argument("--seed", type=int, default=0, help="of the run (0)")
    parser.add_argument("--page", type=Path, help="page whose section on blocks gets the figures")
    asked = parser.parse_args()
    counts: Counter[tuple[str, str]] = Counter()
    worst: dict[str, float] = {}
    for number in range(asked.blocks):
        kind, block = random_block(asked.seed, number)
        found = compare(block)
        counts[kind, found.ending] += 1
        if found.ending == "agree":
            worst[kind] = max(worst.get(kind, 0.0), found.moved)
        if found.ending == "differ":
            print(f"{asked.seed}:{number} {kind}: {found}", file=sys.stderr)
    rows = [
        "| blocks | tried | " + " | ".join(ENDINGS) + " | largest difference, sd |",
        "|---" + "|---:" * (len(ENDINGS) + 2) + "|",
    ]
    for kind in KINDS:
        tried = sum(counts[kind, ending] for ending in ENDINGS)
        cells = " | ".join(f"{counts[kind, ending]:,}" for ending in ENDINGS)
        rows.append(f"| {kind} | {tried:,} | {cells} | {worst.get(kind, 0.0):.1e} |")
    lines = [f"{asked.blocks:,} blocks of seed {asked.seed} on {machine()}.", "", *rows]
    print("\n".join(lines))
    if asked.page:
        write_section(asked.page, "blocks", lines)
    return int(any(ending == "differ" for _, ending in counts.elements()))


if __name__ == "__main__":
    sys.exit(main())
