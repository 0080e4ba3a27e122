"""Adjustment of blocks and of single photos by least squares."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.adjustment import findings  # noqa: F401  (what the verdict on a resection rests on)

if TYPE_CHECKING:
    from photogram.adjustment.adjustment import AsPublished, Ordering, Progress, UnitVariance, adjust

__all__ = ["AsPublished", "Ordering", "Progress", "UnitVariance", "adjust"]


def __getattr__(name: str) -> object:
    """Load the adjustment of blocks when it is asked for: a single photo does without."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from photogram.adjustment import adjustment

    return getattr(adjustment, name)
