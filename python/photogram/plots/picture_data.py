"""The data of plots: arrays of any adjusted network, in metric axes.

Plots do not depend on classes of results; the method `_plot_data` of a result returns an object with these
data as attributes, such as `results.picture_data.PicturedNetwork`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.show.quantity import Axis


def display_unit(unit: str, largest: float = 0.0) -> tuple[float, str]:
    """Return the factor of small lengths in plots, and their unit there."""
    small = {"m": (1e6, "µm") if largest < 1e-3 else (1e3, "mm"), "mm": (1e3, "µm")}
    return small[unit] if unit in small and largest < 1.0 else (1.0, unit)


@dataclass(frozen=True, eq=False)
class Plan:
    """A network of P photos and n points in metric axes."""

    axes: tuple[str, str, str]  # Names of the axes
    unit: str  # Of lengths; empty if the scale of the object space is arbitrary
    photo_ids: Sequence[str]
    photos: Floats  # (P, 3) stations
    point_ids: Sequence[str]
    points: Floats  # (n, 3) positions; NaN for unused points
    rays: Indices  # (n,) numbers of image observations
    kinds: NDArray[np.str_]  # (n,) `control`, `check` or `pass`
    differences: Floats  # (n, 3) adjusted minus given coordinates of control and check points; NaN for others


@dataclass(frozen=True, eq=False)
class Images:
    """The m used image observations."""

    unit: str  # Of image coordinates: `mm` or `px`
    photos: Indices  # (m,) rows of photos and of points
    points: Indices
    xy: Floats  # (m, 2) image coordinates
    residuals: Floats  # (m, 2) observed minus adjusted
    redundancy: Floats  # (m, 2) redundancy numbers; NaN without covariances
    cameras: Indices  # (m,) rows of cameras
    names: Sequence[str]  # Of the cameras
    down: bool  # Whether y increases downwards, like rows of pixels
    # (m,) True for sample and line of a scanner, whose residuals refer to its focal plane. Such observations
    # have separate cameras.
    scanned: Bools


@dataclass(frozen=True, eq=False)
class Correlated:
    """Correlations of the k estimated parameters of a camera."""

    camera: str  # Its name
    names: Sequence[str]  # The parameters
    coefficients: Floats  # (k, k)
    remark: str = ""  # Meaning of the coefficients, if not obvious


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve over r radii."""

    name: str
    values: Floats  # (r,)
    bands: dict[str, Floats]  # (r,) standard deviations by name


@dataclass(frozen=True, eq=False)
class Curves:
    """Radial distortion of a camera over r radii, in the unit of image coordinates."""

    camera: str  # Its name, and the type of its lens model
    unit: str  # Of image coordinates: `mm` or `px`
    radii: Floats  # (r,) from 0
    observed: float  # The largest radius of an observation; curves beyond are extrapolated
    curves: Sequence[Curve]  # The curve, then other forms of it, each in a separate panel
    # (q, r) curves of single photos, drawn faintly
    others: Floats = field(default_factory=lambda: np.empty((0, 0)))


@dataclass(frozen=True, eq=False)
class VectorField:
    """Small vectors over the frame of a camera, or over a plane."""

    title: str  # Meaning of the vectors
    places: Floats  # (n, 2) both, in the unit of the axes
    vectors: Floats
    labels: Sequence[str] = ()  # Names of the points, or nothing
    axes: tuple[Axis, ...] = tuple(Axis(name, "mm", small="µm", factor=1e3) for name in "xy")


@dataclass(frozen=True, eq=False)
class Moved:
    """Changes of n points by an undetected error."""

    sentence: str  # The error
    points: Indices  # (n,) rows
    changes: Floats  # (n, 3) along the axes of the plan
    ratios: Floats  # (n,) largest changes of a coordinate, standard deviations
    limit: float  # Standard deviations from which on a change counts
    suspects: Floats  # (k, 3) points and stations of an erroneous observation
    several: int  # Number of points in the network
