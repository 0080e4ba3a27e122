"""Gross errors at initial stations: photos, observations, names, control (Appendix H).

Coarse stations leave large residuals with a pattern; a break in the pattern indicates an error.
"""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.diagnosis.findings import Finding, Level, Section, finding, note
from photogram.diagnosis.robust import fit, mad_sd
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.rays import Rays, meet
from photogram.network.subset import kept_images
from photogram.results.exchanged_names import exchanged_names
from photogram.results.result import Result
from photogram.words import phrase

BAD_PHOTO = 4.0  # A bad photo exceeds the median residual of the median photo by this factor,
BAD_PHOTO_SD = 4.3
"""... and exceeds all photos by this number of robust standard deviations (of the logarithm)."""
BREAK = 10.0  # Robust standard deviations from the pattern of the photo that are a break
FLAGRANT = 24.0  # A break that is grave even if no single observation explains it
CHANCE = 2.0  # A break this many times the least one is grave with three rays as well
EXPLAINED = 0.35  # Largest part of the residuals that remains after an explanation
CONTROL_GRAVE, CONTROL_LOOK = 12.0, 6.0
"""Control differences in robust standard deviations that are reported."""
FEWEST_CONTROL = 4  # Control points that a comparison needs
FEWEST_ERRORS, ERRORS_OF_PHOTO = 5, 0.3
"""Number of gross errors, and part of its observations, above which a photo is rejected as a whole."""
CANDIDATES = 5  # Number of photos with the largest residuals that are omitted by trial
IMAGE_KINDS = ("gross-error", "exchanged-points", "name-used-twice")
"""Findings on observations that the adjusted stations may disprove."""
PARTED, FEWEST_OF_TWO = 0.1, 2
"""Largest part of the residuals, and least rays per group, if one name belongs to two points."""
AS_WELL = 3.0  # Least ratio to the remaining residual without one ray
MOST_PHOTOS = 20
MEDIAN_SIZE = 1.18  # Median length of a residual vector, in standard deviations of its components


@dataclass(frozen=True, eq=False)
class Suspects:
    """Observations that the adjustment may have to exclude."""

    images: Bools  # (m,) gross errors
    photos: Bools  # (P,) bad photos
    control: Bools  # (n,) control points far from the intersections of their rays


def gross(block: Block, unit: str = "mm") -> tuple[Section, Suspects]:
    """Find bad photos, gross errors, exchanged names, and distant control.

    `unit` is the printed unit of image coordinates.
    """
    section = Section(
        "Gross errors (intersection from the initial stations)",
        "Large patterned residuals are normal before the adjustment; a break in the pattern is an error.",
    )
    rays, photos = _bad_photos(Rays.of(block, unit=unit), section)
    findings, images = _broken(rays)
    while (photo := _overrun(rays, findings)) is not None:
        # One mistake is reported, not one per point.
        photos[photo] = True
        name, count = block.photo_ids[photo], int((rays.used & (block.image_photos == photo)).sum())
        message = phrase("check.bad-photo.points", photo=name, n=count)
        note(section, "grave", message, [name], values={"points": float(count)})
        rays = rays.without(block.image_photos == photo)
        findings, images = _broken(rays)
    section.findings += findings
    control = _control(rays.without(images), section)
    return section, Suspects(images, photos, control)


def disproved(block: Block, suspects: Suspects, adjusted: Result) -> Bools:
    """Return (m,) suspects of :func:`gross` that fit from the adjusted stations.

    A wrong station affects the intersections of its neighbours, so that good observations seem wrong.
    `adjusted` is a converged adjustment without the suspects. Photos missing in it are not in the return.
    """
    number = {name: index for index, name in enumerate(adjusted.block.photo_ids)}
    index = np.array([number.get(name, -1) for name in block.photo_ids])
    there = (index >= 0)[:, np.newaxis]
    refined = block.replace(
        photo_positions=np.where(there, adjusted.photo_positions[index], block.photo_positions),
        photo_attitudes=np.where(there, adjusted.photo_attitudes[index], block.photo_attitudes),
    )
    gone = (index < 0)[block.image_photos]
    _, wrong = _broken(Rays.of(refined).without(gone))
    return suspects.images & ~wrong & ~gone


def without(block: Block, findings: list[Finding], images: Bools) -> list[Finding]:
    """Return findings of :func:`gross` that do not depend on given observations alone."""

    def stands(finding: Finding) -> bool:
        photos = np.isin(np.array(block.photo_ids)[block.image_photos], finding.photos)
        own = photos & np.isin(np.array(block.point_ids)[block.image_points], finding.points)
        return finding.kind not in IMAGE_KINDS or not own.any() or not images[own].all()

    return [finding for finding in findings if stands(finding)]


