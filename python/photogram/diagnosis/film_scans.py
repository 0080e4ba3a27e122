"""Scans that were joined of two parts: readings of one half are shifted against those of the other.

Jitter of the lines of a scanner: residuals of images in nearly the same line are alike.

With v the residuals of a photo's images in standard deviations, what is smooth over the scan taken out, r
their redundancy numbers, and sums over all pairs of images that lie within some distance across the lines
(n), or beyond it within four times as much (f: what is smooth is alike there, too),

    S = sum_n v_i v_j - q sum_f v_i v_j,    q = sum_n r_i r_j / sum_f r_i r_j
    z = S / sqrt(sum_n v_i^2 v_j^2 + q^2 sum_f v_i^2 v_j^2),    s^2 = S / sum_n r_i r_j

z is normal where errors do not know each other, and s is what lines have in common: of two images in one line
both have it, and v = R e, R about r on its diagonal.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.robust import critical
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.results.result import Result

FEWEST_OF_HALVES = 12
"""Images of a photo."""
EXPLAINED = 0.4
"""Of the sum of squares of a photo's residuals that a shift of one half explains at least."""
BEYOND = 2.0
"""Standard deviations of a reading by which halves are shifted at least."""


def seam_hints(result: Result) -> list[Message]:
    """Name the photo whose residuals have the largest step amid the scan, beside what is affine.

    Marks say little of it: a film of its own takes theirs up. Photos that overlap it show a part of it.
    """
    block, forms, found = result.block, result.film_forms, []
    used = np.isfinite(result.residuals).all(axis=1)
    for row, film in result.films:
        own = np.flatnonzero((block.image_photos == row) & used)
        if len(own) >= FEWEST_OF_HALVES:
            # Both parts meet where the middle of the photo is read.
            given = block.image_xy[own] - forms[block.photo_ids[row]].matrix[:, 0], result.residuals[own]
            found += [
                (*_step(*given, block.image_sd[own], axis), axis, row, film.readings.pitch) for axis in (0, 1)
            ]
    value, step, axis, row, pitch = max(found, default=(0.0, 0.0, 0, 0, 1.0))
    if not value > critical(4 * len(result.films)):
        return []
    halves, seam = (("left and right", "seam_column"), ("upper and lower", "seam_row"))[axis]
    unit = "mm" if pitch == 1.0 else "px"
    return [
        Message(
            f"the {halves} halves of the scan of {block.photo_ids[row]} are shifted against each other,"
            f" residuals show {step:.2g} {unit}: was the film scanned in two parts that were joined? Then"
            f" {seam} of the table photos, the line where they meet, gives each its own film"
        )
    ]


def _step(away: Floats, residuals: Floats, sd: Floats, axis: int) -> tuple[float, float]:
    """Return the test value of a step amid an axis, and the step: of x or y, the larger; 0 without.

    `away`: (n, 2) readings from the middle of the photo.
    """
    design = np.column_stack([np.ones(len(away)), away / np.abs(away).max(), np.sign(away[:, axis]) / 2])
    best = 0.0, 0.0
    for k in (0, 1):
        own = residuals[:, k] / sd[:, k]
        basis, triangle = np.linalg.qr(design / sd[:, k : k + 1])
        if abs(triangle[3, 3]) < 1e-9 * abs(triangle[0, 0]):
            continue
        gain = float(basis[:, 3] @ own)
        step = abs(gain / triangle[3, 3])
        if step > BEYOND * float(np.median(sd[:, k])) and gain**2 > EXPLAINED * float(own @ own):
            best = max(best, (abs(gain), step))
    return best


FEWEST = 20
"""Images of a photo."""
WINDOWS = tuple(0.001 * 2.0**k for k in range(7))
"""How far apart lines are, in parts of the scan."""
FAR = 2
"""So many of these on are those that are far."""
CHANCE = 1e-3
"""Of a hint where nothing is wrong."""
OTHERWISE = 2.0
"""Times by which z is larger than that of lines across: what is alike in both is no matter of lines."""
WORTH = 0.5
"""Standard deviations of a reading that lines have in common at least."""
TINY = 1e-9


@dataclass(frozen=True)
class _Found:
    """Lines of a scanner: rows (1) or columns (0), of x or y; z, s in pixels, and pixels between them."""

    z: float
    jitter: float
    lines: int
    axis: int
    within: float


def line_hints(result: Result) -> list[Message]:
    """Name scanners whose lines jitter, with the standard deviations that count it.

    Parameters
    ----------
    result
        An adjustment with covariances.
    """
    scanners: dict[int, tuple[str, list[int]]] = {}
    for row, film in result.films:
        if film.readings.pitch != 1.0:
            scanners.setdefault(id(film.scanner), (film.scanner.name, []))[1].append(row)
    limit = critical(4 * (len(WINDOWS) - FAR) * max(len(scanners), 1), CHANCE)
    said = []
    for name, rows in scanners.values():
        own = max(_of_scanner(result, rows), key=lambda each: each.z, default=None)
        if own is not None and own.z > limit:
            said.append(Message(_said(result, name, rows, own)))
    return said


