"""Observed positions of photos as a whole, against those that images and control give without them.

With C and A the projection centres and attitudes of an adjustment without observed positions, the residual of
an observed position is v = observed - (C + A l), l its lever arm. What is wrong with all of them has a form:

    heights above the ellipsoid for those above the geoid      v = (0, 0, N)
    another datum                                              v = s
    a wrong lever arm                                          v = A d
    a time offset tau                                          v = tau dC/dt
    feet for metres, exchanged axes                            v of the observed positions that were meant

Each is fitted by least squares, and judged by its likelihood ratio; one more parameter must gain ln f more.
Where images have no control, the model is first brought onto the observed positions by a similarity, which
hides the first two.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from photogram.adjustment.hypotheses import FOOT
from photogram.arguments.types import Floats, Indices
from photogram.checks.adjusting import Adjuster
from photogram.checks.control_sets import similarity_partials
from photogram.checks.robust import mad_sd
from photogram.network.block import Block
from photogram.network.observations import Observation, Position
from photogram.network.rays import LocalAxes, Rays
from photogram.network.strips import strips_of
from photogram.results.result import Result
from photogram.statistics.likelihood import RIVAL, Judged, judged, likelihood

__all__ = ["ObservedPositions", "Wrong", "observed_positions"]

FEWEST = 5
"""Observed positions that can be judged as a whole."""
EQUAL = 0.1
"""Relative difference within which a lever arm is the given one with other signs or axes."""
Meant = Callable[[Floats], Floats]
"""Makes of (n, 3) coordinates as given those that were meant."""


@dataclass(frozen=True, eq=False)
class _Hypothesis:
    """What is wrong with all positions.

    Attributes
    ----------
    kind
        In a word or two.
    text
        In a sentence, of the k fitted parameters.
    design
        (3n, k) of what is fitted; k may be 0.
    meant
        What the given coordinates should be, before that.
    """

    kind: str
    text: Callable[[Floats], str]
    design: Floats
    meant: Meant | None = None


@dataclass(frozen=True)
class Wrong:
    """What is wrong with the observed positions as a whole.

    Attributes
    ----------
    kind, text
        In a word or two, and in a sentence.
    judged
        How sure it is.
    change
        Makes of the block what was meant.
    """

    kind: str
    text: str
    judged: Judged
    change: Callable[[Block], Block]


@dataclass(frozen=True, eq=False)
class ObservedPositions:
    """Observed positions of n photos, and the photos as the rest of the network has them.

    Attributes
    ----------
    block
        The block.
    photos
        (n,) its photos.
    observed
        (n, 3) positions as given, in the block's own coordinates.
    places
        Which of the block's observations each is; -1 where the position of the photo is weighted.
    arms
        (n, 3) lever arms in the axes of the photos.
    times
        (n,) seconds; all equal where none are given.
    axes
        Metric axes of the block.
    centres, attitudes
        (n, 3) and (n, 3, 3), photo to metric axes, without the observed positions.
    deviations
        (n, 3) of v, about.
    free
        Whether the model has a datum of its own.
    """

    block: Block
    photos: Indices
    observed: Floats
    places: list[int]
    arms: Floats
    times: Floats
    axes: LocalAxes
    centres: Floats
    attitudes: Floats
    deviations: Floats
    free: bool

    def residuals(self, meant: Meant | None = None) -> Floats:
        """(n, 3) observed minus computed, in the metric axes."""
        observed = self.observed if meant is None else meant(self.observed)
        computed = self.centres + np.einsum("nij,nj->ni", self.attitudes, self.arms)
        found: Floats = self.axes.positions(observed) - computed
        return found

    def explain(self) -> Wrong | None:
        """Return what explains the residuals of all positions, if something does."""
        hypotheses = self._hypotheses()
        freedom = 3 * len(self.photos) - (7 if self.free else 0)
        given, _ = self._left(None, np.zeros((3 * len(self.photos), 0)))
        fitted = [self._left(each.meant, each.design) for each in hypotheses]
        # A parameter more costs ln f.
        left = [
            omega * math.exp(each.design.shape[1] * math.log(freedom) / freedom)
            for each, (omega, _) in zip(hypotheses, fitted, strict=True)
        ]
        by_kind = {each.kind: row for row, each in enumerate(hypotheses)}
        for whole, part in (("shift", "geoid"),):
            if whole in by_kind and part in by_kind:
                one, other = by_kind[whole], by_kind[part]
                if likelihood(left[other], left[one], freedom) < RIVAL:
                    left[one] = math.inf
        verdict = judged(given, left, freedom)
        if verdict is None:
            return None
        best = [(hypotheses[row], fitted[row][1]) for row in verdict.best]
        texts = "; or ".join(each.text(values) for each, values in best)
        word = "probably" if len(best) == 1 else "it cannot be told which:"
        text = f"{word} {texts}: observed positions would miss the photos by {verdict.fall:.3g} times less"
        first, values = best[0]
        return Wrong(first.kind, text, verdict, lambda block: self._put_right(block, first, values))

    def _left(self, meant: Meant | None, design: Floats) -> tuple[float, Floats]:
        """Return Omega and the parameters of a hypothesis."""
        weights = 1 / self.deviations.ravel()
        right = self.residuals(meant).ravel() * weights
        nuisance = np.zeros((len(right), 0))
        if self.free:
            nuisance = similarity_partials(self.centres - self.centres.mean(axis=0))
        whole = np.hstack([design, nuisance]) * weights[:, np.newaxis]
        if not np.isfinite(right).all():
            return math.inf, np.zeros(design.shape[1])
        solved: Floats = np.zeros(0)
        if whole.shape[1]:
            solved = np.asarray(np.linalg.lstsq(whole, right, rcond=None)[0])
        left = right - whole @ solved
        return max(float(left @ left), np.finfo(np.float64).tiny), solved[: design.shape[1]]

    def _hypotheses(self) -> list[_Hypothesis]:
        count, unit = len(self.photos), self.block.linear_unit
        none = np.zeros((3 * count, 0))

        def said(text: str) -> Callable[[Floats], str]:
            return lambda _values: text

        def vector(values: Floats) -> str:
            return f"({', '.join(f'{each:.3f}' for each in values)}) {unit}"

        what = "observed positions of the photos"
        found = [
            _Hypothesis(
                "feet in heights",
                said(f"heights of the {what} are in feet, all else in metres"),
                none,
                lambda positions: positions * [1.0, 1.0, FOOT],
            ),
            _Hypothesis("lever arm", self._arm, self.attitudes.reshape(-1, 3)),
        ]
        velocities, per = self._velocities()
        if np.isfinite(velocities).all():
            found.append(
                _Hypothesis(
                    "time offset",
                    lambda values: (
                        f"the {what} are those of another time: {values[0]:.4f} {per} later along the flight"
                    ),
                    velocities.reshape(-1, 1),
                )
            )
        if self.block.spheroid is None:
            found += [
                _Hypothesis(
                    "feet", said(f"the {what} are in feet"), none, lambda positions: positions * FOOT
                ),
                _Hypothesis(
                    "X and Y exchanged",
                    said(f"X and Y of the {what} are exchanged"),
                    none,
                    lambda positions: positions[:, [1, 0, 2]],
                ),
            ]
        if not self.free:
            up = np.tile([[0.0], [0.0], [1.0]], (count, 1))
            found += [
                _Hypothesis(
                    "geoid",
                    lambda values: (
                        f"heights of the {what} are {values[0]:.3f} {unit} above those of the control:"
                        " ellipsoidal and orthometric heights are mixed"
                    ),
                    up,
                ),
                _Hypothesis(
                    "shift",
                    lambda values: f"the {what} are in another datum, shifted by {vector(values)}",
                    np.tile(np.eye(3), (count, 1)),
                ),
            ]
        return found

    def _arm(self, change: Floats) -> str:
        """Say what is wrong with the lever arm when it should have changed by so much."""
        given, unit = np.median(self.arms, axis=0), self.block.linear_unit
        meant = given + change
        size = float(np.linalg.norm(given))
        shown = f"({', '.join(f'{each:.3f}' for each in meant)}) {unit}"
        if not size:
            return f"the antenna has a lever arm of {shown}"
        for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
            if np.linalg.norm(given[list(order)] * signs - meant) < EQUAL * size:
                axes = "has other axes" if order != (0, 1, 2) else "has the wrong sign"
                return f"the lever arm {axes}: it should be about {shown}"
        return f"the lever arm is wrong: it should be about {shown}"

    def _velocities(self) -> tuple[Floats, str]:
        """(n, 3) along the flight, a second or a step from photo to photo; NaN where there is none."""
        found = np.full(self.centres.shape, np.nan)
        timed = bool(np.ptp(self.times) > 0)
        for strip in strips_of(self.centres):
            if len(strip) > 1:
                steps = self.times[strip] if timed else np.arange(len(strip), dtype=np.float64)
                if (np.diff(steps) > 0).all():
                    found[strip] = np.gradient(self.centres[strip], steps, axis=0)
        return found, "s" if timed else "steps from photo to photo"

    def _put_right(self, block: Block, hypothesis: _Hypothesis, values: Floats) -> Block:
        """Return the block with the observed positions that were meant."""
        observed = self.observed if hypothesis.meant is None else hypothesis.meant(self.observed)
        wrong = (hypothesis.design @ values).reshape(-1, 3) if len(values) else np.zeros(observed.shape)
        meant = self.axes.from_local(self.axes.positions(observed) - wrong)
        observations = list(block.observations)
        weighted = block.photo_positions_observed
        weighted = block.photo_positions.copy() if weighted is None else weighted.copy()
        for row, place in enumerate(self.places):
            if place < 0:
                weighted[self.photos[row]] = meant[row]
            else:
                observations[place] = _moved(block.observations[place], meant[row])
        return block.replace(photo_positions_observed=weighted, observations=observations)


def _moved(observation: Observation, position: Floats) -> Observation:
    assert isinstance(observation, Position)
    return Position(
        observation.photo,
        position,
        covariance=observation.precision,
        lever_arm=observation.lever_arm,
        time=observation.time,
    )


def observed_positions(block: Block, adjusted: Adjuster) -> ObservedPositions | None:
    """Return the observed positions of a block and what the rest of it says of them.

    None where there are too few, or the rest cannot be adjusted. Positions with unknown lever arms, shifts or
    drifts are left to these.
    """
    number = {name: row for row, name in enumerate(block.photo_ids)}
    rows: list[int] = []
    places: list[int] = []
    values: list[Floats] = []
    for place, each in enumerate(block.observations):
        if isinstance(each, Position) and all(unknown is None for unknown in each.unknowns):
            rows.append(number[each.photo])
            places.append(place)
            deviations = np.sqrt(np.diagonal(each.precision))
            values.append(np.concatenate([each.observed, deviations]))
    sd = block.photo_position_sd
    given = (
        block.photo_positions if block.photo_positions_observed is None else block.photo_positions_observed
    )
    per_unit = np.ones(3) if block.spheroid is None else np.array([block.spheroid.a, block.spheroid.a, 1.0])
    for row in np.flatnonzero((np.isfinite(sd) & (sd > 0)).all(axis=1)).tolist():
        rows.append(row)
        places.append(-1)
        values.append(np.concatenate([given[row], np.zeros(4), sd[row] * per_unit]))
    if len(rows) < FEWEST:
        return None
    kept = [each for each in block.observations if not isinstance(each, Position)]
    loose = np.where(sd == 0, 0.0, np.inf)
    rest = adjusted.otherwise(unit_variance="unity").tried(
        block.replace(observations=kept, photo_position_sd=loose, photo_positions_observed=None)
    )
    if rest is None or not rest.converged:
        return None
    return _compared(block, rest, np.array(rows), places, np.array(values))


def _compared(
    block: Block, rest: Result, photos: Indices, places: list[int], values: Floats
) -> ObservedPositions:
    placed = block.replace(
        cameras=(),
        photo_cameras=None,
        principal_distances=np.ones(len(block.photo_ids)),
        photo_positions=rest.photo_positions,
        photo_attitudes=rest.photo_attitudes,
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        photo_positions_observed=None,
        photo_attitudes_observed=None,
        observations=(),
        mounts=(),
    )
    rays = Rays.of(placed)
    per_unit = np.ones(3) if block.spheroid is None else np.array([block.spheroid.a, block.spheroid.a, 1.0])
    own = (
        np.sqrt(np.maximum(np.diagonal(rest.photo_cofactors[photos], axis1=1, axis2=2)[:, :3], 0)) * per_unit
    )
    free = "constraints" in rest.datum.kind
    size = max(mad_sd(rest.standardized), 1.0)
    # What the datum adds to the deviations of a free model is no part of its shape.
    deviations = np.hypot(values[:, 7:], 0.0 if free else size * own)
    return ObservedPositions(
        block,
        photos,
        values[:, :3],
        places,
        values[:, 3:6],
        values[:, 6],
        rays.axes,
        rays.centres[photos],
        rays.cameras[photos],
        np.asarray(deviations),
        free,
    )
