"""Adjusted control networks: results in pixels and body axes, rejection."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError
from photogram.formats.csm.photos import SupportedImage
from photogram.formats.isis.network import ControlNetwork
from photogram.formats.isis.solving import Settings, Solving
from photogram.formats.project import Project
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.geometry import Cartesian, local_frames
from photogram.network.motion import focal_images
from photogram.results.footprints import metric_covariances
from photogram.results.result import Result
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Outcome:
    """A network after adjustment of its block."""

    contents: PlanetaryContents
    result: Result

    @cached_property
    def point_rows(self) -> Indices:
        """(n,) the network point of each point of the block."""
        places = {name: row for row, name in enumerate(self.contents.network.points.ids)}
        return np.array([places[name] for name in self.result.block.point_ids], dtype=np.int64)

    @cached_property
    def images(self) -> list[Image]:
        """The image of each photo of the block."""
        return [self.contents.images[name] for name in self.result.block.photo_ids]

    @cached_property
    def rows(self) -> dict[Image, Indices]:
        """The block observations that are measures in each image of the network."""
        different = self.contents.different
        places = {image: place for place, image in enumerate(different)}
        of_photo = np.array([places[image] for image in self.images], dtype=np.int64)
        own = rows_of_each(of_photo[self.result.block.image_photos], len(different))
        return dict(zip(different, own, strict=True))

    @cached_property
    def measure_rows(self) -> Indices:
        """(m,) network measure of each observation: first of its point in the image."""
        network, block = self.contents.network, self.result.block
        measures, count = network.measures, len(network.points)
        serial_of = {serial: row for row, serial in enumerate(measures.serials)}
        of_photo = np.array([serial_of[each.serial] for each in self.images], dtype=np.int64)
        counting = np.flatnonzero(~network.is_ignored)
        keys = measures.serial[counting].astype(np.int64) * count + network.point_of_measure[counting]
        known, first = np.unique(keys, return_index=True)
        own = of_photo[block.image_photos] * count + self.point_rows[block.image_points]
        return np.asarray(counting[first[np.searchsorted(known, own)]])

    @cached_property
    def rejected(self) -> Bools:
        """(M,) measures of the network that are not ignored and were rejected."""
        network = self.contents.network
        measures, count = network.measures, len(network.points)
        keys = measures.serial.astype(np.int64) * count + network.point_of_measure
        used = keys[self.measure_rows[self.result.used_images]]
        return np.asarray(~network.is_ignored & ~np.isin(keys, used))

    @cached_property
    def residuals(self) -> Floats:
        """(m, 2) measured minus computed sample and line, in pixels."""
        found = np.full((len(self.result.residuals), 2), np.nan)
        for image, mine in self.rows.items():
            isd = image.supported.isd
            turned = np.linalg.inv(isd.detector.planes["isis"].matrix)
            own = self.result.residuals[mine] * isd.axes[:2]
            found[mine] = own @ turned.T / isd.detector.summing
        return found

    @cached_property
    def focal(self) -> Floats:
        """(m, 2) measured x and y without distortion, in camera axes, millimetres."""
        found = focal_images(self.result.block).copy()
        for image, mine in self.rows.items():
            found[mine] *= image.supported.isd.axes[:2]
        return found

    @cached_property
    def xyz(self) -> Floats:
        """(n, 3) adjusted points, fixed to the body, metres; NaN if omitted."""
        return Cartesian(self.result.block.spheroid).positions(np.array(self.result.point_positions))

    @cached_property
    def latitudes(self) -> Floats:
        """(n, 3) latitude, longitude from 0 (radians), and radius (metres)."""
        return spherical(self.xyz)

    @cached_property
    def before(self) -> Floats:
        """(n, 3) initial values of points, as in :attr:`latitudes`."""
        return spherical(self.contents.starts[self.point_rows])

    @cached_property
    def corrections(self) -> Floats:
        """(n, 3) corrections of latitude, longitude and radius, metres."""
        after = self.latitudes
        change = after - self.before
        # Differences across the prime meridian.
        change[:, 1] = (change[:, 1] + np.pi) % (2 * np.pi) - np.pi
        radius = after[:, 2]
        metres = np.column_stack([radius, radius * np.cos(after[:, 0]), np.ones(len(after))])
        return np.asarray(change * metres)

    @cached_property
    def point_rms(self) -> Floats:
        """(n,) root mean square residuals of points, pixels."""
        used, block = self.result.used_images, self.result.block
        points, count = block.image_points[used], len(block.point_ids)
        squares = np.bincount(points, (self.residuals[used] ** 2).mean(axis=1), minlength=count)
        return np.asarray(np.sqrt(squares / np.maximum(np.bincount(points, minlength=count), 1)))

    @cached_property
    def covariances(self) -> Floats:
        """(n, 3, 3) a-posteriori covariances of X, Y, Z, square metres."""
        own, axes = metric_covariances(self.result), self._axes
        return own if self.result.block.spheroid is None else axes.transpose(0, 2, 1) @ own @ axes

    @property
    def _axes(self) -> Floats:
        """(n, 3, 3) east, north and up at the points, as rows."""
        places = self.latitudes
        return local_frames(np.column_stack([places[:, 1], places[:, 0], places[:, 2]]))

    @cached_property
    def local_sigmas(self) -> Floats:
        """(n, 3) standard deviations along latitude, longitude and radius, metres."""
        own = self._axes @ self.covariances @ self._axes.transpose(0, 2, 1)
        return np.asarray(np.sqrt(np.maximum(np.einsum("nkk->nk", own), 0.0))[:, [1, 0, 2]])


def spherical(xyz: Floats) -> Floats:
    """Return (n, 3) latitudes, longitudes from 0, and radii of (n, 3) X, Y, Z."""
    radius = np.linalg.norm(xyz, axis=1)
    latitude = np.arctan2(xyz[:, 2], np.hypot(xyz[:, 0], xyz[:, 1]))
    return np.column_stack([latitude, np.arctan2(xyz[:, 1], xyz[:, 0]) % (2 * np.pi), radius])


DETAILS = "control network"
PITCHES = 1.4  # Standard deviation of image coordinates, in pixels of the detector


@dataclass(frozen=True, eq=False)
class Image:
    """An image of a network: serial number, file, support data, parameters."""

    serial: str
    path: Path
    supported: SupportedImage
    solving: Solving

    @property
    def pitch(self) -> float:
        """The side of a detector pixel in millimetres."""
        (x, y), _ = self.supported.isd.detector.planes["isis"].matrix.T
        return float((x * x + y * y) ** 0.5)


@dataclass(frozen=True, eq=False)
class PlanetaryContents:
    """A network as read, its images by photo name, and its settings.

    `starts` are (N, 3) initial X, Y, Z of all its points in metres; NaN for ignored ones.
    """

    network: ControlNetwork
    path: Path
    images: Mapping[str, Image]
    settings: Settings
    starts: Floats

    @property
    def different(self) -> list[Image]:
        """The images, each once: a push frame camera has several photos in one image."""
        return list(dict.fromkeys(self.images.values()))


def rows_of_each(values: NDArray[np.integer[Any]], count: int) -> list[Indices]:
    """Return the positions of each integer below `count` in an array of values."""
    order = np.argsort(values, kind="stable")
    return np.split(order, np.searchsorted(values[order], np.arange(1, count)))


def contents_of(details: Mapping[str, Any]) -> PlanetaryContents:
    """Return the contents of a project from a control network."""
    found = details.get(DETAILS)
    if not isinstance(found, PlanetaryContents):
        raise InputError(phrase("isis.project"))
    return found


NORMAL = 1.4826  # Standard deviation of normal errors, in median absolute deviations
FEWEST = 2  # Smallest number of remaining measures of a point
FAINT = 1e6
"""Factor of the standard deviations of rejected measures, so that residuals can be computed for a possible
reinstatement.
"""
MOST_ROUNDS = 30


def rejecting(project: Project, adjust: Callable[..., Result]) -> Callable[..., Result]:
    """Return a call that adjusts a control network with rejection.

    Adjustment and rejection or reinstatement of measures (:func:`flagged`) alternate until nothing changes.
    The last adjustment is without the rejected measures.
    """
    contents = contents_of(project.details)
    if not contents.settings.rejects:
        return adjust

    def rejected(block: Block, **options: Any) -> Result:
        if not isinstance(block, Block):
            raise InputError(phrase("isis.rejection-poses"))
        multiplier = contents.settings.multiplier
        out = np.zeros(len(block.image_xy), dtype=bool)
        for rounds in count(1):
            sd = block.image_sd * np.where(out, FAINT, 1.0)[:, np.newaxis]
            result = adjust(block.replace(image_sd=sd), **options)
            if not result.converged:
                return result
            residuals = Outcome(contents, result).residuals
            lengths = np.where(result.used_images, np.hypot(*residuals.T), np.nan)
            limit = rejection_limit(lengths[~out], multiplier)
            now = flagged(lengths, out, block.image_points, limit)
            if (now == out).all():
                break
            out = now
            if rounds == MOST_ROUNDS:
                raise AdjustmentError(phrase("isis.rejection-rounds", n=rounds))
        if out.any():
            images = ("image_photos", "image_points", "image_xy", "image_sd")
            kept = {name: getattr(block, name)[~out] for name in images}
            result = adjust(block.replace(**kept), **options)
        counts = {"n": int(out.sum()), "total": len(out), "rounds": rounds, "least": FEWEST}
        remark = Message.of("isis.rejected", **counts, multiplier=multiplier, factor=NORMAL, limit=limit)
        return replace(result, messages=[remark, *result.messages])

    return rejected


def rejection_limit(lengths: Floats, multiplier: float) -> float:
    """Return median + multiplier x 1.4826 x median absolute deviation."""
    median = float(np.nanmedian(lengths))
    return median + multiplier * NORMAL * float(np.nanmedian(np.abs(lengths - median)))


def flagged(lengths: Floats, out: Bools, points: Indices, limit: float) -> Bools:
    """Return which measures to reject after an adjustment, as in jigsaw.

    A rejected measure remains rejected while its residual exceeds the limit. Otherwise the longest residual
    of a point is rejected if it exceeds the limit and two measures remain. `lengths` are (m,) of residuals,
    NaN if unused; `out` (m,) which were rejected before; `points` (m,) the point of each.
    """
    long = lengths > limit
    stay = out & long
    count = int(points.max(initial=-1)) + 1
    left = np.bincount(points[np.isfinite(lengths)], minlength=count)
    left -= np.bincount(points[stay], minlength=count)
    # Sorted by length: the last of each point is its longest.
    fresh = np.flatnonzero(long & ~out)
    order = fresh[np.lexsort((lengths[fresh], points[fresh]))]
    last = np.append(points[order][1:] != points[order][:-1], True)[: len(order)]
    longest = order[last]
    stay[longest[left[points[longest]] > FEWEST]] = True
    return stay
