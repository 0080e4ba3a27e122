"""Score tests of additional unknowns: of fixed stations, points and lens models, which may be wrong.

Fixed values are not observations: without residuals, their errors appear as errors of good observations
nearby. B are the partials of the images by the fixed coordinates, in standard deviations; ~v are the
residuals. With c = B' ~v and C = B' R B, the weighted sum of squares would decrease by T = c' C^-1 c if they
were free (Rao's score, :func:`photogram.score_test`). T is chi-square with the number of coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.equivalent_cameras import calibration_words
from photogram.network.motion import focal_images
from photogram.network.rays import Rays, seen_without_lenses
from photogram.results.network import AdjustedNetwork
from photogram.statistics.findings import Tested
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import Result

HELD = Phrase("test.held")  # Type of these tests
SUSPECTED = 5  # Largest number of tested stations and points: those with the worst images
LEAST_IMAGES = 3  # Smallest number of images of a tested station


@dataclass(frozen=True, eq=False)
class Held:
    """A fixed item: its name, its images, and the indices of its partials."""

    named: Phrase
    images: Indices
    partials: Indices


def held_tested(result: Result) -> list[Tested]:
    """Return tests of fixed stations and points with the worst images, if required."""
    if not result.WHOLE:
        return []
    return held_tests(result, partial(_suspected, result), partial(station_partials, result))


def held_tests(
    result: AdjustedNetwork,
    suspected_by: Callable[[Floats], Sequence[Held]],
    partials_of: Callable[[], Floats],
) -> list[Tested]:
    """Return the test T of each fixed item that (m,) squares of images suspect, if residuals are too large.

    `partials_of` returns (p, m, 2) partials of the images by the unknowns of photos; items have indices of
    these.
    """
    if result.loss or not is_suspected(result):
        return []
    image_sd = result.image_given_sd
    residuals = np.where(result.used_images[:, np.newaxis], result.residuals / image_sd, 0.0)
    suspected = suspected_by((residuals**2).sum(axis=1))
    if not suspected:
        return []
    partials = partials_of()
    factor = result._factor()
    found: list[tuple[Phrase, float, float]] = []
    for each in suspected:
        columns = np.zeros((len(each.partials), *residuals.shape))
        columns[:, each.images] = partials[np.ix_(each.partials, each.images)] / image_sd[each.images]
        # Free unknowns may absorb it.
        value = score(factor, columns, residuals) if np.isfinite(columns).all() else None
        if value is not None:
            name = Phrase("named.held", {"named": each.named})
            found.append((name, value, float(len(each.partials))))
    if not found:
        return []
    names, values, dimensions = zip(*found, strict=True)
    tested = Tested(
        HELD, np.array(values), lambda place: names[place[0]], "T", np.array(dimensions), held=True
    )
    return [tested]


def is_suspected(result: AdjustedNetwork) -> bool:
    """Return whether residuals are too large and covariances exist for tests."""
    test = result.global_test
    if test is None or not test.rejected_high or not result.converged:
        return False
    return bool(np.isfinite(result.redundancy[result.used_images]).all())


def held_remark(found: Sequence[Tested], largest: float) -> list[Phrase]:
    """Return a message if a fixed value has a larger T than all removed observations."""
    place = found[0].largest() if found else None
    if place is None or not found[0].values[place] > largest:
        return []
    fields = {"name": found[0].name(place), "value": float(found[0].values[place]), "largest": largest}
    return [Phrase("line.held", fields)]


def _suspected(result: Result, of_images: Floats) -> list[Held]:
    """Return the fixed items with the worst images, the worst first."""
    block, used = result.block, result.used_images
    given, photos = result.photo_given_sd, (block.image_photos, block.photo_ids, LEAST_IMAGES)
    points = block.image_points, block.point_ids, 1
    mounted = {each.photo for each in block.mounts} | {each.frame for each in block.mounts}
    rows: list[tuple[float, Held]] = []
    for what, of, (owners, names, least), sd, shift in (
        ("position", "photo", photos, given[:, :3], 0),
        ("attitude", "photo", photos, given[:, 3:], 3),
        ("control", "point", points, block.point_sd, 0),
    ):
        held = np.asarray(sd == 0)
        if what != "position" or block.geographic:  # Partials have other axes than the components.
            held = held & held.all(axis=1, keepdims=True)
        counts = np.bincount(owners[used], minlength=len(names))
        means = np.bincount(owners, of_images, len(names)) / np.maximum(counts, 1)
        order = -means * (counts if of == "point" else 1)
        own = np.flatnonzero(held.any(axis=1) & (counts >= least))
        for row in own[np.argsort(order[own], kind="stable")][:SUSPECTED].tolist():
            if of == "point" or names[row] not in mounted:
                images = np.flatnonzero(used & (owners == row))
                named = Phrase(f"named.{what}", {of: names[row]})
                rows.append((float(means[row]), Held(named, images, shift + np.flatnonzero(held[row]))))
    rows.sort(key=lambda row: -row[0])
    return [each for _, each in rows[:SUSPECTED]]


def station_partials(result: Result) -> Floats:
    """(6, m, 2) partials of images by coordinates and rotations of stations; NaN for scanners."""
    plain, seen = seen_without_lenses(as_adjusted(result))
    block = result.block
    if not seen.any():
        return np.full((6, len(block.image_xy), 2), np.nan)
    rays = Rays.of(plain)
    places = rays.axes.positions(result.point_positions)[plain.image_points]
    photos = plain.image_photos
    by_position = rays.partials(places, np.arange(len(places)))
    turned = np.cross(rays.cameras[photos].transpose(0, 2, 1), (places - rays.centres[photos])[:, np.newaxis])
    by_turn = by_position @ turned.transpose(0, 2, 1)
    found = np.full((6, len(block.image_xy), 2), np.nan)
    found[:, seen] = np.concatenate([by_position, by_turn], axis=2).transpose(2, 0, 1)
    # Without lens models y is positive upwards.
    down = np.array([each.image_y == "down" for each in block.cameras], dtype=bool)
    if down.any():
        found[:, down[np.asarray(block.photo_cameras)[block.image_photos]], 1] *= -1.0
    return found


def as_adjusted(result: Result, *, free: bool = False) -> Block:
    """Return a block with photos at their adjusted poses, `free` or weighted as given."""
    changes: dict[str, Any] = {
        "photo_positions": result.photo_positions,
        "photo_attitudes": result.photo_attitudes,
    }
    if free or result.block.timed:
        # Fixed coefficients replace fixed poses on trajectories.
        sd = np.full((len(result.block.photo_ids), 3), np.inf)
        changes |= {"photo_positions_observed": None, "photo_attitudes_observed": None}
        changes |= {"photo_position_sd": sd, "photo_attitude_sd": sd}
    return result.block.replace(**changes)


def fall_by_lens(result: Result, images: Bools) -> float:
    """Return the decrease of Omega (Rao) with a separate lens model for (m,) `images`; 0 if unknown."""
    if result.loss or not result.WHOLE or not is_suspected(result):
        return 0.0
    block, own = result.block, images & result.used_images
    # Partials of these images by typical lens parameters, in standard deviations.
    xy = focal_images(block)[own]
    low, high = xy.min(axis=0), xy.max(axis=0)
    x, y = ((xy - (low + high) / 2) / max(float((high - low).max()) / 2, 1e-300)).T
    r2, zero, one = x * x + y * y, np.zeros_like(x), np.ones_like(x)
    terms = [
        *((x * r2, y * r2), (x * r2**2, y * r2**2)),
        *((r2 + 2 * x * x, 2 * x * y), (2 * x * y, r2 + 2 * y * y)),
        *((x, y), (one, zero), (zero, one)),
    ]
    columns = np.zeros((len(terms), *block.image_xy.shape))
    columns[:, own] = np.array(terms).transpose(0, 2, 1) / block.image_sd[own]
    used = result.used_images[:, np.newaxis]
    residuals: Floats = np.where(used, result.residuals / block.image_sd, 0.0)
    factor = result._factor()
    for count in (len(columns), 4, 2):
        if (found := score(factor, columns[:count], residuals)) is not None:
            return found
    return 0.0


def how_to_calibrate(block: Block) -> Phrase | None:
    """Return a message on estimating cameras; None if all parameters are estimated."""
    if not block.cameras:
        return Phrase("how.camera")
    names = dict.fromkeys(name for camera in block.cameras for name in calibration_words(camera))
    return Phrase("how.calibrate", {"names": ",".join(names)}) if names else None


TAKEN_UP = 1e-9  # Smaller parts of the partials are rounding errors


def score(factor: _photocore.BlockCovariances, partials: Floats, residuals: Floats) -> float | None:
    """Return T = c' C^-1 c of (k, m, 2) `partials` B; None if unknowns absorb a part of B.

    `partials` and (m, 2) `residuals` are in standard deviations of the images; those of unused images are 0.
    """
    flat = partials.reshape(len(partials), -1)
    sizes = np.sqrt(np.einsum("kr,kr->k", flat, flat))
    if not (sizes > 0).all():
        return None
    projected = factor.project_images(partials, threads=0, progress=None).reshape(flat.shape)
    matrix = flat @ projected.T
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2 / np.outer(sizes, sizes))
    if not (values > TAKEN_UP).all():
        return None
    along = vectors.T @ (flat @ residuals.ravel() / sizes)
    return float((along**2 / values).sum())
