"""The formats of cameras by their names, and files of a calibration in them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from photogram.arguments.arrays import one_of
from photogram.errors import InputError
from photogram.io import json
from photogram.targets.calibration_result import Calibrated
from photogram.targets.output.mrcal import mrcal_models, valid_region
from photogram.targets.output.opencv import opencv_yaml
from photogram.targets.output.rig import Rig, rig_of
from photogram.targets.output.ros import kalibr_camchain, ros_camera_info
from photogram.targets.uncertainty import uncertainty_map
from photogram.words import phrase

CAMERA_FORMATS: Mapping[str, Callable[[Rig], dict[str, bytes]]] = MappingProxyType(
    {
        "opencv_yaml": opencv_yaml,
        "ros_camera_info": ros_camera_info,
        "kalibr_camchain": kalibr_camchain,
        "mrcal": mrcal_models,
    }
)


def camera_files(calibrated: Calibrated, to: str, need: float | None = None) -> dict[str, bytes]:
    """Return the cameras of an adjusted calibration in the format of another program.

    Parameters
    ----------
    calibrated
        The adjusted calibration; pixels count from 0 at the centre of the first.
    to
        `opencv_yaml`, `ros_camera_info` (a file a camera), `kalibr_camchain` (one file), `mrcal` (a
        `.cameramodel` a camera, with the calibration where mrcal could have made it).
    need
        Of `mrcal`: the largest standard deviation (pixels, of directions) inside the
        `valid_intrinsics_region` of its cameras; None: there is no such region.

    Returns
    -------
    Contents by the names of files.

    Raises
    ------
    InputError
        A format that there is not, a lens that it cannot hold: the message has the command that fits one that
        it can. `need` with another format, or no pixel that is so well known.
    """
    one_of("format of cameras", to, list(CAMERA_FORMATS))
    rig = rig_of(calibrated)
    if need is None:
        return CAMERA_FORMATS[to](rig)
    if to != "mrcal":
        raise InputError(phrase("error.not-applicable", name="need", other=to))
    maps = (uncertainty_map(calibrated, row) for row in range(len(rig.cameras)))
    return mrcal_models(rig, {row: valid_region(each, need) for row, each in enumerate(maps)})


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
