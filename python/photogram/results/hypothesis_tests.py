"""Tests of hypotheses on an adjusted network: the core, check points, odds."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import sampled
from photogram.arguments.types import Floats, Indices
from photogram.results.hypotheses import DETECTION, SHARES, WHOLE, Effect, Hypotheses
from photogram.results.hypothesis_checks import Joint, correlate, in_deviations, single_checks, with_checks
from photogram.results.network_trial import (
    IMAGE,
    NO_FACTS,
    Facts,
    NamedSuspects,
    NetworkTrial,
    Tests,
    notable,
)
from photogram.show.quantity import Axis
from photogram.statistics.findings import ALTERNATIVES, Tested

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
) -> Hypotheses:
    """Return the hypotheses of an adjusted network with the `tests` of its observations.

    `axes` are those of its points, `standing` the sum of squares and the degrees of freedom, `known` is
    whether the unit weight is known. `limit`: standard deviations from which on an undetected error of a
    point counts.
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
    found = trial.core.hypotheses(
        **core, estimated=estimated, detection=DETECTION, limit=limit, effects=EFFECTS
    )
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
    same = (
        "correlations",
        "index",
        "component",
        "probability",
        "estimate",
        "redundancy",
        "mdb",
        "bias_to_noise",
        "sets",
    )
    every = Hypotheses(
        **{name: found[name] for name in same},
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
