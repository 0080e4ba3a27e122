"""What the pictures of all programs share; matplotlib is an extra (`pip install 'photogram[plots]'`)."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import TYPE_CHECKING

from photogram.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["drawn", "round_length"]


def drawn(figure: Figure, path: Path) -> bytes:
    """Return a figure in the format that the name of a file asks for, PNG without one.

    Raises
    ------
    InputError
        The suffix names no format of matplotlib.
    """
    suffix = path.suffix.lower().removeprefix(".") or "png"
    if suffix not in figure.canvas.get_supported_filetypes():
        raise InputError(f"matplotlib draws no {suffix!r}; png, pdf and svg are possible", file=path)
    content = io.BytesIO()
    figure.savefig(content, format=suffix)
    return content.getvalue()


def round_length(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above a value.

    For a value that is not positive, which has none, it is 1.
    """
    if not value > 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))
