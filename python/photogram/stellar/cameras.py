"""Calibrated cameras with covariance, and their files: weighted priors of later adjustments."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import truth_value
from photogram.arguments.fields import Checked
from photogram.arguments.objects import path_of
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.json import read_json, to_json
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.cameras import Camera
from photogram.stellar.parameters import INDEX, INTERIOR, UNITS
from photogram.stellar.problem import Problem
from photogram.stellar.sky_cameras import SkyCamera, camera_of_blocks, read_camera, weight_of
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.stellar import Result


_IN_MODEL = {"cx": "c", "cy": "c_y"}
_METRE = 1000.0  # in mm
_POWERS = {"rad": 0, "m": 1, "m^-1": -1, "m^-2": -2, "m^-3": -3, "m^-4": -4, "m^-6": -6}


@dataclass(frozen=True, eq=False)
class PlateCamera(Checked):
    """Calibrated plate camera.

    Attributes
    ----------
    values
        (13,) epsilon, xp, yp, cx, cy, dx, dy, K1 to K5, phi_T; radians, metres.
    covariance
        (13, 13), scaled by the square of `mean_error`; zero for fixed parameters.
    mean_error
        Mean error of unit weight of the calibration, metres for unit plate weight.
    degrees_of_freedom
        Degrees of freedom of the calibration.
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
        """Return the camera of a calibration, preferably of the combined solution."""
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
        """Read a camera file of `camera_document`.

        Raises
        ------
        InputError
            If the file cannot be read, or is another document.
        """
        document = read_json(path)
        document["kind"].choice(("stellar camera",))
        values, covariance = read_camera(document, INTERIOR)
        return cls(
            values,
            covariance,
            document["m"].number(),
            document["degrees_of_freedom"].whole(),
            document["common_scale"].value is True,
            document.get("reference_principal_distance", 0.0).number(),
        )

    def document(self) -> dict[str, Any]:
        """Return the members of the JSON document."""
        chosen = [i for i in range(len(INTERIOR)) if self.covariance[i, i] > 0]
        return {
            "program": f"photogram {_photocore.__version__}",
            "kind": "stellar camera",
            "form": "distortion, then scale" if self.distortion_first else "scale, then distortion",
            "reference_principal_distance": self.distortion_first or None,
            "common_scale": self.common_scale,
            "parameters": {
                name: {"value": value, "unit": UNITS[name]}
                for name, value in zip(INTERIOR, self.values.tolist(), strict=True)
            },
            "covariance": {
                "order": [INTERIOR[i] for i in chosen],
                "matrix": self.covariance[np.ix_(chosen, chosen)],
            },
            "m": self.mean_error,
            "degrees_of_freedom": self.degrees_of_freedom,
        }

    def to_json(self) -> bytes:
        """Return the camera as a JSON document."""
        return to_json(self.document())

    def as_camera(self, name: str = "", *, weighted: bool = True) -> Camera:
        """Return the camera of a block: the model `plate`, in mm.

        Image coordinates are plate coordinates: x, y and the axis towards the object are right-handed.

        Parameters
        ----------
        name
            Name in reports.
        weighted
            Whether parameters are weighted by their full covariance; otherwise they are fixed. Fixed
            parameters remain fixed.
        """
        scale = np.array([_METRE ** _POWERS[UNITS[each]] for each in INTERIOR])
        values, covariance = self.values * scale, self.covariance * np.outer(scale, scale)
        if self.common_scale:
            values[INTERIOR.index("cy")] = 0.0
        names = [*(_IN_MODEL.get(each, each) for each in INTERIOR), "c0"]
        values = np.append(values, _METRE * self.distortion_first)
        return camera_of_blocks("plate", names, values, np.pad(covariance, (0, 1)), name, weighted)

    def as_prior(self, problem: Problem, unit: float | None = None) -> Problem:
        """Return a calibration that uses this camera as a weighted prior.

        Parameters
        ----------
        problem
            Calibration whose weights of attitudes and refraction are unchanged. Fixed parameters remain
            fixed.
        unit
            Expected mean error of unit weight, metres for unit plate weight; None: the one of this camera's
            calibration.

        Raises
        ------
        InputError
            If the camera has another form.
        """
        options = problem.options
        if (self.common_scale, self.distortion_first) != (options.common_scale, options.distortion_first):
            raise InputError(phrase("stars.other-form"))
        known = np.diag(self.covariance) > 0
        place = 9 + np.flatnonzero(known)
        weights, initial = problem.parameter_weights.copy(), problem.initial.copy()
        fixed = problem.fixed.copy()
        weights[9:22, :] = weights[:, 9:22] = 0.0
        part = self.covariance[np.ix_(known, known)]
        weights[np.ix_(place, place)] = (unit or self.mean_error) ** 2 * weight_of(part)
        initial[9:22] = self.values
        fixed[9:22] |= ~known & (np.arange(13) != INDEX["cy"] - 9 if self.common_scale else True)
        return replace(problem, parameter_weights=weights, initial=initial, fixed=fixed)


def camera_from(path: Path | str, name: str = "", *, weighted: bool = True) -> Camera:
    """Read a camera file of `photogram stellar-camera` as a camera of blocks.

    Parameters
    ----------
    path
        `camera.json`, of plates or of digital exposures.
    name
        Name in reports.
    weighted
        Whether calibrated parameters are weighted by their full covariance; otherwise they are fixed.

    Returns
    -------
    `plate` (mm), or the model of a lens in pixels: columns and rows.

    Raises
    ------
    InputError
        If the file cannot be read, or is not a camera.
    """
    truth_value("weighted", weighted)
    file = path_of("path", path)
    document = read_json(file)
    if "nonorthogonality_rad" in document or "correction" in document:
        raise InputError(phrase("stars.correction"), file=file)
    plate = document.get("kind", "").value == "stellar camera"
    reader: type[PlateCamera | SkyCamera] = PlateCamera if plate else SkyCamera
    return reader.read(file).as_camera(name, weighted=weighted)


def camera_document(result: Result) -> bytes:
    """Return the camera of a calibration as JSON, with data for directions.

    These are the attitudes with their covariance, also in the system of the reference station, the station
    and its weather. The program of 1967 punched the same data.
    """
    result = result.combined or result
    problem = result.problem
    site, options = problem.site, problem.options
    chosen = [INDEX[name] for name in result.estimated]
    document = PlateCamera.of(result).document() | {
        "orientation": {
            "unit": "rad",
            "order": ["alpha", "omega", "kappa"],
            "station": {name: result.attitude(name) for name in result.groups},
            "reference": options.reference and result.transformed_attitudes(),
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
    return to_json(document)