def _overrun(rays: Rays, findings: list[Finding]) -> int | None:
    """Return the photo with too many gross errors, if any."""
    block = rays.block
    number = {name: index for index, name in enumerate(block.photo_ids)}
    shares = np.zeros(len(number))
    for error in findings:
        for name in error.photos:
            shares[number[name]] += len(error.points) / len(error.photos)
    images = np.bincount(block.image_photos[rays.used], minlength=len(number))
    overrun = (shares >= FEWEST_ERRORS) & (shares > ERRORS_OF_PHOTO * images)
    return int(np.argmax(np.where(overrun, shares / np.maximum(images, 1), 0))) if overrun.any() else None


def _bad_photos(rays: Rays, section: Section) -> tuple[Rays, Bools]:
    """Exclude the photo without which the others fit best, until none is conspicuous."""
    block = rays.block
    bad = np.zeros(len(block.photo_ids), dtype=bool)
    for step in range(MOST_PHOTOS + 1):
        medians = _medians(block, rays.intersect().sizes, rays.used)
        known = np.flatnonzero(medians > 0)
        if step == 0 and known.size:
            usual = float(np.median(medians[known]))
            section.figure("median residual of a photo", f"{usual:.4f} {rays.unit}")
        if len(known) < 4 or step == MOST_PHOTOS:
            break
        worst = _worst(rays, medians, known)
        if worst is None:
            break
        photo, usual, rays = worst
        bad[photo] = True
        name, size, unit = block.photo_ids[photo], float(medians[photo]), rays.unit
        message = phrase("check.bad-photo.residuals", photo=name, residual=size, others=usual, unit=unit)
        values = {f"median_residual_{unit}": size, "times_usual": size / usual}
        note(section, "grave", message, [name], values=values)
    return rays, bad


def _worst(rays: Rays, medians: Floats, known: Indices) -> tuple[int, float, Rays] | None:
    """Return the worst photo, and the median of the others and rays without it.

    A bad photo affects the medians of its neighbours, in a small block of all photos. So the photo is
    compared with the others after its removal.
    """
    block = rays.block
    doubtful = known[medians[known] > BAD_PHOTO * np.quantile(medians[known], 0.25)]
    tried = []
    for photo in doubtful[np.argsort(-medians[doubtful], kind="stable")][:CANDIDATES].tolist():
        without = rays.without(block.image_photos == photo)
        others = _medians(block, without.intersect().sizes, without.used)
        logs = np.log(others[others > 0])
        if len(logs) >= 3:
            tried.append((float(logs.mean()), photo, logs, without))
    if not tried:
        return None
    _, photo, logs, without = min(tried, key=lambda each: each[:2])
    middle = float(np.median(logs))
    if np.log(medians[photo]) - middle < max(np.log(BAD_PHOTO), BAD_PHOTO_SD * mad_sd(logs - middle)):
        return None
    return photo, float(np.exp(middle)), without


