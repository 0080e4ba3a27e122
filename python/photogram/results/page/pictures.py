"""Which pictures of a network stand on its page."""

from __future__ import annotations

from photogram.results.network import AdjustedNetwork
from photogram.show.page import Drawing

__all__ = ["drawings"]


def drawings(result: AdjustedNetwork) -> dict[str, Drawing]:
    """Return the pictures that a result has, by name."""
    return {}
