"""The options of the assessment of a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from photogram.arguments.fields import Checked, option
from photogram.lazy_dataclasses import dataclass

# Fixed: the corners of the camera, the mean of the boards, rays of the image, the axes of the camera
DatumName = Literal["corners", "mean-frames", "image", "axes"]
Into = Literal["odd", "halves"] | int


def distances_of(text: str) -> list[float]:
    """Return positive distances with commas between them."""
    try:
        distances = [float(each) for each in text.split(",") if each.strip()]
    except ValueError:
        distances = [0.0]
    if not all(each > 0 for each in distances):
        raise ValueError("a list of distances, such as 1,inf")
    return distances


def _division(text: str) -> str | int | None:
    """Return a division of the views for cross-validation."""
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
