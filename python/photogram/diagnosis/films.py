"""Mistakes of scanned films: scans that were joined of two parts, jitter of lines, misfitting fiducial marks.

Readings of one half of a joined scan are shifted against the other half. With jitter, the residuals in nearly
the same scan line are correlated. Let v be the residuals of a photo in standard deviations, reduced by a
smooth function over the scan, and r their redundancy numbers. Sums are over all pairs within some distance
across the lines (n), or between it and four times that distance (f, where smooth effects are still similar):

    S = sum_n v_i v_j - q sum_f v_i v_j,    q = sum_n r_i r_j / sum_f r_i r_j
    z = S / sqrt(sum_n v_i^2 v_j^2 + q^2 sum_f v_i^2 v_j^2),    s^2 = S / sum_n r_i r_j

z is normal if errors are independent. s is the common error of a line: two observations in one line share it,
and v = R e with about r on the diagonal of R.

Marks of all photos, of a photo, or a reading misfit. Films that have changed along one axis but are modelled
as conformal leave a pattern at the marks. If residuals are too large, the block is adjusted with free b1 and
b2 of these films. Along the axis at atan2(b2, b1)/2 a film is longer by 2 sqrt(b1^2 + b2^2) than across.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from photogram.arguments.arrays import by_key
from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.mistakes import MOST, Adjuster, omega
from photogram.diagnosis.tested_values import FOUND
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.films import Film, Mark
from photogram.network.observations import Fiducial, KnownTogether
from photogram.results.fixed_tests import is_suspected
from photogram.results.result import Result
from photogram.statistics.distributions import critical_chi_square
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
    block, forms, found = result.block, result.film_forms, [(0.0, 0.0, 0, 0, 1.0)]
    used = np.isfinite(result.residuals).all(axis=1)
    for row, film in result.films:
        own = np.flatnonzero((block.image_photos == row) & used)
        if len(own) >= FEWEST_OF_HALVES:
            # The two parts join at the middle of the photo.
            away = block.image_xy[own] - forms[block.photo_ids[row]].matrix[:, 0]
            for axis, k in product((0, 1), (0, 1)):
                jump = _step(away, axis, result.residuals[own, k], block.image_sd[own, k])
                found.append((*jump, axis, row, film.readings.pitch))
    value, step, axis, row, pitch = max(found)
    if not value > normal_limit(4 * len(result.films), FOUND):
        return []
    fields = {"photo": block.photo_ids[row], "step": step, "unit": "mm" if pitch == 1.0 else "px"}
    return [Message(phrase(f"film-check.seam.{('column', 'row')[axis]}", **fields))]


def _step(away: Floats, axis: int, residuals: Floats, sd: Floats) -> tuple[float, float]:
    """Return the test value of a step of x or y, and the step; 0 if not significant.

    `away` are (n, 2) readings relative to the middle of the photo.
    """
    design = np.column_stack([np.ones(len(away)), away / np.abs(away).max(), np.sign(away[:, axis]) / 2])
    values = residuals / sd
    basis, triangle = np.linalg.qr(design / sd[:, np.newaxis])
    gain, size = abs(float(basis[:, 3] @ values)), abs(float(triangle[3, 3]))
    known = size >= 1e-9 * abs(triangle[0, 0]) and gain > BEYOND * float(np.median(sd)) * size
    return (gain, gain / size) if known and gain**2 > EXPLAINED * float(values @ values) else (0.0, 0.0)


FEWEST_OF_LINES = 20  # Observations of a photo
WINDOWS = tuple(0.001 * 2.0**k for k in range(7))  # Distances between lines, as parts of the scan
FAR = 2  # Number of windows between near and far distances
CHANCE = 1e-3  # Probability of a hint in correct data
OTHERWISE = 2.0  # Least ratio of z along lines to z across lines
WORTH = 0.5  # Least common error of a line, in standard deviations of a reading
TINY = 1e-9


def line_hints(result: Result) -> list[Message]:
    """Name scanners with jittering lines, with standard deviations that include it."""
    scanners: dict[int, tuple[str, list[int]]] = {}
    for row, film in result.films:
        if film.readings.pitch != 1.0:
            scanners.setdefault(id(film.scanner), (film.scanner.name, []))[1].append(row)
    limit = normal_limit(4 * (len(WINDOWS) - FAR) * max(len(scanners), 1), CHANCE)
    messages = []
    for name, rows in scanners.values():
        found = max(_of_scanner(result, rows), key=lambda each: each[1]["z"], default=None)
        if found is not None and found[1]["z"] > limit:
            fields = {"scanner": name, "axis": "xy"[found[0][1]], **found[1]}
            code = f"film-check.jitter.{('columns', 'rows')[found[0][0]]}"
            messages.append(Message(phrase(code, **fields)))
    return messages


def _of_scanner(result: Result, rows: list[int]) -> Iterator[tuple[tuple[int, int], dict[str, float]]]:
    """Yield lines (rows: 1), axis and size of jitter if it exceeds the correlation across the lines."""
    order, values = _smoothed(result, rows)
    if not len(order):
        return
    block, redundancy = result.block, result.redundancy[order]
    xy, sd = block.image_xy[order], float(np.median(block.image_sd[order]))
    extent = float(np.ptp(xy, axis=0).max())
    # Offsets separate the photos: no distance reaches from one to another.
    at = xy + 2.0 * extent * block.image_photos[order][:, np.newaxis]
    for axis in (0, 1):
        own = values[:, axis], redundancy[:, axis]
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
                sizes = {"jitter": sd * jitter, "sd": float(np.hypot(sd, sd * jitter))}
                yield (lines, axis), {"z": float(z[lines].max()), "within": WINDOWS[k] * extent, **sizes}


def _smoothed(result: Result, rows: list[int]) -> tuple[Indices, Floats]:
    """Return images of photos that have enough, and (k, 2) residuals in sd without a smooth function."""
    block, photos = result.block, result.block.image_photos
    used = np.isfinite(result.residuals).all(axis=1) & np.isfinite(result.redundancy).all(axis=1)
    used &= np.isin(photos, rows)
    used &= np.bincount(photos[used], minlength=len(block.photo_ids))[photos] >= FEWEST_OF_LINES
    order = np.flatnonzero(used)
    values = result.residuals[order] / block.image_sd[order]
    for photo in np.unique(photos[order]):
        own = photos[order] == photo
        xy = block.image_xy[order[own]]
        x, y = ((xy - xy.mean(axis=0)) / np.ptp(xy, axis=0).max()).T
        smooth = np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y, x**3, y**3])
        values[own] -= smooth @ np.linalg.lstsq(smooth, values[own], rcond=None)[0]
    return order, values


def _pairs(at: Floats, values: Floats, redundancy: Floats, within: float) -> Floats:
    """Return (3,) sums over pairs within a distance: v_i v_j, squares, r_i r_j."""
    order = np.argsort(at)
    at = at[order]
    first, last = np.searchsorted(at, at - within), np.searchsorted(at, at + within, "right")
    columns = np.column_stack([values, values**2, redundancy])[order]
    behind = np.concatenate([np.zeros((1, 3)), np.cumsum(columns, axis=0)])
    found: Floats = (columns * (behind[last] - behind[first] - columns)).sum(axis=0) / 2
    return found


CERTIFICATE = "certificate"
ALIKE = 0.7  # Comparable test values, as a part of the largest
FEWEST_FAILING = 3  # Marks of a photo that all fail


class _Tested(NamedTuple):
    """The largest test value of a reading, or of a mark in its certificate (without photo)."""

    value: float
    mark: str
    photo: str = ""

    @property
    def message(self) -> Phrase:
        return phrase("film-check.marks.reading", mark=self.mark, photo=self.photo, test=self.value)


def mark_hints(result: Result) -> list[Message]:
    """Return the probable mistake in fiducial marks.

    If a mark fails on all photos, its certificate is wrong. If all marks of a photo fail, their names, the
    side of the film or the camera are wrong. A single reading may refer to a wrong location. The largest test
    value decides.
    """
    tested = sorted(_tested(result), key=lambda each: -each.value)
    limit = normal_limit(2 * len(tested), FOUND)
    if not tested or not tested[0].value > limit:
        return []
    largest, readings = tested[0], [each for each in tested if each.photo]
    whole = _photos(readings, limit)
    if largest.photo in whole:
        return [Message(phrase("film-check.marks.all", photos=whole))]
    worst = [each for each in tested if each.value >= max(limit, ALIKE * largest.value)]
    if largest.photo:
        messages = [each.message for each in worst if each.photo]
        return [Message(phrase("film-check.marks.readings", readings=messages))]
    counts = Counter(each.mark for each in readings)
    named = [
        phrase("film-check.marks.mark", mark=each.mark, test=each.value, n=counts[each.mark])
        for each in worst
        if not each.photo
    ]
    several = len(named) >= FEWEST_FAILING and all(film.pattern is None for _, film in result.films)
    return [Message(phrase(f"film-check.marks.{'pattern' if several else 'certificate'}", marks=named))]


def _photos(readings: list[_Tested], limit: float) -> list[str]:
    """Return the worst photos on which at least three marks, and more than half, fail."""
    found = by_key((each.photo, each.value) for each in readings)
    size = {photo: float(np.sqrt(np.mean(np.square(values)))) for photo, values in found.items()}
    return [
        photo
        for photo, values in found.items()
        if sum(each > limit for each in values) >= max(FEWEST_FAILING, len(values) / 2 + 0.5)
        and size[photo] >= ALIKE * max(size.values())
    ]


def _tested(result: Result) -> Iterator[_Tested]:
    for kind in (result.kinds[name] for name in (Fiducial.KIND, CERTIFICATE) if name in result.kinds):
        sizes = np.abs(np.nan_to_num(kind.standardized))
        for row, values in zip(kind.rows.tolist(), sizes, strict=True):
            own = result.block.observations[row]
            if not isinstance(own, KnownTogether):
                photo, mark = own.of
                yield _Tested(float(values.max()), mark, photo)
            elif all(isinstance(each, Mark) for each in own.joined):
                pairs = values.reshape(-1, 2).max(axis=1).tolist()
                yield from (_Tested(value, each.name) for value, each in zip(pairs, own.joined, strict=True))


FEWEST_MARKS = 4  # Marks of a photo: three fit any axis


def axis_hints(result: Result) -> list[Message]:
    """Report photos with unmodelled film changes along one axis."""
    read = result.block.observations.of_type(Fiducial)
    count = Counter(each.photo for each in read)
    names = result.block.photo_ids
    conformal = {
        row: film
        for row, film in result.films
        if not (film.placement.is_held or film.size.deviations[1:].any())
        and count[names[row]] >= FEWEST_MARKS
    }
    if not conformal or not is_suspected(result):
        return []
    meant = Adjuster.of(result).converged(_freed(result.block, conformal))
    squares, freedom = result.sum_and_freedom
    if meant is None or omega(result) - omega(meant) < MOST * (squares - freedom):
        return []
    limit, found = critical_chi_square(CHANCE / len(conformal), 2), []
    for row in conformal:
        b = meant.film[row, 4:]
        if b @ np.linalg.solve(meant.film_cofactors[row, 4:, 4:], b) > limit:
            found.append((2.0 * float(np.hypot(*b)), names[row], np.degrees(np.arctan2(b[1], b[0]) / 2)))
    if not found:
        return []
    found.sort(reverse=True)
    longer, photo, angle = found[0]
    far = max(float(np.linalg.norm(each.mark.position[:2])) for each in read if each.photo == photo)
    fields = {"longer": longer, "angle": float(angle), "at_marks": 1e3 * longer * far}
    return [Message(phrase("film-check.axis", photos=[name for _, name, _ in found], photo=photo, **fields))]


def _freed(block: Block, films: Mapping[int, Film]) -> Block:
    """Return a block with free b1 and b2 of some films."""
    meant: dict[int, object] = {}
    for film in films.values():
        size = film.size.replace(sd=[film.size.deviations[0], np.inf, np.inf])
        meant |= {id(film.size): size, id(film): replace(film, size=size)}

    def freed(item: Any) -> Any:
        changes = {name: meant[id(own)] for name, own in vars(item).items() if id(own) in meant}
        return replace(item, **changes) if changes else item

    observations, passages = ([*map(freed, own)] for own in (block.observations, block.passages))
    return block.replace(observations=observations, passages=passages)
