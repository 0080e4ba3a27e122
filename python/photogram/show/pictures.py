"""What the pictures of all programs share; matplotlib is an extra (`pip install 'photogram[plots]'`)."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from photogram.errors import InputError
from photogram.show.style import need_matplotlib, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 120
"""Dots an inch of pictures that are made of dots."""
SILENT: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
"""What formats would say of version and time."""


def new_figure(width: float, height: float) -> Figure:
    """Return a figure that belongs to no window (inches)."""
    need_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # takes long to import
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained", dpi=DPI)
    FigureCanvasAgg(figure)
    return figure


def drawn(figure: Figure, path: Path | None = None) -> bytes:
    """Return a figure in the format that the name of a file asks for, PNG without one.

    Raises
    ------
    InputError
        The suffix names no format of matplotlib.
    """
    suffix = "" if path is None else path.suffix.lower().removeprefix(".")
    suffix = suffix or "png"
    if suffix not in figure.canvas.get_supported_filetypes():
        raise InputError(f"matplotlib draws no {suffix!r}; png, pdf and svg are possible", file=path)
    content = io.BytesIO()
    # Equal figures give equal files, whatever version draws them, and whenever.
    with styled():
        figure.savefig(content, format=suffix, metadata=SILENT.get(suffix))
    return content.getvalue()


def files(figures: Mapping[str, Figure], folder: Path, ending: str) -> dict[Path, bytes]:
    """Return figures as files of a folder, in the format of their common ending (`png`, `pdf`, `svg`)."""
    places = {folder / f"{name}.{ending}": figure for name, figure in figures.items()}
    return {place: drawn(figure, place) for place, figure in places.items()}


def decimal_sign(figure: Figure, sign: str) -> None:
    """Write the numbers at all axes of a figure with the decimal sign of a language."""
    from matplotlib.ticker import ScalarFormatter

    class Signed(ScalarFormatter):
        def __call__(self, x: float, pos: int | None = None) -> str:
            return super().__call__(x, pos).replace(".", sign)

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(axis.get_major_formatter(), ScalarFormatter):
                axis.set_major_formatter(Signed(useOffset=False))


def round_length(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above a value.

    For a value that is not positive, which has none, it is 1.
    """
    if not value > 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))
