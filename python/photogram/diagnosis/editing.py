"""Gross errors by iterative data snooping (Appendix H, 3-sigma rule).

A gross error affects the test values of its neighbours. So only the largest of a neighbourhood is removed
before the block is adjusted again, and the others are re-evaluated.

`photogram.snoop` is not used, because it removes control as a group. Of 63 wrong observations, one in a
hundred, it removed 61; this module removes 50. With one wrong coordinate of control, however, it reported
good control and photos as grave in 16 of 200 projects, and this module in 3 (`benches/giant_check.py`,
control 5 m and 500 m). Components of control have hardly any redundancy and are tested one by one here.
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Indices
from photogram.diagnosis.adjusting import Adjuster
from photogram.diagnosis.blunders import (
    Suspect,
    control_finding,
    finding_of,
    kind_of,
    limit_of,
    tests,
    with_rivals,
)
from photogram.diagnosis.findings import Finding, Section, small_unit
from photogram.diagnosis.gross import Suspects
from photogram.diagnosis.predictions import (
    exchange,
    exchanged_pair,
    exchanged_where_rays_meet,
    freed,
    tests_of_predictions,
)
from photogram.diagnosis.robust import critical, mad_sd
from photogram.diagnosis.views import View
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.block import Block
from photogram.network.rays import Rays
from photogram.network.subset import kept_images, of_photos
from photogram.results.result import Result
from photogram.show.quantity import Axis, Quantity, Table

ROUNDS = 20  # Maximum number of adjustments
COMPARABLE = 0.4  # Smaller test values (of the largest) may be consequences
HOPELESS = 5.0
"""Spread of the test values above which photos that did not fit before the adjustment are removed.

