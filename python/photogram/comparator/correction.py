"""The correction of any measurements on a calibrated comparator (NOAA TR NOS 57, equations 34 and 63)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from photogram.comparator.polynomial import Frame, Polynomial, design
from photogram.errors import InputError
from photogram.files import read_bytes

if TYPE_CHECKING:
    from photogram.adjusted import Floats

__all__ = ["Correction"]

PARAMETERS = 21
"""Scale x, scale y, lack of orthogonality, nine coefficients of x, nine of y."""
STEPS = 20


def _no_covariance() -> Floats:
    return np.zeros((PARAMETERS, PARAMETERS))


@dataclass(frozen=True, eq=False)
class Correction:
    """Corrects readings of a comparator: first linearly, then by the polynomials.

    x' = Sx x + Sy sin(alpha) y, y' = Sy cos(alpha) y (equation 34); corrected = x' + P_x(x', y'), y' +
    P_y(x', y') (equation 63).

    Attributes
    ----------
    scale_x, scale_y, nonorthogonality_rad
        Sx, Sy, alpha.
    polynomial
        P_x and P_y; None without.
    covariance
        (21, 21) of Sx, Sy, alpha (rad) and the coefficients (micrometres, in the frame of the polynomial), x
        then y.
    """

    scale_x: float
    scale_y: float
    nonorthogonality_rad: float
    polynomial: Polynomial | None = None
    covariance: Floats = field(default_factory=_no_covariance, repr=False)

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
            (n, 2) readings in micrometres from the zero of the comparator, to which the polynomials are tied.
        """
        corrected = self.linear(xy_um)
        return corrected if self.polynomial is None else corrected + self.polynomial.evaluate(corrected)

    def invert(self, corrected_um: Floats) -> Floats:
        """Return the readings (n, 2) that `apply` corrects to the given coordinates (n, 2).

        Raises
        ------
        InputError
            Newton's iteration does not come to rest: the place is far outside the calibrated range.
        """
        linear = np.array(corrected_um, dtype=float)
        if self.polynomial is not None:
            linear = self._before_polynomial(self.polynomial, linear)
        return np.asarray(np.linalg.solve(self.matrix, linear.T).T)

    @staticmethod
    def _before_polynomial(polynomial: Polynomial, corrected: Floats) -> Floats:
        place = corrected.copy()
        for _ in range(STEPS):
            excess = place + polynomial.evaluate(place) - corrected
            jacobian = np.eye(2) + polynomial.jacobian(place)
            step = np.linalg.solve(jacobian, excess[..., np.newaxis])[..., 0]
            place = place - step
            # Rounding of coordinates of a metre is 1e-10 um.
            if np.abs(step).max(initial=0.0) < 1e-8:
                return place
        raise InputError("the correction cannot be inverted so far outside the calibrated range")

    def covariance_of(self, xy_um: Floats, measured_um2: Floats | None = None) -> Floats:
        """Return the covariance of corrected readings (n, 2, 2) in um^2.

        It holds for the position relative to the centre of the frame of the polynomials: rotation and shift
        of corrected coordinates are free.

        Parameters
        ----------
        xy_um
            (n, 2) readings.
        measured_um2
            (2, 2) or (n, 2, 2) covariance of the readings themselves; None for that of the correction alone.
        """
        by_parameters, by_reading = self._partials(np.asarray(xy_um, dtype=float))
        covariance = by_parameters @ self.covariance @ by_parameters.transpose(0, 2, 1)
        if measured_um2 is not None:
            covariance = covariance + by_reading @ np.asarray(measured_um2) @ by_reading.transpose(0, 2, 1)
        return np.asarray(covariance)

    def _partials(self, xy_um: Floats) -> tuple[Floats, Floats]:
        """Return partials of corrected readings by parameters (n, 2, 21) and by readings (n, 2, 2)."""
        linear = self.linear(xy_um)
        frame = self.polynomial.frame if self.polynomial else Frame.metres()
        inner = np.eye(2) + (
            self.polynomial.jacobian(linear) if self.polynomial else np.zeros((len(linear), 2, 2))
        )
        # Counted from the reading at the centre of the frame: a shift is not part of the correction.
        x, y = (xy_um - np.linalg.solve(self.matrix, frame.centre_um)).T
        s, c = math.sin(self.nonorthogonality_rad), math.cos(self.nonorthogonality_rad)
        zero = np.zeros_like(x)
        by_linear = np.array([[x, s * y, self.scale_y * c * y], [zero, c * y, -self.scale_y * s * y]])
        by_parameters = np.zeros((len(x), 2, PARAMETERS))
        by_parameters[:, :, :3] = inner @ by_linear.transpose(2, 0, 1)
        if self.polynomial is not None:
            functions = design(frame, linear)
            by_parameters[:, 0, 3:12] = functions
            by_parameters[:, 1, 12:] = functions
        return by_parameters, inner @ self.matrix

    def document(self) -> dict[str, Any]:
        """Return the correction as the members of a JSON document, units in their names."""
        document: dict[str, Any] = {
            "scale_x": self.scale_x,
            "scale_y": self.scale_y,
            "nonorthogonality_rad": self.nonorthogonality_rad,
            "polynomial": None,
            "covariance": self.covariance.tolist(),
        }
        if self.polynomial is not None:
            document["polynomial"] = {
                "centre_um": list(self.polynomial.frame.centre_um),
                "half_range_um": list(self.polynomial.frame.half_range_um),
                "coefficients_x_um": self.polynomial.scaled_um[0].tolist(),
                "coefficients_y_um": self.polynomial.scaled_um[1].tolist(),
            }
        return document

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> Correction:
        """Return the correction that :meth:`document` described.

        Raises
        ------
        KeyError, TypeError, ValueError
            It is no such document.
        """
        polynomial = None
        if (members := document["polynomial"]) is not None:
            (x, y), (half_x, half_y) = members["centre_um"], members["half_range_um"]
            frame = Frame((float(x), float(y)), (float(half_x), float(half_y)))
            scaled = np.array([members["coefficients_x_um"], members["coefficients_y_um"]], dtype=float)
            polynomial = Polynomial(frame, scaled.reshape(2, 9), np.zeros((18, 18)))
        return cls(
            float(document["scale_x"]),
            float(document["scale_y"]),
            float(document["nonorthogonality_rad"]),
            polynomial,
            np.array(document["covariance"], dtype=float).reshape(PARAMETERS, PARAMETERS),
        )

    def to_json(self) -> bytes:
        """Return the correction as a JSON document (UTF-8)."""
        return orjson.dumps(self.document(), option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)

    @classmethod
    def read(cls, path: Path) -> Correction:
        """Read a correction, or the one in the document of a calibration.

        Raises
        ------
        InputError
            The file cannot be read or holds none.
        """
        data = read_bytes(path)
        try:
            document = orjson.loads(data)
            return cls.from_document(document.get("correction", document))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InputError(f"holds no correction of a comparator: {error}", file=path) from None
