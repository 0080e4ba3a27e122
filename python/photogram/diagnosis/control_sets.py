"""Control points as a set against a free model: units, axes, mirror images.

Without control, the image observations define a free model with its own datum: positions Y of the control
points with their joint covariance C_Y. A similarity compares control X, with covariance C_X, with this model:

    Omega = min over m, R, t of e' (C_X + C_Y)^-1 e,     e = X - (m R Y + t)

In a linear model, this is the increase of the sum of squares if that control is added. So a hypothesis about
all control (heights in feet, X and Y exchanged ...) costs a fit of seven parameters and no adjustment.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import combinations

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.diagnosis.adjusting import Adjuster
from photogram.diagnosis.blunders import limit_of, tests
from photogram.diagnosis.findings import Explained, likely
from photogram.diagnosis.hypotheses import FOOT
from photogram.diagnosis.predictions import freed
from photogram.diagnosis.regression import spread
from photogram.diagnosis.robust import mad_sd
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.observations import Control
from photogram.network.rays import LocalAxes, local_axes
from photogram.network.similarity import turn_and_scale
from photogram.results.result import Result
from photogram.statistics.likelihood import judged
from photogram.words import phrase

MOST = 60  # Maximum number of compared control points
FEWEST = 3
TRIPLES = 400  # Maximum number of tried triples of control points
CLEARLY = 2 * math.log(20)  # Additional cost of an explanation by single points (likelihood ratio of 20)
PAIRS = 15  # Maximum number of tried exchanges
GROWTHS = 5
NEAR = 6.0  # Standard deviations within which a point agrees with a similarity
STEPS = 30
CONVERGED = 1e-9
MANY = 2  # Number of control points that do not fit above which the whole set is doubted

EXCHANGED = "X and Y exchanged"

Change = Callable[[Floats], Floats]  # Changes (n, 3) given coordinates to the intended ones


@dataclass(frozen=True)
class _Set:
    kind: str
    change: Change

    def meant(self, block: Block) -> Block:
        """Return the block with the intended control."""
        held = np.isfinite(block.point_sd).any(axis=1, keepdims=True)
        positions = np.where(held, self.change(block.point_positions), block.point_positions)
        order = [1, 0, 2] if self.kind == EXCHANGED else [0, 1, 2]
        return block.replace(point_positions=positions, point_sd=block.point_sd[:, order])


def _scaled(*factors: float) -> Change:
    return lambda positions: positions * factors


SETS = (
    _Set("feet in heights", _scaled(1, 1, FOOT)),
    _Set("metres in heights", _scaled(1, 1, 1 / FOOT)),
    _Set("feet in X", _scaled(FOOT, 1, 1)),
    _Set("feet in Y", _scaled(1, FOOT, 1)),
    _Set("feet in X and Y", _scaled(FOOT, FOOT, 1)),
    _Set(EXCHANGED, lambda positions: positions[:, [1, 0, 2]]),
)
"""Hypotheses about all control; in geographic space only those on heights, and the exchange."""


SAME_BUT_SCALE = {"metres in heights", "feet in X and Y"}


@dataclass(frozen=True, eq=False)
class FreeModel:
    """Control points in the free model, which does not depend on them."""

    block: Block  # The block with its control
    axes: LocalAxes  # Its metric axes
    points: Indices  # (k,) the control points
    held: Bools  # (k, 3) their control components (finite sd)
    model: Floats  # (k, 3) positions in the model, in the axes
    given: Floats  # (k, 3) positions in the model, in the block's own coordinates
    covariance: Floats  # (3k, 3k) of `model`
    per_unit: Floats  # (3,) approximate size of a unit of each coordinate, in units of the axes

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom of the comparison."""
        return int(self.held.sum()) - 7

    def omega(self, change: Change | None = None) -> float:
        """Return Omega under a hypothesis; infinite if it cannot be fitted."""
        return self._best(self._target(change))[0]

    def scale(self, change: Change) -> float:
        """Return the scale of the similarity under a hypothesis: 1 for correct stations."""
        return self._best(self._target(change))[1].scale

    def _best(self, target: Floats) -> tuple[float, _Similarity]:
        if not np.isfinite(target).all():
            return math.inf, _Similarity.start(self.model, self.model)
        starts = [_Similarity.start(self.model, target)]
        full = self.held.all(axis=1)
        if full.sum() >= FEWEST:
            starts.append(self._closest(np.flatnonzero(full), target))
        rows = np.flatnonzero(self.held.ravel())
        return min((self._fitted(each, target, rows) for each in starts), key=lambda each: each[0])

    def two_exchanged(self) -> float:
        """Return Omega after the best exchange of two points."""
        target = self._target(None)
        _, similarity = self._nearest(target)
        placed = similarity.of(self.model)
        pairs = [
            pair
            for pair in combinations(range(len(target)), 2)
            if (self.held[pair[0]] == self.held[pair[1]]).all()
        ]

        def apart(pair: tuple[int, int]) -> float:
            own, swapped = target[list(pair)], target[list(pair[::-1])]
            at = placed[list(pair)]
            return float(((at - swapped) ** 2).sum() - ((at - own) ** 2).sum())

        left = math.inf
        for pair in sorted(pairs, key=apart)[:PAIRS]:
            swapped = target.copy()
            swapped[list(pair)] = target[list(pair[::-1])]
            left = min(left, self._best(swapped)[0])
        return left

    def some_wrong(self, change: Change | None = None) -> float:
        """Return the cost of explaining the misfit, under a hypothesis, by wrong points.

        The cost is Omega of the other points plus two terms. Each wrong point adds 2 ln(3 k), because it is
        one of k. Each of its errors adds 2 ln(error / standard deviation). The correct points are the ones
        nearest to the similarity of three points that most other points fit.
        """
        target, full = self._target(change), np.flatnonzero(self.held.all(axis=1))
        deviations = self._deviations
        if len(full) < FEWEST or not np.isfinite(target).all():
            return math.inf
        nearest, _ = self._nearest(target)
        sizes = np.abs(nearest).max(axis=1)
        right = sizes <= np.sort(sizes[full])[max(len(full) // 2, FEWEST - 1)]
        for _ in range(GROWTHS):
            rows = np.flatnonzero((self.held & right[:, np.newaxis]).ravel())
            some = full[right[full]]
            start = self._closest(some, target)
            omega, similarity = self._fitted(start, target, rows)
            misses = np.where(self.held, (target - similarity.of(self.model)) / deviations, 0.0)
            now = np.abs(misses).max(axis=1) < NEAR
            if right[full].sum() < FEWEST or now[full].sum() < FEWEST or (now == right).all():
                break
            right = now
        gone = np.flatnonzero((self.held & ~right[:, np.newaxis]).ravel())
        tests = self._left_out(similarity, target, gone)
        count = int((~right).sum()) * math.log(3 * len(right))
        return omega + 2 * (count + float(np.log(np.maximum(np.abs(tests), 1.0)).sum()))

    @property
    def _deviations(self) -> Floats:
        """(k, 3) standard deviations of control minus model, before the similarity."""
        own = np.sqrt(np.maximum(np.diag(self.covariance), 0)).reshape(-1, 3)
        return np.asarray(np.hypot(own, self.per_unit * self.block.point_sd[self.points]))

    def _nearest(self, target: Floats) -> tuple[Floats, _Similarity]:
        """Return the three-point similarity that most points fit, after (k, 3) misfits."""
        deviations = self._deviations
        best, nearest = math.inf, (np.zeros(target.shape), _Similarity.start(self.model, target))
        for three in _triples(np.flatnonzero(self.held.all(axis=1))):
            similarity = self._closest(three, target)
            misses = np.where(self.held, (target - similarity.of(self.model)) / deviations, 0.0)
            cost = float(np.log1p(misses**2).sum())
            if cost < best:
                best, nearest = cost, (misses, similarity)
        return nearest

    def _left_out(self, similarity: _Similarity, target: Floats, gone: Indices) -> Floats:
        """Return errors of omitted components by the others, in standard deviations."""
        rows = np.flatnonzero(self.held.ravel())
        error, design, own = self._equations(similarity, target, rows)
        weighted = np.linalg.solve(own, design)
        projector = np.linalg.inv(own) - weighted @ np.linalg.pinv(design.T @ weighted) @ weighted.T
        place = np.searchsorted(rows, gone)
        cofactor = np.linalg.pinv(projector[np.ix_(place, place)])
        errors = cofactor @ (projector @ error)[place]
        tests: Floats = errors / np.sqrt(np.maximum(np.diag(cofactor), np.finfo(np.float64).tiny))
        return tests

    def _equations(
        self, similarity: _Similarity, target: Floats, rows: Indices
    ) -> tuple[Floats, Floats, Floats]:
        """Return misclosures, partials (shift, scale, rotation) and covariance of rows."""
        turned = similarity.scale * (self.model - self.model.mean(axis=0)) @ similarity.rotation.T
        whole = np.kron(np.eye(len(turned)), similarity.scale * similarity.rotation)
        variances = ((self.per_unit * self.block.point_sd[self.points]).ravel()[rows]) ** 2
        own = (whole @ self.covariance @ whole.T)[np.ix_(rows, rows)] + np.diag(variances)
        return (target - similarity.of(self.model)).ravel()[rows], _similarity_partials(turned)[rows], own

    def _target(self, change: Change | None) -> Floats:
        supplied = self.block.point_positions[self.points]
        meant = supplied if change is None else change(supplied)
        # A free component carries no information: it has the coordinate of the model.
        return self.axes.positions(np.where(self.held, meant, self.given))

    def _closest(self, which: Indices, target: Floats) -> _Similarity:
        some = self.model[which]
        return _Similarity.closest(some, target[which]).about(some, self.model)

    def _fitted(self, similarity: _Similarity, target: Floats, rows: Indices) -> tuple[float, _Similarity]:
        """Return Omega of some rows and the similarity after Gauss-Newton steps."""
        before = math.inf
        for _ in range(STEPS):
            error, design, own = self._equations(similarity, target, rows)
            try:
                root = np.linalg.cholesky(own)
            except np.linalg.LinAlgError:
                return math.inf, similarity
            whitened = np.linalg.solve(root, design)
            right = np.linalg.solve(root, error)
            step = np.linalg.lstsq(whitened, right, rcond=None)[0]
            left = right - whitened @ step
            now = float(left @ left)
            if abs(before - now) <= CONVERGED * max(now, 1.0):
                return now, similarity
            before = now
            similarity = similarity.moved(step)
        return before, similarity


def _triples(points: Indices) -> list[Indices]:
    """Return triples of points: all, or a random sample with a fixed seed."""
    if math.comb(len(points), 3) <= TRIPLES:
        return [np.array(three) for three in combinations(points.tolist(), 3)]
    random = np.random.default_rng(0)
    return [random.permutation(points)[:3] for _ in range(TRIPLES)]


@dataclass(frozen=True, eq=False)
class _Similarity:
    scale: float
    rotation: Floats
    shift: Floats

    @classmethod
    def start(cls, model: Floats, target: Floats) -> _Similarity:
        """Return the shift between the means of two sets of points."""
        return cls(1.0, np.eye(3), target.mean(axis=0) - model.mean(axis=0))

    @classmethod
    def closest(cls, model: Floats, target: Floats) -> _Similarity:
        """Return the unweighted least-squares similarity."""
        scale, rotation, _ = turn_and_scale(model, target)
        return cls(max(scale, 1e-6), rotation, target.mean(axis=0) - model.mean(axis=0))

    def of(self, model: Floats) -> Floats:
        """Return (k, 3) transformed model points; rotation and scale about their mean."""
        centre = model.mean(axis=0)
        placed: Floats = self.scale * (model - centre) @ self.rotation.T + centre + self.shift
        return placed

    def about(self, some: Floats, model: Floats) -> _Similarity:
        """Return the same similarity about the mean of all points."""
        from_some, to_all = some.mean(axis=0), model.mean(axis=0)
        moved = self.scale * (to_all - from_some) @ self.rotation.T + from_some + self.shift - to_all
        return _Similarity(self.scale, self.rotation, moved)

    def moved(self, step: Floats) -> _Similarity:
        """Return the similarity after a step of translation, scale and rotation."""
        return _Similarity(
            self.scale * math.exp(float(np.clip(step[3], -1, 1))),
            Attitudes.of("rotation_vector", step[np.newaxis, 4:]).matrices[0] @ self.rotation,
            self.shift + step[:3],
        )


def doubtful(first: Result | None, *kinds: str) -> bool:
    """Test whether all observations of some types may be wrong."""
    if first is None or not first.converged:
        return True
    values = tests(first)
    size = max(mad_sd(first.standardized), np.finfo(np.float64).tiny)
    limit = limit_of(values) * size
    beyond = sum(int((values[kind] > limit).any(axis=1).sum()) for kind in kinds if kind in values)
    fixed = "control" in kinds and bool((first.block.point_sd == 0).any())
    return beyond >= MANY or (fixed and size > MANY)


def free_model(block: Block, adjusted: Adjuster) -> FreeModel | None:
    """Return control points in the free model of other observations, or None."""
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    points = spread(np.flatnonzero(np.isfinite(block.point_sd).any(axis=1) & (rays >= 2)), MOST)
    if len(points) < FEWEST:
        return None
    rest = freed(block, np.arange(len(block.point_ids))).replace(
        observations=[each for each in block.observations if not isinstance(each, Control)]
    )
    result = adjusted.otherwise(unit_variance="unity").tried(rest)
    if result is None:
        return None
    points = points[result.used_points[points]]
    held = np.isfinite(block.point_sd[points])
    if not result.converged or held.sum() <= 7:
        return None
    axes = local_axes(block)
    per_unit = np.ones(3)
    given = result.point_positions[points]
    if block.spheroid is not None:
        a = block.spheroid.a
        per_unit = np.array([a * math.cos(float(given[:, 1].mean())), a, 1.0])
    scale = np.tile(per_unit, len(points))
    names = [block.point_ids[point] for point in points.tolist()]
    covariance = result.covariance(("point", names)) * scale * scale[:, np.newaxis]
    model = axes.positions(given)
    shape = max(mad_sd(result.standardized), 1.0) ** 2 * _of_shape(covariance, model)
    return FreeModel(block, axes, points, held, model, given, shape, per_unit)


def _of_shape(covariance: Floats, model: Floats) -> Floats:
    """Return a covariance whose datum part has the average variance of its shape part.

    The comparison estimates a similarity anyway. The datum part of the model would only cost digits.
    """
    basis, _ = np.linalg.qr(_similarity_partials(model - model.mean(axis=0)))
    across = np.eye(len(covariance)) - basis @ basis.T
    shape = across @ covariance @ across
    found: Floats = shape + np.trace(shape) / len(shape) * basis @ basis.T
    return found


def _similarity_partials(turned: Floats) -> Floats:
    """(3k, 7) partials of points about their mean by shift, scale and rotation."""
    design = np.zeros((len(turned), 3, 7))
    design[:, :, :3] = np.eye(3)
    design[:, :, 3] = turned
    for axis in range(3):
        design[:, :, 4 + axis] = np.cross(np.eye(3)[axis], turned)
    return design.reshape(-1, 7)


def explain(model: FreeModel) -> Explained | None:
    """Return the mistake in the control as a set that explains the misfit, if any."""
    sets = [
        each
        for each in SETS
        if model.block.spheroid is None or "heights" in each.kind or each.kind == EXCHANGED
    ]
    changed = [model.omega(each.change) for each in sets]
    single = min(model.some_wrong(), model.two_exchanged())
    verdict = judged(model.omega(), changed, model.degrees_of_freedom)
    if verdict is None or min(changed) + CLEARLY > single:
        # Other wrong points hide a mistake in the set: both are compared with the cost of wrong points.
        changed = [
            min(omega, model.some_wrong(each.change)) for omega, each in zip(changed, sets, strict=True)
        ]
        verdict = judged(single, changed, model.degrees_of_freedom)
        if verdict is None:
            return None
    best = [sets[place] for place in verdict.best]
    if {each.kind for each in best} == SAME_BUT_SCALE:
        # The hypotheses differ only in scale, which the stations determine.
        best = [min(best, key=lambda each: abs(math.log(model.scale(each.change))))]
        verdict = replace(verdict, best=verdict.best[:1])
    if model.held.all(axis=1).sum() < FEWEST:
        # A mistake in the set cannot be distinguished from one in some points.
        verdict = replace(verdict, explained=False)
    causes = [phrase(f"mistake.control.{each.kind}") for each in best]
    effect = phrase("mistake.control-misfit", times=verdict.fall)
    return Explained(best[0].kind, likely(causes, effect), verdict, best[0].meant)
