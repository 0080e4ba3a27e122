"""The options of reading a calibration: board, images, lens."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from photogram.arguments.fields import Checked, option
from photogram.lazy_dataclasses import dataclass
from photogram.targets.choices import PixelOrigin, Regularisation, Shape, Synchronisation, ViewBy

if TYPE_CHECKING:
    from photogram.targets.board import Board


def pair(text: str) -> tuple[int, int]:
    """Return two numbers with an x between them."""
    first, x, second = text.lower().partition("x")
    if not (x and first.strip().isdecimal() and second.strip().isdecimal()):
        raise ValueError("two numbers such as 10x7")
    return int(first), int(second)


def _board(text: str) -> Path | tuple[int, int]:
    """Return a file, or the corners along x and y."""
    if Path(text).is_file():
        return Path(text)
    try:
        return pair(text)
    except ValueError as error:
        raise ValueError(f"{error}, or an existing file") from None


def _deviations(text: str) -> tuple[float, float]:
    """Return two standard deviations with a comma between them."""
    try:
        radial, tangential = map(float, text.split(","))
    except ValueError:
        raise ValueError("two numbers, such as 1,0.1") from None
    return radial, tangential


def _offsets(texts: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return clock offsets with standard deviations from `right=0,0.01`."""
    offsets = {}
    for text in texts:
        camera, _, numbers = text.rpartition("=")
        try:
            offset, sd = map(float, (numbers if "," in numbers else f"{numbers},inf").split(","))
        except ValueError:
            offset = sd = math.nan
        if not (camera and math.isfinite(offset) and sd >= 0):
            raise ValueError("CAMERA=S or CAMERA=S,SD")
        offsets[camera] = offset, sd
    return offsets


def _corner_sd(texts: Sequence[str]) -> float:
    """Return the standard deviation of corners from `images=0.3`."""
    name, _, number = texts[-1].partition("=")
    try:
        sd = float(number)
    except ValueError:
        sd = 0.0
    if not (len(texts) == 1 and name.strip() == "images" and 0 < sd < math.inf):
        raise ValueError("images=S for x and y of a corner")
    return sd


@dataclass(frozen=True, kw_only=True)
class CalibrationOptions(Checked):
    """Options of :func:`photogram.targets.read`, and of `photogram calibrate`.

    Attributes
    ----------
    board
        The board, a file that describes it, or the number of corners of a chessboard along x and y. None: the
        board in the folder or in the corner file.
    spacing
        Distance between the corners of a chessboard, if `board` has only their numbers.
    shape, unit
        Override the values of the board.
    model
        Lens model as in :func:`first_values`.
    knots, knot_sd
        For a splined lens: number of knots along columns and rows (30, 20). Standard deviations of the zero
        priors, radial and tangential, in units of the stereographic image (1, 0.1).
    cameras, views, within, pixel_origin, size
        Grouping of images and pixel convention: see docs/targets.md.
    sync
        `known`: images of one view are simultaneous. `none`: each has its own pose. `offset`: images have
        times by camera clocks with unknown offsets.
    offsets
        Prior clock offsets by camera name: seconds, and their standard deviations. 0 is fixed, infinite is
        free (the default, from 0).
    sd0, regularise
        As in :class:`Calibration`.
    """

    board: Board | Path | tuple[int, int] | None = option(None, kind=str, parse=_board)
    spacing: float | None = None
    unit: str | None = None
    shape: Shape | None = None
    cameras: Sequence[str] = option((), kind=list[str])
    size: tuple[int, int] | None = option(None, kind=str, parse=pair)
    views: ViewBy = "name"
    within: float = option(0.005, 0.0)
    sync: Synchronisation = "known"
    offsets: Mapping[str, tuple[float, float]] | None = option(
        None, kind=list[str], parse=_offsets, name="--offset"
    )
    pixel_origin: PixelOrigin = "center"
    model: str | None = None
    knots: tuple[int, int] | None = option(None, kind=str, parse=pair)
    knot_sd: tuple[float, float] | None = option(None, kind=str, parse=_deviations)
    sd0: float | None = option(None, kind=list[str], parse=_corner_sd, name="--sd")
    regularise: Regularisation | None = None

    def __post_init__(self) -> None:
        from photogram.arguments.objects import require

        super().__post_init__()
        is_pair = isinstance(self.board, tuple)
        require(not is_pair or self.spacing is not None, "board", "requires", name="CxR", other="spacing")
        require(is_pair or self.spacing is None, "spacing", "requires", name="spacing", other="board CxR")
