"""Support data (ISDs) with the corrections of an adjustment in their tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import orjson

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.csm.angles import Polynomials, angle_axes, of_angles, to_angles, to_quaternions
from photogram.formats.csm.cubes import is_cube
from photogram.formats.csm.isd import Isd, Positions, Turns
from photogram.formats.csm.photos import SupportedImage, to_camera, trajectory_of
from photogram.formats.csm.reading import UNITS
from photogram.formats.isis.outcome import Image
from photogram.io.json import read_json
from photogram.network.trajectories import Basis, Coefficient, Polynomial
from photogram.results.trajectories import AdjustedTrajectory
from photogram.words import phrase

CLOSE = 0.01  # Pixels: how far what is seen with the new tables may be from what the trajectory sees
GRID = 32  # Samples, and lines, at which both are compared: about a thousand points
HALVINGS = 8  # Of the intervals of a table, at most


def updated_support(image: Image, adjusted: AdjustedTrajectory) -> bytes | None:
    """Return the support data of an image with adjusted tables; None of a cube, whose tables are binary.

    Positions, velocities, quaternions and angular velocities at the times of their records, and half-way
    between these as often as it takes for straight joins to see a thousand points within :data:`CLOSE`; an
    error if that never is. Whatever was not adjusted, and all else, stays as it is.
    """
    if is_cube(image.path):
        return None
    document = read_json(image.path).value
    corrected = _Corrected(image, adjusted)
    truth = _adjusted_image(image, adjusted)
    samples, lines = (np.linspace(1.0, size, GRID) for size in image.supported.isd.size)
    rows, columns = np.meshgrid(lines, samples)
    ground = truth.to_ground(rows.ravel(), columns.ravel())
    seen = truth.to_image(ground)
    for halvings in range(HALVINGS + 1):
        isd = corrected.isd(halvings)
        apart = SupportedImage(isd, "updated", "isis", "isis").to_image(ground) - seen
        if not np.nanmax(np.abs(apart), initial=0.0) > CLOSE:
            corrected.put(document, halvings)
            return orjson.dumps(document, option=orjson.OPT_INDENT_2)
    raise InputError(phrase("isis.tables", limit=CLOSE, n=HALVINGS), file=image.path)


def _adjusted_image(image: Image, adjusted: AdjustedTrajectory) -> SupportedImage:
    """Return an image on its trajectory as adjusted; what of its tables stays is that of the image alone."""
    own, over = adjusted.given, image.solving.over
    table = trajectory_of(image.supported.isd, own.name, interpolation="isis").table
    taken: tuple[str, ...] = ()
    if own.position is not None and not over[0]:
        taken += ("times", "positions", "velocities", "interpolation")
    if own.rotation is not None and not over[1]:
        taken += ("attitude_times", "attitudes", "attitude_interpolation")
    table = replace(table, **{name: getattr(own.table, name) for name in taken})
    changes: dict[str, Any] = {"table": table}
    for name, value in (("position", adjusted.position), ("rotation", adjusted.rotation)):
        if (basis := getattr(own, name)) is not None:
            changes[name] = replace(basis, value=value, sd=0.0)
    return SupportedImage(image.supported.isd, own.name, "isis", "isis", replace(own, **changes))


class _Corrected:
    """The tables of an image with its corrections, at any times."""

    def __init__(self, image: Image, adjusted: AdjustedTrajectory) -> None:
        self.original, self.over = image.supported.isd, image.solving.over
        own, solving = adjusted.given, image.solving
        self.places = _total(own.position, own.coefficients[0], solving.position, adjusted.position)
        self.angles = _total(own.rotation, own.coefficients[1], solving.angles, adjusted.rotation)
        self.table = replace(trajectory_of(self.original, own.name, interpolation="isis"), body=None)

    def isd(self, halvings: int) -> Isd:
        """Return support data with corrected tables, whose intervals are halved so many times."""
        found = self.original
        if self.places is not None:
            times = _halved(found.position.times, halvings)
            places = self.places.at(times) + (self._flown(times)[0] if self.over[0] else 0.0)
            found = replace(found, position=Positions(times, places))
        if self.angles is not None:
            times = _halved(found.pointing.times, halvings)
            angles = self._before(times) + self.angles.at(times)
            found = replace(found, pointing=Turns(times, of_angles(angles)))
        return found

    def put(self, document: dict[str, Any], halvings: int) -> None:
        """Put the corrected tables into a document; of one record there is no other velocity to tell."""
        isd = self.isd(halvings)
        if self.places is not None:
            own, times = document["instrument_position"], isd.position.times
            unit = UNITS[own.get("unit", "km")]
            own["positions"] = (isd.position.places / unit).tolist()
            if len(times) > 1:
                speeds = self.places.rates(times) / unit
                if self.over[0]:
                    known = _given(own, "velocities", times)
                    if known is None:
                        known = np.gradient(self._flown(times)[0] / unit, times, axis=0)
                    speeds += known
                own["velocities"] = speeds.tolist()
            own["ephemeris_times"] = times.tolist()
        if self.angles is not None:
            own, times = document["instrument_pointing"], isd.pointing.times
            constant = np.reshape(own.get("constant_rotation", np.eye(3)), (3, 3))
            own["quaternions"] = to_quaternions(constant.T @ isd.pointing.matrices).tolist()
            if len(times) > 1:
                own["angular_velocities"] = self._turning(self.angles, own, times).tolist()
            own["ephemeris_times"] = times.tolist()

    def _before(self, times: Floats) -> Floats:
        """Return the angles that those of polynomials are added to."""
        return to_angles(self._flown(times)[1]) if self.over[1] else np.zeros((len(times), 3))

    def _turning(self, total: Polynomials, own: Mapping[str, Any], times: Floats) -> Floats:
        """Return angular velocities along inertial axes."""
        before, rates = self._before(times), total.rates(times)
        if self.over[1]:
            known = _given(own, "angular_velocities", times)
            if known is None:
                rates += np.gradient(before, times, axis=0)
            else:
                rates += np.linalg.solve(angle_axes(before), known[:, :, np.newaxis])[:, :, 0]
        return np.asarray(np.einsum("nij,nj->ni", angle_axes(before + total.at(times)), rates))

    def _flown(self, times: Floats) -> tuple[Floats, Floats]:
        """Return places, and matrices inertial to camera, of the tables as they were."""
        places, turned, *_ = self.table.flown(times, *np.zeros((2, 0, 3)))
        return places, to_camera(self.original, turned.reshape(-1, 3, 3))


def _given(own: Mapping[str, Any], name: str, times: Floats) -> Floats | None:
    """Return (n, 3) numbers of records at times, joined straight; None where there are none."""
    if not own.get(name):
        return None
    known, values = np.array(own["ephemeris_times"]), np.array(own[name])
    return np.column_stack([np.interp(times, known, column) for column in values.T])


def _halved(times: Floats, halvings: int) -> Floats:
    """Return times, and those that divide their intervals into 2^halvings equal parts."""
    parts = 2**halvings
    places = np.arange((len(times) - 1) * parts + 1) / parts
    return np.asarray(np.interp(places, np.arange(len(times)), times))


def _total(
    basis: Basis | None, given: Sequence[Coefficient], begun: Floats, adjusted: Floats
) -> Polynomials | None:
    """Return adjusted polynomials; None where there are none."""
    if not isinstance(basis, Polynomial) or basis.reference is None or basis.scale is None:
        return None
    total = begun.copy()
    total[:, : len(given)] += (adjusted - np.array([each.position for each in given])).T
    return Polynomials(total, basis.reference, basis.scale)
