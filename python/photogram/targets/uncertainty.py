"""Projection uncertainty of a calibrated camera at pixels, over its image and with distance; image parts."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, shaped, truth_value
from photogram.arguments.types import Bools, Floats
from photogram.io.csv_text import csv_text
from photogram.lazy_dataclasses import dataclass
from photogram.network.passages import beyond_knots
from photogram.network.point_sets import hull, outside
from photogram.summaries import Brief, Rows
from photogram.targets.housing import (
    camera_number,
    datum_rows,
    fixed_points,
    housing_of,
    projection_cofactors,
    size_of,
    worst,
)
from photogram.targets.options import DatumName
from photogram.targets.vision import points_at
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated


def image_grid(size: tuple[int, int], grid: tuple[int, int]) -> tuple[Floats, Floats, Floats]:
    """Return (w,) columns, (h,) rows and (h w, 2) pixels of a grid over an image."""
    across, down = (np.linspace(0.0, length - 1.0, count) for length, count in zip(size, grid, strict=True))
    return across, down, np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)


def at_distance(distance: float, unit: str) -> Phrase:
    """Return a distance in words: `at 2 m`, `at infinity`."""
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


IMAGE_GRID = (60, 40)  # rays that define the datum `image`


def projection_uncertainty(
    result: Calibrated,
    camera: int | str,
    pixels: ArrayLike,
    distance: float = np.inf,
    datum: DatumName = "corners",
    noise_only: bool = False,
) -> Floats:
    """Compute the projection uncertainty of points fixed to the camera housing.

    See docs/targets.md.

    Parameters
    ----------
    result, camera
        The adjusted calibration, and one of its cameras: number or name.
    pixels
        (n, 2) pixels, from 0 at the centre of the first pixel.
    distance
        Distance of the points from the camera centre, in the unit of the board; infinite: directions.
    datum
        Fixed reference: `corners`, the observed corners of the camera; `mean-frames`, the mean of the boards,
        as in mrcal. `image`, rays of the whole image at this distance; `axes`, the camera axes.
    noise_only
        Whether to include only corner errors and no prior errors, as in mrcal. The result is too small for
        lens parts determined only by priors.

    Returns
    -------
    (n, 2, 2) covariances, square pixels, scaled by the variance of unit weight; NaN for undefined pixels.

    Raises
    ------
    InputError
        If the camera does not exist, if the distance is not positive, or if arrays have other shapes.
    """
    truth_value("noise_only", noise_only)
    where = shaped("pixels", pixels, (None, 2))
    number = camera_number(result, camera)
    housing, own = housing_of(result, number)
    if noise_only:
        housing = housing.noise_only()
    away, rows = checked_distance(distance), datum_rows(housing, own, datum)
    if datum == "image":
        points = points_at(housing.cameras[own], image_grid(size_of(result, number), IMAGE_GRID)[2], [away])
        points = points[np.isfinite(points).all(axis=1)]
        weights = np.broadcast_to(np.eye(2), (len(points), 2, 2))
        rows[:, housing.parameters(own)] = fixed_points(
            housing.cameras[own], points, weights, bool(np.isfinite(away))
        )
    found = housing.variance * projection_cofactors(housing, own, where, distance, rows)
    seen = result.cameras[number].camera
    if seen.knots is not None:
        # Beyond the knots the edge polynomials are extrapolated with unknown errors.
        found[beyond_knots(seen.parameters, seen.rays(where))] = np.nan
    return found


def uncertainty_map(
    result: Calibrated,
    camera: int | str = 0,
    distance: float = np.inf,
    grid: tuple[int, int] = (60, 40),
    *,
    datum: DatumName = "corners",
    noise_only: bool = False,
    model: str = "not tested against other views",
) -> UncertaintyMap:
    """Compute the projection uncertainty over the image of a camera.

    Parameters
    ----------
    result, camera, distance, datum, noise_only
        As in :func:`projection_uncertainty`.
    grid
        Number of pixels across and down, from edge to edge.
    model
        Verdict of :func:`cross_validate` on the lens model.

    Raises
    ------
    InputError
        As in :func:`projection_uncertainty`, or if the image size is unknown.
    """
    number = camera_number(result, camera)
    size = size_of(result, number)
    columns, rows, pixels = image_grid(size, grid)
    found = projection_uncertainty(result, number, pixels, distance, datum, noise_only)
    housing, own = housing_of(result, number)
    return UncertaintyMap(
        camera=result.cameras[number].name,
        size=size,
        distance=float(distance),
        unit=result.calibration.board.unit,
        datum=datum,
        noise_only=noise_only,
        columns=columns,
        rows=rows,
        covariances=found.reshape(len(rows), len(columns), 2, 2),
        corners=housing.seen.xy[housing.seen.cameras == own],
        model=model,
    )


def uncertainty_against_distance(
    result: Calibrated,
    camera: int | str,
    pixel: Sequence[float],
    distances: ArrayLike,
    *,
    datum: DatumName = "corners",
    noise_only: bool = False,
) -> UncertaintyCurve:
    """Compute the projection uncertainty of a pixel at several distances.

    Parameters
    ----------
    result, camera, datum, noise_only
        As in :func:`projection_uncertainty`.
    pixel
        Column and row.
    distances
        (n,) distances from the camera centre; infinite: directions.

    Raises
    ------
    InputError
        As in :func:`projection_uncertainty`.
    """
    number = camera_number(result, camera)
    place = shaped("pixel", pixel, (2,))
    away = shaped("distances", distances, (None,))
    sd = [
        worst(projection_uncertainty(result, number, place[np.newaxis], each, datum, noise_only))[0]
        for each in away.tolist()
    ]
    return UncertaintyCurve(
        camera=result.cameras[number].name,
        pixel=(float(place[0]), float(place[1])),
        unit=result.calibration.board.unit,
        datum=datum,
        distances=away,
        sd=np.array(sd),
    )


def checked_distance(distance: float) -> float:
    """Return a distance; reject one that is not positive."""
    if not distance > 0:
        raise argument_error("distance", "positive", value=distance)
    return float(distance)


PARTS = (5, 4)  # across and down
ACROSS = ("left", "left of the middle", "", "right of the middle", "right")
DOWN = ("upper", "above the middle", "below the middle", "lower")


class PicturePart(NamedTuple):
    """Image part: column and row, centre in pixels, and name."""

    cell: tuple[int, int]
    middle: tuple[float, float]
    name: str


def parts_of(size: tuple[int, int]) -> list[PicturePart]:
    across, down = (
        [(each + 0.5) / count * (side - 1) for each in range(count)]
        for count, side in zip(PARTS, size, strict=True)
    )
    return [
        PicturePart((column, row), (x, y), _name(column, row))
        for row, y in enumerate(down)
        for column, x in enumerate(across)
    ]


def _name(column: int, row: int) -> str:
    """Return the name of a part: `upper left corner`, `left edge, above the middle`."""
    at_side, at_end = column in (0, PARTS[0] - 1), row in (0, PARTS[1] - 1)
    if at_side and at_end:
        return f"{DOWN[row]} {ACROSS[column]} corner"
    if at_side or at_end:
        edge, along = (ACROSS[column], DOWN[row]) if at_side else (DOWN[row], ACROSS[column])
        return f"{edge} edge" + (f", {along}" if along else "")
    return " and ".join(filter(None, (DOWN[row], ACROSS[column])))
