"""What the verdict on an adjusted block rests on."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from photogram.arguments.arrays import chosen, finite_rows
from photogram.messages import Undetermined, counted
from photogram.results.axes import point_axes
from photogram.results.fixed_tests import fall_by_lens, held_tested, how_to_calibrate
from photogram.results.network import AdjustedNetwork
from photogram.results.network_trial import KINDS, OBSERVATION
from photogram.results.observation_rows import tested_singly
from photogram.results.patterns import CameraImages, patterns
from photogram.results.reliability_summary import ReliabilitySummary
from photogram.results.result import Result
from photogram.results.suspects import observations_of_core
from photogram.show.methods import findings_of
from photogram.statistics.findings import Findings, Removed, Systematic, Tested, by_f
from photogram.statistics.reliability import TESTABLE

ROBUST = "a robust loss changes the weights"
"""Why there is no global test with one."""


HARMFUL = {
    "its rays do not meet: it ran off": "its rays do not meet before the cameras",
    "ran into the station of a photo": "its rays lead to the station of one of its photos",
    "given at the place of a station that sees it": "it is given at the place of a station that sees it",
    "given beside a station that sees it, and its images do not fit": "it is given beside a station",
}
"""Why a point was left out because of which the others would be wrong, and what that says of its images."""


DISTANCES = frozenset({"c", "f", "fx", "fy"})
"""What principal distances are called."""
UNKNOWN = 1 / 3
"""A principal distance whose standard deviation is a larger part of it might be any."""


def network_findings(
    result: AdjustedNetwork,
    held: Iterable[Tested],
    systematic: Sequence[Systematic],
    labels: Sequence[str] = (),
) -> Findings:
    """Return the tests that every network has: with those of what is held, and of patterns.

    `labels` are those of the observations beside images, in the order of the core.
    """
    unit_weight = None if result.KNOWN else result.sum_and_freedom
    return Findings(
        status=result.status,
        observations=[
            *(
                tested_singly(result)
                if result.reliability_summary is None  # a loss has changed the weights
                else groups_tested(result.reliability_summary, labels, unit_weight)
            ),
            *(each if unit_weight is None else by_f(each, *unit_weight) for each in held),
        ],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=None if result.loss else result.global_test,
        untested=ROBUST if result.loss else "no degrees of freedom",
        computed=has_redundancy(result),
        systematic=systematic,
        snooped=result.snooped,
        remarks=unseen(result),
        snoop="--snoop (photogram.snoop)",
    )


@findings_of.register(Result)
def block_findings(result: Result) -> Findings:
    """Return the tests of a block: standard deviations are given, so the unit weight is known."""
    # Held to look for blunders before the photos are adjusted: nobody takes these places for true.
    intersected = not result.photo_given_sd.any()
    # Data snooping needs the whole block and adjusted photos.
    tests_more = result.WHOLE and not intersected
    labels = [each.label for each in observations_of_core(result.block)]
    found = network_findings(
        result, [] if intersected else held_tested(result), [] if intersected else _patterns(result), labels
    )
    return replace(
        found,
        undetermined=left_open(result),
        checks=result.check_points.agreement,
        intersected=intersected,
        scaled=result.unit_variance != "unity",
        remarks=[*found.remarks, *_left_out(result), *_on_checks(result)],
        hints=result.hints,
        exchanged=result.exchanged,
        set_aside=_set_aside(result),
        snoop=found.snoop if tests_more else "",
        weigh="--sd control=...",
        calibrate=how_to_calibrate(result.block),
        check="`photogram check` (`photogram.diagnose`)",
        take_out=""
        if not tests_more
        else "`--snoop` (`photogram.snoop`) takes gross errors out one after the other, and says which cannot"
        " be told apart.",
        iterate=_iterated(result),
        if_usable=_unproved(result),
    )


def _iterated(result: Result) -> str:
    """Return how to end iterations that ran out; nothing for other ends."""
    if result.status != "not converged":
        return ""
    more = f"Allow more iterations than {len(result.iterations)}: `--iterations N` (`max_iterations=N`)"
    weak = any(isinstance(each, Undetermined) for each in result.messages)
    if not weak or not any(np.isinf(each.deviations).any() for each in result.block.cameras):
        return f"{more}."
    return f"{more}, or leave weak parameters of cameras out of `--self-calibrate`."


def _unproved(result: Result) -> list[str]:
    """Say what nothing proves of a block: its accuracy without check points, points with two rays."""
    found = []
    if not (result.used_points & (result.point_kinds == "check")).any():
        found.append(
            "There are no check points. Leave some control out (no standard deviation), and compare it:"
            " that is the only independent proof of the accuracy."
        )
    if few := int(np.count_nonzero(result.point_rays == 2)):
        found.append(
            f"{few} of {np.count_nonzero(result.used_points)} points have two rays only: an error"
            " across the base shows, one along it does not."
        )
    return found


def left_open(result: AdjustedNetwork) -> list[str]:
    """Name what the adjusted values leave undetermined, or determine no better than that it is there."""
    said = [each.what for each in result.messages if isinstance(each, Undetermined)]
    lengths = [
        f"{name} of {camera.name}, {value:.6g} with a standard deviation of {sd:.3g}"
        for camera in getattr(result, "cameras", ())
        for name, value, sd in zip(camera.names, camera.values, camera.sd, strict=True)
        if name in DISTANCES and sd > UNKNOWN * abs(value)
    ]
    return said or lengths


def _set_aside(result: Result) -> Removed | None:
    """Return what the first values took out and has not returned; none of the images left is among it."""
    if not result.set_aside:
        return None
    images = sum(name.startswith("image") for name in result.set_aside)
    return Removed(
        [{"name": name} for name in result.set_aside], images / max(images + len(result.image_points), 1)
    )


def _left_out(result: Result) -> list[str]:
    """Say which points were left out because one of their images must be wrong."""
    return [
        f"point {point} is left out, one of its images must be wrong: {HARMFUL[reason]}"
        for point, reason in result.dropped.items()
        if reason in HARMFUL
    ]


def _on_checks(result: Result) -> list[str]:
    """Say which check points are tested with what nobody has given, and why they are not tested."""
    checks, axes = result.check_points, point_axes(result.block)
    if not len(checks.rows):
        return []
    if checks.agreement is None:
        return [f"check points are not tested: {checks.untested}"]
    if not checks.assumed.any():
        return []
    own = zip(checks.given_sd[checks.assumed][0].tolist(), axes, strict=True)
    assumed = " and ".join(dict.fromkeys(f"{value * axis.factor:.2g} {axis.small}" for value, axis in own))
    return [
        f"standard deviations of {checks.assumed.sum()} of {counted(len(checks.rows), 'check point')} are not"
        f" given: those of control are assumed ({assumed}); --sd check=... says how good they are"
    ]


def _patterns(result: Result) -> list[Systematic]:
    block, photos = result.block, len(result.block.photo_ids)
    cameras = [CameraImages("the camera", np.ones(photos, dtype=bool), 0)]
    if block.photo_cameras is not None:
        cameras = [
            CameraImages(each.name, block.photo_cameras == row, int(np.count_nonzero(each.information)))
            for row, each in enumerate(result.cameras)
        ]
    axes = [axis.name for axis in point_axes(block)]
    return patterns(result, cameras, axes, lambda own: fall_by_lens(result, own))


def has_redundancy(result: AdjustedNetwork) -> bool:
    """Return whether redundancy numbers were computed, without which no observation is tested."""
    return bool(finite_rows(result.redundancy)[chosen(result.used_images)].all())


def unseen(result: AdjustedNetwork) -> list[str]:
    """Say how many image coordinates no other observation checks."""
    redundancy = result.redundancy[chosen(result.used_images)]
    hidden = int(np.count_nonzero(redundancy <= TESTABLE))
    if not hidden:
        return []
    return [
        f"errors of {hidden} of {redundancy.size} image coordinates would not show in their residuals"
        f" (redundancy below {TESTABLE:g})"
    ]


PLURALS = {
    "image": "images",
    "control": "control points",
    "position": "positions of photos",
    "attitude": "attitudes of photos",
    "camera": "cameras",
    "unknown": "common unknowns",
}
"""What the kinds are called; those of observations beside images have labels."""


def groups_tested(
    summary: ReliabilitySummary, labels: Sequence[str] = (), unit_weight: tuple[float, float] | None = None
) -> list[Tested]:
    """Return the tests of all groups, kind by kind.

    `labels` are those of the observations beside images, in the order of the core, `unit_weight` the weighted
    sum of squares and the degrees of freedom where that is estimated; None where it is known.
    """
    suspects, tests = summary.suspects, summary.tests
    testable = summary.testable
    found = []
    for kind, name in enumerate(KINDS):
        own = np.flatnonzero(suspects.kinds == kind)
        parts = [(PLURALS.get(name, name), own)]
        if kind == OBSERVATION:
            named = np.array(labels, dtype=object)[suspects.subjects[own]]
            parts = [(f"observations of the kind {each}", own[named == each]) for each in sorted(set(labels))]
        for what, groups in parts:
            if not testable[groups].any():
                continue
            values = np.where(testable[groups], tests.statistic[groups], math.nan)
            tested = Tested(what, values, _named(summary, groups), "T", tests.rank[groups].astype(np.float64))
            found.append(tested if unit_weight is None else by_f(tested, *unit_weight))
    return found


def _named(summary: ReliabilitySummary, groups: np.ndarray) -> Callable[[tuple[int, ...]], str]:
    return lambda place: summary.suspects.name(int(groups[place[0]]))
