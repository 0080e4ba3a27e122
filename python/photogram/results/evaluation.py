"""Tests of hypotheses and of standard deviations by type on an adjusted network, and their summary."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, MutableMapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import finite_rows, sampled
from photogram.arguments.types import Floats, Indices
from photogram.memory import give_back
from photogram.results.hypotheses import DETECTION, SHARES, WHOLE, Effect, Hypotheses
from photogram.results.network_trial import (
    CONTROL,
    IMAGE,
    NO_FACTS,
    OBSERVATION,
    Facts,
    LostSupportError,
    NamedSuspects,
    NetworkTrial,
    Out,
    Tests,
    notable,
)
from photogram.results.reliability import Listed, Reliability, ReliabilitySummary, downweighted, listed
from photogram.show.quantity import Axis
from photogram.statistics.distributions import log_chi_square
from photogram.statistics.evidence import MEDIAN
from photogram.statistics.findings import ALTERNATIVES, LARGEST_FACTOR, NOMINAL, Tested, Text, TypeFactor
from photogram.statistics.limits import global_test
from photogram.statistics.reliability import TESTABLE
from photogram.statistics.weight_rules import wrong_types

if TYPE_CHECKING:
    from photogram.results.network import AdjustedNetwork

EFFECTS = 16  # Groups with computed effects: those of the largest bias-to-noise ratios
DRAWN = 300  # Largest number of points whose changes are stored for plots
ALL_PHOTOS = 16  # Largest number of photos that are all tested for a shift
MOST_PHOTOS = 4  # Of more photos, this number is tested: those with the largest mean residuals


def hypotheses(
    trial: NetworkTrial,
    tests: Tests,
    facts: Facts,
    axes: Sequence[Axis],
    standing: tuple[float, float],
    limit: float,
    *,
    known: bool,
    last: bool = False,
) -> Hypotheses:
    """Return the hypotheses of an adjusted network with the `tests` of its observations.

    `axes` are those of its points, `standing` the sum of squares and the degrees of freedom, `known` is
    whether the unit weight is known. `limit`: standard deviations from which on an undetected error of a
    point counts. `last`: whether the trial may be released.
    """
    suspects, estimated = trial.suspects, None if known else standing
    images = (suspects.kinds == 0) & tests.active
    adjusted = np.flatnonzero(np.bincount(suspects.points[images]))
    drawn = sampled(adjusted, DRAWN)
    core = {**NO_FACTS, **facts}
    timed, agreement, strips = (core.pop(name, None) for name in ("timed", "agreement", "strips"))
    checks = len(core["checks"])
    core["checks"] = [*core["checks"], *drawn.tolist()]
    joint: Joint | None = None
    if agreement is not None:
        core["compared"] = checks
        if agreement.joint is not None:
            flat, differences, covariance = agreement.joint
            joint = flat, differences, np.linalg.inv(covariance)  # Once for all hypotheses
            # Otherwise, they differ no more than expected, and name no single component.
            core["by_component"] = (
                agreement.together is not None and agreement.together.probability_above < 0.5
            )
    if core["widths"]:
        core["photos"] = shifted_photos(suspects, tests)
    if last:
        trial.restart(trial.core)
        give_back()
    found = trial.core.hypotheses(
        **core, estimated=estimated, detection=DETECTION, limit=limit, effects=EFFECTS, last=last
    )
    if last:
        give_back()
    if strips is not None:
        of_strips = np.isin(found["code"], ("gnss-set", "camera-f-strip"))
        found["index"][of_strips] = np.array(strips)[found["index"][of_strips]]
    effects, relative, alone = {}, set[int](), np.nan_to_num(found["statistic"])
    groups = _groups(suspects, found["group"], found["index"])
    for row, (*values, changes) in found["effects"].items():
        effects[row] = Effect(changes[checks:], *values)
    if known and joint is not None:
        for row, own in [*enumerate(found["sets"]), *found["groups"].items()]:
            of_set = row < len(found["sets"])
            units = own["plausible"] if of_set else trial.deviations[suspects.rows(int(groups[row]))]
            if row in effects and with_checks(found, row, own, units, checks, joint):
                relative.add(row)
    variance = None if known else standing[0] / standing[1]
    deviates, sizes, errors = in_deviations(found, checks, joint, variance)
    for own in found["sets"]:
        if own["sd_between_photos"] is not None:
            # Residuals are smaller than errors by the root of the mean redundancy number.
            mean_redundancy = standing[1] / np.count_nonzero(~np.isnan(tests.residual))
            own["sd_between_photos"] /= math.sqrt(min(mean_redundancy, 1.0))
    statistic, estimate = found["statistic"], found["estimate"]
    kinds = [*zip(found["code"], (found["component"] < 0).tolist(), strict=True)]
    numbers = Counter(kinds)
    numbers["photo", True] = len(suspects.given.photo_ids)
    count = np.array([numbers[kind] for kind in kinds])
    k = np.maximum(np.count_nonzero(~np.isnan(estimate), axis=1), 1)

    def change(statistic: ArrayLike) -> Floats:
        """Return twice the logarithms of the likelihood ratios against no error."""
        if estimated is None:
            return np.asarray(statistic)
        omega, freedom = estimated
        return -freedom * np.log(np.maximum(1 - np.asarray(statistic) / omega, 1e-300))

    odds = _log_odds(change(statistic), k, np.maximum(found["observations"], k + 1), count)
    odds -= np.nansum(np.square(estimate / found["plausible"]), axis=1) / 2
    # Terms of distortion bend a network, other principal distances have nearly the effect of an image size:
    # bent heights of many control points and resized images are rare.
    odds[np.isin(found["code"], ("control-bending", "camera-size"))] -= math.log(ALTERNATIVES)
    shares = np.isin(found["code"], SHARES)
    odds[shares] -= np.square((estimate[shares, 0] - 1.0) / WHOLE) / 2
    largest = float(np.nanmax(tests.statistic[images], initial=0.0))
    of_images = float(_log_odds(change(largest), 2, 3, max(int(np.count_nonzero(images)), 1)))
    checked = -math.inf if agreement is None else largest_odds([agreement.points])
    if joint is not None:
        of_checks, dimension = single_checks(joint)
        by_one = _log_odds(of_checks, dimension, dimension + 1, len(dimension))
        checked = max(checked, float(by_one.max()))
    sets = len(found["sets"])
    every = Hypotheses(
        **{name: found[name] for name in ("correlations", "index", "component", "sets", "probability")},
        **{name: found[name] for name in ("estimate", "redundancy", "mdb", "bias_to_noise")},
        code=np.array(found["code"], dtype=np.str_),
        group=groups,
        rank=found["rank"].astype(np.int64),
        statistic=statistic,
        log_odds=odds,
        by_checks=(np.nan_to_num(statistic) - alone) / 2,
        effects=effects,
        deviates=deviates,
        sizes=sizes,
        errors=errors,
        drawn=drawn,
        limit=limit,
        suspects=suspects,
        points=len(adjusted),
        axes=axes,
        times="s" if timed else "exposures",
        excess=max(standing[0] - standing[1], 0.0) if known else 0.0,
        relative=relative,
        single_odds=float(np.nanmax(odds[sets:], initial=max(of_images, checked))),
    )
    if joint is not None:
        correlate(found, [row for row in sorted(relative) if every.is_harmful(row)], checks, joint)
    return every


def shifted_photos(suspects: NamedSuspects, tests: Tests) -> list[int]:
    """Return photos that may have an error in common of all their images; of few photos all.

    Of many, these are the photos with the largest means of the residuals of an image axis.
    """
    count, images = len(suspects.given.photo_ids), np.flatnonzero(suspects.kinds == IMAGE)
    if count <= ALL_PHOTOS:
        return [*range(count)]
    photos = suspects.photos[images]
    numbers = np.maximum(np.bincount(photos, minlength=count), 1)
    residuals = np.nan_to_num(tests.residual[: 2 * len(images)]).reshape(-1, 2).T
    sums = [np.bincount(photos, own, minlength=count) for own in residuals]
    return notable(np.stack(sums, axis=1) ** 2 / numbers[:, np.newaxis], MOST_PHOTOS)


def _groups(suspects: NamedSuspects, kinds: Indices, subjects: Indices) -> Indices:
    """Return the groups with these types and subjects; -1 for a negative type."""
    most = max(int(suspects.subjects.max(initial=0)), int(subjects.max(initial=0))) + 1
    others = np.flatnonzero(suspects.kinds != 0)
    keys = suspects.kinds[others] * most + suspects.subjects[others]
    order = np.argsort(keys)
    found = np.full(len(kinds), -1)
    own = kinds >= 0
    found[own] = others[order[np.searchsorted(keys, (kinds * most + subjects)[own], sorter=order)]]
    return found


def largest_odds(tests: Iterable[Tested]) -> float:
    """Return the largest log odds of an error that tests of single values have."""
    found = [-math.inf]
    for each in tests:
        k = np.asarray(each.dimension, dtype=np.float64)
        values = np.square(each.values) if each.statistic == "w" else np.asarray(each.values)
        values = values * k if each.statistic == "F" else values
        odds = _log_odds(values, k, k + 1, max(int(np.count_nonzero(~np.isnan(values))), 1))
        found.append(float(np.nanmax(odds, initial=-math.inf)))
    return max(found)


def _log_odds(statistic: ArrayLike, k: ArrayLike, observations: ArrayLike, count: ArrayLike) -> Floats:
    """Return T/2 - k/2 ln n_h - ln N_h: the log odds of an error of any size against no error."""
    half = np.asarray(k) / 2 * np.log(observations)
    return np.asarray(np.asarray(statistic) / 2 - half - np.log(count))


SINGULAR = 1e-10  # Relative eigenvalue of directions that nothing determines

Joint = tuple[Indices, Floats, Floats]
"""Coordinates of check points with differences D, these, and the inverse C^-1 of their covariance."""


def single_checks(joint: Joint) -> tuple[Floats, Floats]:
    """Return T of an error of each single check point, and its dimension.

    With the score s = C^-1 D and the redundancy W = C^-1, T = s' W^-1 s over its coordinates.
    """
    flat, differences, inverse = joint
    score = inverse @ differences
    points = [np.flatnonzero(flat // 3 == point) for point in np.unique(flat // 3)]
    found = [score[own] @ np.linalg.solve(inverse[np.ix_(own, own)], score[own]) for own in points]
    return np.array(found), np.array([len(own) for own in points], dtype=float)


def with_checks(
    found: Facts, row: int, own: MutableMapping[str, Any], sizes: Floats, checks: int, joint: Joint
) -> bool:
    """Test a set or a group with check points as further observations; return whether only these test it.

    Differences D of check points with the covariance C are independent of the residuals. If the parameters
    change them by G, D adds G' C^-1 D to the score s and G' C^-1 G to the redundancy R. The components of a
    group, in the next rows, have T = s_k^2 / R_kk. `sizes` (k) of parameters in different units decide which
    directions nothing determines.
    """
    flat, differences, inverse = joint
    hidden = bool(found["rank"][row] == 0)
    k = len(own["estimate"])
    units = np.outer(sizes, sizes) if len(sizes) == k else np.ones((k, k))
    g = np.reshape(own["at_checks"], (-1, 3, k))[:checks].reshape(-1, k)[flat]
    if not np.isfinite(g).all() or not g.any():
        return False
    weighted = inverse @ g
    redundancy, score = g.T @ weighted, weighted.T @ differences
    if not hidden:
        # Directions without redundancy have no cofactors.
        own_part = _inverse(np.reshape(own["cofactors"], (k, k)), 1 / units)
        redundancy += own_part
        score += own_part @ own["estimate"]
    cofactors = _inverse(redundancy, units)
    estimate = cofactors @ score
    _take_over(found, row, float(score @ estimate), estimate, len(flat))
    if row < len(found["sets"]):
        own["estimate"], own["cofactors"] = estimate.tolist(), cofactors.ravel().tolist()
        return hidden
    for part, (value, own_redundancy) in enumerate(zip(score, redundancy.diagonal(), strict=True), 1):
        if k > 1 and own_redundancy > 0:
            error = value / own_redundancy
            _take_over(found, row + part, float(value * error), np.array([error]), len(flat))
    return False


def in_deviations(
    found: Facts, checks: int, joint: Joint | None, variance: float | None
) -> tuple[dict[int, float], dict[int, float], dict[int, Floats]]:
    """Return estimates of errors and the errors with known effects, both in standard deviations, and these.

    An error e has the square e' R e and, if it changes check points by G e, e' G' C^-1 G e; 0 if nothing
    tests it. Its estimate is the root of T, of several parameters of T - k + 1 (a limit of each direction).
    `variance`: the estimated variance of unit weight; None if it is known.
    """
    deviates, sizes, errors = {}, {}, {}
    squares = scores = np.zeros(len(found["effects"]))
    if joint is not None and len(squares):
        flat, differences, inverse = joint
        g = np.stack([changes[:checks].ravel()[flat] for *_, changes in found["effects"].values()])
        weighted = np.where(np.isfinite(g).all(axis=1, keepdims=True), g, 0.0) @ inverse
        squares, scores = np.nansum(weighted * g, axis=1), weighted @ differences
    for row, square, score in zip(found["effects"], squares.tolist(), scores.tolist(), strict=True):
        mdb = found["mdb"][row]
        tested = 0.0 if np.isnan(mdb[0]) else float(found["noncentrality"][row])
        own = found["sets"][row] if row < len(found["sets"]) else found["groups"].get(row, {})
        errors[row] = mdb[~np.isnan(mdb)] if tested else np.array(own.get("error", []))
        square = square if len(errors[row]) else 0.0
        statistic = np.nan_to_num(found["statistic"][row]) - max(found["rank"][row] - 1, 0)
        if variance is not None:  # Their statistics do not include check points
            statistic = statistic / variance if tested else score**2 / (square or 1.0)
        deviates[row] = math.sqrt(max(statistic, 0.0))
        sizes[row] = math.sqrt(tested + (variance or 1.0) * square)
    return deviates, sizes, errors


def correlate(found: Facts, rows: Sequence[int], checks: int, joint: Joint) -> None:
    """Correlate the scores of sets that only check points test: the largest canonical correlations.

    All redundancies G' C^-1 G are one matrix, because its blocks are small: factors of C would take longer.
    """
    if len(rows) < 2:
        return
    flat, _, inverse = joint
    changes = [np.reshape(found["sets"][row]["at_checks"], (3 * checks, -1))[flat] for row in rows]
    ends = np.cumsum([own.shape[1] for own in changes]).tolist()
    blocks = [slice(end - own.shape[1], end) for own, end in zip(changes, ends, strict=True)]
    whole = np.hstack(changes)
    redundancy = whole.T @ inverse @ whole
    white = np.zeros_like(redundancy)
    for block in blocks:
        values, vectors = np.linalg.eigh(redundancy[block, block])
        seen = values > SINGULAR * values[-1]
        white[block, block] = vectors * np.where(seen, np.where(seen, values, 1.0) ** -0.5, 0.0)
    scores = white.T @ redundancy @ white
    for (one, own), (other, its) in combinations(zip(rows, blocks, strict=True), 2):
        correlation = np.linalg.norm(scores[own, its], 2)
        found["correlations"][[one, other], [other, one]] = correlation


def _inverse(matrix: Floats, units: Floats) -> Floats:
    """Return the pseudo-inverse of a symmetric matrix, computed with elements times `units`."""
    if matrix.size == 1:  # Most sets have one parameter
        return np.divide(1.0, matrix, out=np.zeros((1, 1)), where=matrix != 0)
    return np.asarray(units * np.linalg.pinv(units * matrix, hermitian=True, rcond=SINGULAR))


def _take_over(found: Facts, row: int, statistic: float, estimate: Floats, count: int) -> None:
    """Replace the test and the estimate of a row that `count` differences of check points test as well."""
    k = len(estimate)
    found["statistic"][row], found["rank"][row] = statistic, k
    found["estimate"][row, :k] = estimate
    found["probability"][row] = math.exp(float(log_chi_square(statistic, float(k))))
    found["observations"][row] += count


MOST_WAITING = 1_000_000  # Groups of a network whose factor and inverse wait for a report

_SHARED = ("level", "power", "known", "suspects", "tests", "standing", "downweighted")


def reliability_summary(result: AdjustedNetwork) -> ReliabilitySummary | None:
    """Return the summary of a network; None without redundancy numbers or convergence."""
    computed = bool(finite_rows(result.redundancy)[result.used_images].all())
    if not (computed and result.converged and result.degrees_of_freedom > 0):
        return None
    refused = LostSupportError, _photocore.BlockError, _photocore.CollectionError
    facts, weight = result._hypothesis_facts(), "known" if result.known_weight else "unknown"
    found = errors = lost = list_groups = None
    # Other results remain valid; a network that is singular by rounding has a message already.
    with suppress(*refused):
        found = result.reliability(unit_weight=weight)
    if found is not None:
        list_groups = lists(result, found)
        errors, lost = evaluated(result, found, facts), found.downweighted
    elif result.loss is not None:
        lost = downweighted(result._trial(), result._terms, result.image_weights, result.used_images)
    if lost is not None and (found is None or lost.removed.excessive or lost.unsupported):
        # A common error may be the reason: the loss removes observations that have it.
        trial = result._trial()
        trial.out = Out(np.zeros(len(trial.deviations), dtype=bool))
        with suppress(*refused):
            level, power = DETECTION
            options: dict[str, Any] = {"level": level, "power": power, "unit_weight": weight}
            whole = Reliability(trial, result.covariances, lost, **options)
            list_groups = list_groups or lists(result, whole)
            # Check points were compared with the robust solution.
            of_whole = evaluated(result, whole, facts | {"agreement": None})
            if of_whole[0].common() or wrong_types(of_whole[1], of_whole[0].odds()):
                found, errors = found or whole, of_whole
    if found is None or errors is None or list_groups is None:
        return None
    summary = ReliabilitySummary(
        **{name: getattr(found, name) for name in _SHARED},
        list_groups=list_groups,
        hypotheses=errors[0],
        types=tuple(errors[1]),
    )
    if is_large(found):
        summary.listed  # noqa: B018
    return summary


def is_large(found: Reliability) -> bool:
    """Return whether the trial of a network ends with its hypotheses."""
    return len(found.suspects) > MOST_WAITING


def lists(result: AdjustedNetwork, found: Reliability) -> Callable[[], Listed]:
    """Return a function that lists groups for reports; of a large network they are listed now."""
    # Plan coordinates may be angles.
    list_groups = partial(listed, found, result._terms.linear_unit, heights=result.geographic)
    if not is_large(found):
        return list_groups
    done = list_groups()
    return lambda: done


def evaluated(
    result: AdjustedNetwork, found: Reliability, facts: Facts
) -> tuple[Hypotheses, list[TypeFactor]]:
    """Evaluate the hypotheses of the catalogue with some facts, and standard deviations by type."""
    known, limit = result.known_weight, result.max_bias_ratio
    standing = found.standing.sum_and_freedom if known else result.sum_and_freedom
    types = type_factors(found.trial, found.tests, limit, standing) if known else []
    parts = found.trial, found.tests, facts, result._terms.point_axes, standing, limit
    return hypotheses(*parts, known=known, last=is_large(found)), types


MOST_ROWS = 64  # Largest number of observations with an exact sum of R_ij^2
VISIBLE = 1e-6  # Least redundancy of a direction
FACTORS = 100  # Number of examined factors
FEW, WEAK = 20.0, 0.1
"""Redundancy, and mean redundancy, below which chi-square with r degrees of freedom is wrong."""


def type_factors(
    trial: NetworkTrial, tests: Tests, limit: float, standing: tuple[float, float]
) -> list[TypeFactor]:
    """Return the agreement of the standard deviations of each type.

    Images are included if the global test of their sum of squares and degrees of freedom rejects. `limit`:
    undetected factors of standard deviations that matter.
    """
    suspects, test = trial.suspects, global_test(*standing)
    images = test is not None and (test.rejected_high or test.rejected_low)
    used = tests.active & (suspects.kinds <= OBSERVATION) & (images | (suspects.kinds != IMAGE))
    found: dict[Text, list[Indices]] = {}
    for kind in np.unique(suspects.kinds[used]).tolist():
        groups = np.flatnonzero(used & (suspects.kinds == kind))
        if kind != OBSERVATION:
            found[suspects.type(kind, 0)] = [groups]
            continue
        for group in groups.tolist():
            name = suspects.type(kind, int(suspects.subjects[group]))
            found.setdefault(name, []).append(np.array([group]))
    return [_factor(trial, tests, kind, np.hstack(groups), limit) for kind, groups in found.items()]


def _factor(trial: NetworkTrial, tests: Tests, kind: Text, groups: Indices, limit: float) -> TypeFactor:
    """Return the agreement of the standard deviations of some groups."""
    suspects = trial.suspects
    own = np.zeros(len(suspects), dtype=bool)
    own[groups] = True
    rows = np.flatnonzero(np.repeat(own, np.diff(suspects.row_starts)) & np.isfinite(tests.redundancy))
    residuals, redundancy, sd = tests.residual[rows], tests.redundancy[rows], trial.deviations[rows]
    squares, r = float(np.nansum(residuals**2)), float(redundancy.sum())
    with np.errstate(divide="ignore", invalid="ignore"):
        w = np.abs(residuals) / np.sqrt(redundancy)
    w = w[np.isfinite(w) & (redundancy > TESTABLE)]
    is_control = bool(suspects.kinds[groups[0]] == CONTROL)
    equal = suspects.kinds[groups[0]] == IMAGE and len(sd) and np.ptp(sd) <= 1e-9 * sd[0]
    spread, likeliest = math.nan, None
    if len(rows) <= MOST_ROWS and r < max(FEW, WEAK * len(rows)):
        mixed = TypeFactor(kind, squares, r, spread=float(np.square(redundancy).sum()))
        # The squares of R outside the diagonal increase s.
        if squares > NOMINAL**2 * r or (is_control and mixed.undetected > limit):
            within = np.flatnonzero(np.isin(np.hstack([*map(suspects.rows, groups.tolist())]), rows))
            found = trial.core.responses(groups.tolist())[within][:, rows]
            spread, likeliest = float(np.square(found).sum()), _likeliest(found, residuals)
    return TypeFactor(
        kind,
        squares,
        r,
        median=float(np.median(w)) / MEDIAN if w.size else math.nan,
        sd=float(sd[0]) if equal else math.nan,
        unit=suspects.given.image_unit,
        spread=spread,
        likeliest=likeliest,
    )


def _likeliest(cofactors: Floats, residuals: Floats) -> tuple[float, float]:
    """Return the likeliest factor F of the standard deviations of residuals, and the gain of log L.

    Along the eigenvectors of their cofactors R, with eigenvalues mu, residuals have the variances mu + (F^2 -
    1) mu^2.
    """
    mu, vectors = np.linalg.eigh((cofactors + cofactors.T) / 2)
    seen = mu > VISIBLE
    squares = (vectors.T[seen] @ residuals) ** 2 / mu[seen]
    factors = np.geomspace(1.0, LARGEST_FACTOR, FACTORS)
    growth = 1.0 + np.multiply.outer(factors**2 - 1.0, mu[seen])
    gains = (squares * (1.0 - 1.0 / growth) - np.log(growth)).sum(axis=1) / 2
    best = int(gains.argmax())
    return float(factors[best]), float(gains[best])
