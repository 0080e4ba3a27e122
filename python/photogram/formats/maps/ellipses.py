"""Error ellipses of horizontal positions."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.show.sketch.marks import ellipse_axes
from photogram.show.style import round_length

CONFIDENCE = 0.95  # Default probability of an ellipse
VERTICES = 36
SHARE = 0.3  # Size of a typical drawn ellipse relative to the distance between neighbours


@dataclass(frozen=True, eq=False)
class Ellipses:
    """n error ellipses."""

    major: Floats  # (n,) semi-axes in the unit of the positions
    minor: Floats
    azimuth: Floats  # (n,) of the major axis, clockwise from the second axis (north): radians, -pi/2 to pi/2

    def outlines(self, scale: float = 1.0) -> Floats:
        """Return (n, 37, 2) closed outlines about the origin, enlarged."""
        around = np.linspace(0.0, math.tau, VERTICES + 1)
        along, across = (
            scale * np.outer(self.major, np.cos(around)),
            scale * np.outer(self.minor, np.sin(around)),
        )
        sine, cosine = np.sin(self.azimuth)[:, np.newaxis], np.cos(self.azimuth)[:, np.newaxis]
        found = np.stack([along * sine + across * cosine, along * cosine - across * sine], axis=2)
        found[:, -1] = found[:, 0]
        return found


def ellipses(covariances: Floats, confidence: float | None = CONFIDENCE) -> Ellipses:
    """Return the error ellipses of (n, 2, 2) or larger covariances of east and north.

    The axes are the roots of the eigenvalues, times the root of the quantile of chi-square with two degrees
    of freedom, -2 ln(1 - confidence): 2.4477 for 95 %. They contain the true position with the probability
    `confidence`; None: standard ellipses (39 %). NaN if the covariance is NaN.
    """
    factor = 1.0 if confidence is None else math.sqrt(-2.0 * math.log1p(-confidence))
    semi_axes, angles = ellipse_axes(covariances[:, :2, :2])
    major, minor = factor * semi_axes.T
    return Ellipses(major, minor, np.radians(np.where(angles < 0, -90.0, 90.0) - angles))


def fitting_scale(found: Ellipses, places: Floats) -> float:
    """Return a round display scale (1, 2, 5, 10 ...) for ellipses at (n, 2) positions."""
    known = np.isfinite(found.major) & np.isfinite(places[:, :2]).all(axis=1)
    if not known.any():
        return 1.0
    typical, extent = float(np.median(found.major[known])), np.ptp(places[known, :2], axis=0)
    area = max(float(extent[0] * extent[1]), float(extent.max()) ** 2 / len(places))
    spacing = math.sqrt(area / known.sum())
    return max(round_length(SHARE * spacing / typical), 1.0) if typical > 0 else 1.0
