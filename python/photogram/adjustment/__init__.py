"""Adjustment of blocks and of single photos by least squares."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from photogram.adjustment.adjustment import AsPublished, Ordering, Progress, UnitVariance, adjust

__all__ = ["AsPublished", "Ordering", "Progress", "UnitVariance", "adjust"]

WAYS = {"findings_of": ("findings",)}
"""The files that show a result, by the names of the ways: see `photogram.show.ways`."""


def __getattr__(name: str) -> object:
    """Load the adjustment of blocks when it is asked for: a single photo does without."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from photogram.adjustment import adjustment

    return getattr(adjustment, name)