Such an adjustment cannot disprove earlier findings either."""
EXCHANGES = 5  # Maximum number of control point pairs that are exchanged back
LOOSE = 0.01  # Standard deviation of loose control, as a part of the flying height
BLUNDER = 3.0
TWENTIETH = 1.96
SURE = 1e-4  # Probability that a good block has a grave test value
SHOWN = 20
RETURNS = 10  # Maximum number of observations that are reinstated


@dataclass
class Edited:
    """The adjustment and the removed observations."""

    first: Result | None  # The first and the last adjustment; None if it failed
    last: Result | None
    reason: str  # The reason for the failure
    spread: float  # Robust standard deviation of the last test values: 1 if the weights are correct
    section: Section  # List of gross errors
    # Findings on removed components of control, by point
    control: dict[str, list[Finding]] = field(default_factory=dict)
    # Pairs of control points with exchanged coordinates
    exchanged: list[tuple[str, str]] = field(default_factory=list)
    # Suspected control points that agree with their predictions
    cleared: list[str] = field(default_factory=list)
    asked: bool = True  # Whether an adjustment was requested

    @property
    def taken_out(self) -> int:
        """Number of observations excluded from the last adjustment."""
        return len(self.section.findings) + sum(len(each) for each in self.control.values())


def edit(block: Block, suspects: Suspects, adjusted: Adjuster) -> Edited:
    """Adjust a block and remove gross errors, the largest of a neighbourhood first.

    Suspected observations are excluded from the beginning. Suspected photos are excluded if the block does
    not fit with them, suspected control until its prediction confirms it. Control points that agree with each
    other's predictions are exchanged, and the search restarts.
    """
    found = _edited(block, suspects, adjusted)
    if not suspects.control.any() or not found.control:
        return found
    # Joint removal reduces the redundancy that distinguishes wrong control from other control.
    none = np.zeros_like(suspects.control)
    plain = _edited(block, replace(suspects, control=none), adjusted)
    usable = plain.last is not None and plain.last.converged and plain.spread < HOPELESS
    if not usable or plain.taken_out >= found.taken_out:
        return found
    left = [block.point_ids[point] for point in np.flatnonzero(suspects.control).tolist()]
    return replace(plain, cleared=[name for name in left if name not in plain.control])


def _edited(block: Block, suspects: Suspects, adjusted: Adjuster) -> Edited:
    section = blunder_section()
    current = kept_images(block, ~suspects.images)
    left = np.flatnonzero(suspects.control)
    exchanged: list[tuple[str, str]] = []
    try:
        first = adjusted.tried(current) if left.size else None
        while True:
            section = blunder_section()
            start, fewer = _first(freed(current, left), suspects.photos, adjusted, section)
            first = first or start
            if not start.converged and not exchanged:
                pair = exchanged_where_rays_meet(current)
                if pair is not None and adjusted(exchange(current, *pair)).converged:
                    exchanged.append(_names(block, pair))
                    current, left = exchange(current, *pair), np.setdiff1d(left, pair)
                    continue
                left = np.union1d(left, _gross_control(fewer, adjusted))
                start = adjusted(freed(fewer, left))
                fewer = start.block
            last, spread, control = _snoop(start, fewer, adjusted, section)
            doubtful = np.union1d(left, [block.point_ids.index(name) for name in control]).astype(np.int64)
            pair = _exchanged(last, current, doubtful, spread, adjusted) if last.converged else None
            if pair is None or len(exchanged) == EXCHANGES:
                break
            exchanged.append(_names(block, pair))
            current, left = exchange(current, *pair), np.setdiff1d(left, pair)
        cleared: list[str] = []
        if left.size and last.converged:
            last, spread = _judged(last, current, left, spread, adjusted, section, control)
            cleared = [block.point_ids[point] for point in left if block.point_ids[point] not in control]
    except AdjustmentError as error:
        return Edited(None, None, str(error), float("nan"), section)
    if last.converged:
        last = _returned(last, current, section, spread, adjusted)
    _list(last, spread, section)
    limit = _grave(last, spread)
    section.findings = _graded(section.findings, limit)
    control = {name: _graded(findings, limit) for name, findings in control.items()}
    return Edited(first, last, "", spread, section, control, exchanged, cleared)


def _names(block: Block, pair: tuple[int, int]) -> tuple[str, str]:
    return block.point_ids[pair[0]], block.point_ids[pair[1]]


def _gross_control(block: Block, adjusted: Adjuster) -> Indices:
    """Return wrong control points of a block that only converges with loose control.

    With standard deviations of a hundredth of the flying height, control causes no strain, and much larger
    errors become visible.
    """
    rays = Rays.of(View.of(block).seen)
    away = np.linalg.norm(
        rays.intersect().positions[rays.block.image_points] - rays.centres[rays.block.image_photos], axis=1
    )
    if not np.isfinite(away).any():
        return np.empty(0, dtype=np.int64)
    loose = LOOSE * float(np.nanmedian(away))
    per_unit = np.array([block.spheroid.a, block.spheroid.a, 1.0] if block.spheroid else [1.0] * 3)
    held = np.isfinite(block.point_sd)
    relaxed = block.replace(point_sd=np.where(held, np.maximum(block.point_sd, loose / per_unit), np.inf))
    first = adjusted.tried(relaxed)
    if first is None:
        return np.empty(0, dtype=np.int64)
    _, _, control = _snoop(first, relaxed, adjusted, blunder_section())
    return np.array([block.point_ids.index(name) for name in control], dtype=np.int64)


def _exchanged(
    result: Result, given: Block, points: Indices, spread: float, adjusted: Adjuster
) -> tuple[int, int] | None:
    """Find an exchanged pair among doubtful control points."""
    points = points[np.isfinite(given.point_sd[points]).any(axis=1) & result.used_points[points]]
    if len(points) < 2:
        return None
    if np.isfinite(result.block.point_sd[points]).any():
        without = adjusted.tried(freed(result.block, points))
        if without is None:
            return None
        result = without
    return exchanged_pair(result, given, points, spread) if result.converged else None


def _judged(
    result: Result,
    given: Block,
    points: Indices,
    spread: float,
    adjusted: Adjuster,
    section: Section,
    control: dict[str, list[Finding]],
) -> tuple[Result, float]:
    """Restore removed control that agrees with its prediction, and report the rest."""
    errors, tests = tests_of_predictions(result, given, points, spread)
    limit = critical(int(np.isfinite(given.point_sd).sum()))
    point_sd = result.block.point_sd.copy()
    for row, error, test in zip(points.tolist(), errors, np.abs(tests), strict=True):
        for axis in np.flatnonzero(test > limit).tolist():
            finding = control_finding(given, row, axis, float(error[axis]), float(test[axis]) * spread)
            control.setdefault(given.point_ids[row], []).append(finding)
        fits = test <= limit
        point_sd[row, fits] = given.point_sd[row, fits]
    if (point_sd == result.block.point_sd).all():
        return result, spread
    held = result.block.replace(point_sd=point_sd)
    last, spread, more = _snoop(adjusted(held), held, adjusted, section)
    for name, findings in more.items():
        control.setdefault(name, []).extend(findings)
    return last, spread


def blunder_section() -> Section:
    """Return an empty list of gross errors."""
    return Section(
        "Blunders (adjustment, 3-sigma rule)",
        "A residual beyond three of its standard deviations is suspect; what is taken out is named below.",
    )


def _first(block: Block, bad: Bools, adjusted: Adjuster, section: Section) -> tuple[Result, Block]:
    """Adjust with all photos, or without the bad photos that prevent a fit."""
    error = None
    if not bad.any():
        return adjusted(block), block
    try:
        result = adjusted(block)
        if result.converged and mad_sd(result.standardized) < HOPELESS:
            photos = np.flatnonzero(bad)
            own = [mad_sd(result.standardized[block.image_photos == photo]) for photo in photos]
            bad = np.zeros_like(bad)
            bad[photos[[not size < HOPELESS for size in own]]] = True
            if not bad.any():
                return result, block
    except AdjustmentError as caught:
        error = caught
    fewer = of_photos(block, ~bad)
    names = [name for name, of in zip(block.photo_ids, bad.tolist(), strict=True) if of]
    section.remark(f"adjusted without the photos that do not fit: {', '.join(names)}")
    if error is not None:
        section.remark(f"with them: {error}")
    return adjusted(fewer), fewer


def _snoop(
    first: Result, block: Block, adjusted: Adjuster, section: Section
) -> tuple[Result, float, dict[str, list[Finding]]]:
    result = first
    control: dict[str, list[Finding]] = {}
    for step in range(ROUNDS):
        spread = max(mad_sd(result.standardized), np.finfo(np.float64).tiny)
        suspects = _largest(result, spread)
        if not suspects or not result.converged or step == ROUNDS - 1:
            break
        for suspect in suspects:
            finding = finding_of(result, suspect, spread)
            if suspect.kind == "control":
                control.setdefault(finding.points[0], []).append(
                    with_rivals(finding, result, suspect, spread)
                )
            else:
                section.findings.append(finding)
        block = _without(result, suspects)
        try:
            result = adjusted(block)
        except AdjustmentError as error:
            section.remark(f"without these it cannot be adjusted: {error}")
            break
    return result, spread, control


def _largest(result: Result, spread: float) -> list[Suspect]:
    """Return the largest observations of neighbourhoods beyond the critical value."""
    values = tests(result)
    limit = limit_of(values) * spread
    beyond = [
        Suspect(kind, int(row), int(axis), float(each[row, axis]))
        for kind, each in values.items()
        for row, axis in np.argwhere(each > limit)
    ]
    beyond.sort(key=lambda each: -each.test)
    if not beyond or beyond[0].kind != "image":
        # An error of control or of a station affects distant test values: it is removed alone.
        return beyond[:1]
    taken: list[Suspect] = []
    photos: set[int] = set()
    points: set[int] = set()
    for suspect in beyond:
        if suspect.kind != "image" or suspect.test < COMPARABLE * beyond[0].test:
            break
        photo = int(result.block.image_photos[suspect.row])
        point = int(result.block.image_points[suspect.row])
        if photo not in photos and point not in points:
            taken.append(suspect)
            photos.add(photo)
            points.add(point)
    return taken


def _without(result: Result, suspects: list[Suspect]) -> Block:
    block = result.block
    point_sd = block.point_sd.copy()
    station_sd = np.hstack([block.photo_position_sd, block.photo_attitude_sd])
    kept = np.ones(len(block.image_xy), dtype=bool)
    gone: set[int] = set()
    for suspect in suspects:
        if suspect.kind == "image":
            kept[suspect.row] = False
        elif suspect.kind == "control":
            point_sd[suspect.row, suspect.axis] = np.inf
        elif suspect.kind == "station":
            station_sd[suspect.row, suspect.axis] = np.inf
        else:
            gone.add(int(kind_of(result, suspect).rows[suspect.row]))
    changed = block.replace(
        point_sd=point_sd,
        photo_position_sd=station_sd[:, :3],
        photo_attitude_sd=station_sd[:, 3:],
        observations=[each for row, each in enumerate(block.observations) if row not in gone],
    )
    return kept_images(changed, kept)


def _returned(result: Result, whole: Block, section: Section, spread: float, adjusted: Adjuster) -> Result:
    """Reinstate observations that fit after the removal of gross errors nearby.

    They are tried one by one, in the order of their test values. The one with the largest test value is the
    gross error itself.
    """
    blunders = sorted(
        (each for each in section.findings if each.kind == "blunder"),
        key=lambda each: each.values["test_value"],
    )
    for finding in blunders[:-1][:RETURNS]:
        photo, point = whole.photo_ids.index(finding.photos[0]), whole.point_ids.index(finding.points[0])
        row = int(np.flatnonzero((whole.image_photos == photo) & (whole.image_points == point))[0])
        block = result.block
        number = block.photo_ids.index(finding.photos[0])
        if ((block.image_photos == number) & (block.image_points == point)).any():
            # The observation is already reinstated: both its coordinates were named.
            section.findings.remove(finding)
            continue
        back = block.replace(
            image_photos=np.append(block.image_photos, number),
            image_points=np.append(block.image_points, point),
            image_xy=np.vstack([block.image_xy, whole.image_xy[[row]]]),
            image_sd=np.vstack([block.image_sd, whole.image_sd[[row]]]),
        )
        tried = adjusted.converged(back)
        if tried is None or not tried.used_images[-1]:
            continue
        values = tests(tried)
        limit = limit_of(values) * spread
        others = values["image"][block.image_points.size :]
        on_point = values["image"][tried.block.image_points == point]
        if others.any() and on_point.max() < limit:
            section.findings.remove(finding)
            result = tried
    return result


def _grave(result: Result, spread: float) -> float:
    """Return the test value above which a finding is grave.

    If errors have heavier tails than normal ones, the 95 % quantile (1.96 sd) defines the spread.
    """
    values = tests(result)
    images = values["image"][values["image"] > 0]
    tail = float(np.quantile(images, 0.95)) / TWENTIETH if images.size else spread
    return limit_of(values, SURE) * max(spread, tail)


def _graded(findings: list[Finding], limit: float) -> list[Finding]:
    """Grade findings: grave if their test value exceeds a limit."""
    return [
        replace(each, level="grave" if each.values["test_value"] > limit else "look") for each in findings
    ]


def _list(result: Result, spread: float, section: Section) -> None:
    """List test values beyond 3 after all removals, the largest ones, and their number."""
    values = tests(result)["image"] / spread
    tested = int((values > 0).sum())
    images, axes = np.nonzero(values > BLUNDER)
    section.figure("robust spread of the test values", f"{spread:.3f} (1 when the weights are right)")
    section.figure(
        f"image coordinates beyond {BLUNDER:g} times the spread",
        f"{len(images)} of {tested} tested ({0.0027 * tested:.0f} to be expected)",
    )
    if not len(images):
        return
    block = result.block
    unit, factor = small_unit(block.image_unit)
    order = np.argsort(-values[images, axes], kind="stable")[:SHOWN]
    rows, axis = images[order], axes[order]
    residuals, redundancy = factor * result.residuals[rows, axis], result.redundancy[rows, axis]
    photos, points = block.image_photos[rows].tolist(), block.image_points[rows].tolist()
    small = (Axis.of("", unit),)
    columns = [
        Quantity([block.photo_ids[photo] for photo in photos], kind="name", head="Photo"),
        Quantity([block.point_ids[point] for point in points], kind="name", head="Point"),
        Quantity(["xy"[k] for k in axis], kind="name", head="Axis"),
        Quantity(residuals, small, "deviation", head="Residual", decimals=1),
        Quantity(redundancy, head="Redundancy", decimals=3),
        Quantity(values[rows, axis], head="Test value", decimals=2),
        Quantity(residuals / redundancy, small, "deviation", head="Error", decimals=1),
    ]
    note = "The error is the gross error that would explain the residual."
    section.parts.append(Table("", "Largest test values of the other observations", columns, note))
