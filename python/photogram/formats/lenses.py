"""Cameras of one family, forward Brown about a principal point, under the names of other packages."""

from __future__ import annotations

from collections.abc import Mapping

from photogram.formats.project import Size
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera

_TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_MIDDLE = frozenset({"bal", "perspective", "brown", "brown_forward"})
"""Models that count from the middle of the picture, y up."""
_FAMILY = _MIDDLE | {
    *("radial", "simple_radial", "simple_pinhole", "pinhole"),
    *("opencv", "full_opencv", "opencv_pinhole", "agisoft_frame"),
}


@dataclass(frozen=True)
class Lens:
    """A camera in pixels whose lens is that of OpenCV, y down; p1 belongs to r^2 + 2 y^2 in y."""

    fx: float  # Principal distances
    fy: float
    cx: float  # Principal point from the upper-left corner
    cy: float
    k1: float = 0.0  # Terms; k4 .. k6 are of the denominator
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    @property
    def terms(self) -> tuple[float, ...]:
        """k1, k2, p1, p2, k3, k4, k5, k6."""
        return tuple(getattr(self, name) for name in _TERMS)

    def is_plain(self, *names: str) -> bool:
        """Whether nothing but the named terms is there."""
        return not any(getattr(self, name) for name in _TERMS if name not in names)


def lens_of(camera: Camera, size: Size | None) -> Lens | None:
    """Return a camera as one of the family, to the last digit; None where it is none.

    A camera that counts from the middle of the picture needs its size.
    """
    values = camera.parameters
    if camera.unit != "px" or camera.model not in _FAMILY:
        return None
    if camera.model == "opencv_pinhole" and any(values[name] for name in ("s1", "s2", "s3", "s4")):
        return None
    terms = {name: values[name] for name in _TERMS if name in values}
    if camera.model == "agisoft_frame":
        if values["b2"] or values["k4"]:
            return None
        terms |= {"p1": values["p2"], "p2": values["p1"]}
        fx, middle = values["f"] + values["b1"], (values["w"] / 2, values["h"] / 2)
        return Lens(fx, values["f"], middle[0] + values["cx"], middle[1] + values["cy"], **terms)
    if camera.model in _MIDDLE:
        return None if size is None else _about_middle(camera, size, terms)
    if "k" in values:
        terms = {"k1": values["k"]}
    fx, fy = (values["f"], values["f"]) if "f" in values else (values["fx"], values["fy"])
    return Lens(fx, fy, values["cx"], values["cy"], **terms)


def _about_middle(camera: Camera, size: Size, terms: Mapping[str, float]) -> Lens | None:
    values = camera.parameters
    f = values["f"] if camera.model == "bal" else -values["c"]
    lost = {"brown": ("K1", "K2", "K3", "P1", "P2", "b1", "b2"), "brown_forward": ("C1", "C2", "r0")}
    if f < 0 or any(values[name] for name in lost.get(camera.model, ())):
        return None
    if camera.model == "brown_forward":
        # With y down B2 has the other sign.
        terms = {"p1": -values["B2"] * f, "p2": values["B1"] * f}
        terms |= {f"k{n}": values[f"A{n}"] * f ** (2 * n) for n in (1, 2, 3)}
    middle = size[0] / 2 + values.get("xp", 0.0), size[1] / 2 - values.get("yp", 0.0)
    return Lens(f, f, *middle, **terms)
