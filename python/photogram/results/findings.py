"""The findings for the verdict of an adjusted block, such as observations that were entered twice."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.arrays import chosen, finite_rows
from photogram.arguments.types import Floats, Indices
from photogram.messages import Undetermined
from photogram.network.block import Block
from photogram.results.evaluation import largest_odds
from photogram.results.fixed_tests import held_tested, how_to_calibrate
from photogram.results.hypotheses import FEWEST
from photogram.results.network import AdjustedNetwork
from photogram.results.network_tables import point_axes
from photogram.results.patterns import block_patterns
from photogram.results.tables import Tests
from photogram.statistics.findings import (
    CONTROL_POINTS,
    IMAGES,
    Findings,
    Removed,
    Systematic,
    Tested,
    Text,
    TypeFactor,
)
from photogram.statistics.limits import GlobalTest, global_test
from photogram.statistics.reliability import TESTABLE
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import Result

HARMFUL = {
    reason: Phrase(f"harmful.{reason}")
    for reason in ("ran-off", "ran-into-station", "at-station", "near-station")
}
"""Reasons of the core for excluding points that would distort others, and messages on their images."""


IN_PARALLEL = range(5_000, 1_000_000)
"""Numbers of image observations with work on two threads: fewer need less time, more need more memory."""
DISTANCES = frozenset({"c", "f", "fx", "fy"})  # Names of principal distances
CHANGED = 2.3  # Factor of standard deviations that differences of three check points detect
UNKNOWN = 1 / 3  # Largest standard deviation of a determined principal distance, relative to it


def network_findings(
    result: AdjustedNetwork,
    fixed: Sequence[Tested],
    systematic: Sequence[Systematic],
) -> Findings:
    tests, summary = Tests(result), result.reliability_summary
    test, remarks, of_summary = _whole_test(result), unseen(result), dict[str, Any]()
    lost = None if summary is None else summary.downweighted
    if summary is not None:
        errors, rivals = summary.hypotheses, largest_odds(fixed)
        if assumed := errors.assumed():
            remarks.append(Phrase("line.datum-assumed", {"errors": assumed}))
        remarks += errors.inseparable(rivals)
        of_summary = {
            "types": list(summary.types) if result.known_weight else [],
            "unchecked": [*errors.unchecked(), *_unchecked_control(result, summary.types)],
            "common": errors.common_errors(rivals),
            "of_checks": errors.of_checks(),
            "common_is_harmful": errors.common_is_harmful,
        }
    return Findings(
        status=result.status,
        observations=[
            *(tests.components if summary is None else tests.groups),
            *(each if result.known_weight else each.studentized(*result.sum_and_freedom) for each in fixed),
        ],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=test,
        odds=-math.inf if summary is None else summary.hypotheses.odds(rivals),
        untested=Phrase("untested.loss" if result.loss else "untested.freedom"),
        computed=bool(finite_rows(result.redundancy)[chosen(result.used_images)].all()),
        systematic=systematic,
        snooped=result.snooped if lost is None else lost.removed,
        robust=result.loss is not None,
        unsupported=[] if lost is None else lost.unsupported,
        remarks=remarks,
        can_snoop=True,
        **of_summary,
    )


def _unchecked_control(result: AdjustedNetwork, types: Iterable[TypeFactor]) -> list[Phrase]:
    """Return messages on undetected factors of the standard deviations of control that matter.

    Other points are wrong by at most the error of control. Check points detect a factor that changes their
    differences by more than CHANGED standard deviations.
    """
    given, limit = result.point_given_sd, result.max_bias_ratio
    weighted = (given > 0) & np.isfinite(given) & result.used_points[:, np.newaxis]
    found = [each for each in types if each.group == CONTROL_POINTS and each.undetected > limit]
    if not found or not weighted.any(axis=0).all():
        return []
    control = np.array([np.median(own[has]) for own, has in zip(given.T, weighted.T, strict=True)])
    sd = result.point_sd[result.used_points & ~weighted.any(axis=1)]
    checks = getattr(result, "check_points", None)
    shown = math.inf if checks is None or checks.agreement is None else np.nanmedian(checks.agreement.sd)
    return [
        phrase("unchecked.sd", kind=each.group, factor=each.undetected)
        for each in found
        if each.undetected * np.median(control) < CHANGED * shown
        and np.count_nonzero((each.undetected * control > limit * sd).any(axis=1)) >= FEWEST
    ]


def _whole_test(result: AdjustedNetwork) -> GlobalTest | None:
    """Return the test of all observations that a loss does not remove, with their given weights."""
    if not result.loss:
        return result.global_test
    summary = result.reliability_summary
    constrained = getattr(result, "unit_variance", "constrained") == "constrained"
    if summary is None or not result.known_weight or not constrained:
        return None
    return global_test(*summary.standing.sum_and_freedom)


def block_findings(result: Result) -> Findings:
    """Return the tests of a block; the unit weight is known."""
    # Fixed temporarily to find gross errors before the adjustment of photos.
    intersected = not result.photo_given_sd.any()
    # Data snooping requires the complete block and adjusted photos.
    tests_more = result.WHOLE and not intersected

    def residual_findings() -> tuple[Sequence[Systematic], list[Phrase]]:
        test = _whole_test(result)
        copies = duplicates(result.block, test.factor if test else 1.0)
        return [] if intersected else block_patterns(result), copies

    if len(result.image_points) in IN_PARALLEL and not result.loss:
        # The hypotheses of the summary are tested without the GIL.
        with ThreadPoolExecutor(1) as other:
            waiting = other.submit(residual_findings)
            result.reliability_summary  # noqa: B018
            systematic, copies = waiting.result()
    else:
        systematic, copies = residual_findings()
    found = network_findings(result, [] if intersected else held_tested(result), systematic)
    left_out = [
        Phrase("line.point-left-out", {"point": str(point), "reason": HARMFUL[reason]})
        for point, reason in result.dropped.items()
        if reason in HARMFUL
    ]
    checked = (result.used_points & (result.point_kinds == "check")).any()
    unproved = [] if checked else [Phrase("advice.check-points")]
    if few := int(np.count_nonzero(result.point_rays == 2)):
        fields = {"n": few, "all": int(np.count_nonzero(result.used_points))}
        unproved.append(Phrase("advice.two-rays", fields))
    set_aside = iterate = None
    if aside := result.set_aside:  # Images that the initial values removed and did not reinstate
        images = sum(getattr(name, "code", "") == "named.image" for name in aside)
        counts: dict[Text, tuple[int, int]] = {IMAGES: (images, images + len(result.image_points))}
        set_aside = Removed([{"name": name} for name in aside], counts)
    if result.status == "not converged":
        weak = any(isinstance(each, Undetermined) for each in result.messages)
        free = any(np.isinf(each.deviations).any() for each in result.block.cameras)
        code = "advice.iterate-or-fix" if weak and free else "advice.iterate"
        iterate = Phrase(code, {"n": len(result.iterations)})
    return replace(
        found,
        undetermined=left_open(result),
        checks=result.check_points.agreement,
        intersected=intersected,
        scaled=result.unit_variance != "unity",
        remarks=[*found.remarks, *left_out, *_on_checks(result)],
        duplicates=copies,
        hints=result.hints,
        exchanged=result.exchanged,
        set_aside=set_aside,
        can_snoop=tests_more,
        weigh=Phrase("how.control"),
        calibrate=how_to_calibrate(result.block),
        check=Phrase("how.check.network"),
        take_out=Phrase("advice.snoop") if tests_more else None,
        iterate=iterate,
        if_usable=unproved,
    )


def left_open(result: AdjustedNetwork) -> Sequence[Text]:
    """Return the names of undetermined or poorly determined adjusted values."""
    said = [each.what for each in result.messages if isinstance(each, Undetermined)]
    lengths = [
        phrase("named.uncertain", name=name, camera=camera.name, value=value, sd=sd)
        for camera in getattr(result, "cameras", ())
        for name, value, sd in zip(camera.names, camera.values, camera.sd, strict=True)
        if name in DISTANCES and sd > UNKNOWN * abs(value)
    ]
    return said or lengths


def _on_checks(result: Result) -> list[Phrase]:
    """Return check points with assumed sd, and reasons for missing tests."""
    checks, axes = result.check_points, point_axes(result.block)
    if len(checks.rows) and checks.agreement is None:
        return [Phrase("line.checks-untested", {"reason": checks.untested})]
    if not checks.assumed.any():
        return []
    own = zip(checks.given_sd[checks.assumed][0].tolist(), axes, strict=True)
    sizes = dict.fromkeys((value * axis.factor, axis.small) for value, axis in own)
    sd = [phrase("part.size", value=value, unit=unit) for value, unit in sizes]
    fields = {"assumed": int(checks.assumed.sum()), "n": len(checks.rows), "sd": sd}
    return [Phrase("line.checks-assumed", {**fields, "how": Phrase("how.checks")})]


def unseen(result: AdjustedNetwork) -> list[Phrase]:
    """Return the number of image coordinates without check by other observations."""
    redundancy = result.redundancy[chosen(result.used_images)]
    hidden = int(np.count_nonzero(redundancy <= TESTABLE))
    fields = {"hidden": hidden, "all": redundancy.size, "limit": TESTABLE}
    return [Phrase("line.unseen", fields)] if hidden else []


FEWEST_OF_PHOTO = 4  # Equal image observations of two photos
SHARE = 0.5  # Share of equal observations of a photo
FEWEST_OF_POINT = 2  # Equal image observations of two points
EQUAL = 0.25  # Largest differences of copies, in standard deviations of image observations
ROUNDED = 0.1  # Last digit of equal values, in standard deviations, below which they are no chance


def duplicates(block: Block, factor: float = 1.0) -> list[Phrase]:
    """Return messages on copies: photos and points with equal images, equal additional observations.

    Images are equal within their noise, additional observations in all digits. `factor` is the factor of the
    given standard deviations that the residuals indicate.
    """
    messages, repeated = [], list(_repeated(block))
    if repeated:
        messages.append(phrase("duplicates.observations", n=len(repeated), names=repeated))
    if not len(block.image_xy):
        return messages
    # A factor that is not a number does not count.
    limit = EQUAL * (factor if factor < 1.0 else 1.0) * float(np.median(block.image_sd))
    for name, owners, others, ids, fewest in (
        ("photos", block.image_photos, block.image_points, block.photo_ids, FEWEST_OF_PHOTO),
        ("points", block.image_points, block.image_photos, block.point_ids, FEWEST_OF_POINT),
    ):
        pairs = _equal_pairs(owners, others, block.image_xy, limit, fewest)
        if pairs:
            names = [phrase("part.pair", first=str(ids[i]), second=str(ids[j])) for i, j in pairs]
            messages.append(phrase(f"duplicates.{name}", n=len(names), names=names))
    return messages


def _equal_pairs(
    owners: Indices, others: Indices, xy: Floats, limit: float, fewest: int
) -> list[tuple[int, int]]:
    """Return pairs of owners whose observations are mostly equal within a limit."""
    # Sums of different coordinates on one photo, or of one point, are rarely near each other.
    keys = xy[:, 0] + xy[:, 1] / np.pi
    keys += others * (2.0 * float(np.ptp(keys)) + 1.0)
    order = np.argsort(keys)
    near = np.flatnonzero(np.diff(keys[order]) <= 2 * limit)
    first, second = order[near], order[near + 1]
    equal = (np.abs(xy[first] - xy[second]) <= limit).all(axis=1) & (others[first] == others[second])
    pairs = np.sort(np.column_stack([owners[first[equal]], owners[second[equal]]]), axis=1)
    if not len(pairs):
        return []
    found, counts = np.unique(pairs, axis=0, return_counts=True)
    sizes = np.bincount(owners, minlength=int(owners.max()) + 1)
    most = counts >= np.maximum(fewest, SHARE * sizes[found].min(axis=1))
    return [(int(i), int(j)) for i, j in found[most] if i != j]


def _repeated(block: Block) -> Iterator[str]:
    """Yield names of additional observations with the same objects and values as one before."""
    for columns in block.observations.columns:
        table, seen = columns.table, set()
        names = list(zip(table["points"], table["photos"], strict=True))
        # Observations of unknowns alone may be repeated constraints.
        if len(set(names)) == len(names) or not any(names[0]):
            continue
        times = table.get("time", [None] * len(names))
        unknowns = [tuple(map(id, row)) for row in table["unknowns"]]
        observed = map(tuple, np.asarray(table["observed"]).tolist())
        for row, key in enumerate(zip(names, unknowns, times, observed, strict=True)):
            if key not in seen:
                seen.add(key)
                continue
            sd = math.sqrt(float(np.asarray(table["precision"][row]).diagonal().max()))
            # The unit of the last decimal of the value with the most decimals; conditions have no values.
            decimals = (repr(value).partition("e")[0].partition(".")[2].rstrip("0") for value in key[3])
            if 10.0 ** -max(map(len, decimals), default=math.inf) < ROUNDED * sd:
                yield f"{columns.label} {' - '.join(key[0][0] + key[0][1])}"
