"""The coefficients of images as jigsaw tells them: kilometres and degrees, with their standard deviations."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.csm.angles import to_angles
from photogram.formats.csm.isd import Isd
from photogram.formats.csm.photos import to_camera
from photogram.formats.isis.contents import Image
from photogram.lazy_dataclasses import dataclass
from photogram.network.motion import about
from photogram.network.trajectories import Trajectory
from photogram.results.trajectories import AdjustedTrajectory

KM = 1000.0
_NAMES = (("X", "Y", "Z"), ("RA", "DEC", "TWIST"))
_UNITS = ("km", "deg")


@dataclass(frozen=True)
class Parameter:
    """A coefficient of an image: X, Y, Z in km or RA, DEC, TWIST in degrees, by powers of scaled time.

    `apriori` is its standard deviation in metres or degrees: 0 where it is known, infinite where it is free;
    `adjusted` that a posteriori, in the unit.
    """

    name: str
    power: int
    unit: str
    initial: float
    correction: float
    apriori: float
    adjusted: float

    @property
    def final(self) -> float:
        """The adjusted value."""
        return self.initial + self.correction


def parameters(image: Image, adjusted: AdjustedTrajectory) -> list[Parameter]:
    """Return the coefficients of an image that are solved for, and of the rest that of degree 0."""
    solving, own = image.solving, adjusted.given
    places, angles = _middle(image.supported.isd, own)
    degrees = float(np.rad2deg(1.0))
    kinds = (
        (own.coefficients[0], adjusted.position, adjusted.position_sd, solving.position, places, 1 / KM),
        (own.coefficients[1], adjusted.rotation, adjusted.rotation_sd, solving.angles, angles, degrees),
    )
    found = []
    for part, (coefficients, values, sd, begun, middle, unit) in enumerate(kinds):
        given = np.array([each.deviations for each in coefficients]).reshape(-1, 3)
        start = np.array([each.position for each in coefficients]).reshape(-1, 3)
        solved = int(given.any(axis=1).sum())
        for axis, name in enumerate(_NAMES[part]):
            if not solved:
                found.append(Parameter(name, 0, _UNITS[part], float(middle[axis] * unit), 0.0, 0.0, 0.0))
            for k in range(solved):
                change = float(values[k, axis] - start[k, axis])
                apriori = given[k, axis] * (degrees if part else 1.0)
                numbers = (begun[axis, k] * unit, change * unit, apriori, sd[k, axis] * unit)
                found.append(Parameter(name, k, _UNITS[part], *map(float, numbers)))
    return found


def _middle(isd: Isd, own: Trajectory) -> tuple[Floats, Floats]:
    """Return the place and the angles in the middle of tables, inertial."""
    still = Trajectory(own.name, own.table)
    tables = (isd.position.times, isd.pointing.times)
    (places, _), (_, turned) = (about(still, float(times[0] + times[-1]) / 2) for times in tables)
    return places, to_angles(to_camera(turned[np.newaxis]))[0]
