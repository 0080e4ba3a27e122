"""`cameras_covariance.json`: names, joint covariance and datum of cameras and sensors."""

from __future__ import annotations

from photogram.io import json
from photogram.targets.calibration_result import Calibrated

__all__ = ["FILE", "cameras_covariance"]

FILE = "cameras_covariance.json"


def cameras_covariance(calibrated: Calibrated) -> bytes:
    """Return the file: parameters of cameras, then dt, w of sensors (R <- Exp(w) R, t <- t + dt)."""
    names, cofactors = calibrated.cofactors(("cameras", "sensors"))
    scale = calibrated.result.covariance_scale
    return json.to_json(
        {
            "kind": "covariance of cameras",
            "cameras": [
                {"name": each.name, "model": each.camera.model, "parameters": dict(each.camera.parameters)}
                for each in calibrated.cameras
            ],
            "sensors": calibrated.sensors.tolist(),
            "names": names,
            "covariance": (scale * cofactors).tolist(),
            "datum": "axes",
            "pixel_origin": "center",
            "sigma0": None if scale is None else scale**0.5,
        }
    )
