"""Adjustment of blocks and of single photos by least squares."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.adjustment.adjustment import AsPublished, Ordering, Progress, UnitVariance, adjust

__all__ = ["AsPublished", "Ordering", "Progress", "UnitVariance", "adjust"]

WAYS = {"findings_of": ("findings",)}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__ = on_demand(__name__, dict.fromkeys(__all__, "adjustment"))
