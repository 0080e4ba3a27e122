"""Refraction models for air and water."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

from photogram.arguments.fields import Checked, option
from photogram.arguments.objects import require
from photogram.lazy_dataclasses import dataclass
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram._photocore import RefractionRow

Air = Literal["giant", "standard"]
Water = Literal["giant", "snell"]

METRES_PER_UNIT = {"m": 1.0, "ft": 0.3048}  # Linear units whose length is known


def _model(name: str, words: object) -> Any:
    """Return the option of a model; the word `none` is None."""
    return option(None, kind=words, parse=lambda word: None if word == "none" else word, name=name)


@dataclass(frozen=True)
class Refraction(Checked):
    """Refraction models of the rays between points and cameras (`docs/refraction.md`).

    Parameters
    ----------
    air
        "giant": K = 13 (H - h) [1 - 0.02 (2 H + h)] microradians, H and h in km, for cameras up to 9,000 m
        (GIANT guide, Appendix F). "standard": horizontal layers of the U.S. Standard Atmosphere 1976, at any
        height (after Saastamoinen 1974). None: air is ignored.
    water
        For points below the water level. "giant": Appendix G of the guide. "snell": the exact ray by Snell's
        law at a level surface. None: water is ignored.
    water_level
        Height of the water in the linear unit of the block: above the ellipsoid, or Z.
    refractive_index
        Refractive index of the water relative to air.

    Raises
    ------
    InputError
        If a model does not exist, the level is not finite, or the index is not finite and at least 1.
    """

    air: Air | None = _model("--air-refraction", Literal[Air, "none"])
    water: Water | None = _model("--water-refraction", Literal[Water, "none"])
    water_level: float = 0.0
    refractive_index: float = option(1.340, 1.0, name="--water-index")

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("water_level", "refractive_index"):
            require(math.isfinite(getattr(self, name)), name, "finite", value=getattr(self, name))

    def phrase(self, linear_unit: str) -> Phrase:
        """Return the refraction models as a message."""
        parts = [Phrase(f"refraction.air.{self.air}")] if self.air else []
        if self.water:
            fields = {"level": self.water_level, "unit": linear_unit, "index": self.refractive_index}
            parts.append(Phrase(f"refraction.water.{self.water}", fields))
        return Phrase("refraction", {"parts": parts}) if parts else Phrase("assume.no_refraction")

    def describe(self, linear_unit: str) -> str:
        """Return the refraction models in one line."""
        return str(self.phrase(linear_unit))

    def row(self, linear_unit: str) -> RefractionRow:
        """Return the row for the core: models, level, index, metres per linear unit.

        Raises
        ------
        InputError
            If the length of the unit is unknown.
        """
        metres = metres_per_unit(linear_unit)
        return self.air, self.water, self.water_level, self.refractive_index, metres


def metres_per_unit(linear_unit: str) -> float:
    """Return the length of a linear unit in metres, for the models of air."""
    known = linear_unit in METRES_PER_UNIT
    require(known, "linear_unit with refraction", "choice", names=list(METRES_PER_UNIT), value=linear_unit)
    return METRES_PER_UNIT[linear_unit]
