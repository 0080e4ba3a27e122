"""How coordinates and angles of a network stand in the tables of a page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogram.arguments.types import Floats
from photogram.results.findings import axes
from photogram.results.result import Result
from photogram.show.angles import ARCSEC, degrees_minutes_seconds
from photogram.show.page import Cell, Column, decimals_of, fixed

__all__ = ["Frame", "block_frame", "degrees"]


@dataclass(frozen=True)
class Frame:
    """Names and units of k components, and how their values are written.

    Attributes
    ----------
    names
        What the components are called.
    units
        Of their differences and standard deviations.
    factors
        (k,) what leads from inner units to these.
    angles
        Whether a component is written in degrees, minutes and seconds, or in degrees.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    factors: Floats
    angles: tuple[str, ...]

    def values(self, decimals: Sequence[int]) -> list[Column]:
        """Return columns for values."""
        return [
            Column(name, unit if angle == "" else {"dms": "° ′ ″", "deg": "°"}[angle], decimals=count)
            for name, unit, angle, count in zip(self.names, self.units, self.angles, decimals, strict=True)
        ]

    def deviations(self, decimals: Sequence[int], before: str = "sd ") -> list[Column]:
        """Return columns for standard deviations or differences."""
        return [
            Column(f"{before}{name}", unit, decimals=count)
            for name, unit, count in zip(self.names, self.units, decimals, strict=True)
        ]

    def decimals(self, deviations: Floats) -> list[int]:
        """Return decimals of standard deviations (n, k) in inner units: two figures of the median."""
        scaled = np.reshape(deviations, (-1, len(self.names))) * self.factors
        return [decimals_of(column) for column in scaled.T]

    def value_decimals(self, deviations: Floats) -> list[int]:
        """Return decimals of values: as their standard deviations have, in degrees four more."""
        return [
            min(count + (4 if angle == "deg" else 0), 9)
            for count, angle in zip(self.decimals(deviations), self.angles, strict=True)
        ]

    def cell(self, component: int, value: float, decimals: int) -> Cell:
        """Return a value of a component."""
        angle = self.angles[component]
        if not math.isfinite(value) or not angle:
            return Cell(float(value))
        if angle == "deg":
            return Cell(math.degrees(value))
        parts = degrees_minutes_seconds(value, decimals)
        width = decimals + 3 if decimals else 2
        sign = "-" if value < 0 else ""
        return Cell(
            f"{sign}{parts[0]} {parts[1]:02d} {parts[2]:0{width}.{decimals}f}", sorts=math.degrees(value)
        )

    def cells(self, values: Floats, decimals: Sequence[int]) -> list[Cell]:
        """Return a row of values."""
        return [self.cell(k, float(value), decimals[k]) for k, value in enumerate(values)]

    def difference(self, component: int, value: float, decimals: int) -> Cell:
        """Return a difference or standard deviation in inner units, with decimals of its component."""
        outer = value * float(self.factors[component])
        return Cell(fixed(outer, decimals), sorts=outer) if math.isfinite(outer) else Cell(outer)

    def differences(self, values: Floats) -> list[Cell]:
        """Return a row of standard deviations or differences."""
        return [Cell(float(value)) for value in values * self.factors]


def block_frame(result: Result) -> Frame:
    """Return how the coordinates of a block are written."""
    unit = result.block.linear_unit
    if result.block.geographic:
        factors = np.array([1.0 / ARCSEC, 1.0 / ARCSEC, 1.0])
        return Frame(axes(result), ("″", "″", unit), factors, ("dms", "dms", ""))
    return Frame(axes(result), (unit,) * 3, np.ones(3), ("", "", ""))


def degrees() -> Frame:
    """Return how attitudes are written: degrees, their standard deviations in seconds of arc."""
    return Frame(("omega", "phi", "kappa"), ("″",) * 3, np.full(3, 1.0 / ARCSEC), ("deg",) * 3)
