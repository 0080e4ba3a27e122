"""The similarity x = s A X + B with covariance, and transformed points."""

from __future__ import annotations

from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import matrix_fault, number, numbers, shaped, truth_value
from photogram.arguments.objects import path_of
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io import json
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.geometry import rotation_angles, rotation_fault
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Similarity:
    """The similarity x = s A X + B from control X to model x (ground, model units).

    A = K(kappa) Phi(phi) Omega(omega) (TB 19, equation 2.3).

    Attributes
    ----------
    scale
        s, model units per ground unit.
    rotation
        (3, 3) A.
    control_centre, model_centre, shift
        (3,) each. The computations use x - model_centre = s A (X - control_centre) + shift, which preserves
        the digits of large coordinates.
    tangent_covariance
        (7, 7) covariance of three small rotations about the model axes (rad), s and shift; regular at every
        attitude. None if unknown.
    deviation_factor
        Factor of the standard deviations of transformed points. It is sigma0 if standard deviations of the
        stations were given and the covariance is scaled by sigma0 squared, because an error of the unit
        weight affects the points as well. Otherwise 1.
    """

    scale: float
    rotation: Floats
    control_centre: Floats
    model_centre: Floats
    shift: Floats
    tangent_covariance: Floats | None = None
    deviation_factor: float = 1.0

    @classmethod
    def from_core(
        cls,
        row: _photocore.CentredRow,
        tangent_covariance: Floats | None = None,
        deviation_factor: float = 1.0,
    ) -> Self:
        """Convert the row of the core."""
        scale, *arrays = row
        rotation, shift, control_centre, model_centre = map(np.array, arrays)
        centres = control_centre, model_centre
        return cls(scale, rotation, *centres, shift, tangent_covariance, deviation_factor)

    @classmethod
    def from_parameters(
        cls,
        scale: float,
        rotation: ArrayLike,
        translation: ArrayLike,
        covariance: ArrayLike | None = None,
        *,
        control_centre: ArrayLike = (0.0, 0.0, 0.0),
        model_centre: ArrayLike = (0.0, 0.0, 0.0),
        deviation_factor: float = 1.0,
    ) -> Self:
        """Create a similarity from the parameters of x = s A X + B.

        Parameters
        ----------
        scale, rotation, translation
            s, A (3, 3), B (3,).
        covariance
            (7, 7) of omega, phi, kappa (rad), s, b1, b2, b3, or None.
        control_centre, model_centre
            (3,) origins of the computation; any points near the stations.
        deviation_factor
            Factor of the standard deviations of points.

        Raises
        ------
        InputError
            If the scale is not positive, the matrix is not a rotation, the covariance is invalid, or a value
            is not a finite number.
        """
        a, b = shaped("rotation", rotation, (3, 3)), shaped("translation", translation, (3,))
        scale = number("scale", scale, "positive")
        deviation_factor = number("deviation_factor", deviation_factor, "positive")
        if reason := rotation_fault(a):
            raise InputError(phrase("orientation.rotation", reason=reason))
        centre, model = (
            shaped(name, value, (3,))
            for name, value in (("control_centre", control_centre), ("model_centre", model_centre))
        )
        with np.errstate(over="ignore", invalid="ignore"):
            shift = b + scale * a @ centre - model
        if not np.isfinite(shift).all():
            raise InputError(phrase("orientation.finite"))
        made = cls(scale, a, centre, model, shift, None, deviation_factor)
        if covariance is None:
            return made
        given = shaped("covariance", covariance, (7, 7))
        with np.errstate(all="ignore"):
            back = np.linalg.inv(made.parameter_partials)
            tangent: Floats = back @ given @ back.T
        fault = matrix_fault(given, singular=True)
        if fault or not np.isfinite(tangent).all():
            raise InputError(phrase("orientation.covariance", reason=fault.fields["reason"] if fault else ""))
        return replace(made, tangent_covariance=tangent)

    @property
    def translation(self) -> Floats:
        """(3,) B in model units."""
        b: Floats = self.shift + self.model_centre - self.scale * self.rotation @ self.control_centre
        return b

    @property
    def angles(self) -> Floats:
        """(3,) omega, phi, kappa in radians; phi in [-pi/2, pi/2]."""
        angles: Floats = rotation_angles(self.rotation[np.newaxis])[0]
        return angles

    @property
    def parameter_partials(self) -> Floats:
        """(7, 7) partials of omega, phi, kappa, s, b1, b2, b3 by tangent parameters."""
        return _photocore.similarity_partials(self._row())

    @property
    def covariance(self) -> Floats | None:
        """(7, 7) covariance of omega, phi, kappa (rad), s, b1, b2, b3 (model units) or None.

        Near phi = 90 degrees, the variances of omega and kappa are unbounded. Point covariances are not
        affected.
        """
        if self.tangent_covariance is None:
            return None
        partials = self.parameter_partials
        covariance: Floats = partials @ self.tangent_covariance @ partials.T
        return covariance

    def to_model(self, control: ArrayLike) -> Floats:
        """Return (n, 3) model coordinates x = s A X + B of control (TB 19, eq. 2.1)."""
        centred = shaped("control", control, (None, 3)) - self.control_centre
        model: Floats = self.scale * centred @ self.rotation.T + self.shift + self.model_centre
        return model

    def transform(self, model: ArrayLike, model_sd: ArrayLike = 0.0) -> tuple[Floats, Floats]:
        """Transform model points to control with covariances (TB 19, equation 2.2).

        Parameters
        ----------
        model
            (n, 3) model coordinates.
        model_sd
            Standard deviations in model units, broadcast to (n, 3), multiplied by `deviation_factor`. Default
            0, for the covariance of the parameters only.

        Returns
        -------
        (n, 3) X = A^T (x - B) / s in ground units, and their (n, 3, 3) covariances, NaN if the parameter
        covariance is unknown.

        Raises
        ------
        InputError
            If a shape differs, or a value is not a number.
        """
        points = shaped("model", model, (None, 3))
        try:
            sd = np.broadcast_to(numbers("model_sd", model_sd), points.shape) * self.deviation_factor
        except ValueError:
            fields = {"shape": str(points.shape), "actual": str(np.shape(model_sd))}
            raise InputError(phrase("orientation.broadcast", **fields)) from None
        covariance = self.tangent_covariance
        known = np.full((7, 7), np.nan) if covariance is None else covariance
        return _photocore.transform_points(self._row(), known, points, sd)

    def _row(self) -> _photocore.CentredRow:
        return (
            self.scale,
            self.rotation.tolist(),
            self.shift.tolist(),
            self.control_centre.tolist(),
            self.model_centre.tolist(),
        )


def read_similarity(path: Path, *, usable: bool = False) -> Similarity:
    """Read the parameters and their covariance from a JSON document.

    Parameters
    ----------
    path
        The document.
    usable
        True to reject an orientation that has not converged, or that has grave findings.

    Raises
    ------
    InputError
        If the file cannot be read, is not such a document, or the orientation is rejected.
    """
    truth_value("usable", usable)
    path = path_of("path", path)
    with json.holding("result of an absolute orientation", path):
        found = json.read_json(path).value
        is_refused, centres = usable and not found["usable"], found["centres"]
        reasons = ([*map(str, found["messages"])] or [found["status"]]) if is_refused else []
        covariance = found["covariance"]
        if covariance is not None and any(value is None for row in covariance for value in row):
            covariance = None  # An unknown element
        similarity = Similarity.from_parameters(
            found["scale"],
            found["rotation"],
            found["translation"],
            covariance,
            control_centre=centres["control"],
            model_centre=centres["model"],
            deviation_factor=found["deviation_factor"],
        )
    if is_refused:
        raise InputError(phrase("orientation.unusable", reasons=reasons), file=path)
    return similarity
