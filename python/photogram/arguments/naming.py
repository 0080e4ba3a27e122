"""Names of photos and points, in the order in which people look for them."""

from __future__ import annotations

import re

__all__ = ["natural_order"]

_DIGITS = re.compile("([0-9]+)")


def natural_order(name: str) -> list[tuple[int, str]]:
    """Return the key by which people sort names: character by character, but runs of digits as numbers."""
    parts = _DIGITS.split(name)
    return [(int(part), "") if place % 2 else (-1, part) for place, part in enumerate(parts)]
