"""Random networks of every camera, kind and datum against a dense step that shares nothing with the engine.

    python -m tests.fuzz.dense_network --networks 42 --seed 5 --page docs/reliability.md

Every equation is written out once more; partials are imaginary steps, the equations are decomposed by
orthogonal matrices with scaled columns. What the observations leave open is the null space of all equations,
by singular values; inner constraints are solved in the complement of B, and what is held has no columns. The
dense step starts from the engine's result: where this is right, it leads nowhere.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from photogram import InnerConstraints, PhotogramError, Result, adjust, network

from .equations import STEP, Dense, logarithm
from .networks import DATUMS, KINDS, MODELS, RandomNetwork, random_network
from .page import machine, write_section

__all__ = ["ENDINGS", "Comparison", "compare"]

Floats = NDArray[np.float64]
TOLERANCE = 1e-8
"""Of the engine; coordinates on an ellipsoid are written to a few millionths of their standard deviations."""
COARSE = 1e-4
NEAR, EXACT, ROUNDING = 1e-7, 1e-8, 1e-13
"""Unknowns in standard deviations; variances (relative) and redundancy numbers; the same by the condition
squared, as the engine forms normal equations."""
ON_ELLIPSOID = 3e-6
"""Positions of 6400 km have their last digits at 1e-9 m, and so have partials by what is 15 m apart."""
CURVED = 1e-2
"""By how much of a standard deviation of the last step cofactors, which are those before it, may differ."""
NULL = 1e-9
"""Singular values of scaled equations that are none."""
HOPELESS = 1e6
ENDINGS = ("agree", "too weak to compare", "not converged", "refused by name", "differ")


@dataclass(frozen=True)
class Comparison:
    """How the engine's result compares: its ending, the condition, and the largest differences.

    `moved` in standard deviations, `variances` relative, `correlations` and `redundancy` absolute.
    """

    ending: str
    condition: float = np.nan
    moved: float = np.nan
    variances: float = np.nan
    correlations: float = np.nan
    redundancy: float = np.nan
    said: str = ""
    sums: dict[str, tuple[float, float]] = field(default_factory=dict, repr=False)
    """Of each kind of observation: v' P v, and its redundancy numbers, whose sum is what to expect of it."""


def compare(random: RandomNetwork) -> Comparison:
    """Adjust a network, and compare the result with the dense solution."""
    geographic = random.block.spheroid is not None
    try:
        result = adjust(
            random.block,
            datum=random.datum,
            threads=1,
            max_iterations=100,
            tolerance=COARSE if geographic else TOLERANCE,
        )
        covariances = result.covariances()
    except PhotogramError as error:
        return Comparison("refused by name", said=str(error))
    if not result.converged:
        return Comparison("not converged")
    dense = Dense(random.block, result)
    free = dense.free(result)
    design, right = equations(dense)
    solved = _solved(dense, design[:, free], right, random, free)
    if isinstance(solved, Comparison):
        return solved
    step, root, condition = solved
    change = np.zeros(dense.count)
    change[free] = np.maximum(np.abs(step) - _unwritten(dense)[free], 0)
    q = np.zeros((dense.count, dense.count))
    q[np.ix_(free, free)] = root @ root.T
    found = covariances.covariance(dense.selection()) / result.covariance_scale
    sd = np.sqrt(np.diag(q))
    known = sd > 0
    if np.abs(found[~known]).max(initial=0.0) > 0:
        return Comparison("differ", condition, said="what is known has cofactors")
    moved = float((change[known] / sd[known]).max())
    apart = np.abs(found - q)[np.ix_(known, known)] / np.outer(sd[known], sd[known])
    redundancy = _redundancy(result, dense, design[:, free] @ root)
    last = CURVED * result.iterations[-1].largest_change
    fine = max(EXACT, ROUNDING * condition**2, max(ON_ELLIPSOID, last) if geographic else 0.0)
    variances, correlations = float(np.diag(apart).max()), float(apart.max())
    near = max(NEAR, fine, COARSE if geographic else 0.0)
    same = moved < near and max(correlations, redundancy) < fine
    ending = "agree" if same else "differ"
    return Comparison(ending, condition, moved, variances, correlations, redundancy, sums=_sums(result))


def _sums(result: Result) -> dict[str, tuple[float, float]]:
    squares = (result.residuals / result.block.image_sd) ** 2
    found = {"image": (float(squares.sum()), float(result.redundancy.sum()))}
    for name, kind in result.kinds.items():
        found[name] = kind.sum_of_squares, float(np.nansum(kind.redundancy))
    return found


