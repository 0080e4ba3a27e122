"""Scans that were joined of two parts, and jitter of scan lines.

Readings of one half of a joined scan are shifted against the other half. With jitter, the residuals in nearly
the same scan line are correlated. Let v be the residuals of a photo in standard deviations, reduced by a
smooth function over the scan, and r their redundancy numbers. Sums are over all pairs within some distance
across the lines (n), or between it and four times that distance (f, where smooth effects are still similar):

    S = sum_n v_i v_j - q sum_f v_i v_j,    q = sum_n r_i r_j / sum_f r_i r_j
    z = S / sqrt(sum_n v_i^2 v_j^2 + q^2 sum_f v_i^2 v_j^2),    s^2 = S / sum_n r_i r_j

z is normal if errors are independent. s is the common error of a line: two observations in one line share it,
and v = R e with about r on the diagonal of R.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.tested_values import FOUND
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.results.result import Result
from photogram.statistics.limits import normal_limit
from photogram.words import Phrase, phrase

FEWEST_OF_HALVES = 12  # Observations of a photo
EXPLAINED = 0.4  # Least part of a photo's sum of squares that a shift of one half explains
BEYOND = 2.0  # Least shift between halves, in standard deviations of a reading


def seam_hints(result: Result) -> list[Message]:
    """Report the photo with the largest step of residuals in the middle of the scan.

    An affine deformation is estimated together with the step. Marks hardly show the step, because the film
    parameters absorb it. Overlapping photos show a part of it.
    """
    block, forms, found = result.block, result.film_forms, []
    used = np.isfinite(result.residuals).all(axis=1)
    for row, film in result.films:
        own = np.flatnonzero((block.image_photos == row) & used)
        if len(own) >= FEWEST_OF_HALVES:
            # The two parts join at the middle of the photo.
            given = block.image_xy[own] - forms[block.photo_ids[row]].matrix[:, 0], result.residuals[own]
            found += [
                (*_step(*given, block.image_sd[own], axis), axis, row, film.readings.pitch) for axis in (0, 1)
            ]
    value, step, axis, row, pitch = max(found, default=(0.0, 0.0, 0, 0, 1.0))
    if not value > normal_limit(4 * len(result.films), FOUND):
        return []
    code = f"film-check.seam.{('column', 'row')[axis]}"
    unit = "mm" if pitch == 1.0 else "px"
    return [Message(phrase(code, photo=block.photo_ids[row], step=step, unit=unit))]


def _step(away: Floats, residuals: Floats, sd: Floats, axis: int) -> tuple[float, float]:
    """Return the test value of a step, and the larger step of x or y; 0 if not significant.

    `away` are (n, 2) readings relative to the middle of the photo.
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


FEWEST = 20  # Observations of a photo
WINDOWS = tuple(0.001 * 2.0**k for k in range(7))  # Distances between lines, as parts of the scan
FAR = 2  # Number of windows between near and far distances
CHANCE = 1e-3  # Probability of a hint in correct data
OTHERWISE = 2.0  # Least ratio of z along lines to z across lines
WORTH = 0.5  # Least common error of a line, in standard deviations of a reading
TINY = 1e-9


@dataclass(frozen=True)
class _Found:
    """Jitter along rows (1) or columns (0) of x or y: z, s and distance in pixels."""

    z: float
    jitter: float
    lines: int
    axis: int
    within: float


def line_hints(result: Result) -> list[Message]:
    """Name scanners with jittering lines, with standard deviations that include it."""
    scanners: dict[int, tuple[str, list[int]]] = {}
    for row, film in result.films:
        if film.readings.pitch != 1.0:
            scanners.setdefault(id(film.scanner), (film.scanner.name, []))[1].append(row)
    limit = normal_limit(4 * (len(WINDOWS) - FAR) * max(len(scanners), 1), CHANCE)
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
    """Yield the jitter of lines if it exceeds the correlation across the lines."""
    images = _of_photos(result, rows)
    if images is None:
        return
    extent = float(np.ptp(images.xy, axis=0).max())
    # Offsets separate the photos: no distance reaches from one to another.
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
            # A smaller distance contains fewer pairs of different lines.
            k = int((z[lines] >= z[lines].max() / 2).argmax())
            jitter = float(np.sqrt(max(total[lines, k], 0.0) / max(near[lines, k, 2], TINY)))
            if z[lines].max() > OTHERWISE * z[1 - lines].max() and jitter > WORTH:
                yield _Found(float(z[lines].max()), images.sd * jitter, lines, axis, WINDOWS[k] * extent)


@dataclass(frozen=True, eq=False)
class _Images:
    """Observations of a scanner, photo by photo."""

    photos: Indices  # (m,) photos and (m, 2) readings
    xy: Floats
    values: Floats  # (m, 2) residuals in sd, reduced by a smooth function, and redundancy numbers
    redundancy: Floats
    sd: float  # Median standard deviation of a reading


def _of_photos(result: Result, rows: list[int]) -> _Images | None:
    """Return the observations of the photos that have enough; None without."""
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
    """Return (3,) sums over pairs within a distance: v_i v_j, squares, r_i r_j."""
    order = np.argsort(at)
    at = at[order]
    first, last = np.searchsorted(at, at - within), np.searchsorted(at, at + within, "right")
    columns = np.column_stack([values, values**2, redundancy])[order]
    behind = np.concatenate([np.zeros((1, 3)), np.cumsum(columns, axis=0)])
    found: Floats = (columns * (behind[last] - behind[first] - columns)).sum(axis=0) / 2
    return found
