from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypedDict

from photogram.targets import Board
from photogram.targets.options import PixelOrigin, Regularisation, Shape, Synchronisation, ViewBy

class CalibrationKeywords(TypedDict, total=False):
    """Fields of `CalibrationOptions` as keywords of functions."""

    board: Board | Path | tuple[int, int] | None
    spacing: float | None
    unit: str | None
    shape: Shape | None
    cameras: Sequence[str]
    size: tuple[int, int] | None
    views: ViewBy
    within: float
    sync: Synchronisation
    offsets: Mapping[str, tuple[float, float]] | None
    pixel_origin: PixelOrigin
    model: str | None
    knots: tuple[int, int] | None
    knot_sd: tuple[float, float] | None
    sd0: float | None
    regularise: Regularisation | None
