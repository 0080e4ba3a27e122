"""What is written of a calibration: cameras, sizes of their pictures, and where they are to each other.

Lenses are as OpenCV, ROS and Kalibr have them: a pinhole with terms in one order, or a fisheye with four;
so is YAML: numbers with all their digits, matrices in rows.
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
    """A lens."""

    fisheye: bool  # Whether it is equidistant
    focal: tuple[float, float]  # fx, fy and cx, cy
    centre: tuple[float, float]
    terms: Mapping[str, float]  # By their names; missing ones are 0

    @property
    def matrix(self) -> Floats:
        """(3, 3) K."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def first(self, count: int) -> list[float] | None:
        """Return the first terms in the order of OpenCV; None where others are not 0."""
        order = FISHEYE_TERMS if self.fisheye else TERMS
        if any(value for name, value in self.terms.items() if name not in order[:count]):
            return None
        return [self.terms.get(name, 0.0) for name in order[:count]] + [0.0] * (count - len(order))

    def fewest(self, counts: tuple[int, ...]) -> list[float] | None:
        """Return the terms of the first of some counts that is enough; None where none is."""
        return next((found for each in counts if (found := self.first(each)) is not None), None)


def terms_of(camera: Camera) -> Terms | None:
    """Return a camera as such a lens, to the last digit; None where it is none."""
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
    # Width and height of their pictures, pixels; None where not known
    sizes: tuple[tuple[int, int] | None, ...]
    sensors: Floats  # (K, 4, 4) camera 0 -> camera k; NaN of cameras that are not tied to it
    calibrated: Calibrated | None = None  # What they came from; None where that is not at hand

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

    def size(self, camera: int) -> tuple[int, int]:
        """Return width and height of the pictures of a camera; an InputError where they are not known."""
        found = self.sizes[camera]
        if found is None:
            raise InputError(phrase("targets.no-size", camera=self.names[camera]))
        return found

    def refusal(
        self, camera: int, title: str, models: Sequence[str], code: str = "targets.refused"
    ) -> InputError:
        """Return the error of a camera that a format cannot represent, with the models that it can."""
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
