"""What is written of a calibration: cameras, sizes of their pictures, and where they are to each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.targets.calibration_result import Calibrated
from photogram.targets.vision import inverted

__all__ = ["Rig", "rig_of"]


@dataclass(frozen=True, eq=False)
class Rig:
    """K cameras in pixels from 0 at the centre of the first.

    Attributes
    ----------
    cameras
        The cameras.
    sizes
        Width and height of their pictures, pixels; None where not known.
    sensors
        (K, 4, 4) camera 0 -> camera k; NaN of cameras that are not tied to it.
    calibrated
        What they came from; None where that is not at hand.
    """

    cameras: tuple[Camera, ...]
    sizes: tuple[tuple[int, int] | None, ...]
    sensors: Floats
    calibrated: Calibrated | None = None

    @property
    def names(self) -> list[str]:
        """What files call the cameras."""
        return [each.name or f"camera {row}" for row, each in enumerate(self.cameras)]

    @property
    def files(self) -> list[str]:
        """The same as names of files."""
        return ["".join(c if c.isalnum() or c in "-_." else "-" for c in each) for each in self.names]

    def tied(self, camera: int) -> bool:
        """Return whether the pose of a camera to camera 0 is known."""
        return bool(np.isfinite(self.sensors[camera]).all())

    def from_before(self, camera: int) -> Floats:
        """Return (4, 4) the camera before -> a camera."""
        return np.asarray(self.sensors[camera] @ inverted(self.sensors[camera - 1]))

    def size(self, camera: int) -> tuple[int, int]:
        """Return width and height of the pictures of a camera.

        Raises
        ------
        InputError
            They are not known.
        """
        found = self.sizes[camera]
        if found is None:
            raise InputError(
                f"the camera {self.names[camera]}: the size of its pictures is not known: --size WxH beside"
                " corners, width and height of cameras in a project"
            )
        return found

    def refusal(self, camera: int, title: str, models: Sequence[str], why: str = "") -> InputError:
        """Return the error of a camera that a format cannot hold, with the command that fits another."""
        own = self.cameras[camera]
        return InputError(
            f"{title} cannot hold the camera {self.names[camera]}, {own.model}{why}:"
            f" `photogram convert-lens IN --to {models[0]}` fits one that it can"
            + (f" (or {', '.join(models[1:])})" if len(models) > 1 else "")
        )


def rig_of(calibrated: Calibrated) -> Rig:
    """Return the cameras of an adjusted calibration."""
    sensors = calibrated.sensors.copy()
    references = np.asarray(calibrated.calibration.references)
    sensors[(references != 0) & (np.arange(len(sensors)) > 0)] = np.nan
    return Rig(
        cameras=tuple(each.camera for each in calibrated.cameras),
        sizes=tuple(calibrated.calibration.corners.sizes),
        sensors=sensors,
        calibrated=calibrated,
    )
