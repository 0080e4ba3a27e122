"""Lenses of OpenCV and of the programs with its terms: pinholes and fisheyes, y down."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera

# Of a pinhole in the order of OpenCV (p1 of r^2 + 2 y^2 in y); k4, k5, k6 are in the denominator
TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
FISHEYE_TERMS = ("k1", "k2", "k3", "k4")
_PINHOLES = frozenset(
    {"simple_pinhole", "pinhole", "simple_radial", "radial", "opencv", "full_opencv", "opencv_pinhole"}
)
_FISHEYES = frozenset(
    {"simple_fisheye", "fisheye", "simple_radial_fisheye", "radial_fisheye", "opencv_fisheye"}
)


@dataclass(frozen=True)
class OpencvLens:
    """A camera with a lens of OpenCV, in the unit of the camera."""

    fisheye: bool  # Whether it is equidistant
    focal: tuple[float, float]  # fx, fy and cx, cy
    centre: tuple[float, float]
    terms: Mapping[str, float]  # By name; missing terms are 0

    @property
    def matrix(self) -> Floats:
        """(3, 3) K."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def named(self, *names: str) -> dict[str, float] | None:
        """Return some terms by name; None if others are not 0."""
        if any(value for name, value in self.terms.items() if name not in names):
            return None
        return {name: self.terms.get(name, 0.0) for name in names}

    def first(self, count: int) -> list[float] | None:
        """Return the first terms in OpenCV order; None if others are not 0."""
        order = FISHEYE_TERMS if self.fisheye else TERMS
        found = self.named(*order[:count])
        return None if found is None else [*found.values()] + [0.0] * (count - len(order))

    def fewest(self, counts: tuple[int, ...]) -> list[float] | None:
        """Return the terms for the first sufficient count; None if all are too small."""
        return next((found for each in counts if (found := self.first(each)) is not None), None)

    @property
    def ros(self) -> tuple[str, list[float]]:
        """Distortion model of ROS and its coefficients, which are empty if it has more terms."""
        if self.fisheye:
            return "equidistant", self.first(4) or []
        if (terms := self.first(5)) is not None:
            return "plumb_bob", terms
        return "rational_polynomial", self.first(8) or []


def opencv_lens(camera: Camera) -> OpencvLens | None:
    """Return a camera as an exactly equivalent lens; None if impossible."""
    if camera.model not in _PINHOLES | _FISHEYES:
        return None
    values = camera.parameters
    focal = (values["f"], values["f"]) if "f" in values else (values["fx"], values["fy"])
    core = {"f", "fx", "fy", "cx", "cy"}
    terms = {"k1" if name == "k" else name: value for name, value in values.items() if name not in core}
    return OpencvLens(camera.model in _FISHEYES, focal, (values["cx"], values["cy"]), terms)