def _said(result: Result, scanner: str, rows: list[int], own: _Found) -> str:
    images = np.isin(result.block.image_photos, rows)
    sd = float(np.median(result.block.image_sd[images]))
    lines, axis = ("columns", "rows")[own.lines], "xy"[own.axis]
    return (
        f"residuals in {axis} of images in nearly the same {lines} of {scanner} (within"
        f" {own.within:.0f} px) are alike by {own.jitter:.2g} px (z = {own.z:.1f}): its lines jitter, and"
        f" marks and images on one line err together; --set sd.images={np.hypot(sd, own.jitter):.2g} counts"
        " it in their standard deviations, and so does sd.fiducial_images"
    )


def _of_scanner(result: Result, rows: list[int]) -> Iterator[_Found]:
    """Yield what lines have in common, where it is more than what those across have."""
    images = _of_photos(result, rows)
    if images is None:
        return
    extent = float(np.ptp(images.xy, axis=0).max())
    # Photos lie apart: no distance reaches from one to another.
    at = images.xy + 2.0 * extent * images.photos[:, np.newaxis]
    for axis in (0, 1):
        own = images.values[:, axis], images.redundancy[:, axis]
        near = np.array(
            [[_pairs(at[:, lines], *own, window * extent) for window in WINDOWS] for lines in (0, 1)]
        )
        near, far = near[:, :-FAR], near[:, FAR:] - near[:, :-FAR]
        ratio = near[..., 2] / np.maximum(far[..., 2], TINY)
        total = near[..., 0] - ratio * far[..., 0]
        z = total / np.sqrt(np.maximum(near[..., 1] + ratio**2 * far[..., 1], TINY))
        for lines in (0, 1):
            # The narrower the distance, the less is in it that lines have not in common.
            k = int((z[lines] >= z[lines].max() / 2).argmax())
            jitter = float(np.sqrt(max(total[lines, k], 0.0) / max(near[lines, k, 2], TINY)))
            if z[lines].max() > OTHERWISE * z[1 - lines].max() and jitter > WORTH:
                yield _Found(float(z[lines].max()), images.sd * jitter, lines, axis, WINDOWS[k] * extent)


@dataclass(frozen=True, eq=False)
class _Images:
    """Images of a scanner, photo by photo."""

    photos: Indices  # (m,) and (m, 2): their photos and readings
    xy: Floats
    values: Floats  # (m, 2) residuals in standard deviations, free of what is smooth, and redundancy numbers
    redundancy: Floats
    sd: float  # The median standard deviation of a reading


def _of_photos(result: Result, rows: list[int]) -> _Images | None:
    """Return the images of those photos that have enough; None without."""
    block, residuals = result.block, result.residuals
    photos, redundancy = block.image_photos, result.redundancy
    used = np.isfinite(residuals).all(axis=1) & np.isfinite(redundancy).all(axis=1) & np.isin(photos, rows)
    used &= np.bincount(photos[used], minlength=len(block.photo_ids))[photos] >= FEWEST
    order = np.flatnonzero(used)
    order = order[np.argsort(photos[order], kind="stable")]
    if not len(order):
        return None
    xy, sd = block.image_xy[order], block.image_sd[order]
    values = residuals[order] / sd
    for own in np.split(np.arange(len(order)), np.flatnonzero(np.diff(photos[order])) + 1):
        x, y = ((xy[own] - xy[own].mean(axis=0)) / np.ptp(xy[own], axis=0).max()).T
        smooth = np.column_stack([np.ones(len(own)), x, y, x * x, x * y, y * y, x**3, y**3])
        values[own] -= smooth @ np.linalg.lstsq(smooth, values[own], rcond=None)[0]
    return _Images(photos[order], xy, values, redundancy[order], float(np.median(sd)))


def _pairs(at: Floats, values: Floats, redundancy: Floats, within: float) -> Floats:
    """Return (3,) sums over pairs within a distance: of v_i v_j, of their squares, of r_i r_j."""
    order = np.argsort(at)
    at = at[order]
    first, last = np.searchsorted(at, at - within), np.searchsorted(at, at + within, "right")
    columns = np.column_stack([values, values**2, redundancy])[order]
    behind = np.concatenate([np.zeros((1, 3)), np.cumsum(columns, axis=0)])
    found: Floats = (columns * (behind[last] - behind[first] - columns)).sum(axis=0) / 2
    return found
