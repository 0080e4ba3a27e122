"""Output content of a calibration: cameras, image sizes, and relative poses.

Lenses follow OpenCV, ROS and Kalibr: a pinhole with ordered terms, or a fisheye with four. YAML numbers have
all digits, and matrices are written by row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.targets.calibration_result import Calibrated
from photogram.words import phrase

# Pinhole, in the order of OpenCV; k4, k5, k6 are in the denominator
TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
FISHEYE_TERMS = ("k1", "k2", "k3", "k4")
PINHOLES = frozenset(
    {"simple_pinhole", "pinhole", "simple_radial", "radial", "opencv", "full_opencv", "opencv_pinhole"}
)
FISHEYES = frozenset(
    {"simple_fisheye", "fisheye", "simple_radial_fisheye", "radial_fisheye", "opencv_fisheye"}
)
_OTHER_NAMES = {"k": "k1"}


@dataclass(frozen=True)
class Terms:
    """Lens of the pinhole or fisheye type."""

    fisheye: bool  # Whether it is equidistant
    focal: tuple[float, float]  # fx, fy and cx, cy
    centre: tuple[float, float]
    terms: Mapping[str, float]  # By name; missing terms are 0

    @property
    def matrix(self) -> Floats:
        """(3, 3) K."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def first(self, count: int) -> list[float] | None:
        """Return the first terms in OpenCV order; None if others are not 0."""
        order = FISHEYE_TERMS if self.fisheye else TERMS
        if any(value for name, value in self.terms.items() if name not in order[:count]):
            return None
        return [self.terms.get(name, 0.0) for name in order[:count]] + [0.0] * (count - len(order))

    def fewest(self, counts: tuple[int, ...]) -> list[float] | None:
        """Return the terms for the first sufficient count; None if all are too small."""
        return next((found for each in counts if (found := self.first(each)) is not None), None)


def terms_of(camera: Camera) -> Terms | None:
    """Return a camera as an exactly equivalent lens; None if impossible."""
    if camera.model not in PINHOLES | FISHEYES:
        return None
    values = camera.parameters
    focal = (values["f"], values["f"]) if "f" in values else (values["fx"], values["fy"])
    core = {"f", "fx", "fy", "cx", "cy"}
    terms = {_OTHER_NAMES.get(name, name): value for name, value in values.items() if name not in core}
    return Terms(camera.model in FISHEYES, focal, (values["cx"], values["cy"]), terms)


@dataclass(frozen=True, eq=False)
class Rig:
    """K cameras in pixels from 0 at the centre of the first."""

    cameras: tuple[Camera, ...]  # The cameras
    # Image width and height, pixels; None if unknown
    sizes: tuple[tuple[int, int] | None, ...]
    sensors: Floats  # (K, 4, 4) camera 0 -> camera k; NaN for cameras not tied to it
    calibrated: Calibrated | None = None  # The source calibration; None if not available

    @property
    def names(self) -> list[str]:
        """Camera names in files."""
        return [each.name or f"camera {row}" for row, each in enumerate(self.cameras)]

    @property
    def files(self) -> list[str]:
        """Camera names as file names."""
        return ["".join(c if c.isalnum() or c in "-_." else "-" for c in each) for each in self.names]

    def tied(self, camera: int) -> bool:
        """Return whether the pose of a camera relative to camera 0 is known."""
        return bool(np.isfinite(self.sensors[camera]).all())

    def size(self, camera: int) -> tuple[int, int]:
        """Return image width and height of a camera.

        InputError: if they are unknown.
        """
        found = self.sizes[camera]
        if found is None:
            raise InputError(phrase("targets.no-size", camera=self.names[camera]))
        return found

    def refusal(
        self, camera: int, title: str, models: Sequence[str], code: str = "targets.refused"
    ) -> InputError:
        """Return the error of an unsupported camera, with the supported models."""
        fields = {"camera": self.names[camera], "model": self.cameras[camera].model, "to": "|".join(models)}
        return InputError(phrase(code, title=title, **fields))


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
