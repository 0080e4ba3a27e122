"""Camera formats by name, and files of a calibration in these formats."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from photogram.arguments.arrays import one_of
from photogram.errors import InputError
from photogram.io import json
from photogram.targets.mrcal import mrcal_models, valid_region
from photogram.targets.output import Rig, kalibr_camchain, opencv_yaml, rig_of, ros_camera_info
from photogram.targets.uncertainty import uncertainty_map
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated

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
        Adjusted calibration; pixels count from 0 at the centre of the first.
    to
        `opencv_yaml`, `ros_camera_info` (one file per camera), `kalibr_camchain` (one file), `mrcal` (one
        `.cameramodel` per camera, with the calibration if mrcal supports it).
    need
        For `mrcal`: the largest standard deviation (pixels, of directions) inside the
        `valid_intrinsics_region` of its cameras; None: omit the region.

    Returns
    -------
    Contents by file name.

    Raises
    ------
    InputError
        If the format is unknown or does not support the lens: the message has the command that fits a
        supported one. If `need` is given with another format, or if no pixel is accurate enough.
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
    """Return a covariance file of camera parameters, then dt, w of sensors."""
    names, cofactors = calibrated.cofactors(("cameras", "sensors"))
    scale = calibrated.covariance_scale
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
