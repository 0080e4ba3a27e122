"""What pictures are drawn from: arrays that every adjusted network has, in metric axes.

A picture knows no class of results. `pictured` gives what it draws; the file `pictured.py` beside each class
of results defines it for that class, and is imported with its package.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.show.methods import Way
from photogram.statistics.findings import Observations


@dataclass(frozen=True, eq=False)
class Plan:
    """A network in metric axes.

    Attributes
    ----------
    axes, unit
        What the three axes are called, and what lengths along them are measured in; no unit where the scale
        of the object space is arbitrary.
    photo_ids, photos
        Names, and (P, 3) stations.
    point_ids, points
        Names, and (n, 3) positions; NaN for points that were left out.
    rays
        (n,) numbers of images of the points.
    kinds
        (n,) `control`, `check` or `pass`.
    differences
        (n, 3) adjusted minus given coordinates of control and check points; NaN where none are given.
    """

    axes: tuple[str, str, str]
    unit: str
    photo_ids: Sequence[str]
    photos: Floats
    point_ids: Sequence[str]
    points: Floats
    rays: Indices
    kinds: NDArray[np.str_]
    differences: Floats


@dataclass(frozen=True, eq=False)
class Images:
    """Image observations that took part.

    Attributes
    ----------
    unit
        Of image coordinates: `mm` or `px`.
    photos, points
        (m,) which photo and which point.
    xy, residuals, redundancy
        (m, 2) image coordinates, observed minus adjusted, and redundancy numbers (NaN without covariances).
    cameras
        (m,) which of the cameras.
    names
        What the cameras are called.
    down
        Whether y counts downwards, as rows of pixels do.
    scanned
        (m,) whether the coordinates are sample and line of a scanner: residuals are in its focal plane all
        the same. Such images have cameras of their own.
    """

    unit: str
    photos: Indices
    points: Indices
    xy: Floats
    residuals: Floats
    redundancy: Floats
    cameras: Indices
    names: Sequence[str]
    down: bool
    scanned: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def of_scanner(self, camera: int) -> bool:
        """Whether the images of a camera are samples and lines."""
        return bool(self.scanned.any() and self.scanned[self.cameras == camera].any())

    @property
    def shown_as(self) -> tuple[float, str]:
        """What residuals are multiplied by, and the unit that they then have."""
        return (1000.0, "µm") if self.unit == "mm" else (1.0, self.unit)


@dataclass(frozen=True, eq=False)
class Correlated:
    """Correlations of the k estimated parameters of a camera."""

    camera: str  # Its name
    names: Sequence[str]  # The parameters
    coefficients: Floats  # (k, k)
    remark: str = ""  # What the coefficients are, where that is not plain


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve over r radii.

    Attributes
    ----------
    name
        What it is.
    values
        (r,) the curve.
    bands
        (r,) standard deviations by what they are of.
    """

    name: str
    values: Floats
    bands: dict[str, Floats]


@dataclass(frozen=True, eq=False)
class Curves:
    """Radial distortion of a camera over r radii, in the unit of image coordinates."""

    camera: str  # Its name, and what kind of lens it has
    unit: str  # Of image coordinates: `mm` or `px`
    radii: Floats  # (r,) from 0
    observed: float  # The largest radius with an image; curves beyond are extrapolated
    curves: Sequence[Curve]  # The curve as it is, then other forms of it, each in a panel of its own
    # (q, r) curves of single photos, drawn faintly
    others: Floats = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def shown_as(self) -> tuple[float, str]:
        """What the curves are multiplied by, and the unit that they then have."""
        return (1000.0, "µm") if self.unit == "mm" else (1.0, self.unit)


@dataclass(frozen=True, eq=False)
class Deviations:
    """Distances of n points from a feature that is fitted to them."""

    title: str  # What the feature is
    unit: str  # Of lengths
    points: Sequence[str]  # The names of the points
    directions: Sequence[str]  # What d deviations of each point are
    values: Floats  # (n, d) deviations, and k times their standard deviations
    expanded: Floats

    @property
    def shown_as(self) -> tuple[float, str]:
        """What deviations are multiplied by, and the unit that they then have."""
        largest = float(np.abs(self.values).max(initial=0.0))
        small = {"m": (1e6, "µm") if largest < 1e-3 else (1e3, "mm"), "mm": (1e3, "µm")}
        return small[self.unit] if self.unit in small and largest < 1.0 else (1.0, self.unit)


@dataclass(frozen=True, eq=False)
class VectorField:
    """Small vectors over the frame of a camera."""

    title: str  # What they are
    places: Floats  # (n, 2) both, mm
    vectors: Floats
    labels: Sequence[str] = ()  # What the places are called, or nothing


class Pictured(ABC):
    """What is drawn of an adjusted network. Each part is computed when it is asked for."""

    @property
    @abstractmethod
    def title(self) -> str:
        """What the network is called; nothing where it has no name."""

    @property
    @abstractmethod
    def plan(self) -> Plan:
        """The network."""

    @abstractmethod
    def covariances(self, points: Indices) -> Floats:
        """Return (k, 3, 3) covariances of points along the axes of the plan; NaN where there are none."""

    @property
    @abstractmethod
    def footprints(self) -> Floats:
        """(P, v, 3) closed outlines, in the axes of the plan, of what photos show of level ground.

        NaN for photos that show none of it; (0, v, 3) where no axis of the plan is vertical.
        """

    @property
    @abstractmethod
    def images(self) -> Images:
        """The image observations that took part."""

    @property
    @abstractmethod
    def tested(self) -> list[Observations]:
        """All observations with their standardized residuals, kind by kind."""

    @property
    @abstractmethod
    def unit_weight(self) -> float:
        """The root of the variance of unit weight; 1 where there is none."""

    @property
    @abstractmethod
    def correlations(self) -> list[Correlated]:
        """Cameras with two or more estimated parameters; none without covariances."""

    @property
    @abstractmethod
    def distortion(self) -> list[Curves]:
        """Cameras with radial distortion."""

    @property
    def deviations(self) -> list[Deviations]:
        """Features with deviations of points."""
        return []

    @property
    def films(self) -> list[VectorField]:
        """Mean residuals of the marks of cameras, and patterns of films."""
        return []


@Way
def pictured(result: object) -> Pictured:
    """Return what pictures draw of a result.

    Raises
    ------
    TypeError
        The result of something else than an adjustment of photos and points.
    """
    kind = type(result).__name__
    raise TypeError(f"there are no pictures of {kind}: they are of adjusted blocks and collections")