def _medians(block: Block, sizes: Floats, used: Bools) -> Floats:
    """(P,) median size of each photo's residuals; NaN with fewer than three."""
    rows = np.flatnonzero(used & np.isfinite(sizes))
    order = rows[np.lexsort((sizes[rows], block.image_photos[rows]))]
    photos, starts, counts = np.unique(block.image_photos[order], return_index=True, return_counts=True)
    medians = np.full(len(block.photo_ids), np.nan)
    enough = counts >= 3
    medians[photos[enough]] = sizes[order][(starts + counts // 2)[enough]]
    return medians


def _broken(rays: Rays) -> tuple[list[Finding], Bools]:
    """Find observations that break the pattern of their photo, and explain each."""
    block = rays.block
    departure = _departures(rays, rays.intersect().residuals)
    points = np.unique(block.image_points[departure > BREAK])
    rows_of = _rows_of(rays, points)
    gross = np.zeros(len(block.image_xy), dtype=bool)
    solver = _Solver(rays)
    findings, exchanged = _exchanged(rays, rows_of) if rows_of else ([], {})
    for point, rows in rows_of.items():
        if point in exchanged:
            gross[rows[block.image_photos[rows] == exchanged[point]]] = True
            continue
        explained, wrong = _explained(solver, point, rows, float(departure[rows].max()))
        findings.append(explained)
        if explained.level == "grave":
            gross[wrong] = True
    return findings, gross


def _explained(solver: _Solver, point: int, rows: Indices, departure: float) -> tuple[Finding, Indices]:
    """Find the wrong observation of a point; return the finding and the doubtful rows."""
    block = solver.rays.block
    before = solver.largest(rows, solver.met(point, []))
    left = [solver.without(point, rows, row) for row in rows.tolist()] if len(rows) > 2 else []
    unit = solver.rays.unit
    name, values = block.point_ids[point], {f"residual_{unit}": before, "departure_sd": departure}
    photos = [block.photo_ids[photo] for photo in block.image_photos[rows].tolist()]
    fields = {"point": name, "before": before, "unit": unit}
    parted = _parted(solver, point, rows, before) if len(rows) >= 2 * FEWEST_OF_TWO else None
    if parted is not None and min(left) > AS_WELL * parted[2]:
        first, second = (
            [block.photo_ids[photo] for photo in block.image_photos[group].tolist()] for group in parted[:2]
        )
        message = phrase("check.name-used-twice", **fields, first=first, second=second)
        return finding("grave", message, photos, [name], values=values), rows
    if left and min(left) < EXPLAINED * before:
        place = int(np.argmin(left))
        message = phrase("check.gross-error.one", **fields, photo=photos[place], after=min(left))
        # Any two of three rays may meet by chance: a small break does not prove an error of the third.
        proof: Level = "grave" if len(rows) > 3 or departure > CHANCE * BREAK else "look"
        return finding(proof, message, [photos[place]], [name], values=values), rows[[place]]
    message = phrase("check.gross-error.some", **fields, photos=photos)
    level: Level = "grave" if departure > FLAGRANT else "look"
    return finding(level, message, photos, [name], values=values), rows


def _parted(
    solver: _Solver, point: int, rows: Indices, before: float
) -> tuple[Indices, Indices, float] | None:
    """Return two groups of a point's rays that intersect well, and their residual."""
    best, found = PARTED * before, None
    for pair in combinations(rows.tolist(), 2):
        position = solver.met(point, rows[~np.isin(rows, pair)].tolist())
        residuals, in_front = solver.rays.residuals(np.broadcast_to(position, (len(rows), 3)), rows)
        # Rays of two points may meet anywhere, even behind the cameras, with any residual.
        sizes = np.linalg.norm(residuals, axis=1)
        near = in_front & (sizes < PARTED * min(before, float(np.nan_to_num(sizes, nan=0.0).max())))
        one, other = rows[near], rows[~near]
        if min(len(one), len(other)) < FEWEST_OF_TWO:
            continue
        left = max(
            solver.largest(one, solver.met(point, other.tolist())),
            solver.largest(other, solver.met(point, one.tolist())),
        )
        if left < best:
            best, found = left, (one, other, left)
    return found


def _departures(rays: Rays, residuals: Floats) -> Floats:
    """(m,) robust standardized distances of residuals from their photo's linear pattern."""
    block = rays.block
    rows = np.flatnonzero(rays.used & np.isfinite(residuals).all(axis=1))
    rows = rows[np.argsort(block.image_photos[rows], kind="stable")]
    photos = np.unique(block.image_photos[rows])
    bounds = np.searchsorted(block.image_photos[rows], [*photos.tolist(), len(block.photo_ids)]).tolist()
    departures = np.zeros(len(block.image_xy))
    spreads = np.zeros(len(photos))
    for index, (first, last) in enumerate(pairwise(bounds)):
        own = rows[first:last]
        xy = block.image_xy[own]
        design = np.column_stack([np.ones(len(own)), xy / 100]) if len(own) >= 8 else np.ones((len(own), 1))
        left = residuals[own] - design @ fit(design, residuals[own])
        departures[own] = np.linalg.norm(left, axis=1)
        spreads[index] = mad_sd(left)
    usual = float(np.median(spreads)) if spreads.size else 0.0
    smallest = block.image_sd.max(axis=1)
    spread = np.zeros(len(block.photo_ids))
    spread[photos] = np.maximum(spreads, usual)
    scaled: Floats = departures / np.maximum(spread[block.image_photos], smallest)
    return scaled


def _rows_of(rays: Rays, points: Indices) -> dict[int, Indices]:
    block = rays.block
    rows = np.flatnonzero(rays.used & np.isin(block.image_points, points))
    rows = rows[np.argsort(block.image_points[rows], kind="stable")]
    bounds = np.searchsorted(block.image_points[rows], [*points.tolist(), len(block.point_ids)])
    return {
        point: rows[first:last]
        for point, first, last in zip(points.tolist(), bounds, bounds[1:], strict=False)
    }


class _Solver:
    """Intersections with rays omitted."""

    def __init__(self, rays: Rays) -> None:
        self.rays = rays
        self.across, self.right = rays.equations()
        self.normal, self.constant, self.count = rays.totals()

    def largest(self, rows: Indices, position: Floats) -> float:
        """Return the largest residual of some observations for one position, millimetres."""
        residuals, _ = self.rays.residuals(np.broadcast_to(position, (len(rows), 3)), rows)
        return float(np.nan_to_num(np.linalg.norm(residuals, axis=1), nan=np.inf).max())

    def met(self, point: int, less: list[int]) -> Floats:
        """Return the position of a point without some rays."""
        normal = self.normal[point] - self.across[less].sum(axis=0)
        constant = self.constant[point] - self.right[less].sum(axis=0)
        rays = self.count[point] - len(less)
        position: Floats = meet(normal[np.newaxis], constant[np.newaxis], np.array([rays]))[0]
        return position

    def without(self, point: int, rows: Indices, row: int) -> float:
        """Return the largest residual of a point's other observations without one of them."""
        return self.largest(rows[rows != row], self.met(point, [row]))


def _exchanged(rays: Rays, rows_of: dict[int, Indices]) -> tuple[list[Finding], dict[int, int]]:
    """Find exchanged names among broken points; return findings, and the photo of each point."""
    block = rays.block
    # Before the adjustment, residuals of good images have the size of the pattern of their photo.
    sizes = rays.intersect().sizes
    usual = np.fmax(_medians(block, sizes, rays.used), np.nanmedian(sizes[rays.used])) / MEDIAN_SIZE
    alone = kept_images(block, rays.used).replace(point_sd=np.inf)
    alone = alone.replace(image_sd=np.maximum(alone.image_sd, usual[alone.image_photos, np.newaxis]))
    findings: list[Finding] = []
    found: dict[int, int] = {}
    for each in exchanged_names(alone, ~np.isin(alone.image_points, list(rows_of))):
        photo, points = each.photos[0], list(each.points)
        message = phrase("check.exchanged-points", points=points, photo=photo)
        values = {"statistic_as_named": each.as_named, "statistic_exchanged": each.exchanged}
        findings.append(finding("grave", message, [photo], points, values=values))
        found |= dict.fromkeys(map(block.point_ids.index, points), block.photo_ids.index(photo))
    return findings, found


def _control(rays: Rays, section: Section) -> Bools:
    """Compare control with intersected positions and report conspicuous differences.

    Returns (n,) the points with grave differences.
    """
    block = rays.block
    held = np.isfinite(block.point_sd)
    met = rays.intersect().positions
    control = np.flatnonzero(held.any(axis=1) & np.isfinite(met).all(axis=1))
    if not control.size:
        section.remark("no control point is intersected")
        return np.zeros(len(block.point_ids), dtype=bool)
    given = np.where(held[control], block.point_positions[control], rays.axes.from_local(met[control]))
    differences = np.where(held[control], met[control] - rays.axes.positions(given), np.nan)
    for axis, name in enumerate(("east", "north", "up") if block.geographic else ("X", "Y", "Z")):
        _control_component(block, control, differences[:, axis], name, section)
    grave = [each for each in section.findings if each.kind == "control-difference" and each.level == "grave"]
    return np.isin(block.point_ids, [name for finding in grave for name in finding.points])


def _control_component(
    block: Block, control: Indices, differences: Floats, name: str, section: Section
) -> None:
    """Report the control points whose difference in one component is conspicuous."""
    known = np.flatnonzero(np.isfinite(differences))
    if not known.size:
        return
    unit, middle = block.linear_unit, float(np.median(differences[known]))
    spread = mad_sd(differences - middle)
    section.figure(
        f"control, intersected minus given, {name}",
        f"median {middle:.3f} {unit}, spread {spread:.3f} {unit} ({len(known)} points)",
    )
    if len(known) < FEWEST_CONTROL or spread == 0:
        return
    # The spread of few points is uncertain.
    sizes = np.abs(differences[known] - middle) / spread / (1 + FEWEST_CONTROL / len(known))
    for row, size in zip(known.tolist(), sizes.tolist(), strict=True):
        if size > CONTROL_LOOK:
            point, difference = block.point_ids[control[row]], float(differences[row])
            fields = {"point": point, "axis": name, "difference": difference, "unit": unit}
            level: Level = "grave" if size > CONTROL_GRAVE else "look"
            message = phrase("check.control-difference", **fields)
            note(section, level, message, [], [point], values={f"difference_{name}": difference})
