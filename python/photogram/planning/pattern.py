"""One pattern of a plan: a predicted block, its standard deviations as lengths, its places and its scale."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from photogram.adjustment.prediction import image_depths
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.motion import on_shared
from photogram.planning.statistics import (
    ControlQuality,
    MotionQuality,
    PhotoQuality,
    PointQuality,
    control_quality,
    locations,
    motion_quality,
    photo_quality,
    point_quality,
)
from photogram.results.result import Result


@dataclass(frozen=True, eq=False)
class Pattern:
    """A planned network with what it promises.

    Attributes
    ----------
    name
        Of the pattern, for tables.
    result
        The predicted block (a priori unit weight).
    known
        The same if its readout times were known; None where they are, or where there are none.
    """

    name: str
    result: Result
    known: Result | None = None

    @property
    def block(self) -> Block:
        """The planned block."""
        return self.result.block

    @property
    def axes(self) -> tuple[str, str, str]:
        """Names of the components of positions: X, Y, Z, or E (east), N (north), h (height)."""
        return ("E", "N", "h") if self.block.geographic else ("X", "Y", "Z")

    @cached_property
    def point_sd(self) -> Floats:
        """(n, 3) expected standard deviations along `axes`, linear unit; NaN for points left out."""
        return self.result.point_sd * self._point_units

    @cached_property
    def photo_sd(self) -> Floats:
        """(P, 6) expected standard deviations: along `axes` in the linear unit, then angles in radians."""
        sd = self.result.photo_sd.copy()
        sd[:, :3] *= geometry.lengths_of_units(self.result.photo_positions, self.block.spheroid)
        return sd

    @cached_property
    def control_sd(self) -> Floats:
        """(n, 3) a priori standard deviations of control, linear unit; infinite where not held."""
        return self.block.point_sd * self._point_units

    @property
    def new_points(self) -> NDArray[np.bool_]:
        """(n,) which points are to be determined: those that take part and are not control."""
        return np.asarray(self.result.used_points & (self.result.point_kinds != "control"))

    @cached_property
    def point_plan(self) -> Floats:
        """(n, 2) points in plan, linear unit: X, Y, or the tangent plane amid the photos, x pointing east."""
        return self._plan(self.result.point_positions)

    @cached_property
    def photo_plan(self) -> Floats:
        """(P, 2) photo stations in plan, as `point_plan`."""
        return self._plan(self.result.photo_positions)

    @cached_property
    def point_locations(self) -> NDArray[np.str_]:
        """(n,) `corner`, `edge` or `interior`, as :func:`~photogram.planning.statistics.locations` has it."""
        stations = [self.photo_plan]
        if on_shared(self.block).any():
            # A strip of a scanner is as long as its trajectory.
            flown = {id(each): each for each in self.block.all_trajectories}
            stations += [self._cartesian_plan(each.table.positions) for each in flown.values()]
        return locations(self.point_plan, np.concatenate(stations))

    @cached_property
    def scale(self) -> float:
        """How long a millimetre in the photo is on the ground, linear unit: the mean of all images."""
        return float(self._scales.mean())

    @cached_property
    def unit(self) -> float:
        """The standard deviation of image coordinates on the ground, linear unit: the mean of all images."""
        rms = np.sqrt((self.result.block.image_sd[self.result.used_images] ** 2).mean(axis=1))
        return float((self._scales * rms).mean())

    @cached_property
    def points(self) -> list[PointQuality]:
        """New points and their images, by number of rays, by location, and all."""
        return point_quality(self.result, self.point_sd, self.point_locations, self.new_points)

    @cached_property
    def photos(self) -> list[PhotoQuality]:
        """Positions (linear unit) and attitudes (radians) of the photos."""
        return photo_quality(self.result, self.photo_sd, self.axes)

    @cached_property
    def motion(self) -> list[MotionQuality]:
        """Readout times, velocities and rates of photos, trajectories; nothing where nothing moves."""
        return motion_quality(self.result)

    @property
    def known_rms_sd(self) -> tuple[float, float, float] | None:
        """What `rms_sd` of all new points would be, were the readout times known; None where they are."""
        if self.known is None or not self.new_points.any():
            return None
        sd = (self.known.point_sd * self._point_units)[self.new_points]
        x, y, z = np.sqrt((sd**2).mean(axis=0)).tolist()
        return x, y, z

    @cached_property
    def control(self) -> list[ControlQuality]:
        """Held components of control, by axis."""
        return control_quality(self.result, self.control_sd, self.axes)

    @cached_property
    def _point_units(self) -> Floats:
        """(n, 3) how long a unit of the coordinates of points is, linear unit."""
        return geometry.lengths_of_units(self.result.point_positions, self.block.spheroid)

    @cached_property
    def _scales(self) -> Floats:
        photos = self.block.image_photos[self.result.used_images]
        depths = image_depths(self.block)[self.result.used_images]
        return np.asarray(depths / self.block.camera_scales()[photos])

    def _plan(self, positions: Floats) -> Floats:
        spheroid = self.block.spheroid
        if spheroid is None:
            return positions[:, :2]
        return self._cartesian_plan(geometry.geographic_to_geocentric(positions, spheroid))

    def _cartesian_plan(self, xyz: Floats) -> Floats:
        """Return the plan of places in X, Y, Z, geocentric where the space is geographic."""
        spheroid = self.block.spheroid
        if spheroid is None:
            return xyz[:, :2]
        # The mean of geocentric coordinates knows no antimeridian.
        stations = geometry.geographic_to_geocentric(self.result.photo_positions, spheroid)
        centre = stations.mean(axis=0)
        frame = geometry.local_frames(geometry.geocentric_to_geographic(centre[np.newaxis], spheroid))[0]
        return np.asarray((xyz - centre) @ frame[:2].T)
