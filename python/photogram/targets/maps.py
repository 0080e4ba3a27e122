"""Projection-uncertainty maps, uncertainty curves against distance, and image parts."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.io.csv_text import csv_text
from photogram.lazy_dataclasses import dataclass
from photogram.network.hull import hull, outside
from photogram.summaries import Brief, Rows
from photogram.targets.options import DatumName
from photogram.targets.projection import worst
from photogram.words import Phrase, phrase


def image_grid(size: tuple[int, int], grid: tuple[int, int]) -> tuple[Floats, Floats, Floats]:
    """Return (w,) columns, (h,) rows and (h w, 2) pixels of a grid over an image."""
    across, down = (np.linspace(0.0, length - 1.0, count) for length, count in zip(size, grid, strict=True))
    return across, down, np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)


def distance_text(distance: float, unit: str) -> str:
    """Return a distance in words: `at 2 m`, `at infinity`."""
    return str(at_distance(distance, unit))


def at_distance(distance: float, unit: str) -> Phrase:
    """Return the phrase of a distance."""
    return Phrase(f"map.at{'' if math.isfinite(distance) else '.infinity'}", {"n": distance, "unit": unit})


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class UncertaintyMap(Brief):
    """Projection uncertainty of points fixed to the camera housing.

    Attributes
    ----------
    camera, size
        Camera name, and image width and height, pixels.
    distance, unit
        Distance of the points from the camera centre; infinite: directions.
    datum, noise_only
        Datum, and whether only corner errors are included.
    columns, rows
        (w,) and (h,) grid coordinates, pixels from 0 at the centre of the first.
    covariances
        (h, w, 2, 2) covariances of image coordinates, square pixels; NaN for undefined pixels.
    corners
        (m, 2) observed board corners.
    model
        Verdict on the lens model, which the map assumes to be correct.
    """

    camera: str
    size: tuple[int, int]
    distance: float
    unit: str
    datum: DatumName
    noise_only: bool
    columns: Floats
    rows: Floats
    covariances: Floats
    corners: Floats
    model: str

    @property
    def sd(self) -> Floats:
        """(h, w) standard deviations in the worst direction, pixels."""
        return worst(self.covariances.reshape(-1, 2, 2)).reshape(self.covariances.shape[:2])

    @property
    def pixels(self) -> Floats:
        """(h, w, 2) the grid."""
        return np.stack(np.meshgrid(self.columns, self.rows), axis=-1)

    @property
    def coverage(self) -> Floats:
        """(k, 2) the convex hull of the observed corners."""
        return hull(self.corners)

    @property
    def inside(self) -> Bools:
        """(h, w) whether pixels of the grid are within the hull of the observed corners."""
        return ~outside(self.pixels.reshape(-1, 2), self.coverage).reshape(self.covariances.shape[:2])

    @property
    def largest(self) -> float:
        """Largest standard deviation in the observed board region, pixels.

        NaN if no pixel of the grid is in the region.
        """
        return float(np.fmax.reduce(self.sd[self.inside], initial=-np.inf)) if self.inside.any() else math.nan

    @property
    def title(self) -> str:
        """Title of the map with camera, distance and datum."""
        code, at = f"map.title{'.noise' if self.noise_only else ''}", at_distance(self.distance, self.unit)
        return str(phrase(code, camera=self.camera, at=at, datum=self.datum))

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the map."""
        rows = [
            ("largest", str(phrase("map.largest", seen=self.largest, all=float(np.nanmax(self.sd))))),
            ("smallest", str(phrase("map.pixels", size=float(np.nanmin(self.sd))))),
            ("model", self.model),
        ]
        return self.title, rows

    def to_npz(self) -> bytes:
        """Return the arrays and `sd` in the format of NumPy, named by attribute."""
        content = io.BytesIO()
        names = ("columns", "rows", "sd", "covariances", "corners", "size", "distance", "title", "model")
        arrays: dict[str, Any] = {name: np.asarray(getattr(self, name)) for name in names}
        np.savez_compressed(content, **arrays)
        return content.getvalue()

    def to_csv(self) -> bytes:
        """Return one row per pixel: column, row, sd in the worst direction, covariance."""
        flat = self.covariances.reshape(-1, 2, 2)
        own = self.pixels.reshape(-1, 2)
        return csv_text(
            {
                "column": own[:, 0],
                "row": own[:, 1],
                "sd": self.sd.ravel(),
                "variance_column": flat[:, 0, 0],
                "covariance": flat[:, 0, 1],
                "variance_row": flat[:, 1, 1],
            }
        )


def map_name(found: UncertaintyMap) -> str:
    """Return the map name in files: `left-infinity`."""
    away = "infinity" if math.isinf(found.distance) else f"{found.distance:g}"
    return f"{found.camera}-{away}"


@dataclass(frozen=True, eq=False, kw_only=True)
class UncertaintyCurve:
    """Projection uncertainty of one pixel against the distance of the point.

    Attributes
    ----------
    camera, pixel
        Camera and pixel.
    unit, datum
        Unit of distances, and datum.
    distances
        (n,) from the centre of the camera.
    sd
        (n,) standard deviations in the worst direction, pixels.
    """

    camera: str
    pixel: tuple[float, float]
    unit: str
    datum: DatumName
    distances: Floats
    sd: Floats

    @property
    def minimum(self) -> tuple[float, float]:
        """Distance of the smallest standard deviation, and its value."""
        best = int(np.nanargmin(self.sd))
        return float(self.distances[best]), float(self.sd[best])


PARTS = (5, 4)  # across and down
ACROSS = ("left", "left of the middle", "", "right of the middle", "right")
DOWN = ("upper", "above the middle", "below the middle", "lower")


@dataclass(frozen=True)
class PicturePart:
    """Image part: column and row, centre in pixels, and name."""

    cell: tuple[int, int]
    middle: tuple[float, float]
    name: str


def parts_of(size: tuple[int, int]) -> Iterator[PicturePart]:
    """Yield the parts of an image row by row."""
    for row in range(PARTS[1]):
        for column in range(PARTS[0]):
            x, y = (
                (each + 0.5) / count * (side - 1)
                for each, count, side in zip((column, row), PARTS, size, strict=True)
            )
            yield PicturePart((column, row), (x, y), _name(column, row))


def _name(column: int, row: int) -> str:
    """Return the name of a part: `upper left corner`, `left edge, above the middle`."""
    at_side, at_end = column in (0, PARTS[0] - 1), row in (0, PARTS[1] - 1)
    if at_side and at_end:
        return f"{DOWN[row]} {ACROSS[column]} corner"
    if at_side or at_end:
        edge, along = (ACROSS[column], DOWN[row]) if at_side else (DOWN[row], ACROSS[column])
        return f"{edge} edge" + (f", {along}" if along else "")
    return " and ".join(filter(None, (DOWN[row], ACROSS[column])))
