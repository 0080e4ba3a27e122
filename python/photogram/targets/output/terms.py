"""Lenses as OpenCV, ROS and Kalibr have them: a pinhole with terms in one order, or a fisheye with four."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera

__all__ = ["FISHEYE_TERMS", "TERMS", "Terms", "terms_of"]

TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
"""Of a pinhole, in the order of OpenCV; k4, k5, k6 are of the denominator."""
FISHEYE_TERMS = ("k1", "k2", "k3", "k4")
"""Of an equidistant camera."""
PINHOLES = frozenset(
    {"simple_pinhole", "pinhole", "simple_radial", "radial", "opencv", "full_opencv", "opencv_pinhole"}
)
FISHEYES = frozenset(
    {"simple_fisheye", "fisheye", "simple_radial_fisheye", "radial_fisheye", "opencv_fisheye"}
)
_OTHER_NAMES = {"k": "k1"}


@dataclass(frozen=True)
class Terms:
    """A lens.

    Attributes
    ----------
    fisheye
        Whether it is equidistant.
    focal, centre
        fx, fy and cx, cy.
    terms
        By their names; missing ones are 0.
    """

    fisheye: bool
    focal: tuple[float, float]
    centre: tuple[float, float]
    terms: Mapping[str, float]

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
