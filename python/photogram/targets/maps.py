"""Maps of the uncertainty of projection over a picture, curves of it against distance, parts of a picture."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.io.csv_text import csv_text
from photogram.lazy_dataclasses import dataclass
from photogram.network.hull import hull, outside
from photogram.show.methods import Brief, Rows
from photogram.targets.projection import DatumName, worst


def image_grid(size: tuple[int, int], grid: tuple[int, int]) -> tuple[Floats, Floats, Floats]:
    """Return (w,) columns, (h,) rows and (h w, 2) pixels of a grid over a picture, from edge to edge."""
    across, down = (np.linspace(0.0, length - 1.0, count) for length, count in zip(size, grid, strict=True))
    return across, down, np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)


def distance_text(distance: float, unit: str) -> str:
    """Return a distance in words: `at 2 m`, `at infinity`."""
    return f"at {distance:g} {unit}" if math.isfinite(distance) else "at infinity"


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class UncertaintyMap(Brief):
    """How far off a camera may image points that stay fixed to its housing.

    Attributes
    ----------
    camera, size
        Its name, and width and height of its pictures, pixels.
    distance, unit
        Of the points from the centre of the camera; infinite: directions.
    datum, noise_only
        What holds still, and whether the errors of the corners alone count.
    columns, rows
        (w,) and (h,) of the grid, pixels from 0 at the centre of the first.
    covariances
        (h, w, 2, 2) of image coordinates, square pixels; NaN where a pixel sees nothing that is known.
    corners
        (m, 2) where the camera has seen the board.
    model
        What is known of the model of the lens, which the map takes for right.
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
        """(k, 2) the convex hull of the corners that were seen."""
        return hull(self.corners)

    @property
    def inside(self) -> Bools:
        """(h, w) which pixels of the grid lie within the area where the board was seen."""
        return ~outside(self.pixels.reshape(-1, 2), self.coverage).reshape(self.covariances.shape[:2])

    @property
    def largest(self) -> float:
        """Largest standard deviation where the board was seen, pixels; NaN where no pixel of the grid is."""
        return float(np.fmax.reduce(self.sd[self.inside], initial=-np.inf)) if self.inside.any() else math.nan

    @property
    def title(self) -> str:
        """What the map shows, with all that it depends on."""
        noise = ", noise alone" if self.noise_only else ""
        return (
            f"{self.camera}: standard deviation of projection {distance_text(self.distance, self.unit)}"
            f" (datum {self.datum}{noise}), px"
        )

    def brief(self) -> tuple[str, Rows]:
        """Return the map in a few lines."""
        rows = [
            (
                "largest",
                f"{self.largest:.3g} px where the board was seen, {np.nanmax(self.sd):.3g} px anywhere",
            ),
            ("smallest", f"{np.nanmin(self.sd):.3g} px"),
            ("model", self.model),
        ]
        return self.title, rows

    def to_npz(self) -> bytes:
        """Return the arrays in the format of NumPy, by the names of the attributes, with `sd`."""
        content = io.BytesIO()
        np.savez_compressed(
            content,
            columns=self.columns,
            rows=self.rows,
            sd=self.sd,
            covariances=self.covariances,
            corners=self.corners,
            size=np.array(self.size),
            distance=np.array(self.distance),
            title=np.array(self.title),
            model=np.array(self.model),
        )
        return content.getvalue()

    def to_csv(self) -> bytes:
        """Return a row for each pixel of the grid: column, row, sd in the worst direction, the covariance."""
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
    """Return what files and pictures call a map: `left-infinity`."""
    away = "infinity" if math.isinf(found.distance) else f"{found.distance:g}"
    return f"{found.camera}-{away}"


@dataclass(frozen=True, eq=False, kw_only=True)
class UncertaintyCurve:
    """The uncertainty of projection of one pixel against the distance of the point.

    Attributes
    ----------
    camera, pixel
        Where.
    unit, datum
        Of distances, and what holds still.
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
        """Distance and standard deviation where the latter is smallest."""
        best = int(np.nanargmin(self.sd))
        return float(self.distances[best]), float(self.sd[best])


PARTS = (5, 4)  # across and down
ACROSS = ("left", "left of the middle", "", "right of the middle", "right")
DOWN = ("upper", "above the middle", "below the middle", "lower")


@dataclass(frozen=True)
class PicturePart:
    """A part of a picture: its column and row, its middle in pixels, and what it is called."""

    cell: tuple[int, int]
    middle: tuple[float, float]
    name: str


def parts_of(size: tuple[int, int]) -> Iterator[PicturePart]:
    """Yield the parts of a picture of a width and a height, row by row."""
    for row in range(PARTS[1]):
        for column in range(PARTS[0]):
            x, y = (
                (each + 0.5) / count * (side - 1)
                for each, count, side in zip((column, row), PARTS, size, strict=True)
            )
            yield PicturePart((column, row), (x, y), _name(column, row))


def _name(column: int, row: int) -> str:
    """Return a part in words: `upper left corner`, `left edge, above the middle`, `below the middle`."""
    at_side, at_end = column in (0, PARTS[0] - 1), row in (0, PARTS[1] - 1)
    if at_side and at_end:
        return f"{DOWN[row]} {ACROSS[column]} corner"
    if at_side or at_end:
        edge, along = (ACROSS[column], DOWN[row]) if at_side else (DOWN[row], ACROSS[column])
        return f"{edge} edge" + (f", {along}" if along else "")
    return " and ".join(filter(None, (DOWN[row], ACROSS[column])))
