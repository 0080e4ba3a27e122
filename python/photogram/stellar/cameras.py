"""Calibrated cameras with their covariance, and their files: weighted priors of later adjustments."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io import json
from photogram.network.camera_files import BROWN, PLATE, brown_camera, plate_camera, read_calibrated
from photogram.network.cameras import Camera
from photogram.stellar.parameters import GROUPS, INDEX, UNITS
from photogram.stellar.sky import TAU
from photogram.stellar.transformation import transformed_angles

if TYPE_CHECKING:
    from photogram.stellar.problem import Problem
    from photogram.stellar.result import Result

__all__ = ["BrownCamera", "PlateCamera", "camera_document"]


BROWN_PLACE = (3, 4, 1, 2, 7, 8, 9, 11, 10)
"""Places of these among the common parameters of the core, whose P1 is the p2 of computer vision."""
COMMON = 17
"""Parameters of the core that all images share."""


def weight_of(covariance: Floats) -> Floats:
    """Return the weight matrix of a covariance whose rows differ by orders of magnitude.

    Raises
    ------
    InputError
        The covariance is not positive definite.
    """
    sd = np.sqrt(np.diag(covariance))
    try:
        lower = np.linalg.cholesky(covariance / np.outer(sd, sd))
    except np.linalg.LinAlgError:
        raise InputError("the covariance of the camera is not positive definite") from None
    root = np.linalg.solve(lower, np.diag(1.0 / sd))
    return np.asarray(root.T @ root, float)


@dataclass(frozen=True, eq=False)
class PlateCamera:
    """The camera of a plate: the interior parameters of a calibration.

    Attributes
    ----------
    values
        (13,) epsilon, xp, yp, cx, cy, dx, dy, K1 to K5, phi_T; radians, metres.
    covariance
        (13, 13), scaled by the square of `mean_error`; zero for what was held.
    mean_error
        Mean error of unit weight of the calibration, metres for unit plate weight.
    degrees_of_freedom
        Of the calibration.
    common_scale
        Whether cx is the principal distance of both axes.
    distortion_first
        Principal distance (metres) of the form with scale after distortion; 0 for scale before distortion.
    """

    values: Floats
    covariance: Floats
    mean_error: float
    degrees_of_freedom: int
    common_scale: bool = False
    distortion_first: float = 0.0

    @classmethod
    def of(cls, result: Result) -> PlateCamera:
        """Take the camera of a calibration; of the combined solution where there is one."""
        result = result.combined or result
        options = result.problem.options
        return cls(
            values=result.solved.parameters[9:22].copy(),
            covariance=result.covariance[9:22, 9:22].copy(),
            mean_error=result.mean_error,
            degrees_of_freedom=result.degrees_of_freedom,
            common_scale=options.common_scale,
            distortion_first=options.distortion_first,
        )

    @classmethod
    def read(cls, path: Path) -> PlateCamera:
        """Read what `camera_document` wrote.

        Raises
        ------
        InputError
            The file cannot be read, or is another document.
        """
        document, values, covariance = read_calibrated(path, "stellar camera")
        try:
            return cls(
                values,
                covariance,
                float(document["m"]),
                int(document["degrees_of_freedom"]),
                bool(document["common_scale"]),
                float(document["reference_principal_distance"] or 0.0),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"is not a camera: {error}", file=path) from None

    def document(self) -> dict[str, Any]:
        """Return the camera as it is written."""
        chosen = [i for i in range(len(PLATE)) if self.covariance[i, i] > 0]
        return {
            "program": f"photogram {_photocore.__version__}",
            "kind": "stellar camera",
            "form": "distortion, then scale" if self.distortion_first else "scale, then distortion",
            "reference_principal_distance": self.distortion_first or None,
            "common_scale": self.common_scale,
            "parameters": {
                name: {"value": value, "unit": UNITS[name]}
                for name, value in zip(PLATE, self.values.tolist(), strict=True)
            },
            "covariance": {
                "order": [PLATE[i] for i in chosen],
                "matrix": self.covariance[np.ix_(chosen, chosen)],
            },
            "m": self.mean_error,
            "degrees_of_freedom": self.degrees_of_freedom,
        }

    def to_json(self) -> bytes:
        """Return the camera as a JSON document."""
        return json.to_json(self.document())

    def as_camera(self, name: str = "", *, weighted: bool = True) -> Camera:
        """Return the camera as blocks take it: the model `plate`, in mm, with the parameters of this one.

        Image coordinates are those of the plate: x, y and the axis towards what is seen are right-handed.

        Parameters
        ----------
        name
            For reports.
        weighted
            Whether its parameters are observations with their full covariance; otherwise they are known. What
            was held here is held there.
        """
        return plate_camera(
            self.values,
            self.covariance,
            name,
            weighted=weighted,
            common_scale=self.common_scale,
            distortion_first=self.distortion_first,
        )

    def as_prior(self, problem: Problem, unit: float | None = None) -> Problem:
        """Return a calibration that begins with this camera and gives it the weight of its covariance.

        Parameters
        ----------
        problem
            A calibration; weights of its attitudes and refraction stay. What was held here is held there.
        unit
            Mean error of unit weight that is expected of it, metres for unit plate weight; that of this
            camera's own calibration when None.

        Raises
        ------
        InputError
            The camera is of another form.
        """
        options = problem.options
        if (self.common_scale, self.distortion_first) != (options.common_scale, options.distortion_first):
            raise InputError("the camera has another form: common scale, or order of scale and distortion")
        known = np.diag(self.covariance) > 0
        place = 9 + np.flatnonzero(known)
        weights, initial, fixed = (
            problem.parameter_weights.copy(),
            problem.initial.copy(),
            problem.fixed.copy(),
        )
        weights[9:22, :] = weights[:, 9:22] = 0.0
        part = self.covariance[np.ix_(known, known)]
        weights[np.ix_(place, place)] = (unit or self.mean_error) ** 2 * weight_of(part)
        initial[9:22] = self.values
        fixed[9:22] |= ~known & (np.arange(13) != INDEX["cy"] - 9 if self.common_scale else True)
        return replace(problem, parameter_weights=weights, initial=initial, fixed=fixed)


def camera_document(result: Result) -> bytes:
    """Return the camera of a calibration as JSON, with what programs for directions need besides.

    These are the attitudes, also in the system of the reference station, with their covariance, the station
    and its weather: what the program of 1967 punched.
    """
    result = result.combined or result
    problem = result.problem
    site, options = problem.site, problem.options
    groups = [g for g in range(3) if result.solved.free[3 * g : 3 * g + 3].any()]
    chosen = [INDEX[name] for name in result.estimated]
    angles = {GROUPS[g]: result.solved.parameters[3 * g : 3 * g + 3] for g in groups}
    document = PlateCamera.of(result).document() | {
        "orientation": {
            "unit": "rad",
            "order": ["alpha", "omega", "kappa"],
            "station": angles,
            "reference": None
            if options.reference is None
            else {
                group: transformed_angles(own, site, options.reference, options.pole)
                for group, own in angles.items()
            },
        },
        "station": {
            "number": site.number,
            "name": site.name,
            "latitude_deg": math.degrees(site.latitude),
            "longitude_west_deg": math.degrees(site.longitude_west),
            "elevation_m": site.elevation,
            "temperature_K": site.air.temperature,
            "pressure_mmHg": site.air.pressure,
        },
        "full_covariance": {
            "order": result.estimated,
            "matrix": result.covariance[np.ix_(chosen, chosen)],
        },
    }
    return json.to_json(document)


@dataclass(frozen=True, eq=False)
class BrownCamera:
    """A pinhole camera with Brown's distortion, in pixels, and its covariance.

    With (u, v) = (X, Y) / Z and r^2 = u^2 + v^2,
    x = fx (u (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 u v + p2 (r^2 + 2 u^2)) + cx,
    and y likewise with fy, cy, and p1, p2 exchanged.

    Attributes
    ----------
    values
        (9,) fx, fy, cx, cy, k1, k2, k3, p1, p2.
    covariance
        (9, 9); zero for what was held.
    """

    values: Floats
    covariance: Floats

    NAMES = BROWN

    @classmethod
    def of_field(cls, width: float, height: float, field_of_view: float) -> BrownCamera:
        """Return an ideal camera of a frame in pixels and a horizontal field of view in radians."""
        f = 0.5 * width / math.tan(0.5 * field_of_view)
        values = np.array([f, f, 0.5 * width, 0.5 * height, 0, 0, 0, 0, 0], float)
        return cls(values, np.zeros((9, 9)))

    @property
    def common(self) -> Floats:
        """(17,) as the core takes it."""
        common = np.zeros(COMMON)
        common[list(BROWN_PLACE)] = self.values
        common[13:] = TAU
        return common

    @property
    def known(self) -> NDArray[np.bool_]:
        """(9,) which parameters have a mean error."""
        return np.diag(self.covariance) > 0

    def as_camera(self, name: str = "", *, weighted: bool = True) -> Camera:
        """Return the camera as blocks take it: columns and rows, y down, the model `full_opencv`.

        Parameters
        ----------
        name
            For reports.
        weighted
            Whether its parameters are observations with their full covariance; otherwise they are known. What
            was held here is held there.
        """
        return brown_camera(self.values, self.covariance, name, weighted=weighted)

    def to_json(self) -> bytes:
        """Return the camera as a JSON document: a weighted prior of later adjustments."""
        document = {
            "program": f"photogram {_photocore.__version__}",
            "kind": "brown camera",
            "unit": "pixel",
            "parameters": dict(zip(BROWN, self.values.tolist(), strict=True)),
            "covariance": {"order": BROWN, "matrix": self.covariance},
        }
        return json.to_json(document)

    @classmethod
    def read(cls, path: Path) -> BrownCamera:
        """Read what `to_json` wrote.

        Raises
        ------
        InputError
            The file cannot be read, or is another document.
        """
        _, values, covariance = read_calibrated(path, "brown camera")
        return cls(values, covariance)
