"""Error ellipses of horizontal positions: axes, azimuths, outlines, display scale."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network import geometry

if TYPE_CHECKING:
    from photogram import Result

CONFIDENCE = 0.95  # Default probability of an ellipse
VERTICES = 36
SHARE = 0.3  # Size of a typical drawn ellipse relative to the distance between neighbours


@dataclass(frozen=True, eq=False)
class Ellipses:
    """n error ellipses."""

    major: Floats  # (n,) semi-axes in the unit of the positions
    minor: Floats
    azimuth: Floats  # (n,) of the major axis, clockwise from the second axis (north): radians, -pi/2 to pi/2
    # Probability that the ellipse contains the true position; None: standard ellipses (39 %)
    confidence: float | None

    def outlines(self, centres: Floats, scale: float = 1.0) -> Floats:
        """Return (n, 37, 2) closed outlines about (n, 2) centres, enlarged."""
        around = np.linspace(0.0, math.tau, VERTICES + 1)
        along, across = (
            scale * np.outer(self.major, np.cos(around)),
            scale * np.outer(self.minor, np.sin(around)),
        )
        sine, cosine = np.sin(self.azimuth)[:, np.newaxis], np.cos(self.azimuth)[:, np.newaxis]
        east, north = along * sine + across * cosine, along * cosine - across * sine
        found: Floats = centres[:, np.newaxis, :2] + np.stack([east, north], axis=2)
        found[:, -1] = found[:, 0]
        return found


def ellipses(covariances: Floats, confidence: float | None = CONFIDENCE) -> Ellipses:
    """Return the error ellipses of (n, 2, 2) or larger covariances of east and north.

    The axes are the roots of the eigenvalues, times the root of the quantile of chi-square with two degrees
    of freedom, -2 ln(1 - confidence): 2.4477 for 95 %. The azimuth is half of atan2(2 s_en, s_nn - s_ee). NaN
    if the covariance is NaN.
    """
    factor = 1.0 if confidence is None else math.sqrt(-2.0 * math.log1p(-confidence))
    east, north, both = covariances[:, 0, 0], covariances[:, 1, 1], covariances[:, 0, 1]
    mean, half = (east + north) / 2, np.hypot((north - east) / 2, both)
    return Ellipses(
        factor * np.sqrt(mean + half),
        factor * np.sqrt(np.maximum(mean - half, 0.0)),
        0.5 * np.arctan2(2 * both, north - east),
        confidence,
    )


def metric_covariances(result: Result, *, photos: bool = False) -> Floats:
    """Return (n, 3, 3) covariances of points or stations in the linear unit.

    The axes are X, Y, Z, or east, north and up in geographic space.
    """
    found = result.photo_covariances[:, :3, :3] if photos else result.point_covariances
    if result.block.spheroid is None:
        return found
    places = result.photo_positions if photos else result.point_positions
    lengths = geometry.lengths_of_units(places, result.block.spheroid)
    return np.asarray(found * lengths[:, :, np.newaxis] * lengths[:, np.newaxis, :])


def fitting_scale(found: Ellipses, places: Floats) -> float:
    """Return a round display scale (1, 2, 5, 10 ...) for ellipses at (n, 2) positions.

    The median major axis is about a third of the distance between neighbours.
    """
    known = np.isfinite(found.major) & np.isfinite(places[:, :2]).all(axis=1)
    if not known.any():
        return 1.0
    typical, extent = float(np.median(found.major[known])), np.ptp(places[known, :2], axis=0)
    spacing = math.sqrt(
        max(float(extent[0] * extent[1]), float(extent.max()) ** 2 / len(places)) / known.sum()
    )
    wanted = SHARE * spacing / typical if typical > 0 else 1.0
    power = 10.0 ** math.floor(math.log10(wanted)) if wanted > 1 else 1.0
    return max([step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted], default=1.0)
