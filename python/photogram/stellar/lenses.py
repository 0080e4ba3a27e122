"""Lenses of digital cameras for stellar calibration: models of `docs/cameras.md`."""

from __future__ import annotations

import math
from collections.abc import Callable

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import unknown_name


@dataclass(frozen=True)
class Lens:
    """Lens model of a digital camera."""

    model: str  # Camera model of `docs/cameras.md`
    # Parameters in the order of reports and files, fx, fy, cx, cy first; missing model parameters are zero
    names: tuple[str, ...]
    order: tuple[str, ...]  # All parameters of the model, in its order
    # Distance from the principal point in principal distances, without lens terms, for an axis angle
    # (radians)
    radius: Callable[[float], float]
    formula: str  # The radius formula for reports
    widest: float  # The field of view (radians) at and above which images are undefined
    # Terms that are zero unless given in a camera file: without them the lens is the named projection
    held: tuple[str, ...] = ()
    # Groups of terms for tests, in the order of removal if insignificant
    groups: tuple[tuple[str, ...], ...] = ()

    @property
    def places(self) -> tuple[int, ...]:
        """Indices of the parameters in the model."""
        return tuple(self.order.index(name) for name in self.names)


_SQUARE = ("fx", "fy", "cx", "cy")
_TWO_TERMS = (*_SQUARE, "k1", "k2")
_FISHEYE = (*_SQUARE, "k1", "k2", "k3", "k4")

LENSES: dict[str, Lens] = {
    "brown": Lens(
        "full_opencv",
        (*_SQUARE, "k1", "k2", "k3", "p1", "p2"),
        (*_SQUARE, "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
        math.tan,
        "tan theta (1 + k1 r^2 + k2 r^4 + k3 r^6) and decentering",
        math.pi,
        groups=(("k3",), ("k2",), ("k1",), ("p1", "p2")),
    ),
    "equidistant": Lens("opencv_fisheye", _SQUARE, _FISHEYE, lambda theta: theta, "theta", math.tau),
    "equisolid": Lens(
        "equisolid",
        _TWO_TERMS,
        _TWO_TERMS,
        lambda theta: 2 * math.sin(0.5 * theta),
        "2 sin(theta/2)",
        math.tau,
        held=("k1", "k2"),
    ),
    "stereographic": Lens(
        "stereographic",
        _TWO_TERMS,
        _TWO_TERMS,
        lambda theta: 2 * math.tan(0.5 * theta),
        "2 tan(theta/2)",
        math.tau,
        held=("k1", "k2"),
    ),
    "kannala_brandt": Lens(
        "opencv_fisheye",
        _FISHEYE,
        _FISHEYE,
        lambda theta: theta,
        "theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)",
        math.tau,
        groups=(("k4",), ("k3",), ("k2",), ("k1",)),
    ),
}
"""Lenses by name in files and reports."""


def lens_named(name: str) -> Lens:
    """Return a lens.

    InputError: if the name is unknown.
    """
    if name not in LENSES:
        raise InputError(unknown_name("lens", name, LENSES))
    return LENSES[name]
