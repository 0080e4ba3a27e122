"""Names of the models of refraction on the command line."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["AirModel", "WaterModel"]


class AirModel(StrEnum):
    """Models of the refraction in air."""

    GIANT = "giant"
    STANDARD = "standard"
    NONE = "none"


class WaterModel(StrEnum):
    """Models of the refraction in water."""

    GIANT = "giant"
    SNELL = "snell"
    NONE = "none"