def equations(dense: Dense) -> tuple[Floats, Floats]:
    """Return the whitened partials of what is computed, and observed minus computed."""
    weight = 1 / dense.block.image_sd.ravel()
    roots = [np.linalg.inv(np.linalg.cholesky(part.covariance)) for part in dense.parts]

    def rows(d: NDArray[np.complex128]) -> NDArray[np.complex128]:
        own = [root @ part.misclosure(d) for part, root in zip(dense.parts, roots, strict=True)]
        return np.concatenate([weight * dense.images(d).ravel(), *own])

    right = rows(np.zeros(dense.count, complex)).real
    design = np.empty((len(right), dense.count))
    for k in range(dense.count):
        d = np.zeros(dense.count, complex)
        d[k] = 1j * STEP
        design[:, k] = -rows(d).imag / STEP
    return design, right


def _solved(
    dense: Dense, design: Floats, right: Floats, random: RandomNetwork, free: NDArray[np.int64]
) -> Comparison | tuple[Floats, Floats, float]:
    """Return the step, a root of the cofactors and the condition."""
    scale = np.linalg.norm(design, axis=0)
    if not (np.isfinite(scale).all() and (scale > 0).all()):
        return Comparison("too weak to compare", np.inf)
    scaled, basis = design / scale, np.eye(len(scale))
    null, b = np.zeros((len(scale), 0)), np.zeros((len(scale), 0))
    if isinstance(random.datum, InnerConstraints):
        _, values, vectors = np.linalg.svd(scaled, full_matrices=False)
        null = vectors[values < NULL * values[0]].T / scale[:, None]
        b = _carriers(dense, random.datum)[free, None] * null
        # Steps of the scaled unknowns with B' x = 0.
        basis = np.linalg.qr(b / scale[:, None], mode="complete")[0][:, null.shape[1] :]
    q, r = np.linalg.qr(scaled @ basis)
    condition = float(np.linalg.cond(r))
    if not condition < HOPELESS:
        return Comparison("too weak to compare", condition)
    root = basis @ np.linalg.inv(r) / scale[:, None]
    step = root @ (q.T @ right)
    if null.size:
        # To where the carriers are nearest to their given places, along the null vectors.
        step = step + null @ np.linalg.solve(b.T @ null, b.T @ (_starts(random, dense)[free] - step))
    return step, root, condition


def _carriers(dense: Dense, datum: InnerConstraints) -> Floats:
    """Return D: the squared factors of the unknowns that carry the datum, in units of length."""
    block, factors = dense.block, np.zeros(dense.count)

    def squares(at: Floats) -> Floats:
        partials = [dense.cartesian(at + 1j * STEP * axis).imag / STEP for axis in np.eye(3)]
        return np.array([own @ own for own in partials])

    for name in block.point_ids if datum.points is None else datum.points:
        row = dense.of_point[name]
        factors[dense.of("point", row)] = squares(dense.points[row])
    for name in datum.photos or ():
        photo = dense.of_photo[name]
        factors[dense.of_pose(photo)][:3] = squares(dense.centres[photo])
    for name in datum.attitudes or ():
        factors[dense.of_pose(dense.of_photo[name])][3:] = (datum.radius or 0.0) ** 2
    return factors


def _starts(random: RandomNetwork, dense: Dense) -> Floats:
    """Return what points and photos would step to their given places; zero for all others."""
    block, apart = random.block, np.zeros(dense.count)
    matrices = network.rotation_matrix(block.photo_attitudes)
    given = matrices if block.photo_to_ground else matrices.transpose(0, 2, 1)
    for row, place in enumerate(dense.points):
        apart[dense.of("point", row)] = block.point_positions[row] - place
    for photo in dense.photos:
        turn = logarithm((dense.attitudes[photo].T @ given[photo]).astype(complex)).real
        moved = block.photo_positions[photo] - dense.centres[photo]
        apart[dense.of_pose(photo)] = np.concatenate([moved, turn])
    return apart


def _unwritten(dense: Dense) -> Floats:
    """Return the last digits of all unknowns."""
    size = np.ones(dense.count)
    for photo in dense.photos:
        size[dense.of_pose(photo)][:3] = np.abs(dense.centres[photo])
    for row, place in enumerate(dense.points):
        size[dense.of("point", row)] = np.abs(place)
    for row, values in enumerate(dense.cameras):
        size[dense.of("camera", row)] = np.abs(values)
    return (16 if dense.block.spheroid is not None else 4) * np.spacing(size)


