"""Correction of measurements on a calibrated comparator (NOAA TR NOS 57, equations 34 and 63)."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.arrays import argument_error, matrix_fault, number, shaped, truth_value
from photogram.arguments.fields import Checked, check_fields, option
from photogram.arguments.types import Floats
from photogram.comparator.fits import COUNT, Frame, Polynomial, design
from photogram.comparator.grid import Table
from photogram.comparator.readings import LARGEST_UM, Session
from photogram.errors import InputError
from photogram.io import json
from photogram.io.delimited import cells
from photogram.io.places import at_place
from photogram.lazy_dataclasses import dataclass, field, fields
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.words import phrase


@dataclass(frozen=True)
class Identity(Checked):
    """Identification of a correction.

    Attributes
    ----------
    comparator, secondary
        Comparator number; whether it is the right stage of a stereocomparator.
    date
        Date of the measurement, as text.
    plates
        Numbers of the plates.
    cases
        Number of cases.
    temperature_c
        Temperature of the plates, degrees Celsius; None if unknown.
    low_um, high_um
        Least and largest mean readings, x and y, which define the calibrated range.
    """

    comparator: int
    secondary: bool
    date: str
    plates: tuple[int, ...]
    cases: int
    temperature_c: float | None
    low_um: tuple[float, float]
    high_um: tuple[float, float]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (np.array(self.low_um) < self.high_um).all():
            raise InputError(phrase("comparators.range", value=str([self.low_um, self.high_um])))

    @classmethod
    def of(cls, session: Session, means_um: Sequence[Floats]) -> Identity:
        """Return the identity of a session with mean readings (n, 2) of its cases."""
        readings = np.vstack(means_um)
        (low_x, low_y), (high_x, high_y) = readings.min(axis=0).tolist(), readings.max(axis=0).tolist()
        return cls(
            session.comparator,
            session.secondary,
            session.date,
            tuple(dict.fromkeys(case.plate for case in session.cases)),
            len(session.cases),
            session.temperature_c,
            (low_x, low_y),
            (high_x, high_y),
        )

    @property
    def frame(self) -> Frame:
        """Frame of the calibrated range, which has arguments of readings from -1 to 1."""
        return Frame.of(np.array([self.low_um, self.high_um]))

    @property
    def range_text(self) -> str:
        """Calibrated range as text."""
        (low_x, low_y), (high_x, high_y) = self.low_um, self.high_um
        return f"x {low_x:.0f} to {high_x:.0f}, y {low_y:.0f} to {high_y:.0f} um"


PARAMETERS = 21  # scale x, scale y, lack of orthogonality, nine coefficients of x, nine of y
# Parameter names in camera models; scales less 1, coefficients in mm
MODEL = ("mx", "my", "lean", *(f"{axis}{term}" for axis in "xy" for term in "ABCDEFGHJ"))
MM = 1000.0  # micrometres
MAX_STEPS = 20  # of Newton's iteration


@dataclass(frozen=True, eq=False)
class Correction:
    """Correction of comparator readings: a linear step, then polynomials.

    x' = Sx x + Sy sin(alpha) y, y' = Sy cos(alpha) y (equation 34). The corrected coordinates are x' +
    P_x(x', y'), y' + P_y(x', y') (equation 63).

    Attributes
    ----------
    scale_x, scale_y, nonorthogonality_rad
        Sx, Sy, alpha.
    polynomial
        P_x and P_y; None for a linear correction.
    covariance
        (21, 21) of Sx, Sy, alpha (rad) and the coefficients (micrometres, in the frame of the polynomial), x
        then y.
    identity
        Comparator, date and range of the calibration; None if unknown.
    """

    scale_x: float = option(MISSING, 0, is_open=True)
    scale_y: float = option(MISSING, 0, is_open=True)
    nonorthogonality_rad: float = option(MISSING, -math.pi / 2, math.pi / 2, is_open=True)
    polynomial: Polynomial | None = None
    covariance: Floats = field(default_factory=lambda: np.zeros((PARAMETERS, PARAMETERS)), repr=False)
    identity: Identity | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        if self.polynomial is not None:
            for value in (*self.polynomial.frame.centre_um, *self.polynomial.scaled_um.ravel().tolist()):
                if not math.isfinite(value):
                    raise argument_error("polynomial", "finite", value=value)
            for half in self.polynomial.frame.half_range_um:
                number("half_range_um", half, "positive")
        if fault := matrix_fault(shaped("covariance", self.covariance, 2 * (PARAMETERS,)), singular=True):
            raise InputError(fault)

    @property
    def matrix(self) -> Floats:
        """(2, 2) linear correction N S."""
        lean = self.nonorthogonality_rad
        return np.array([[self.scale_x, self.scale_y * math.sin(lean)], [0.0, self.scale_y * math.cos(lean)]])

    def linear(self, xy_um: Floats) -> Floats:
        """Return readings (n, 2) corrected for scales and lack of orthogonality."""
        return np.asarray(np.asarray(xy_um) @ self.matrix.T)

    def apply(self, xy_um: Floats) -> Floats:
        """Return corrected readings.

        Parameters
        ----------
        xy_um
            (n, 2) readings in micrometres from the zero of the comparator, the origin of the polynomials.
        """
        corrected = self.linear(xy_um)
        return corrected if self.polynomial is None else corrected + self.polynomial.evaluate(corrected)

    def reach(self, xy_um: Floats) -> Floats:
        """Return the relative distances of readings (n, 2) from the centre of the range.

        (n,) the larger value of both axes, in half ranges: 1 at the edge of the calibrated range. Beyond 1
        the polynomials extrapolate. NaN if the range is unknown.
        """
        if self.identity is not None:
            arguments = self.identity.frame.arguments(xy_um)
        elif self.polynomial is not None:
            arguments = self.polynomial.frame.arguments(self.linear(xy_um))
        else:
            return np.full(len(xy_um), math.nan)
        return np.asarray(np.abs(arguments).max(axis=1))

    def invert(self, corrected_um: Floats) -> Floats:
        """Return the readings (n, 2) that `apply` maps to corrected coordinates (n, 2).

        Raises
        ------
        InputError
            If Newton's iteration does not converge because a position is far outside the calibrated range.
        """
        linear = np.array(corrected_um, dtype=float)
        try:
            # Overflow causes a failure of convergence, or a final value that is not finite.
            with np.errstate(over="ignore", invalid="ignore"):
                if self.polynomial is not None:
                    linear = self._before_polynomial(self.polynomial, linear)
                readings = np.linalg.solve(self.matrix, linear.T).T
        except np.linalg.LinAlgError:
            raise InputError(phrase("comparators.singular")) from None
        return np.asarray(readings)

    @staticmethod
    def _before_polynomial(polynomial: Polynomial, corrected: Floats) -> Floats:
        place = corrected.copy()
        for _ in range(MAX_STEPS):
            excess = place + polynomial.evaluate(place) - corrected
            jacobian = np.eye(2) + polynomial.jacobian(place)
            step = np.linalg.solve(jacobian, excess[..., np.newaxis])[..., 0]
            place = place - step
            # Coordinates of a metre have rounding errors of 1e-10 um.
            if np.abs(step).max(initial=0.0) < 1e-8:
                return place
        raise InputError(phrase("comparators.no-inverse"))

    def covariance_of(self, xy_um: Floats, measured_um2: Floats | None = None) -> Floats:
        """Return the covariance of corrected readings (n, 2, 2) in um^2.

        It refers to the position relative to the centre of the polynomial frame. Rotation and shift of
        corrected coordinates are free.

        Parameters
        ----------
        xy_um
            (n, 2) readings.
        measured_um2
            (2, 2) or (n, 2, 2) covariance of the readings; None: only the correction contributes.
        """
        by_parameters, by_reading = partials_of(self, np.asarray(xy_um, dtype=float))
        covariance = by_parameters @ self.covariance @ by_parameters.transpose(0, 2, 1)
        if measured_um2 is not None:
            covariance = covariance + by_reading @ np.asarray(measured_um2) @ by_reading.transpose(0, 2, 1)
        return np.asarray(covariance)

    def as_camera(self, camera: Camera, *, weighted: bool = True) -> Camera:
        """Return a camera with uncorrected readings on this comparator: `on_comparator`.

        Its image coordinates are readings in mm from the zero of the comparator. The parameters of the
        correction are observations of a block with their full covariance, independent of the camera
        parameters. `xp`, `yp` are corrected coordinates relative to the reading `x0`, `y0`, the centre of the
        polynomials.

        Parameters
        ----------
        camera
            A camera of the model `brown` in mm, unbalanced (r0 = 0) and without affinity and shear, which
            belong to the comparator.
        weighted
            Whether the correction is weighted by its covariance; otherwise it is fixed.

        Raises
        ------
        InputError
            If the camera has another model, unit or an affine parameter.
        """
        truth_value("weighted", weighted)
        deviations = _deviations(camera)
        frame = self.polynomial.frame if self.polynomial else Frame.metres()
        x0, y0 = np.linalg.solve(self.matrix, frame.centre_um) / MM
        half_x, half_y = frame.half_range_um
        unit = np.array([1.0] * 3 + [MM] * 18)
        values = (parameters_of(self) - np.repeat([1.0, 0.0], [2, 19])) / unit
        observed = np.flatnonzero(np.diag(self.covariance) > 0) if weighted else np.zeros(0, int)
        names = [MODEL[row] for row in observed]
        covariance = (self.covariance / np.outer(unit, unit))[np.ix_(observed, observed)]
        if camera.covariance is not None:
            apart = np.zeros((len(observed), len(camera.covariance[0])))
            covariance = np.block([[covariance, apart], [apart.T, np.asarray(camera.covariance[1])]])
            names += list(camera.covariance[0])
        constants = {"x0": float(x0), "y0": float(y0), "hx": half_x / MM, "hy": half_y / MM}
        return Camera(
            "on_comparator",
            {name: camera.parameters[name] for name in deviations}
            | dict(zip(MODEL, values.tolist(), strict=True))
            | constants,
            sd=deviations,
            covariance=(names, covariance) if names else None,
            name=camera.name,
            weights=camera.weights,
        )

    def document(self) -> dict[str, Any]:
        """Return the members of the JSON document, with units in their names."""
        document: dict[str, Any] = {each.name: getattr(self, each.name) for each in fields(self)}
        if self.polynomial is not None:
            document["polynomial"] = {
                "centre_um": self.polynomial.frame.centre_um,
                "half_range_um": self.polynomial.frame.half_range_um,
                "coefficients_x_um": self.polynomial.scaled_um[0],
                "coefficients_y_um": self.polynomial.scaled_um[1],
            }
        return document

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> Correction:
        """Return the correction from a document of :meth:`document`.

        Raises
        ------
        KeyError, TypeError, ValueError
            If the document is invalid.
        """
        polynomial = None
        if (members := document["polynomial"]) is not None:
            scaled = [members[f"coefficients_{axis}_um"] for axis in "xy"]
            polynomial = Polynomial(
                Frame(members["centre_um"], members["half_range_um"]),
                shaped("coefficients_um", scaled, (2, COUNT)),
                np.zeros((2 * COUNT, 2 * COUNT)),
            )
        scale_x, scale_y, lean = (document[name] for name in ("scale_x", "scale_y", "nonorthogonality_rad"))
        identity = document["identity"]
        if identity is not None:
            identity = Identity(**{own.name: identity[own.name] for own in fields(Identity)})
        covariance = shaped("covariance", document["covariance"], (PARAMETERS, PARAMETERS))
        return cls(scale_x, scale_y, lean, polynomial, covariance, identity)

    def to_json(self) -> bytes:
        """Return the correction as a JSON document (UTF-8)."""
        return json.to_json(self.document())

    @classmethod
    def read(cls, path: Path) -> Correction:
        """Read a correction file, or the correction in a calibration document.

        Raises
        ------
        InputError
            If the file cannot be read or does not contain a correction.
        """
        with json.holding("correction of a comparator", path):
            document = json.read_json(path).value
            if document.get("usable") is False:
                raise InputError(phrase("comparators.withheld"))
            return cls.from_document(document.get("correction", document))


def parameters_of(correction: Correction) -> Floats:
    """Return the parameters (21,) in the order of the covariance."""
    polynomial = correction.polynomial
    coefficients = np.zeros(18) if polynomial is None else polynomial.scaled_um.ravel()
    linear = correction.scale_x, correction.scale_y, correction.nonorthogonality_rad
    return np.concatenate([linear, coefficients])


def partials_of(correction: Correction, xy_um: Floats) -> tuple[Floats, Floats]:
    """Return partials by parameters (n, 2, 21) and by readings (n, 2, 2)."""
    polynomial, linear = correction.polynomial, correction.linear(xy_um)
    frame = polynomial.frame if polynomial else Frame.metres()
    inner = np.eye(2) + (polynomial.jacobian(linear) if polynomial else np.zeros((len(linear), 2, 2)))
    # Relative to the reading at the centre of the frame: a shift is not part of the correction.
    x, y = (xy_um - np.linalg.solve(correction.matrix, frame.centre_um)).T
    lean, scale_y = correction.nonorthogonality_rad, correction.scale_y
    s, c = math.sin(lean), math.cos(lean)
    by_linear = np.array([[x, s * y, scale_y * c * y], [np.zeros_like(x), c * y, -scale_y * s * y]])
    by_parameters = np.zeros((len(x), 2, PARAMETERS))
    by_parameters[:, :, :3] = inner @ by_linear.transpose(2, 0, 1)
    if polynomial is not None:
        by_parameters[:, 0, 3:12] = by_parameters[:, 1, 12:] = design(frame, linear)
    return by_parameters, inner @ correction.matrix


def _deviations(camera: Camera) -> dict[str, float]:
    """Return standard deviations of the parameters of a camera without affinity."""
    deviations = dict(zip(camera.names, camera.deviations.tolist(), strict=True))
    affine = ("b1", "b2", "r0")
    if camera.model != "brown" or camera.unit != "mm" or any(camera.parameters[name] for name in affine):
        own = {"camera": camera.title, "model": camera.model, "unit": camera.unit}
        raise InputError(phrase("comparators.camera", **own))
    if deviations["b1"] or deviations["b2"]:
        raise InputError(phrase("comparators.camera-free", camera=camera.title))
    return {name: deviations[name] for name in camera.names if name not in affine}


CORRECTED = ("corrected_x_um", "corrected_y_um", "sd_x_um", "sd_y_um", "in_range")
READINGS = ("reading_x_um", "reading_y_um", "in_range")
EDGE = 1.25  # extrapolation limit for a warning, in half ranges from the centre
ROUNDING = 1e-6  # of readings on the edge, in half ranges


def correct_table(
    correction: Correction, table: Table, *, invert: bool = False, extrapolate: bool = False
) -> tuple[bytes, list[Message]]:
    """Return a table with corrected coordinates and standard deviations, and warnings.

    Standard deviations are propagated from the correction without the readings. The column `in_range` is yes
    inside the calibrated range. With `invert`, readings are computed from corrected coordinates.
    """
    xy_um = table.xy_um
    sizes = np.abs(xy_um).max(axis=1, initial=0.0)
    if not (sizes <= LARGEST_UM).all():
        row = int(np.argmin(sizes <= LARGEST_UM))
        code = "error.empty" if np.isnan(sizes[row]) else "error.most"
        with at_place(table.records.place(row), "x, y"):
            raise InputError(phrase(code, value=float(sizes[row]), high=LARGEST_UM))
    if not len(xy_um):
        raise InputError(phrase("error.empty-file", content="measurements"), file=table.records.path)
    if invert:
        columns: tuple[str, ...] = READINGS
        values = readings = correction.invert(xy_um)
    else:
        columns, readings = CORRECTED, xy_um
        with np.errstate(over="ignore", invalid="ignore"):
            variances = np.diagonal(correction.covariance_of(xy_um), axis1=1, axis2=2)
            # Rounding may make a zero variance negative.
            values = np.hstack([correction.apply(xy_um), np.sqrt(np.maximum(variances, 0.0))])
    if not np.isfinite(values).all():
        worst = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
        raise table.records.error(worst, phrase("comparators.infinite"))
    reach = correction.reach(readings)
    remarks = _outside(correction, table, readings, reach, extrapolate=extrapolate)
    in_range = ["" if np.isnan(far) else "yes" if far <= 1 + ROUNDING else "no" for far in reach.tolist()]
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*table.records.columns, *columns])
    for row, (numbers, within) in enumerate(zip(values.tolist(), in_range, strict=True)):
        texts = [f"{number:.4f}" for number in numbers]
        writer.writerow([*cells(table.records.place(row), table.records.delimiter), *texts, within])
    return buffer.getvalue().encode(), remarks


def _outside(
    correction: Correction, table: Table, readings: Floats, reach: Floats, *, extrapolate: bool
) -> list[Message]:
    """Return a warning on readings outside the calibrated range; reject distant ones."""
    if np.isnan(reach).all():
        return [Message(phrase("comparators.unknown-range"))]
    outside = int((reach > 1 + ROUNDING).sum())
    if not outside:
        return []
    worst = int(reach.argmax())
    x, y = readings[worst].tolist()
    identity, place = correction.identity, table.records.place(worst)
    farthest = {"x": x, "y": y, "reach": float(reach[worst])}
    farthest["range"] = f" ({identity.range_text})" if identity else ""
    if reach[worst] > EDGE and not extrapolate:
        raise place.error(phrase("comparators.far-outside", limit=EDGE, **farthest))
    return [place.message(phrase("comparators.outside", n=outside, count=len(reach), **farthest))]
