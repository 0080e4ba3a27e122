"""The options of reading a calibration: board, images, lens."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from photogram.arguments.fields import Checked, option
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.targets import Board


def pair(text: str) -> tuple[int, int]:
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


def _numbers(text: str, count: int | None, form: str) -> list[float]:
    """Return positive numbers with commas between them; else a ValueError with the required form."""
    try:
        found = [float(each) for each in text.split(",") if each.strip()]
    except ValueError:
        found = [0.0]
    if not all(each > 0 for each in found) or count not in (None, len(found)):
        raise ValueError(form)
    return found


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
    knot_sd: tuple[float, float] | None = option(
        None, kind=str, parse=lambda text: tuple(_numbers(text, 2, "two numbers, such as 1,0.1"))
    )
    sd0: float | None = option(None, kind=list[str], parse=_corner_sd, name="--sd")
    regularise: Regularisation | None = None

    def __post_init__(self) -> None:
        from photogram.arguments.objects import require

        super().__post_init__()
        is_pair = isinstance(self.board, tuple)
        require(not is_pair or self.spacing is not None, "board", "requires", name="CxR", other="spacing")
        require(is_pair or self.spacing is None, "spacing", "requires", name="spacing", other="board CxR")


Shape = Literal["held", "bend", "points"]  # estimated: none, centre-line deflections, every point
ViewBy = Literal["name", "time"]
Synchronisation = Literal["known", "none", "offset"]
Regularisation = Literal["mrcal"]
CornerBasis = Literal["kind", "camera", "level", "photo", "component", "rays"]
PixelOrigin = Literal["corner", "center"]


# Fixed: the corners of the camera, the mean of the boards, rays of the image, the axes of the camera
DatumName = Literal["corners", "mean-frames", "image", "axes"]
Into = Literal["odd", "halves"] | int


def distances_of(text: str) -> list[float]:
    return _numbers(text, None, "a list of distances, such as 1,inf")


def _division(text: str) -> str | int | None:
    if text in ("none", "odd", "halves"):
        return None if text == "none" else text
    if not (text.isdecimal() and int(text) > 1):
        raise ValueError("odd, halves, none, or a number greater than 1")
    return int(text)


@dataclass(frozen=True)
class WorthOptions(Checked):
    """Options of the assessment of a calibration, and of `photogram calibrate`.

    Attributes
    ----------
    distances
        Distances of the maps, in the unit of the board; empty: infinity, and the median distance of the
        boards.
    datum, noise_only
        Options of the maps.
    cross_validate
        Type of split; None: without cross-validation.
    suggest
        Number of suggested views.
    grid
        Grid of the maps, pixels across and down.
    """

    distances: Sequence[float] = option((), kind=str, parse=distances_of, name="--distance")
    datum: DatumName = option("corners", name="--datum")
    noise_only: bool = False
    cross_validate: Into | None = option("odd", kind=str, parse=_division)
    suggest: int = option(0, 0)
    grid: tuple[int, int] = (60, 40)