def _redundancy(result: Result, dense: Dense, rows: Floats) -> float:
    """Return the largest difference of a redundancy number: diag(Qvv W), Qvv = S - a Q a'."""
    at = 2 * len(dense.block.image_xy)
    apart = [np.abs(result.redundancy.ravel() - (1 - (rows[:at] ** 2).sum(axis=1))).max()]
    found: dict[int, Floats] = {}
    for kind in result.kinds.values():
        found.update(zip(kind.rows.tolist(), kind.redundancy, strict=True))
    for k, part in enumerate(dense.parts):
        r = len(part.covariance)
        own, at = rows[at : at + r], at + r
        if k in found:
            factor = np.linalg.cholesky(part.covariance)
            numbers = np.diag(factor @ (np.eye(r) - own @ own.T) @ np.linalg.inv(factor))
            apart.append(np.abs(found[k] - numbers).max())
    return float(max(apart))


def main() -> int:
    """Compare random networks; return 1 where one differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz.dense_network", description=__doc__)
    parser.add_argument("--networks", type=int, default=500, help="how many (500)")
    parser.add_argument("--seed", type=int, default=0, help="of the run (0)")
    parser.add_argument("--first", type=int, default=0, help="number of the first (0)")
    parser.add_argument("--page", type=Path, help="page whose section on networks gets the figures")
    asked = parser.parse_args()
    counts: Counter[tuple[str, str]] = Counter()
    seen: Counter[str] = Counter()
    agreed: dict[str, list[Comparison]] = {datum: [] for datum in DATUMS}
    sums: dict[str, list[tuple[float, float]]] = {}
    for number in range(asked.first, asked.first + asked.networks):
        random = random_network(asked.seed, number)
        found = compare(random)
        counts[random.datum_name, found.ending] += 1
        if found.ending == "agree":
            seen.update({*random.kinds, *random.models})
            agreed[random.datum_name].append(found)
            for name, own in found.sums.items():
                sums.setdefault(name, []).append(own)
        else:
            what = f"{random.models} {random.datum_name} {random.kinds}"
            print(f"{asked.seed}:{number} {what}: {found}", file=sys.stderr)
    rows = [
        "| datum | tried | " + " | ".join(ENDINGS) + " | unknowns, sd | variances | redundancy numbers |",
        "|---" + "|---:" * (len(ENDINGS) + 4) + "|",
    ]
    for datum in DATUMS:
        cells = " | ".join(f"{counts[datum, ending]:,}" for ending in ENDINGS)
        tried = sum(counts[datum, ending] for ending in ENDINGS)
        own = agreed[datum]
        columns = (
            [each.moved for each in own],
            [each.variances for each in own],
            [each.redundancy for each in own],
        )
        figures = " | ".join(f"{max(column, default=0.0):.1e}" for column in columns)
        rows.append(f"| {datum} | {tried:,} | {cells} | {figures} |")
    rarest = min((*KINDS, *MODELS), key=lambda name: seen[name])
    lines = [
        f"{asked.networks:,} networks of seed {asked.seed} on {machine()}. Of {len(MODELS)} cameras and"
        f" {len(KINDS)} observation types, the rarest in networks that agree is {rarest},"
        f" in {seen[rarest]:,}.",
        "",
        *rows,
        "",
        "The random errors have the given standard deviations. The expected ratio of $v^T P v$ of a type to",
        "the sum of its redundancy numbers is therefore 1, within three standard deviations (last column).",
        "Points on lines and priors have no random errors, so their ratio is smaller.",
        "",
        "| observations | networks | redundancy | $v^T P v$ over it | 1 within |",
        "|---" + "|---:" * 4 + "|",
    ]
    for name, own in sums.items():
        square, freedom = (sum(column) for column in zip(*own, strict=True))
        if freedom > 1:
            figures = f"{freedom:,.0f} | {square / freedom:.4f} | {3 * np.sqrt(2 / freedom):.4f}"
            lines.append(f"| {name} | {len(own):,} | {figures} |")
    print("\n".join(lines))
    if asked.page:
        write_section(asked.page, "networks", lines)
    return int(any(ending == "differ" for _, ending in counts.elements()))


if __name__ == "__main__":
    sys.exit(main())
