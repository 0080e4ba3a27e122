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
from photogram.words import Phrase, phrase

FEWEST_OF_HALVES = 12  # Images of a photo
EXPLAINED = 0.4  # Of the sum of squares of a photo's residuals that a shift of one half explains at least
BEYOND = 2.0  # Standard deviations of a reading by which halves are shifted at least


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
    code = f"film-check.seam.{('column', 'row')[axis]}"
    unit = "mm" if pitch == 1.0 else "px"
    return [Message(phrase(code, photo=block.photo_ids[row], step=step, unit=unit))]


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


FEWEST = 20  # Images of a photo
WINDOWS = tuple(0.001 * 2.0**k for k in range(7))  # How far apart lines are, in parts of the scan
FAR = 2  # So many of these on are those that are far
CHANCE = 1e-3  # Of a hint where nothing is wrong
OTHERWISE = 2.0  # Least ratio of z along lines to z across lines
WORTH = 0.5  # Standard deviations of a reading that lines have in common at least
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
    """Name scanners whose lines jitter, with standard deviations that include the jitter."""
    scanners: dict[int, tuple[str, list[int]]] = {}
    for row, film in result.films:
        if film.readings.pitch != 1.0:
            scanners.setdefault(id(film.scanner), (film.scanner.name, []))[1].append(row)
    limit = critical(4 * (len(WINDOWS) - FAR) * max(len(scanners), 1), CHANCE)
    messages = []
    for name, rows in scanners.values():
        jitter = max(_of_scanner(result, rows), key=lambda each: each.z, default=None)
        if jitter is not None and jitter.z > limit:
            messages.append(Message(_jitter_message(result, name, rows, jitter)))
    return messages


def _jitter_message(result: Result, scanner: str, rows: list[int], found: _Found) -> Phrase:
    images = np.isin(result.block.image_photos, rows)
    return phrase(
        f"film-check.jitter.{('columns', 'rows')[found.lines]}",
        scanner=scanner,
        axis="xy"[found.axis],
        within=found.within,
        jitter=found.jitter,
        z=found.z,
        sd=float(np.hypot(np.median(result.block.image_sd[images]), found.jitter)),
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
