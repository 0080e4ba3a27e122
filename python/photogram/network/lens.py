"""Fixed lens models: conversion between measured and ideal focal-plane positions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, get_args

import numpy as np

from photogram.arguments.arrays import number, numbers, one_of
from photogram.arguments.objects import require
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass

LensModel = Literal["radial", "transverse", "lrolrocnac", "kaguyalism", "cahvor", "radtan"]

STEPS = 50
CLOSE = 1e-14  # Convergence limit of the inverse, relative to the coordinates (at least 1 mm)
APART = 1e-6  # Step of the numerical derivatives of the inverse, relative in the same way


@dataclass(frozen=True)
class Lens:
    """Fixed distortion of a lens, with models of the Community Sensor Model.

    Parameters
    ----------
    model
        d = (x, y) in millimetres, y **down**, and r = ||d||. Backward models correct the measured position d,
        forward models distort the ideal position d.

        `radial` (k0, k1, k2), backward: d (1 - k0 - k1 r^2 - k2 r^4).
        `transverse` (20), forward: ten coefficients of x, then ten of y, of 1, x, y, x^2, x y, y^2, x^3,
        x^2 y, x y^2, y^3.
        `lrolrocnac` (k), backward: x, y / (1 + k y^2).
        `kaguyalism` (bx, a0 .. a3, by, b0 .. b3), backward: x + a0 + a1 r + a2 r^2 + a3 r^3 + bx; y with b.
        `cahvor` (k0, k1, k2, x0, y0), backward: `radial` about (x0, y0).
        `radtan` (k1, k2, p1, p2, k3), forward: the OpenCV model of d / focal_length.
    coefficients
        Coefficients of the model, in this order.
    focal_length
        Focal length in millimetres, for `radtan`.

    Raises
    ------
    InputError
        If the model does not exist, the number of coefficients is wrong, or a value is not finite.
    """

    model: LensModel
    coefficients: tuple[float, ...]
    focal_length: float = 1.0

    def __post_init__(self) -> None:
        one_of("model of a lens", self.model, get_args(LensModel))
        own = np.atleast_1d(numbers(f"coefficients of the lens {self.model}", self.coefficients))
        count, *_ = _FORMULAS[self.model]
        good = own.shape == (count,) and np.isfinite(own).all()
        require(
            good, f"coefficients of the lens {self.model}", "numbers", count=count, value=self.coefficients
        )
        object.__setattr__(self, "coefficients", tuple(own.tolist()))
        usable = np.isfinite(number("focal_length", self.focal_length)) and self.focal_length != 0
        require(usable, f"focal_length of the lens {self.model}", "positive", value=self.focal_length)

    def corrected(self, places: Floats) -> Floats:
        """Convert (n, 2) measured positions to positions of a perfect lens; millimetres, y up."""
        return self._inverse(places) if _FORMULAS[self.model][1] else self._formula(places)

    def distorted(self, places: Floats) -> Floats:
        """Convert (n, 2) positions of a perfect lens to measured positions; millimetres, y up."""
        return self._formula(places) if _FORMULAS[self.model][1] else self._inverse(places)

    def _formula(self, places: Floats) -> Floats:
        x, y = places[:, 0], -places[:, 1]
        found = _FORMULAS[self.model][2](x, y, self.coefficients, self.focal_length)
        return np.column_stack([found[0], -found[1]])

    def _inverse(self, places: Floats) -> Floats:
        """Invert the formula by Newton's method with numerical derivatives."""
        found = places.copy()
        size = np.maximum(1.0, np.abs(places).max(initial=0.0))
        h = APART * size
        for _ in range(STEPS):
            slopes = [
                (self._formula(found + h * e) - self._formula(found - h * e)) / (2 * h) for e in np.eye(2)
            ]
            (a, c), (b, d) = (each.T for each in slopes)
            miss = places - self._formula(found)
            with np.errstate(divide="ignore", invalid="ignore"):
                step = (
                    np.column_stack([d * miss[:, 0] - b * miss[:, 1], a * miss[:, 1] - c * miss[:, 0]])
                    / (a * d - b * c)[:, np.newaxis]
                )
            found = found + step
            if not (np.abs(step) > CLOSE * size).any():
                break
        return found


def _radial(x: Floats, y: Floats, k: Sequence[float], _: float) -> tuple[Floats, Floats]:
    r2 = x * x + y * y
    factor = 1 - k[0] - k[1] * r2 - k[2] * r2 * r2
    return x * factor, y * factor


def _cahvor(x: Floats, y: Floats, k: Sequence[float], f: float) -> tuple[Floats, Floats]:
    x0, y0 = k[3:]
    dx, dy = _radial(x - x0, y - y0, k[:3], f)
    return dx + x0, dy + y0


def _transverse(x: Floats, y: Floats, k: Sequence[float], _: float) -> tuple[Floats, Floats]:
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3])
    own = np.reshape(k, (2, 10)) @ terms
    return own[0], own[1]


def _lrolrocnac(x: Floats, y: Floats, k: Sequence[float], _: float) -> tuple[Floats, Floats]:
    return x, y / (1 + k[0] * y * y)


def _kaguyalism(x: Floats, y: Floats, k: Sequence[float], _: float) -> tuple[Floats, Floats]:
    r = np.hypot(x, y)
    powers = np.stack([np.ones_like(r), r, r * r, r**3])
    bx, by = k[0], k[5]
    return x + k[1:5] @ powers + bx, y + k[6:10] @ powers + by


def _radtan(x: Floats, y: Floats, k: Sequence[float], f: float) -> tuple[Floats, Floats]:
    k1, k2, p1, p2, k3 = k
    x, y = x / f, y / f
    r2 = x * x + y * y
    factor = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    own_x = x * factor + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    own_y = y * factor + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return f * own_x, f * own_y


_Formula = Callable[[Floats, Floats, Sequence[float], float], tuple[Floats, Floats]]
_FORMULAS: dict[str, tuple[int, bool, _Formula]] = {
    "radial": (3, False, _radial),
    "transverse": (20, True, _transverse),
    "lrolrocnac": (1, False, _lrolrocnac),
    "kaguyalism": (10, False, _kaguyalism),
    "cahvor": (5, False, _cahvor),
    "radtan": (5, True, _radtan),
}  # Number of coefficients, whether the model is forward, formula
